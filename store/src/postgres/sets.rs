//! Uploads stored by sets: a statement per table for many of them, where each alone would take as many.
//!
//! Card. *What:* an upload is plain when its name is new, its component is known, and uploads say already that the
//! component is at its place: it writes its name, itself and its place in the inbox, counts as an input, and changes
//! nothing else. *Rule:* a run of plain uploads is written at once. Any other write is applied alone, in its turn, and
//! those behind it are asked about again: so what moves installations keeps its order, and all rows are the same as one
//! by one. *Requires:* the operator's row is held, so that nobody else stores its uploads meanwhile.

use std::collections::{BTreeMap, HashSet};

use domain::{Component, OperatorId, Timestamp};

use super::{
    Connection,
    sql::{
        Accept, InboxRow, InstallationRow, Job, LifeRow, Overhauls, Sealed, UploadKey, UploadKeyRow, Waiting,
        hours_column, life_columns, seal_upload,
    },
};
use crate::{Receipt, StoreError};

/// Fewer writes are not worth the question.
const FEWEST: usize = 3;

/// Applies a batch of writes of one reach, in its order.
pub(super) async fn apply(
    batch: &mut [Box<dyn Job>],
    connection: &mut Connection,
    now: Timestamp,
) -> Result<(), StoreError> {
    let mut begin = 0;
    while begin < batch.len() {
        let is_plain = plain(&mut batch[begin..], connection).await?;
        let together = is_plain.iter().take_while(|is_plain| **is_plain).count();
        let alone = is_plain[together..].iter().take_while(|is_plain| !**is_plain).count();
        store(&mut batch[begin..begin + together], connection, now).await?;
        begin += together;
        for job in &mut batch[begin..begin + alone] {
            job.apply(connection, now).await?;
        }
        begin += alone;
    }
    Ok(())
}

/// The uploads of a batch; `None` where it holds anything else, or too few.
fn uploads(batch: &mut [Box<dyn Job>]) -> Option<Vec<&mut Waiting<Accept>>> {
    let uploads = batch.iter_mut().map(|job| job.as_any().downcast_mut());
    uploads.collect::<Option<Vec<_>>>().filter(|uploads| uploads.len() >= FEWEST)
}

/// Tells of each write of a batch whether it is a plain upload.
async fn plain(batch: &mut [Box<dyn Job>], connection: &mut Connection) -> Result<Vec<bool>, StoreError> {
    let count = batch.len();
    let Some(uploads) = uploads(batch) else { return Ok(vec![false; count]) };
    let sent: Vec<&Accept> = uploads.into_iter().map(|waiting| &waiting.write).collect();
    let rows = Columns::of(&sent);
    let known: Vec<bool> = sqlx::query_scalar(
        "select not exists (select 1 from upload_keys k where k.operator = $1 and k.upload_id = b.upload_id)
            and exists (select 1 from component_queue q
                        where q.operator = $1 and q.part_number = b.part_number and q.serial_number = b.serial_number)
         from unnest($2, $3, $4) with ordinality as b (upload_id, part_number, serial_number, number)
         order by b.number",
    )
    .bind(rows.operator.as_str())
    .bind(&rows.upload_ids)
    .bind(&rows.part_numbers)
    .bind(&rows.serial_numbers)
    .fetch_all(&mut *connection)
    .await?;
    let mut is_plain = vec![false; count];
    for Held { number, place } in held(connection, &rows, &sent).await? {
        let index = usize::try_from(number - 1).unwrap_or(usize::MAX);
        let Some(Accept { component, upload, .. }) = sent.get(index) else { continue };
        is_plain[index] = known[index] && place.seen_to_hold(component, upload)?;
    }
    let mut names = HashSet::new();
    for (is_plain, upload_id) in is_plain.iter_mut().zip(&rows.upload_ids) {
        *is_plain &= names.insert(upload_id);
    }
    Ok(is_plain)
}

/// The installation that began last before an upload at its place.
#[derive(sqlx_macros::FromRow)]
struct Held {
    /// Number of the upload, from 1.
    number: i64,
    #[sqlx(flatten)]
    place: InstallationRow,
}

