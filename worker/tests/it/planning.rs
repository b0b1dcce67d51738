//! Flights ahead: those that a plan tells, and those that are only asked about.

use std::time::Duration;

use domain::{
    Actor, Ahead, Component, OperatorId, Plan, PlannedStretch, Prognosis, Upload,
    ahead::{LoadAhead, Stretch},
};
use pipeline::Model;
use prognosis::{Coefficient, PaceLaw};
use store::{Completion, Store};
use tempfile::TempDir;
use worker::Analyst;

use crate::common::{now, settings, start, store, upload, work};

const LEASE: Duration = Duration::from_secs(60);

/// A store with a component whose loads act by the square, all that is known of it judged.
async fn judged(folder: &TempDir) -> (Store, Component) {
    let (store, model) = store(folder).await;
    let mut bundle = model.bundle().clone();
    let known = |mean| Coefficient { mean, sd: 0.05 };
    bundle.prior.pace = Some(PaceLaw::told(known(2.0), known(0.3)));
    let body = bundle.to_bytes();
    let model = Model::from_bytes(&body).unwrap();
    store.register_bundle(&model.summary(), &body, Actor::Cli.at(start())).await.unwrap();
    store.activate_bundle(&model.summary().hash, Actor::Cli.at(start())).await.unwrap();
    let mask = &model.bundle().masks()[0];
    for index in 0..60 {
        // Flights at the reference: where none tells of load or temperature, nobody knows the pace.
        let flown = Upload { temperature_c: Some(15.0), ..upload(&model, mask, index) };
        store.accept(&OperatorId::default(), flown, now()).await.unwrap();
    }
    work(&store).await;
    (store, upload(&model, mask, 0).component(&OperatorId::default()))
}

/// Serves the component that waits.
async fn reissue(store: &Store, analyst: &Analyst) {
    let lease = store.lease(LEASE).await.unwrap().expect("the component waits");
    assert_eq!(analyst.serve(&lease).await.unwrap(), Completion::Done);
}

async fn served(store: &Store) -> Prognosis {
    let installed = store.installed(&OperatorId::default(), &"EC-MXA".parse().unwrap()).await.unwrap();
    installed[0].prognosis.clone().unwrap()
}

fn mean_fh(prognosis: &Prognosis) -> f64 {
    prognosis.forecast.as_ref().unwrap().rul.mean_fh()
}

fn harder(load: LoadAhead) -> Ahead {
    Ahead { stretches: vec![Stretch { from_fh: 0.0, load: Some(load), temperature: None }] }
}

#[tokio::test]
async fn what_is_asked_about_the_flights_as_they_are_is_what_is_served_and_nothing_is_written() {
    let folder = tempfile::tempdir().unwrap();
    let (store, component) = judged(&folder).await;
    let (issued, digest) = (served(&store).await, store.digest().await.unwrap());
    assert!(issued.forecast.as_ref().unwrap().pace.is_some());
    let analyst = Analyst::new(store.clone(), settings().clock);
    assert_eq!(analyst.what_if(&component, Ahead::default()).await.unwrap(), Some(issued.clone()));
    let asked = analyst.what_if(&component, harder(LoadAhead::Times(2.0))).await.unwrap().unwrap();
    assert!(mean_fh(&asked) < 0.8 * mean_fh(&issued), "{} after {}", mean_fh(&asked), mean_fh(&issued));
    assert_eq!(served(&store).await, issued);
    assert_eq!(store.digest().await.unwrap(), digest);
    assert_eq!(store.lease(LEASE).await.unwrap(), None, "nothing waits");
    let stranger = Component { serial_number: "9999".parse().unwrap(), ..component };
    assert_eq!(analyst.what_if(&stranger, Ahead::default()).await.unwrap(), None);
}

#[tokio::test]
async fn a_plan_enters_what_is_issued_and_no_state() {
    let folder = tempfile::tempdir().unwrap();
    let (store, component) = judged(&folder).await;
    let (before, digest) = (served(&store).await, store.digest().await.unwrap());
    let stretch = PlannedStretch {
        from: start(),
        until: None,
        utilisation_fh_per_day: Some(8.0),
        load: Some(2.0),
        temperature_c: None,
        mission: None,
    };
    let plan = Plan::new(vec![stretch], now()).unwrap();
    let analyst = Analyst::new(store.clone(), settings().clock);
    let tail = "EC-MXA".parse().unwrap();
    store.set_plan(&OperatorId::default(), &tail, &plan, Actor::Cli.at(now())).await.unwrap();
    reissue(&store, &analyst).await;
    let planned = served(&store).await;
    assert!(mean_fh(&planned) < 0.8 * mean_fh(&before), "{} after {}", mean_fh(&planned), mean_fh(&before));
    assert_eq!(analyst.what_if(&component, harder(LoadAhead::Ratio(2.0))).await.unwrap(), Some(planned));
    assert_eq!(store.digest().await.unwrap(), digest);
    store.set_plan(&OperatorId::default(), &tail, &Plan::default(), Actor::Cli.at(now())).await.unwrap();
    reissue(&store, &analyst).await;
    assert_eq!(served(&store).await, before);
}
