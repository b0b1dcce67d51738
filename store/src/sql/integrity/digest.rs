//! The digest over all estimates and states.
//!
//! Card. *What:* a chain of SHA-256: each result is hashed together with the hash so far. *Order:*
//! operator, part number, serial number, overhaul index; of each life the generation that answers, first its
//! estimates in the order of the life, then the states by block. *Content:* that key and the noun's
//! canonical JSON; nothing that tells when or how often anything was received or computed. One life
//! at a time is in memory, all are read in one transaction.

use domain::{ContentHash, OperatorId};
use serde::Serialize;

use super::super::{
    Connection, Engine,
    access::operators,
    ground::{row::count, sealed::Sealed},
    lives::life::{LifeRow, life_columns},
    results::{
        estimates::{self, EstimateRange},
        states::{self, StateRange},
    },
};
use crate::{Digest, StoreError};

impl Engine {
    pub(crate) async fn digest(&self) -> Result<Digest, StoreError> {
        let mut transaction = self.read_all().await?;
        let mut digest = Digest { digest: ContentHash::of(b""), estimates: 0, states: 0, lives: 0 };
        for operator in operators::all(&mut transaction).await? {
            self.enter(&mut transaction, &operator).await?;
            extend(&mut transaction, &operator, &mut digest).await?;
        }
        Ok(digest)
    }
}

/// Chains all results of an operator to a digest.
async fn extend(connection: &mut Connection, operator: &OperatorId, digest: &mut Digest) -> Result<(), StoreError> {
    let lives = sqlx::query_scalar("select count(*) from lives where operator = $1").bind(operator.as_str());
    digest.lives += count::<u64>("lives", lives.fetch_one(&mut *connection).await?)?;
    let rows: Vec<LifeRow> = sqlx::query_as(concat!(
        "select ",
        life_columns!(),
        "from lives l where l.operator = $1 order by l.part_number, l.serial_number, l.overhaul_index"
    ))
    .bind(operator.as_str())
    .fetch_all(&mut *connection)
    .await?;
    for row in rows {
        let row = row.checked()?;
        let (component, pointer) = (row.component()?, row.pointer());
        let life = (&component, pointer.overhaul_index, pointer.generation);
        for estimate in estimates::of_life(connection, &component, pointer, EstimateRange::ALL).await? {
            digest.estimates += 1;
            digest.digest = chained(digest.digest, &("estimate", life, estimate));
        }
        for state in states::of_life(connection, &component, pointer, StateRange::ALL).await? {
            digest.states += 1;
            digest.digest = chained(digest.digest, &("state", life, state));
        }
    }
    Ok(())
}

fn chained(so_far: ContentHash, result: &impl Serialize) -> ContentHash {
    let result = ContentHash::of_json(result);
    ContentHash::of_parts([so_far.bytes().as_slice(), result.bytes()])
}
