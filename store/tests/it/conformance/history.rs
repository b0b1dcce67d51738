use domain::{Estimate, Upload};
use proptest::{prelude::*, test_runner::TestRunner};
use store::{LifeCursor, Store};
use test_case::test_case;

use crate::fixture::{
    Backend::{self, *},
    Database, bundle, component, day, drain, estimate, later_upload, lease, life_inputs, operator, results, serve,
    states, tail, upload,
};

async fn store_life(store: &Store, hours: &[f64]) -> Vec<Estimate> {
    for (i, hours) in hours.iter().enumerate() {
        store.accept(&operator(), later_upload(&format!("u{i:03}"), "0001", *hours), day(0.0)).await.unwrap();
    }
    drain(store).await;
    let uploads = hours.iter().enumerate().map(|(i, hours)| later_upload(&format!("u{i:03}"), "0001", *hours));
    let mut estimates: Vec<_> = uploads.map(|upload| estimate(&upload, bundle("one").hash)).collect();
    estimates.sort_by(Estimate::life_order);
    estimates
}

#[test_case(Sqlite; "sqlite")]
#[test_case(Postgres; "postgres")]
#[tokio::test]
async fn pages_of_estimates_join_into_the_history(backend: Backend) {
    let database = Database::new(backend);
    let store = database.ready().await;
    let all = store_life(&store, &[30.0, 10.0, 20.0, 10.0, 0.0, 70.0, 10.0]).await;
    for limit in 1..=8 {
        let (mut joined, mut after) = (Vec::<Estimate>::new(), None);
        loop {
            let page = store.estimates(&component("0001"), None, None, None, after.as_ref(), limit).await.unwrap();
            assert!(page.len() <= limit as usize);
            let Some(last) = page.last() else { break };
            after = Some(LifeCursor::from(last));
            joined.extend(page);
        }
        assert_eq!(joined, all, "pages of {limit}");
    }
}

#[test_case(Sqlite; "sqlite")]
#[test_case(Postgres; "postgres")]
#[tokio::test]
async fn a_range_of_hours_is_half_open_and_goes_with_a_cursor(backend: Backend) {
    let database = Database::new(backend);
    let store = database.ready().await;
    let all = store_life(&store, &[0.0, 10.0, 10.0, 20.0, 30.0]).await;
    let within = |from, to, after: Option<usize>| {
        let (store, after) = (store.clone(), after.map(|i| LifeCursor::from(&all[i])));
        async move { store.estimates(&component("0001"), None, from, to, after.as_ref(), 100).await.unwrap() }
    };
    assert_eq!(within(Some(110.0), Some(130.0), None).await, all[1..4]);
    assert_eq!(within(Some(110.0), None, Some(0)).await, all[1..]);
    assert_eq!(within(Some(110.0), None, Some(1)).await, all[2..]);
    assert_eq!(within(None, Some(110.0), None).await, all[..1]);
    assert_eq!(within(None, None, Some(4)).await, []);
    assert_eq!(store.estimates(&component("9999"), None, None, None, None, 10).await.unwrap(), []);
}

#[test_case(Sqlite; "sqlite")]
#[test_case(Postgres; "postgres")]
#[tokio::test]
async fn states_are_paged_by_block(backend: Backend) {
    let database = Database::new(backend);
    let store = database.ready().await;
    let hours: Vec<f64> = (0..30).map(|i| 5.0 * f64::from(i)).collect();
    let all = states(&store_life(&store, &hours).await);
    assert!(all.len() > 5);
    let first = store.states(&component("0001"), None, None, None, None, 3).await.unwrap();
    assert_eq!(first, all[..3]);
    let rest = store.states(&component("0001"), None, None, None, Some(first[2].block), 100).await.unwrap();
    assert_eq!(rest, all[3..]);
    let (from, to) = (all[2].as_of.flight_hours, all[4].as_of.flight_hours);
    assert_eq!(store.states(&component("0001"), None, Some(from), Some(to), None, 100).await.unwrap(), all[2..4]);
}

