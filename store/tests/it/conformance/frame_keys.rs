use domain::{Action, Actor, FrameKeyId, OperatorId};
use store::{FrameKeyRecord, Revocation, Store};
use test_case::test_case;

use crate::fixture::{
    Backend::{self, *},
    Database, day, frame_key, operator,
};

fn elsewhere() -> OperatorId {
    "elsewhere".parse().unwrap()
}

async fn create(store: &Store, operator: &OperatorId, number: u8) -> FrameKeyRecord {
    let key = frame_key(operator, number);
    store.create_frame_key(&key, Actor::Cli).await.unwrap();
    key
}

async fn revoke(store: &Store, operator: &OperatorId, id: FrameKeyId) -> Option<Revocation> {
    store.revoke_frame_key(operator, id, Actor::Cli.at(day(9.0))).await.unwrap()
}

#[test_case(Sqlite; "sqlite")]
#[test_case(Postgres; "postgres")]
#[tokio::test]
async fn a_key_reads_back_within_its_operator(backend: Backend) {
    let database = Database::new(backend);
    let store = database.open().await;
    let (second, first) = (create(&store, &operator(), 2).await, create(&store, &operator(), 1).await);
    let foreign = create(&store, &elsewhere(), 2).await;
    assert_eq!(store.frame_keys(&operator()).await.unwrap(), [first.clone(), second.clone()], "the oldest first");
    assert_eq!(store.frame_keys(&elsewhere()).await.unwrap(), [foreign]);
    for key in [&first, &second] {
        assert_eq!(store.frame_key(&operator(), key.id).await.unwrap().as_ref(), Some(key));
    }
    assert_eq!(
        store.frame_key(&elsewhere(), first.id).await.unwrap(),
        None,
        "another operator's is as if it were not there"
    );
    assert!(store.create_frame_key(&first, Actor::Cli).await.is_err(), "an id is taken once");
    assert!(store.verify().await.unwrap().damaged.is_empty());
}

#[test_case(Sqlite; "sqlite")]
#[test_case(Postgres; "postgres")]
#[tokio::test]
async fn a_revoked_key_stays_and_both_acts_are_in_the_log(backend: Backend) {
    let database = Database::new(backend);
    let store = database.open().await;
    let (key, kept) = (create(&store, &operator(), 2).await, create(&store, &operator(), 3).await);
    assert_eq!(revoke(&store, &elsewhere(), key.id).await, None);
    assert_eq!(revoke(&store, &operator(), FrameKeyId::new([9; 8])).await, None);
    assert_eq!(revoke(&store, &operator(), key.id).await, Some(Revocation::Revoked));
    assert_eq!(revoke(&store, &operator(), key.id).await, Some(Revocation::AlreadyRevoked));
    let revoked = store.frame_key(&operator(), key.id).await.unwrap();
    assert_eq!(revoked, Some(FrameKeyRecord { revoked_at: Some(day(9.0)), ..key.clone() }));
    assert_eq!(store.frame_key(&operator(), kept.id).await.unwrap(), Some(kept.clone()));
    let audit = store.audit(Some(&operator()), 0, 10).await.unwrap();
    let acts: Vec<_> = audit.iter().map(|record| (record.action, record.subject.clone())).collect();
    let (id, other) = (key.id.to_string(), kept.id.to_string());
    let created = Action::FrameKeyCreated;
    assert_eq!(acts, [(created, id.clone()), (created, other), (Action::FrameKeyRevoked, id)]);
    assert_eq!(audit[0].detail["subject"]["position"], "AIL-L");
    assert!(store.verify().await.unwrap().damaged.is_empty());
}
