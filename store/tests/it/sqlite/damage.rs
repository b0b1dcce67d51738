//! Rows that are not what was written.

use store::{Checkpoint, Store, StoreError};

use super::{execute, served, with_history};
use crate::fixture::{
    self, Backend, Database, bundle, component, day, frame_key, later_upload, life_inputs, operator, results, token,
};

#[tokio::test]
async fn a_damaged_row_is_named_and_never_served() {
    for (table, damage) in [
        ("uploads", "update uploads set body = replace(body, '0.0712', '0.0713')"),
        ("uploads", "update uploads set received_at = received_at + 1"),
        ("estimates", "update estimates set body = replace(body, '0.1', '0.2')"),
        ("estimates", "update estimates set flight_hours = flight_hours + 0.5"),
        ("states", "update states set body = replace(body, '1234.5', '1234.6')"),
        ("states", "update states set checksum = zeroblob(32)"),
        ("prognoses", "update prognoses set body = replace(body, '0.02', '0.03')"),
        ("prognoses", "update prognoses set issued_at = 0"),
        ("prognoses", "update prognoses set forecast_from_fh = forecast_from_fh - 0.5"),
        ("prognoses", "update prognoses set forecast_from_fh = null"),
        ("maintenance_events", "update maintenance_events set body = replace(body, '1000', '1001')"),
        ("maintenance_events", "update maintenance_events set flight_hours = flight_hours + 1"),
        ("maintenance_events", "update maintenance_events set kind = 'finding_serviceable'"),
        ("priors", "update priors set lives = 100"),
        ("priors", "update priors set body = x'00'"),
        ("masks", "update masks set k_nom = 0.0753"),
        ("sensor_configurations", "update sensor_configurations set body = replace(body, '0.25', '0.26')"),
        ("tail_sensor_configurations", "update tail_sensor_configurations set effective_from = effective_from - 1"),
        ("tail_plans", "update tail_plans set body = replace(body, '1.25', '1.26')"),
        ("tail_plans", "update tail_plans set set_by = 'service'"),
        ("tail_plans", "update tail_plans set set_at = set_at - 1"),
        ("tail_checks", "update tail_checks set body = replace(body, '123.5', '123.6')"),
        ("tail_checks", "update tail_checks set set_by = 'service'"),
        ("operator_settings", "update operator_settings set body = replace(body, '0.25', '0.26')"),
        ("operator_settings", "update operator_settings set set_at = set_at - 1"),
        ("bundles", "update bundles set summary = replace(summary, '0.0752', '0.0753')"),
    ] {
        let database = with_history().await;
        assert!(execute(&database.path(), damage).await > 0, "{damage}");
        let store = database.open().await;
        let found = store.verify().await.unwrap();
        assert!(found.damaged.iter().any(|row| row.table == table), "{damage}: {found:?}");
        match served(&store).await {
            Err(StoreError::Corrupt { row, .. }) => assert!(row.contains(table), "{damage}: {row}"),
            Ok(served) => {
                let unit = &served.installed[0];
                assert!(unit.is_damaged && unit.prognosis.is_none(), "{damage}: {unit:?}");
            }
            other => panic!("{damage}: {other:?}"),
        }
    }
}

#[tokio::test]
async fn the_body_of_another_row_is_not_taken_for_a_rows_own() {
    let database = with_history().await;
    let swap = "update states set (body, checksum) = (select body, checksum from states order by block limit 1)";
    assert!(execute(&database.path(), swap).await > 1);
    let served = served(&database.open().await).await;
    assert!(matches!(served, Err(StoreError::Corrupt { .. })), "{served:?}");
}