#[test_case(Sqlite; "sqlite")]
#[test_case(Postgres; "postgres")]
#[tokio::test]
async fn results_replace_states_from_a_block_on_and_keep_the_earlier_ones(backend: Backend) {
    let database = Database::new(backend);
    let store = database.ready().await;
    let before = states(&store_life(&store, &[0.0, 20.0, 40.0, 60.0]).await);
    store.accept(&operator(), later_upload("late", "0001", 25.0), day(0.0)).await.unwrap();
    let lease = lease(&store).await;
    let mut results = results(&life_inputs(&store, &lease).await);
    results.states.retain(|state| state.block >= before[1].block);
    results.states_from = Some(before[1].block);
    let expected: Vec<_> = before[..1].iter().chain(&results.states).cloned().collect();
    store.complete(&lease, vec![results]).await.unwrap();
    assert_eq!(store.states(&component("0001"), None, None, None, None, 100).await.unwrap(), expected);
    assert_ne!(expected, before);
}

#[test_case(Sqlite; "sqlite")]
#[test_case(Postgres; "postgres")]
#[tokio::test]
async fn the_prognosis_issued_last_is_served(backend: Backend) {
    let database = Database::new(backend);
    let store = database.ready().await;
    for (id, hours) in [("u1", 0.0), ("u2", 10.0)] {
        store.accept(&operator(), later_upload(id, "0001", hours), day(0.0)).await.unwrap();
        let lease = lease(&store).await;
        let expected = results(&life_inputs(&store, &lease).await).prognosis;
        serve(&store, &lease).await;
        let installed = store.installed(&operator(), &tail("EC-MXA")).await.unwrap();
        assert_eq!((installed.len(), &installed[0].prognosis), (1, &expected));
        assert_eq!(installed[0].pending_uploads, 0);
    }
}

/// The history of some components as it is served.
async fn dump(store: &Store, uploads: &[Upload], operator: &domain::OperatorId) -> String {
    let mut dump = String::new();
    for serial in ["0", "1"] {
        let component = Upload { serial_number: serial.parse().unwrap(), ..uploads[0].clone() }.component(operator);
        let estimates = store.estimates(&component, None, None, None, None, 1000).await.unwrap();
        let states = store.states(&component, None, None, None, None, 1000).await.unwrap();
        let installations = store.installations(&component).await.unwrap();
        dump += &format!("{estimates:?}\n{states:?}\n{installations:?}\n");
    }
    dump
}

/// Uploads of two units over a few hours, with ties, in some order; after which of them a worker runs.
fn life() -> impl Strategy<Value = (Vec<Upload>, Vec<(Upload, bool)>)> {
    let one = (0..2_u8, 0..8_u8, 0..6_u8);
    let uploads = prop::collection::vec(one, 1..12).prop_map(|units| {
        let named = |(i, (serial, hours, time)): (usize, (u8, u8, u8))| Upload {
            flight_hours: 10.0 * f64::from(hours),
            recorded_at: day(f64::from(time)),
            ..upload(&format!("u{i}"), &serial.to_string())
        };
        units.into_iter().enumerate().map(named).collect::<Vec<_>>()
    });
    uploads.prop_flat_map(|uploads| {
        let runs = prop::collection::vec(any::<bool>(), uploads.len());
        let shuffled = (Just(uploads.clone()).prop_shuffle(), runs);
        (Just(uploads), shuffled.prop_map(|(uploads, runs)| uploads.into_iter().zip(runs).collect()))
    })
}

#[test_case(Sqlite; "sqlite")]
#[test_case(Postgres; "postgres")]
fn any_order_of_the_same_uploads_gives_the_same_history(backend: Backend) {
    let runtime = tokio::runtime::Runtime::new().unwrap();
    let database = Database::new(backend);
    let store = runtime.block_on(database.ready());
    let cases = std::cell::Cell::new(0);
    let mut runner =
        TestRunner::new(ProptestConfig { failure_persistence: None, cases: backend.cases(48), ..Default::default() });
    let outcome = runner.run(&life(), |(uploads, shuffled)| {
        cases.set(cases.get() + 1);
        let [ordered, other] = ["ordered", "other"].map(|way| format!("{way}-{}", cases.get()).parse().unwrap());
        runtime.block_on(async {
            for upload in &uploads {
                store.accept(&ordered, upload.clone(), day(0.0)).await.unwrap();
            }
            drain(&store).await;
            for (upload, worker_runs) in shuffled {
                store.accept(&other, upload, day(1.0)).await.unwrap();
                if worker_runs {
                    drain(&store).await;
                }
            }
            drain(&store).await;
            prop_assert_eq!(dump(&store, &uploads, &ordered).await, dump(&store, &uploads, &other).await);
            Ok(())
        })
    });
    outcome.unwrap();
}
