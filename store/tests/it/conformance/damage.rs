use std::collections::BTreeSet;

use store::Store;
use test_case::test_case;

use crate::fixture::{
    Backend::{self, *},
    Database, component,
    everything::{everything, make_anew},
    operator,
    raw::Raw,
    tail,
};

/// Tables whose rows no answer rests on, and those that say themselves what they are.
const UNSEALED: [&str; 3] = ["schema_info", "component_queue", "lesson_claims"];
/// A cache, in which nothing is.
const CACHE: &str = "checkpoints";
/// Columns that no answer rests on.
const VOLATILE: [&str; 1] = ["touched_revision"];
/// Tables of which a row can vanish without a word: caches, and records that nothing else tells of.
const SILENT: [&str; 5] = [CACHE, "states", "prognoses", "exclusions", "retried"];

/// Whether a row of this table that another operator's name stands in is lost behind a wall: Postgres lets nobody look
/// behind that of an operator whom it does not know, and no other row tells that it is missing.
fn is_lost(backend: Backend, table: &str, column: &str) -> bool {
    // Estimates of generations that answer no longer, and installations that have ended.
    let untold = ["estimates", "installations"].contains(&table) || SILENT.contains(&table);
    backend == Postgres && column == "operator" && untold
}

/// What is told of the database, one line for each damage.
async fn told(store: &Store) -> Vec<String> {
    let found = store.verify().await.unwrap();
    let rows = found.damaged.iter().map(|row| format!("{}: {}: {}", row.table, row.row, row.detail));
    let chains = store.verify_audit().await.unwrap();
    let chains = chains.iter().filter_map(|chain| Some(format!("audit: {:?}", chain.damage.as_ref()?)));
    rows.chain(chains).collect()
}

#[test_case(Sqlite; "sqlite")]
#[test_case(Postgres; "postgres")]
#[tokio::test]
async fn every_table_that_answers_rest_on_carries_checksums(backend: Backend) {
    let database = Database::new(backend);
    let store = database.open().await;
    let mut raw = Raw::to(&database).await;
    let checksums = ["checksum", "hash"];
    for table in raw.tables().await {
        let columns = raw.columns(&table).await;
        let sealed = columns.iter().any(|column| checksums.contains(&column.name.as_str()));
        assert_eq!(sealed, !UNSEALED.contains(&table.as_str()), "{table}: {columns:?}");
    }
    assert_eq!(told(&store).await, [""; 0]);
}

#[test_case(Sqlite; "sqlite")]
#[test_case(Postgres; "postgres")]
#[tokio::test]
async fn a_changed_value_of_any_column_is_told_and_a_sound_database_is_not(backend: Backend) {
    let database = Database::new(backend);
    let store = everything(&database).await;
    assert_eq!(told(&store).await, [""; 0]);
    let (mut raw, mut changed) = (Raw::to(&database).await, 0);
    let unsealed = |table: &String| UNSEALED.contains(&table.as_str()) || table == CACHE;
    for table in raw.tables().await.into_iter().filter(|table| !unsealed(table)) {
        let key = raw.key(&table).await;
        raw.execute(&format!("create temp table saved as select * from {table}")).await.unwrap();
        let told_of = |name: &str| !VOLATILE.contains(&name) && !is_lost(backend, &table, name);
        for column in raw.columns(&table).await.into_iter().filter(|column| told_of(&column.name)) {
            let (name, value) = (&column.name, column.changed());
            let update = format!(
                "update {table} set {name} = {value}
                 where ({key}) in (select {key} from {table} order by {key} limit 1)"
            );
            assert_eq!(raw.execute(&update).await.unwrap(), 1, "{update}");
            assert!(!told(&store).await.is_empty(), "{update}");
            raw.execute(&format!("delete from {table}")).await.unwrap();
            raw.execute(&format!("insert into {table} select * from saved")).await.unwrap();
            changed += 1;
        }
        raw.execute("drop table saved").await.unwrap();
    }
    assert!(changed > 150, "only {changed} values were changed");
    assert_eq!(told(&store).await, [""; 0], "all of it was put back");
}