async fn held(connection: &mut Connection, rows: &Columns, sent: &[&Accept]) -> Result<Vec<Held>, StoreError> {
    let tails: Vec<&str> = sent.iter().map(|one| one.upload.tail.as_str()).collect();
    let positions: Vec<&str> = sent.iter().map(|one| one.upload.position.as_str()).collect();
    let held = sqlx::query_as(
        "select b.number, i.operator, i.tail, i.position, i.from_at, i.from_by, i.from_name, i.part_number,
                i.serial_number, i.to_at, i.to_by, i.to_name, i.checksum as place_checksum
         from unnest($2, $3, $4, $5) with ordinality as b (upload_id, tail, position, recorded_at, number)
         cross join lateral (
           select * from installations i
           where i.operator = $1 and i.tail = b.tail and i.position = b.position
             and (i.from_at, i.from_by, i.from_name) < (b.recorded_at, 'upload', b.upload_id)
           order by i.from_at desc, i.from_by desc, i.from_name desc limit 1) i",
    );
    let held = held.bind(rows.operator.as_str()).bind(&rows.upload_ids).bind(tails).bind(positions);
    Ok(held.bind(&rows.recorded_at).fetch_all(connection).await?)
}

/// Uploads of one operator by their columns.
struct Columns {
    operator: OperatorId,
    upload_ids: Vec<String>,
    part_numbers: Vec<String>,
    serial_numbers: Vec<String>,
    recorded_at: Vec<i64>,
}

impl Columns {
    fn of(sent: &[&Accept]) -> Self {
        Self {
            operator: sent[0].component.operator.clone(),
            upload_ids: sent.iter().map(|one| one.upload.upload_id.to_string()).collect(),
            part_numbers: sent.iter().map(|one| one.component.part_number.to_string()).collect(),
            serial_numbers: sent.iter().map(|one| one.component.serial_number.to_string()).collect(),
            recorded_at: sent.iter().map(|one| one.upload.recorded_at.micros()).collect(),
        }
    }
}

/// Stores plain uploads.
async fn store(batch: &mut [Box<dyn Job>], connection: &mut Connection, now: Timestamp) -> Result<(), StoreError> {
    let mut waiting: Vec<&mut Waiting<Accept>> =
        batch.iter_mut().filter_map(|job| job.as_any().downcast_mut()).collect();
    if waiting.is_empty() {
        return Ok(());
    }
    let sent: Vec<&Accept> = waiting.iter().map(|waiting| &waiting.write).collect();
    insert(connection, &sent).await?;
    announce(connection, &sent, now).await?;
    for waiting in &mut waiting {
        waiting.output = Some(Receipt::Accepted);
    }
    Ok(())
}

/// Writes the names, the uploads and their places in the inbox.
async fn insert(connection: &mut Connection, sent: &[&Accept]) -> Result<(), StoreError> {
    let rows = Columns::of(sent);
    let keys: Vec<UploadKey> = sent.iter().map(|one| UploadKey::new(&one.component, &one.upload)).collect();
    let names = sent.iter().zip(&keys).map(|(one, key)| UploadKeyRow::new(key, &one.content_hash));
    let (hashes, name_seals): (Vec<_>, Vec<_>) = names.map(|row| (row.content_hash.clone(), row.seal())).unzip();
    let received_at: Vec<i64> = sent.iter().map(|one| one.received_at.micros()).collect();
    let inbox_seals = sent.iter().zip(&keys).map(|(one, key)| InboxRow::new(key, one.received_at).seal());
    let upload_seals = sent.iter().map(|one| seal_upload(&one.component, &one.upload, &one.body, one.received_at));
    let name = sqlx::query(
        "insert into upload_keys (operator, upload_id, part_number, serial_number, recorded_at, content_hash, checksum)
         select $1, b.* from unnest($2, $3, $4, $5, $6, $7) as b",
    );
    let name = name.bind(rows.operator.as_str()).bind(&rows.upload_ids).bind(&rows.part_numbers);
    let name = name.bind(&rows.serial_numbers).bind(&rows.recorded_at).bind(hashes).bind(name_seals);
    name.execute(&mut *connection).await?;
    let upload = sqlx::query(
        "insert into uploads (operator, upload_id, part_number, serial_number, recorded_at, received_at, body, checksum,
                              flight_hours)
         select $1, b.* from unnest($2, $3, $4, $5, $6, $7, $8, $9) as b",
    );
    let upload = upload.bind(rows.operator.as_str()).bind(&rows.upload_ids).bind(&rows.part_numbers);
    let upload = upload.bind(&rows.serial_numbers).bind(&rows.recorded_at).bind(&received_at);
    let upload = upload.bind(sent.iter().map(|one| one.body.as_str()).collect::<Vec<_>>());
    let upload = upload.bind(upload_seals.collect::<Vec<_>>());
    let hours = sent.iter().map(|one| hours_column(one.upload.flight_hours)).collect::<Vec<_>>();
    upload.bind(hours).execute(&mut *connection).await?;
    let inbox = sqlx::query(
        "insert into inbox (operator, upload_id, part_number, serial_number, recorded_at, since, checksum)
         select $1, b.* from unnest($2, $3, $4, $5, $6, $7) as b",
    );
    let inbox = inbox.bind(rows.operator.as_str()).bind(&rows.upload_ids).bind(&rows.part_numbers);
    let inbox = inbox.bind(&rows.serial_numbers).bind(&rows.recorded_at).bind(&received_at);
    inbox.bind(inbox_seals.collect::<Vec<_>>()).execute(connection).await?;
    Ok(())
}