#[tokio::test]
async fn a_damaged_frame_key_speaks_for_nobody() {
    for damage in [
        "update frame_keys set tail = 'EC-MXB'",
        "update frame_keys set position = 'AIL-R'",
        "update frame_keys set serial_number = '0002'",
        "update frame_keys set mask_id = zeroblob(32)",
        "update frame_keys set bundle = null",
        "update frame_keys set made_at = made_at + 1",
        "update frame_keys set revoked_at = 1",
        "update frame_keys set position = null, part_number = null, serial_number = null, mask_id = null",
    ] {
        let database = with_history().await;
        assert_eq!(execute(&database.path(), damage).await, 1);
        let store = database.open().await;
        let found = store.frame_key(&operator(), frame_key(&operator(), 2).id).await;
        assert!(matches!(found, Err(StoreError::Corrupt { .. })), "{damage}: {found:?}");
        assert!(store.verify().await.unwrap().damaged.iter().any(|row| row.table == "frame_keys"), "{damage}");
    }
    let database = with_history().await;
    execute(&database.path(), "delete from frame_keys").await;
    let found = database.open().await.verify().await.unwrap();
    assert!(found.damaged.iter().any(|row| row.table == "frame_keys"), "one that is missing: {found:?}");
}

#[tokio::test]
async fn a_damaged_token_lets_nobody_in() {
    for damage in [
        "update tokens set operator = 'elsewhere'",
        "update tokens set scope = 'admin'",
        "update tokens set tail = 'EC-MXB', scope = 'aircraft'",
        "update tokens set name = null",
        "update tokens set secret_hash = zeroblob(32)",
        "update tokens set created_at = created_at + 1",
        "update tokens set expires_at = null",
        "update tokens set revoked_at = 1",
    ] {
        let database = with_history().await;
        assert_eq!(execute(&database.path(), damage).await, 1);
        let found = database.open().await.token(&token(&operator(), 2).0.id).await;
        assert!(matches!(found, Err(StoreError::Corrupt { .. })), "{damage}: {found:?}");
    }
}

#[tokio::test]
async fn a_damaged_bundle_is_not_handed_out() {
    let database = with_history().await;
    execute(&database.path(), "update bundles set body = x'00'").await;
    let store = database.open().await;
    assert_eq!(store.verify().await.unwrap().damaged.len(), 1);
    let body = store.bundle_body(&bundle("one").hash).await;
    assert!(matches!(body, Err(StoreError::Corrupt { .. })), "{body:?}");
}

#[tokio::test]
async fn a_damaged_checkpoint_is_as_if_it_were_not_there() {
    for damage in [
        "update checkpoints set body = x'00' where block = (select max(block) from checkpoints)",
        "update checkpoints set checksum = zeroblob(32) where block = (select max(block) from checkpoints)",
        "update checkpoints set digest = zeroblob(32) where block = (select max(block) from checkpoints)",
        "update checkpoints set block = block + 1 where block = (select max(block) from checkpoints)",
        "delete from checkpoints where block = (select max(block) from checkpoints)",
    ] {
        let database = Database::new(Backend::Sqlite);
        let store = database.ready().await;
        for i in 0..4 {
            let upload = later_upload(&format!("u{i}"), "0001", 1000.0 * f64::from(i));
            store.accept(&operator(), upload, day(0.0)).await.unwrap();
        }
        let lease = fixture::lease(&store).await;
        let mut results = results(&life_inputs(&store, &lease).await);
        let checkpoint = |state: &domain::State| Checkpoint {
            block: state.block,
            digest: state.digest,
            body: state.digest.bytes().to_vec(),
        };
        results.checkpoints = results.states.iter().map(checkpoint).collect();
        let (kept, states) = (results.checkpoints.clone(), results.states.clone());
        store.complete(&lease, vec![results]).await.unwrap();
        let digest = store.digest().await.unwrap();
        store.close().await;
        assert_eq!(execute(&database.path(), damage).await, 1, "{damage}");
        let store = Store::open_read_only(&database.url()).await.unwrap();
        let mut wanted: Vec<_> = states.iter().map(|state| (state.block, state.digest)).collect();
        wanted.extend(states.last().map(|state| (state.block + 1, state.digest)));
        let found = store.checkpoint(&component("0001"), 0, 1, &wanted).await.unwrap();
        assert_eq!(found.as_ref(), Some(&kept[kept.len() - 2]), "{damage}");
        assert_eq!(store.digest().await.unwrap(), digest);
    }
}
