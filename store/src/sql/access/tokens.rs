//! Tokens. Their secrets are not here: only what tells them.

use domain::{Act, Action, Actor, OperatorId, Scope, SecretHash, Timestamp, TokenId};
use serde_json::{Value, json};

use super::super::{
    Connection, Engine,
    ground::{
        check,
        row::{self, checksum, corrupt, hash, parse},
        write::{Reach, Write},
    },
};
use super::{anchors, audit::Trace};
use crate::{Revocation, StoreError, TokenRecord, Verification};

const TOKENS: &str = "tokens";

impl Engine {
    pub(crate) async fn create_token(&self, token: &TokenRecord, actor: Actor) -> Result<(), StoreError> {
        let detail = json!({ "scope": token.scope, "name": token.name, "expires_at": token.expires_at });
        let (act, subject) = (actor.at(token.created_at), token.id.to_string());
        let trace = Trace { act, action: Action::TokenCreated, subject, detail };
        self.act(Create(token.clone()), trace, |()| true).await
    }

    pub(crate) async fn tokens(&self, operator: &OperatorId) -> Result<Vec<TokenRecord>, StoreError> {
        let rows: Vec<TokenRow> = sqlx::query_as(tokens!("where operator = $1 order by created_at, token_id"))
            .bind(operator.as_str())
            .fetch_all(&mut *self.read(operator).await?)
            .await?;
        rows.into_iter().map(TokenRow::record).collect()
    }

    pub(crate) async fn token(&self, id: &TokenId) -> Result<Option<TokenRecord>, StoreError> {
        find(&mut *self.read_all().await?, id).await
    }

    pub(crate) async fn has_tokens(&self) -> Result<bool, StoreError> {
        let (sql, mut transaction) = ("select exists (select 1 from tokens)", self.read_all().await?);
        let held: bool = sqlx::query_scalar(sql).fetch_one(&mut *transaction).await?;
        Ok(held || anchors::know_tokens(&mut transaction).await?)
    }

    pub(crate) async fn revoke_token(
        &self,
        operator: &OperatorId,
        id: &TokenId,
        act: Act,
    ) -> Result<Option<Revocation>, StoreError> {
        let trace = Trace { act, action: Action::TokenRevoked, subject: id.to_string(), detail: Value::Null };
        let revoke = Revoke { operator: operator.clone(), id: *id, revoked_at: act.at };
        self.act(revoke, trace, |revoked| *revoked == Some(Revocation::Revoked)).await
    }
}

/// Tokens for which a condition holds.
macro_rules! tokens {
    ($condition:literal) => {
        concat!(
            "select token_id, operator, scope, tail, name, secret_hash, created_at, expires_at, revoked_at, checksum
             from tokens ",
            $condition
        )
    };
}
use tokens;

#[derive(sqlx_macros::FromRow)]
struct TokenRow {
    token_id: String,
    operator: String,
    scope: String,
    tail: Option<String>,
    name: Option<String>,
    secret_hash: Vec<u8>,
    created_at: i64,
    expires_at: Option<i64>,
    revoked_at: Option<i64>,
    checksum: Vec<u8>,
}

impl TokenRow {
    fn record(self) -> Result<TokenRecord, StoreError> {
        let tail = self.tail.as_deref().map(|tail| parse(TOKENS, tail)).transpose()?;
        let token = TokenRecord {
            id: parse(TOKENS, &self.token_id)?,
            operator: parse(TOKENS, &self.operator)?,
            scope: Scope::new(&self.scope, tail).map_err(|error| corrupt(&(TOKENS, &self.token_id), error))?,
            name: self.name.as_deref().map(|name| parse(TOKENS, name)).transpose()?,
            secret: SecretHash::from(hash(TOKENS, &self.secret_hash)?),
            created_at: Timestamp::from_micros(self.created_at),
            expires_at: self.expires_at.map(Timestamp::from_micros),
            revoked_at: self.revoked_at.map(Timestamp::from_micros),
        };
        row::verify(&name(&token), &[], &self.checksum)?;
        Ok(token)
    }
}

/// All columns, because each of them decides who is let in.
fn name(token: &TokenRecord) -> impl serde::Serialize + '_ {
    let TokenRecord { id, operator, scope, name, secret, created_at, expires_at, revoked_at } = token;
    let times = (created_at.micros(), expires_at.map(Timestamp::micros), revoked_at.map(Timestamp::micros));
    (TOKENS, id, operator, scope, name, secret, times)
}

/// Reads all rows and notes the damaged ones.
pub(crate) async fn verify_all(connection: &mut Connection, found: &mut Verification) -> Result<(), StoreError> {
    let check = |row: TokenRow| row.record().map(|_| ());
    check::each(connection, TOKENS, tokens!("order by operator, created_at, token_id"), found, check).await
}

async fn find(connection: &mut Connection, id: &TokenId) -> Result<Option<TokenRecord>, StoreError> {
    let row: Option<TokenRow> =
        sqlx::query_as(tokens!("where token_id = $1")).bind(id.to_string()).fetch_optional(connection).await?;
    row.map(TokenRow::record).transpose()
}

struct Create(TokenRecord);

impl Write for Create {
    type Output = ();

    fn reach(&self) -> Reach<'_> {
        Reach::Operator(&self.0.operator)
    }

    async fn apply(&self, connection: &mut Connection, _: Timestamp) -> Result<(), StoreError> {
        let Self(token) = self;
        sqlx::query(
            "insert into tokens
             (token_id, operator, scope, tail, name, secret_hash, created_at, expires_at, revoked_at, checksum)
             values ($1, $2, $3, $4, $5, $6, $7, $8, $9, $10)",
        )
        .bind(token.id.to_string())
        .bind(token.operator.as_str())
        .bind(token.scope.as_str())
        .bind(token.scope.tail().map(|tail| tail.as_str()))
        .bind(token.name.as_ref().map(|name| name.as_str()))
        .bind(&token.secret.bytes()[..])
        .bind(token.created_at.micros())
        .bind(token.expires_at.map(Timestamp::micros))
        .bind(token.revoked_at.map(Timestamp::micros))
        .bind(checksum(&name(token), &[]))
        .execute(&mut *connection)
        .await?;
        Ok(())
    }
}

struct Revoke {
    operator: OperatorId,
    id: TokenId,
    revoked_at: Timestamp,
}

impl Write for Revoke {
    type Output = Option<Revocation>;

    fn reach(&self) -> Reach<'_> {
        Reach::Operator(&self.operator)
    }

    async fn apply(&self, connection: &mut Connection, _: Timestamp) -> Result<Option<Revocation>, StoreError> {
        let Self { operator, id, revoked_at } = self;
        let token = match find(connection, id).await? {
            Some(token) if token.operator == *operator => token,
            _ => return Ok(None),
        };
        if token.revoked_at.is_some() {
            return Ok(Some(Revocation::AlreadyRevoked));
        }
        let revoked = TokenRecord { revoked_at: Some(*revoked_at), ..token };
        sqlx::query("update tokens set revoked_at = $2, checksum = $3 where token_id = $1")
            .bind(id.to_string())
            .bind(revoked_at.micros())
            .bind(checksum(&name(&revoked), &[]))
            .execute(&mut *connection)
            .await?;
        Ok(Some(Revocation::Revoked))
    }
}
