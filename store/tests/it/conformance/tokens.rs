use domain::{Action, Actor, OperatorId, Scope, Timestamp, Token, TokenId};
use store::{Revocation, Store, TokenRecord, TokenRefusal};
use test_case::test_case;

use crate::fixture::{
    Backend::{self, *},
    Database, day, operator, token, token_scope,
};

fn elsewhere() -> OperatorId {
    "elsewhere".parse().unwrap()
}

async fn create(store: &Store, operator: &OperatorId, number: u8) -> (Token, TokenRecord) {
    let (token, record) = token(operator, number);
    store.create_token(&record, Actor::Cli).await.unwrap();
    (token, record)
}

async fn revoke(store: &Store, operator: &OperatorId, id: &TokenId) -> Option<Revocation> {
    store.revoke_token(operator, id, Actor::Cli.at(day(9.0))).await.unwrap()
}

#[test_case(Sqlite; "sqlite")]
#[test_case(Postgres; "postgres")]
#[tokio::test]
async fn a_token_reads_back_by_its_id_and_in_the_list_of_its_operator(backend: Backend) {
    let database = Database::new(backend);
    let store = database.open().await;
    assert!(!store.has_tokens().await.unwrap());
    let mut own = Vec::new();
    for number in [3, 0, 1, 2] {
        own.push(create(&store, &operator(), number).await.1);
    }
    let (_, foreign) = create(&store, &elsewhere(), 4).await;
    assert!(store.has_tokens().await.unwrap());
    own.sort_by_key(|token| token.created_at);
    assert_eq!(store.tokens(&operator()).await.unwrap(), own);
    assert_eq!(store.tokens(&elsewhere()).await.unwrap(), std::slice::from_ref(&foreign));
    for token in own.iter().chain([&foreign]) {
        assert_eq!(store.token(&token.id).await.unwrap().as_ref(), Some(token));
    }
    assert_eq!(store.token(&Token::issue([9; 32]).id).await.unwrap(), None);
}

#[test_case(Sqlite; "sqlite")]
#[test_case(Postgres; "postgres")]
#[tokio::test]
async fn an_id_is_taken_once(backend: Backend) {
    let database = Database::new(backend);
    let store = database.open().await;
    let (_, first) = create(&store, &operator(), 1).await;
    let again = TokenRecord { operator: elsewhere(), scope: Scope::Admin, ..first.clone() };
    assert!(store.create_token(&again, Actor::Cli).await.is_err());
    assert_eq!(store.token(&first.id).await.unwrap(), Some(first));
    assert_eq!(store.audit(Some(&elsewhere()), 0, 10).await.unwrap(), [], "what failed was not done");
}

#[test_case(Sqlite; "sqlite")]
#[test_case(Postgres; "postgres")]
#[tokio::test]
async fn a_revoked_token_stays_and_is_refused_whatever_the_time(backend: Backend) {
    let database = Database::new(backend);
    let store = database.open().await;
    let (token, _) = create(&store, &operator(), 1).await;
    let (other, kept) = create(&store, &operator(), 2).await;
    assert_eq!(revoke(&store, &elsewhere(), &token.id).await, None, "another operator's is as if it were not there");
    assert_eq!(revoke(&store, &operator(), &Token::issue([9; 32]).id).await, None);
    assert_eq!(revoke(&store, &operator(), &token.id).await, Some(Revocation::Revoked));
    assert_eq!(revoke(&store, &operator(), &token.id).await, Some(Revocation::AlreadyRevoked));
    let record = store.token(&token.id).await.unwrap().unwrap();
    assert_eq!(record.revoked_at, Some(day(9.0)));
    assert_eq!(record.admit(&token.secret, day(1.0)), Err(TokenRefusal::Revoked));
    assert_eq!(store.token(&other.id).await.unwrap(), Some(kept));
    assert!(store.has_tokens().await.unwrap(), "a revoked token still means that callers must show one");
}

#[test_case(Sqlite; "sqlite")]
#[test_case(Postgres; "postgres")]
#[tokio::test]
async fn a_token_opens_to_its_secret_until_it_expires(backend: Backend) {
    let database = Database::new(backend);
    let store = database.open().await;
    let (token, _) = create(&store, &operator(), 0).await;
    let record = store.token(&token.id).await.unwrap().unwrap();
    let principal = record.admit(&token.secret, day(29.9)).unwrap();
    assert_eq!((principal.operator, principal.scope), (operator(), token_scope(0)));
    assert_eq!(principal.actor, Actor::Token(token.id));
    assert_eq!(record.admit(&token.secret, day(30.0)), Err(TokenRefusal::Expired { at: day(30.0) }));
    let stranger = Token::issue([9; 32]).secret;
    assert_eq!(record.admit(&stranger, day(1.0)), Err(TokenRefusal::WrongSecret));
    assert_eq!(
        record.admit(&stranger, day(31.0)),
        Err(TokenRefusal::WrongSecret),
        "who knows no secret learns nothing"
    );
    let lasting = TokenRecord { expires_at: None, ..record };
    assert!(lasting.admit(&token.secret, Timestamp::from_micros(i64::MAX)).is_ok());
}

#[test_case(Sqlite; "sqlite")]
#[test_case(Postgres; "postgres")]
#[tokio::test]
async fn tokens_leave_their_trace_without_a_secret(backend: Backend) {
    let database = Database::new(backend);
    let store = database.open().await;
    let (token, record) = create(&store, &operator(), 1).await;
    revoke(&store, &operator(), &token.id).await;
    revoke(&store, &operator(), &token.id).await;
    let log = store.audit(Some(&operator()), 0, 10).await.unwrap();
    let acts: Vec<_> = log.iter().map(|one| (one.action, one.subject.clone(), one.at)).collect();
    let id = token.id.to_string();
    let expected = [(Action::TokenCreated, id.clone(), record.created_at), (Action::TokenRevoked, id, day(9.0))];
    assert_eq!(acts, expected);
    let text = serde_json::to_string(&log).unwrap();
    let hash: String = record.secret.bytes().iter().map(|byte| format!("{byte:02x}")).collect();
    assert!(!text.contains(&token.reveal()[17..]) && !text.contains(&hash), "{text}");
}
