//! Checkpoints of filters: a cache, so that a damaged row is as good as none.

use std::collections::HashMap;

use domain::{Component, ContentHash};

use super::super::{
    Connection, Engine,
    ground::{
        check,
        key::{BindKey, ComponentColumns, LifePointer},
        row::{checksum, hash, verify},
    },
};
use crate::{Checkpoint, StoreError, Verification};

const CHECKPOINTS: &str = "checkpoints";

impl Engine {
    pub(crate) async fn checkpoint(
        &self,
        component: &Component,
        overhaul_index: u32,
        generation: u32,
        wanted: &[(u64, ContentHash)],
    ) -> Result<Option<Checkpoint>, StoreError> {
        let pointer = LifePointer { overhaul_index: overhaul_index.into(), generation: generation.into() };
        let wanted: HashMap<u64, ContentHash> = wanted.iter().copied().collect();
        let mut transaction = self.read(&component.operator).await?;
        for (block, digest) in kept(&mut transaction, component, pointer, 0).await?.into_iter().rev() {
            let Some(digest) = wanted.get(&block.cast_unsigned()).filter(|wanted| wanted.bytes()[..] == digest) else {
                continue;
            };
            let found = read(&mut transaction, component, pointer, block, digest).await?;
            if found.is_some() {
                return Ok(found);
            }
            tracing::warn!(?component, block, "a damaged checkpoint is passed over");
        }
        Ok(None)
    }
}

/// Blocks and digests of the checkpoints of one generation of a life from a block on, by block.
async fn kept(
    connection: &mut Connection,
    component: &Component,
    pointer: LifePointer,
    from_block: i64,
) -> Result<Vec<(i64, Vec<u8>)>, StoreError> {
    let blocks = sqlx::query_as(
        "select block, digest from checkpoints
         where operator = $1 and part_number = $2 and serial_number = $3 and overhaul_index = $4 and generation = $5
           and block >= $6
         order by block",
    )
    .bind_component(component)
    .bind(pointer.overhaul_index)
    .bind(pointer.generation)
    .bind(from_block);
    Ok(blocks.fetch_all(connection).await?)
}

/// The checkpoint of a block, if it is undamaged.
async fn read(
    connection: &mut Connection,
    component: &Component,
    pointer: LifePointer,
    block: i64,
    digest: &ContentHash,
) -> Result<Option<Checkpoint>, StoreError> {
    let (stored, body): (Vec<u8>, Vec<u8>) = sqlx::query_as(
        "select checksum, body from checkpoints
         where operator = $1 and part_number = $2 and serial_number = $3 and overhaul_index = $4 and generation = $5
           and block = $6",
    )
    .bind_component(component)
    .bind(pointer.overhaul_index)
    .bind(pointer.generation)
    .bind(block)
    .fetch_one(connection)
    .await?;
    let undamaged = verify(&name(component, block, digest), &body, &stored).is_ok();
    Ok(undamaged.then(|| Checkpoint { block: block.cast_unsigned(), digest: *digest, body }))
}

/// The name of a checkpoint, without overhaul index and generation: the digest tells lives apart, and a writer's
/// results are checksummed before it knows them.
fn name<'a>(component: &'a Component, block: i64, digest: &'a ContentHash) -> impl serde::Serialize + 'a {
    (CHECKPOINTS, component, block, digest)
}

/// A checkpoint as columns.
pub(crate) struct Draft {
    block: i64,
    digest: ContentHash,
    checksum: Vec<u8>,
    body: Vec<u8>,
}

impl Draft {
    pub(crate) fn new(component: &Component, checkpoint: Checkpoint) -> Self {
        let Checkpoint { block, digest, body } = checkpoint;
        let block = block.cast_signed();
        Self { block, digest, checksum: checksum(&name(component, block, &digest), &body), body }
    }
}

