//! The board says what the rooms below it say, whatever happens and in whatever order.

use std::collections::BTreeSet;

use domain::{OperatorId, RulDistribution, Status, Upload};
use numerics::Stream;
use store::{Installed, ListedUnit, Scope, Store, Unit, UnitsAsked, Version};
use test_case::test_case;

use super::rebuild::fleet;
use crate::fixture::{
    Backend::{self, *},
    Database, by_hand, checks, day, drain,
    everything::everything,
    later_upload, lease, operator, plan,
    raw::Raw,
    results, settings, tail, upload,
};

const STALE_AFTER_H: f64 = 24.0 * 30.0;

/// Everything that is listed of the operator's fleet.
async fn shown(store: &Store) -> Vec<Installed> {
    let fleet = store.installed_fleet(&operator(), None, 1000).await.unwrap();
    let displaced = store.displaced(&operator()).await.unwrap();
    fleet.into_iter().flat_map(|tail| tail.installed).chain(displaced).collect()
}

/// The draws of a component's forecast.
fn curve(unit: &Installed) -> Option<&RulDistribution> {
    Some(&unit.prognosis.as_ref()?.forecast.as_ref().ok()?.rul)
}

/// Tails in short, made of all that is told of them.
async fn in_short(store: &Store, on: f64) -> Vec<(String, usize, Option<f64>, Status)> {
    let fleet = store.installed_fleet(&operator(), None, 1000).await.unwrap();
    let one = |tail: store::InstalledTail| {
        let status = |unit: &Installed| match (&unit.prognosis, unit.found_failed_fh) {
            (_, Some(_)) => Status::Failed,
            (Some(prognosis), None) => prognosis.status(day(on), STALE_AFTER_H),
            (None, None) => Status::InsufficientHistory,
        };
        let p10 = |unit: &Installed| curve(unit)?.quantile_fh(0.1);
        let worst = tail.installed.iter().map(status).min().unwrap_or(Status::InsufficientHistory);
        let lowest = tail.installed.iter().filter_map(p10).min_by(f64::total_cmp);
        (tail.tail.to_string(), tail.installed.len(), lowest, worst)
    };
    fleet.into_iter().map(one).collect()
}

#[test_case(Sqlite; "sqlite")]
#[test_case(Postgres; "postgres")]
#[tokio::test]
async fn it_says_what_the_rooms_below_say_whatever_happens(backend: Backend) {
    let database = Database::new(backend);
    let store = fleet(&database, async |store| {
        assert_eq!(store.verify().await.unwrap().damaged, []);
        for on in [3.0, 20.0, 45.0, 200.0] {
            let told = store.tails_in_short(&operator(), None, 1000).await.unwrap();
            let told = told.iter().map(|tail| {
                let status = tail.status(day(on), STALE_AFTER_H);
                (tail.tail.to_string(), tail.positions, tail.p10_fh, status)
            });
            assert_eq!(told.collect::<Vec<_>>(), in_short(store, on).await, "on day {on}");
        }
    })
    .await;
    assert!(shown(&store).await.iter().any(|unit| unit.prognosis.is_some()));
}

