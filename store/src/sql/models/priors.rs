//! Learned priors.

use domain::{Component, ContentHash, OperatorId, Timestamp};

use super::super::{
    Connection, Engine,
    ground::{
        check,
        row::{checksum, corrupt, count, hash, parse, verify},
        write::{Reach, Write},
    },
};
use super::lesson_claims;
use crate::{PriorRecord, StoreError, Verification};

const PRIORS: &str = "priors";

impl Engine {
    pub(crate) async fn add_prior(
        &self,
        operator: &OperatorId,
        prior: &PriorRecord,
        body: &[u8],
    ) -> Result<(), StoreError> {
        let found = ContentHash::of(body);
        if found != prior.hash {
            return Err(StoreError::WrongHash { named: prior.hash, found });
        }
        self.write(Add { operator: operator.clone(), prior: prior.clone(), body: body.to_vec() }).await
    }

    pub(crate) async fn priors(&self, operator: &OperatorId) -> Result<Vec<PriorRecord>, StoreError> {
        let rows: Vec<PriorRow> = sqlx::query_as(
            "select operator, part_number, hash, model, parent, lives, learned_at, checksum from priors
             where operator = $1 order by part_number, learned_at, hash",
        )
        .bind(operator.as_str())
        .fetch_all(&mut *self.read(operator).await?)
        .await?;
        rows.into_iter().map(PriorRow::record).collect()
    }

    pub(crate) async fn prior_body(
        &self,
        operator: &OperatorId,
        hash: &ContentHash,
    ) -> Result<Option<Vec<u8>>, StoreError> {
        let sql = "select body from priors where operator = $1 and hash = $2 limit 1";
        let query = sqlx::query_scalar(sql).bind(operator.as_str()).bind(&hash.bytes()[..]);
        let body: Option<Vec<u8>> = query.fetch_optional(&mut *self.read(operator).await?).await?;
        match body {
            Some(body) if ContentHash::of(&body) != *hash => {
                Err(corrupt(&(PRIORS, operator, hash), "its bytes are not those of its hash"))
            }
            body => Ok(body),
        }
    }
}

/// The newest prior that was learned for a component's part number under a bundle.
pub(crate) async fn newest(
    connection: &mut Connection,
    component: &Component,
    model: &ContentHash,
) -> Result<Option<ContentHash>, StoreError> {
    let row: Option<PriorRow> = sqlx::query_as(
        "select operator, part_number, hash, model, parent, lives, learned_at, checksum from priors
         where operator = $1 and part_number = $2 and model = $3
         order by learned_at desc, hash desc limit 1",
    )
    .bind(component.operator.as_str())
    .bind(component.part_number.as_str())
    .bind(&model.bytes()[..])
    .fetch_optional(connection)
    .await?;
    Ok(row.map(PriorRow::record).transpose()?.map(|prior| prior.hash))
}

#[derive(sqlx_macros::FromRow)]
struct PriorRow {
    operator: String,
    part_number: String,
    hash: Vec<u8>,
    model: Vec<u8>,
    parent: Vec<u8>,
    lives: i64,
    learned_at: i64,
    checksum: Vec<u8>,
}

impl PriorRow {
    fn record(self) -> Result<PriorRecord, StoreError> {
        let operator = parse(PRIORS, &self.operator)?;
        let prior = PriorRecord {
            part_number: parse(PRIORS, &self.part_number)?,
            hash: hash(PRIORS, &self.hash)?,
            model: hash(PRIORS, &self.model)?,
            parent: hash(PRIORS, &self.parent)?,
            lives: count(PRIORS, self.lives)?,
            learned_at: Timestamp::from_micros(self.learned_at),
        };
        verify(&name(&operator, &prior), &[], &self.checksum)?;
        Ok(prior)
    }
}

/// Everything but the body, which its hash vouches for.
fn name<'a>(operator: &'a OperatorId, prior: &'a PriorRecord) -> impl serde::Serialize + 'a {
    let PriorRecord { part_number, hash, model, parent, lives, learned_at } = prior;
    (PRIORS, operator, part_number, hash, model, parent, lives, learned_at.micros())
}

struct Add {
    operator: OperatorId,
    prior: PriorRecord,
    body: Vec<u8>,
}

impl Write for Add {
    type Output = ();

    fn reach(&self) -> Reach<'_> {
        Reach::Operator(&self.operator)
    }

    async fn apply(&self, connection: &mut Connection, _: Timestamp) -> Result<(), StoreError> {
        let Self { operator, prior, body } = self;
        let model = &prior.model.bytes()[..];
        let known: bool = sqlx::query_scalar("select exists (select 1 from bundles where hash = $1)")
            .bind(model)
            .fetch_one(&mut *connection)
            .await?;
        if !known {
            return Err(StoreError::UnknownBundle(prior.model));
        }
        sqlx::query(
            "insert into priors (operator, part_number, model, hash, parent, lives, learned_at, checksum, body)
             values ($1, $2, $3, $4, $5, $6, $7, $8, $9)
             on conflict (operator, part_number, model, hash) do update set
               parent = excluded.parent, lives = excluded.lives, learned_at = excluded.learned_at,
               checksum = excluded.checksum
             where excluded.lives > priors.lives",
        )
        .bind(operator.as_str())
        .bind(prior.part_number.as_str())
        .bind(model)
        .bind(&prior.hash.bytes()[..])
        .bind(&prior.parent.bytes()[..])
        .bind(i64::from(prior.lives))
        .bind(prior.learned_at.micros())
        .bind(checksum(&name(operator, prior), &[]))
        .bind(body)
        .execute(&mut *connection)
        .await?;
        lesson_claims::release(connection, operator, &prior.part_number, &prior.model).await
    }
}

#[derive(sqlx_macros::FromRow)]
struct WholePriorRow {
    #[sqlx(flatten)]
    prior: PriorRow,
    body: Vec<u8>,
}

impl WholePriorRow {
    fn check(self) -> Result<(), StoreError> {
        let hash = self.prior.record()?.hash;
        if ContentHash::of(&self.body) == hash {
            Ok(())
        } else {
            Err(corrupt(&(PRIORS, hash), "its bytes are not those of its hash"))
        }
    }
}

/// Checks every prior.
pub(crate) async fn verify_all(connection: &mut Connection, found: &mut Verification) -> Result<(), StoreError> {
    let sql = "select operator, part_number, hash, model, parent, lives, learned_at, checksum, body from priors
               order by operator, part_number, model, hash";
    check::each(connection, PRIORS, sql, found, WholePriorRow::check).await
}