#[test_case(Sqlite; "sqlite")]
#[test_case(Postgres; "postgres")]
#[tokio::test]
async fn a_row_that_vanished_is_told(backend: Backend) {
    let database = Database::new(backend);
    let store = everything(&database).await;
    let (mut raw, mut tables) = (Raw::to(&database).await, BTreeSet::new());
    let silent = |table: &String| UNSEALED.contains(&table.as_str()) || SILENT.contains(&table.as_str());
    for table in raw.tables().await.into_iter().filter(|table| !silent(table)) {
        let key = raw.key(&table).await;
        raw.execute(&format!("create temp table saved as select * from {table}")).await.unwrap();
        // The last one: the first estimates are of a generation that answers no longer.
        let order = key.replace(", ", " desc, ") + " desc";
        let delete =
            format!("delete from {table} where ({key}) in (select {key} from {table} order by {order} limit 1)");
        assert_eq!(raw.execute(&delete).await.unwrap(), 1, "{delete}");
        assert!(!told(&store).await.is_empty(), "{delete}");
        raw.execute(&format!("delete from {table}")).await.unwrap();
        assert!(!told(&store).await.is_empty(), "an emptied {table}");
        raw.execute(&format!("insert into {table} select * from saved")).await.unwrap();
        raw.execute("drop table saved").await.unwrap();
        tables.insert(table);
    }
    assert_eq!(told(&store).await, [""; 0], "all of it was put back");
    assert!(tables.contains("tails") && tables.contains("tokens"), "{tables:?}");
}

#[test_case(Sqlite; "sqlite")]
#[test_case(Postgres; "postgres")]
#[tokio::test]
async fn a_damaged_unit_is_listed_as_one_beside_the_others(backend: Backend) {
    let database = Database::new(backend);
    let store = everything(&database).await;
    let fleet = store.installed_fleet(&operator(), None, 10).await.unwrap();
    assert!(fleet.iter().flat_map(|tail| &tail.installed).all(|unit| !unit.is_damaged), "{fleet:?}");
    let mut raw = Raw::to(&database).await;
    for damage in [
        "update prognoses set body = body || ' ' where serial_number = '0002'",
        "update lives set ended_by = 'x' where serial_number = '0002'",
        "update installations set from_at = from_at + 1 where serial_number = '0002'",
        "update tails set tail = 'EC-MXX' where tail = 'EC-MXB'",
        "delete from tails where tail = 'EC-MXX'",
    ] {
        assert!(raw.execute(damage).await.unwrap() > 0, "{damage}");
    }
    let damaged = store.installed_fleet(&operator(), None, 10).await.unwrap();
    let units = |fleet: &[store::InstalledTail]| -> Vec<String> {
        fleet.iter().flat_map(|tail| &tail.installed).map(|unit| unit.serial_number.to_string()).collect()
    };
    assert_eq!(units(&damaged), units(&fleet));
    for unit in damaged.iter().flat_map(|tail| &tail.installed) {
        let is_damaged = unit.serial_number.as_str() == "0002";
        assert_eq!((unit.is_damaged, unit.prognosis.is_none() || !is_damaged), (is_damaged, true), "{unit:?}");
    }
}

#[test_case(Sqlite; "sqlite")]
#[test_case(Postgres; "postgres")]
#[tokio::test]
async fn a_damaged_row_of_any_kind_that_follows_from_others_is_made_anew(backend: Backend) {
    let database = Database::new(backend);
    let store = everything(&database).await;
    make_anew(&store).await;
    let digest = store.digest().await.unwrap();
    let mut raw = Raw::to(&database).await;
    for damage in [
        "update tails set tail = tail || 'x' where tail = 'EC-MXB'",
        "delete from tails",
        "update installations set serial_number = '0009' where serial_number = '0002'",
        "delete from observed_installations",
        "delete from movements",
        "update lives set ended_by = null",
        "update lives set prognosis_fence = prognosis_fence + 1",
        "update component_queue set processed_revision = 1000000, fence = 0",
        "delete from component_queue where serial_number = '0002'",
        "delete from inbox",
        "delete from estimates where serial_number = '0002'",
    ] {
        assert!(raw.execute(damage).await.is_ok(), "{damage}");
        assert!(damage == "delete from inbox" || !told(&store).await.is_empty(), "{damage}");
        make_anew(&store).await;
        assert_eq!(told(&store).await, [""; 0], "{damage}");
        assert_eq!(store.digest().await.unwrap(), digest, "{damage}");
        assert!(store.installed(&operator(), &tail("EC-MXB")).await.unwrap().len() == 1, "{damage}");
        let ended = store.component(&component("0001")).await.unwrap().unwrap().lives;
        assert!(ended.iter().any(|life| life.found_failed_fh == Some(190.0)), "{damage}: {ended:?}");
    }
}