/// Removes the checkpoints from a block on whose digests no state holds any longer. Each state holds the
/// digest of its block.
pub(crate) async fn delete_outdated(
    connection: &mut Connection,
    component: &Component,
    pointer: LifePointer,
    from_block: i64,
    holds: &HashMap<i64, ContentHash>,
) -> Result<(), StoreError> {
    for (block, digest) in kept(connection, component, pointer, from_block).await? {
        if holds.get(&block).is_some_and(|held| held.bytes()[..] == digest) {
            continue;
        }
        sqlx::query(
            "delete from checkpoints
             where operator = $1 and part_number = $2 and serial_number = $3 and overhaul_index = $4
               and generation = $5 and block = $6",
        )
        .bind_component(component)
        .bind(pointer.overhaul_index)
        .bind(pointer.generation)
        .bind(block)
        .execute(&mut *connection)
        .await?;
    }
    Ok(())
}

/// Writes checkpoints; of each run of blocks the last one stays.
pub(crate) async fn keep(
    connection: &mut Connection,
    component: &Component,
    pointer: LifePointer,
    drafts: &[Draft],
) -> Result<(), StoreError> {
    for draft in drafts {
        insert(connection, component, pointer, draft).await?;
    }
    if drafts.is_empty() { Ok(()) } else { thin_out(connection, component, pointer).await }
}

/// Writes the checkpoint of a block in the place of an earlier one.
async fn insert(
    connection: &mut Connection,
    component: &Component,
    pointer: LifePointer,
    draft: &Draft,
) -> Result<(), StoreError> {
    sqlx::query(
        "insert into checkpoints
         (operator, part_number, serial_number, overhaul_index, generation, block, digest, checksum, body)
         values ($1, $2, $3, $4, $5, $6, $7, $8, $9)
         on conflict (operator, part_number, serial_number, overhaul_index, generation, block)
         do update set digest = excluded.digest, checksum = excluded.checksum, body = excluded.body",
    )
    .bind_component(component)
    .bind(pointer.overhaul_index)
    .bind(pointer.generation)
    .bind(draft.block)
    .bind(&draft.digest.bytes()[..])
    .bind(&draft.checksum)
    .bind(&draft.body)
    .execute(connection)
    .await?;
    Ok(())
}

/// Keeps the last checkpoint of each run of blocks.
async fn thin_out(connection: &mut Connection, component: &Component, pointer: LifePointer) -> Result<(), StoreError> {
    sqlx::query(
        "delete from checkpoints
         where operator = $1 and part_number = $2 and serial_number = $3 and overhaul_index = $4 and generation = $5
           and exists (
             select 1 from checkpoints n
             where n.operator = $1 and n.part_number = $2 and n.serial_number = $3 and n.overhaul_index = $4
               and n.generation = $5 and n.block > checkpoints.block and n.block / $6 = checkpoints.block / $6)",
    )
    .bind_component(component)
    .bind(pointer.overhaul_index)
    .bind(pointer.generation)
    .bind(Checkpoint::RUN.cast_signed())
    .execute(connection)
    .await?;
    Ok(())
}

#[derive(sqlx_macros::FromRow)]
struct CheckpointRow {
    #[sqlx(flatten)]
    key: ComponentColumns,
    block: i64,
    digest: Vec<u8>,
    checksum: Vec<u8>,
    body: Vec<u8>,
}

impl CheckpointRow {
    fn check(self) -> Result<(), StoreError> {
        let (component, digest) = (self.key.component(CHECKPOINTS)?, hash(CHECKPOINTS, &self.digest)?);
        verify(&name(&component, self.block, &digest), &self.body, &self.checksum)
    }
}

/// Checks every checkpoint: a damaged one costs time only, but shows that something damages rows.
pub(crate) async fn verify_all(connection: &mut Connection, found: &mut Verification) -> Result<(), StoreError> {
    let sql = "select operator, part_number, serial_number, block, digest, checksum, body from checkpoints
               order by operator, part_number, serial_number, overhaul_index, generation, block";
    check::each(connection, CHECKPOINTS, sql, found, CheckpointRow::check).await
}