#[test_case(Sqlite; "sqlite")]
#[test_case(Postgres; "postgres")]
#[tokio::test]
async fn a_version_changes_with_what_is_shown_and_with_nothing_else(backend: Backend) {
    let database = Database::new(backend);
    let store = database.ready().await;
    let (a, b, elsewhere) = (tail("EC-MXA"), tail("EC-MXB"), "elsewhere".parse::<OperatorId>().unwrap());
    store.accept(&operator(), later_upload("a0", "0001", 0.0), day(0.0)).await.unwrap();
    let other = Upload { tail: b.clone(), ..later_upload("b0", "0002", 0.0) };
    store.accept(&operator(), other, day(0.0)).await.unwrap();
    drain(&store).await;
    let versions = async || -> [Version; 4] {
        [
            store.version(&operator(), Scope::Fleet).await.unwrap(),
            store.version(&operator(), Scope::Tail(&a)).await.unwrap(),
            store.version(&operator(), Scope::Tail(&b)).await.unwrap(),
            store.version(&elsewhere, Scope::Fleet).await.unwrap(),
        ]
    };
    let mut seen = BTreeSet::new();
    let mut before = versions().await;
    let mut changed = async |what: &str| -> Vec<bool> {
        let now = versions().await;
        assert_eq!(now, versions().await, "{what}: asked twice");
        let changed: Vec<bool> = now.iter().zip(before).map(|(now, before)| *now != before).collect();
        assert!(changed[0] == seen.insert(now[0].hash().to_string()) || seen.len() == 1, "{what}: an old one again");
        before = now;
        changed
    };
    assert_eq!(changed("nothing").await, [false; 4]);
    store.accept(&operator(), later_upload("a1", "0001", 30.0), day(0.0)).await.unwrap();
    assert_eq!(changed("an upload waits").await, [true, true, false, false]);
    drain(&store).await;
    assert_eq!(changed("it was judged").await, [true, true, false, false]);
    store.set_plan(&operator(), &b, &plan(4.0), by_hand(1.0)).await.unwrap();
    assert_eq!(changed("a plan").await, [true, false, true, false]);
    drain(&store).await;
    changed("by the plan").await;
    store.set_checks(&operator(), &[(a.clone(), checks(90.0))], by_hand(1.0)).await.unwrap();
    assert_eq!(changed("a check").await, [true, true, false, false]);
    store.set_settings(&operator(), &settings(0.2), by_hand(1.0)).await.unwrap();
    assert_eq!(changed("settings").await, [true, true, true, false]);
    store.accept(&elsewhere, upload("a0", "0001"), day(0.0)).await.unwrap();
    assert_eq!(changed("another operator's").await, [false, false, false, true]);
    drain(&store).await;
    changed("another operator's was judged").await;
    let moved = Upload { tail: b.clone(), ..later_upload("a2", "0001", 60.0) };
    store.accept(&operator(), moved, day(0.0)).await.unwrap();
    assert_eq!(changed("a unit moved").await, [true, true, true, false]);
    drain(&store).await;
    changed("judged there").await;
    store.void_upload(&operator(), &"a2".parse().unwrap(), by_hand(9.0)).await.unwrap();
    assert_eq!(changed("it is not there after all").await, [true, true, true, false]);
    drain(&store).await;
    changed("judged again").await;
    crate::fixture::fail(&store, &operator(), "0001", 70.0).await;
    assert!(changed("it was found failed").await[0]);
}

#[test_case(Sqlite; "sqlite")]
#[test_case(Postgres; "postgres")]
#[tokio::test]
async fn quantiles_decide_as_the_draws_do_and_only_what_they_leave_open_is_drawn(backend: Backend) {
    let database = Database::new(backend);
    let store = database.ready().await;
    let mut stream = Stream::new(5, &["due"]);
    for number in 0..60 {
        let place = format!("P{number}").parse().unwrap();
        let upload = Upload { position: place, ..later_upload(&format!("u{number}"), &format!("{number:04}"), 50.0) };
        store.accept(&operator(), upload, day(0.0)).await.unwrap();
        let lease = lease(&store).await;
        let mut lives: Vec<_> = store.life_inputs(&lease).await.unwrap().iter().map(results).collect();
        let (scale, share) = (10_f64.powf(1.0 + 3.0 * stream.uniform()), stream.uniform());
        let draws: Vec<_> =
            (0..256).map(|_| (stream.uniform() < share).then(|| scale * (0.2 + stream.uniform()))).collect();
        for prognosis in lives.iter_mut().filter_map(|life| life.prognosis.as_mut()) {
            let forecast = prognosis.forecast.as_mut().unwrap();
            forecast.rul = RulDistribution::from_draws(&draws, if number % 7 == 0 { 4000.0 } else { 10_000.0 });
        }
        store.complete(&lease, lives).await.unwrap();
    }
    let all = shown(&store).await;
    assert_eq!(all.len(), 60);
    let (mut above, mut open) = (0, 0);
    for within_fh in [0.0_f64, 40.0, 300.0, 5000.0, 10_000.0] {
        for risk in [0.001, 0.05, 0.07, 0.1, 0.12, 0.3, 0.5, 0.52, 0.9] {
            let exceeds = |unit: &Unit| {
                let outlook = unit.prognosis.as_ref().unwrap().outlook.as_ref().unwrap();
                outlook.exceeds(within_fh.min(outlook.horizon_fh), risk)
            };
            let is_open = |listed: &ListedUnit| exceeds(&listed.unit).is_none();
            let told = store.units(&operator(), UnitsAsked::default(), is_open).await.unwrap();
            assert_eq!(told.len(), 60);
            for ListedUnit { unit, rul, .. } in &told {
                let whole = all.iter().find(|one| one.position == unit.position).unwrap();
                let drawn = curve(whole).unwrap();
                let (p, _) = drawn.probability_within(within_fh.min(drawn.horizon_fh())).unwrap();
                assert_eq!(unit, &whole.in_short());
                match exceeds(unit) {
                    Some(exceeds) => assert_eq!((exceeds, rul), (p > risk, &None), "{within_fh} fh, {risk}: {unit:?}"),
                    None => assert_eq!(rul.as_ref(), Some(drawn)),
                }
                open += usize::from(rul.is_some());
                above += usize::from(p > risk);
            }
        }
    }
    assert!(above > 500 && (20..500).contains(&open), "{above} are above, {open} had to be drawn");
}

