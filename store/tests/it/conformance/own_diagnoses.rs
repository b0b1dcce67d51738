use domain::{Outcome, Upload};
use store::Receipt;
use test_case::test_case;

use crate::fixture::{
    Backend::{self, *},
    Database, component, day, drain, later_upload, operator, own_diagnosis,
};

#[test_case(Sqlite; "sqlite")]
#[test_case(Postgres; "postgres")]
#[tokio::test]
async fn an_own_diagnosis_is_kept_and_judged_beside_samples_and_made_anew(backend: Backend) {
    let database = Database::new(backend);
    let store = database.ready().await;
    let own = Upload { reading: own_diagnosis(), ..later_upload("own", "0001", 30.0) };
    for (upload, receipt) in [
        (later_upload("samples", "0001", 0.0), Receipt::Accepted),
        (own.clone(), Receipt::Accepted),
        (own.clone(), Receipt::Duplicate),
        (later_upload("own", "0001", 30.0), Receipt::Conflict),
    ] {
        assert_eq!(store.accept(&operator(), upload, day(0.0)).await.unwrap(), receipt);
    }
    drain(&store).await;
    let record = store.upload(&operator(), &own.upload_id).await.unwrap().unwrap();
    assert_eq!(record.upload, own);
    let estimates = store.estimates(&component("0001"), None, None, None, None, 10).await.unwrap();
    let masks: Vec<_> = estimates.iter().map(|estimate| estimate.mask_id.is_some()).collect();
    assert_eq!(masks, [true, false]);
    assert!(matches!(&estimates[1].outcome, Outcome::Diagnosed(found) if found.fit.is_none()));
    let digest = store.digest().await.unwrap();
    assert_eq!(store.forget_derived(None, day(1.0)).await.unwrap(), Some(component("0001")));
    assert_eq!(store.digest().await.unwrap().estimates, 0);
    drain(&store).await;
    assert_eq!(store.digest().await.unwrap(), digest);
    let verified = store.verify().await.unwrap();
    assert!(verified.damaged.is_empty(), "{:?}", verified.damaged);
}