/// Counts the uploads as inputs of their components, and lets the lives wait that they are of.
async fn announce(connection: &mut Connection, sent: &[&Accept], now: Timestamp) -> Result<(), StoreError> {
    let mut by_component: BTreeMap<&Component, Vec<&Accept>> = BTreeMap::new();
    for one in sent {
        by_component.entry(&one.component).or_default().push(one);
    }
    let operator = sent[0].component.operator.as_str();
    let part_numbers: Vec<&str> = by_component.keys().map(|component| component.part_number.as_str()).collect();
    let serial_numbers: Vec<&str> = by_component.keys().map(|component| component.serial_number.as_str()).collect();
    let counts: Vec<i64> = by_component.values().map(|sent| sent.len() as i64).collect();
    let counted: Vec<(String, String, i64)> = sqlx::query_as(
        "update component_queue q set
           not_before = case when q.input_revision = q.processed_revision then $5 else q.not_before end,
           input_revision = q.input_revision + b.count
         from unnest($2, $3, $4) as b (part_number, serial_number, count)
         where q.operator = $1 and q.part_number = b.part_number and q.serial_number = b.serial_number
         returning q.part_number, q.serial_number, q.input_revision",
    )
    .bind(operator)
    .bind(&part_numbers)
    .bind(&serial_numbers)
    .bind(counts)
    .bind(now.micros())
    .fetch_all(&mut *connection)
    .await?;
    let counted: BTreeMap<(&str, &str), i64> =
        counted.iter().map(|(part, serial, revision)| ((part.as_str(), serial.as_str()), *revision)).collect();
    let overhauled: Vec<LifeRow> = sqlx::query_as(concat!(
        "select ",
        life_columns!(),
        "from unnest($2, $3) as b (part_number, serial_number)
         join lives l on l.operator = $1 and l.part_number = b.part_number and l.serial_number = b.serial_number
         where l.overhaul_index > 0 order by l.part_number, l.serial_number, l.overhaul_index"
    ))
    .bind(operator)
    .bind(&part_numbers)
    .bind(&serial_numbers)
    .fetch_all(&mut *connection)
    .await?;
    let mut lives: BTreeMap<(&str, &str), Vec<LifeRow>> = BTreeMap::new();
    for row in &overhauled {
        lives.entry((row.part_number.as_str(), row.serial_number.as_str())).or_default().push(row.clone());
    }
    let mut touched: BTreeMap<(&str, &str, i64), i64> = BTreeMap::new();
    for (component, sent) in &by_component {
        let key = (component.part_number.as_str(), component.serial_number.as_str());
        let overhauls = Overhauls::from_lives(lives.remove(&key).unwrap_or_default())?;
        let newest = counted.get(&key).copied().unwrap_or_default();
        for (behind, one) in sent.iter().rev().enumerate() {
            let life = overhauls.life_at(one.upload.flight_hours, one.upload.recorded_at);
            touched.entry((key.0, key.1, life)).or_insert(newest - behind as i64);
        }
    }
    touch(connection, operator, &touched).await
}

/// Lets lives wait for a worker, each since its component's input of a number.
async fn touch(
    connection: &mut Connection,
    operator: &str,
    touched: &BTreeMap<(&str, &str, i64), i64>,
) -> Result<(), StoreError> {
    sqlx::query(
        "update lives l set touched_revision = b.revision
         from unnest($2, $3, $4, $5) as b (part_number, serial_number, overhaul_index, revision)
         where l.operator = $1 and l.part_number = b.part_number and l.serial_number = b.serial_number
           and l.overhaul_index = b.overhaul_index",
    )
    .bind(operator)
    .bind(touched.keys().map(|key| key.0).collect::<Vec<_>>())
    .bind(touched.keys().map(|key| key.1).collect::<Vec<_>>())
    .bind(touched.keys().map(|key| key.2).collect::<Vec<_>>())
    .bind(touched.values().copied().collect::<Vec<_>>())
    .execute(connection)
    .await?;
    Ok(())
}