/// Brings the schema up to date: SQLite does so when it is opened.
async fn up_to_date(database: &Database, store: Store) -> Store {
    if let Postgres = database.backend() {
        let cluster = database.postgres().await;
        Store::migrate(&cluster.owner_url(), Some(cluster.service_role())).await.unwrap();
        return store;
    }
    store.close().await;
    database.open().await
}

#[test_case(Sqlite; "sqlite")]
#[test_case(Postgres; "postgres")]
#[tokio::test]
async fn rows_that_are_missing_or_behind_are_made_when_the_schema_is_brought_up_to_date(backend: Backend) {
    let database = Database::new(backend);
    let mut store = everything(&database).await;
    let expected = shown(&store).await;
    let mut raw = Raw::to(&database).await;
    for damage in [
        "delete from board_units",
        "delete from board_tails",
        "delete from board_curves",
        "update board_units set prognosis_fence = prognosis_fence - 1",
        "update board_units set tail = 'EC-MXA', position = 'P9' where serial_number = '0002'",
    ] {
        assert!(raw.execute(damage).await.unwrap() > 0, "{damage}");
        assert!(!store.verify().await.unwrap().damaged.is_empty(), "{damage}");
        store = up_to_date(&database, store).await;
        assert_eq!(store.verify().await.unwrap().damaged, [], "{damage}");
        assert_eq!(shown(&store).await, expected, "{damage}");
    }
}

#[test_case(Sqlite; "sqlite")]
#[test_case(Postgres; "postgres")]
#[tokio::test]
async fn units_that_were_called_ok_are_called_current_when_the_schema_is_brought_up_to_date(backend: Backend) {
    let database = Database::new(backend);
    let mut store = database.ready().await;
    for serial in ["0001", "0002"] {
        let upload = Upload { position: format!("P{serial}").parse().unwrap(), ..later_upload(serial, serial, 50.0) };
        store.accept(&operator(), upload, day(0.0)).await.unwrap();
    }
    drain(&store).await;
    let expected = shown(&store).await;
    assert!(expected.iter().any(|unit| unit.in_short().standing() == Status::Current), "{expected:?}");
    let mut raw = Raw::to(&database).await;
    for sql in [
        "drop table tail_checks",
        "drop table operator_settings",
        "delete from _sqlx_migrations where description = 'checks'",
        "update schema_info set version = 16, min_binary = 15",
        "update board_units set standing = 'ok', body = replace(body, '\"current\"', '\"ok\"')",
    ] {
        raw.execute(sql).await.unwrap();
    }
    store = up_to_date(&database, store).await;
    assert_eq!(store.verify().await.unwrap().damaged, []);
    assert_eq!(raw.names("select distinct standing from board_units").await, ["current"]);
    assert_eq!(shown(&store).await, expected);
}
