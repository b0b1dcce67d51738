//! Checksums for the rows that were there before there were any.
//!
//! Card. *What:* once, when a schema that knows no checksums is brought up to date. *Rule:* table by table, some rows
//! in a transaction; a row that has its checksum is left alone, so what was interrupted goes on where it was.
//! *Afterwards:* `schema_info` says that all rows are sealed, and one without a checksum is damaged.

use super::super::{
    Connection,
    access::{anchors, audit, frame_keys::FrameKeyRow, operators::OperatorRow},
    board::{curves::CurveRow, tails::TailBoardRow, units::UnitRow},
    events::recorded::VoidedEventRow,
    ground::sealed,
    lives::{components::ComponentRow, generations::GenerationRow, life::LifeRow},
    models::bundles,
    places::{installations::InstallationRow, movements::MovementRow, observed::PeriodRow, tails::TailRow},
    results::prognoses,
    uploads::{
        aside::{ExclusionRow, SetAsideRow},
        inbox::InboxRow,
        keys::UploadKeyRow,
        retried::RetriedRow,
        voided::VoidedRow,
    },
};
use crate::{StoreError, Verification};

/// Calls a function for each table of which everything else can be made.
macro_rules! sources {
    ($function:ident ( $($argument:expr),* )) => {
        sealed::$function::<OperatorRow>($($argument),*).await?;
        sealed::$function::<FrameKeyRow>($($argument),*).await?;
        sealed::$function::<ComponentRow>($($argument),*).await?;
        sealed::$function::<GenerationRow>($($argument),*).await?;
        sealed::$function::<UploadKeyRow>($($argument),*).await?;
        sealed::$function::<VoidedRow>($($argument),*).await?;
        sealed::$function::<RetriedRow>($($argument),*).await?;
        sealed::$function::<VoidedEventRow>($($argument),*).await?;
    };
}

/// Calls a function for each table that can be made anew.
macro_rules! derived {
    ($function:ident ( $($argument:expr),* )) => {
        sealed::$function::<TailRow>($($argument),*).await?;
        sealed::$function::<LifeRow>($($argument),*).await?;
        sealed::$function::<InstallationRow>($($argument),*).await?;
        sealed::$function::<PeriodRow>($($argument),*).await?;
        sealed::$function::<MovementRow>($($argument),*).await?;
        sealed::$function::<InboxRow>($($argument),*).await?;
        sealed::$function::<SetAsideRow>($($argument),*).await?;
        sealed::$function::<ExclusionRow>($($argument),*).await?;
        sealed::$function::<UnitRow>($($argument),*).await?;
        sealed::$function::<CurveRow>($($argument),*).await?;
        sealed::$function::<TailBoardRow>($($argument),*).await?;
    };
}

/// Seals the rows that are seen: of one operator, where row-level security holds. What is read on one connection is written on
/// the other.
pub(crate) async fn seal_rows(reader: &mut Connection, writer: &mut Connection) -> Result<(), StoreError> {
    sources!(seal_all(&mut *reader, &mut *writer));
    derived!(seal_all(&mut *reader, &mut *writer));
    prognoses::seal(writer).await?;
    for chain in audit::chains(reader).await? {
        audit::anchor(writer, &chain).await?;
    }
    Ok(())
}

/// Seals what belongs to the installation.
pub(crate) async fn seal_models(connection: &mut Connection) -> Result<(), StoreError> {
    bundles::seal(connection).await?;
    audit::anchor(connection, audit::INSTALLATION).await
}

/// Checks every row from which everything else can be made.
pub(super) async fn verify_sources(connection: &mut Connection, found: &mut Verification) -> Result<(), StoreError> {
    sources!(verify(connection, found));
    anchors::verify(connection, found).await
}

/// Checks every row that can be made anew.
pub(super) async fn verify_derived(connection: &mut Connection, found: &mut Verification) -> Result<(), StoreError> {
    derived!(verify(connection, found));
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    const COVERED: &[&str] = &[
        "operators: operator, enrolled_at",
        "frame_keys: operator, key_id, tail, position, part_number, serial_number, mask_id, bundle, made_at, \
         revoked_at",
        "components: operator, part_number, serial_number, enrolled_at",
        "generations: operator, part_number, serial_number, overhaul_index, number, model, prior",
        "upload_keys: operator, upload_id, part_number, serial_number, recorded_at, content_hash",
        "voided: operator, part_number, serial_number, recorded_at, upload_id, voided_at",
        "retried: operator, part_number, serial_number, recorded_at, upload_id, retried_at",
        "voided_events: operator, event_id, part_number, serial_number, voided_at",
        "tails: operator, tail",
        "lives: operator, part_number, serial_number, overhaul_index, generation, prognosis_fence, ended_by, \
         began_by, began_fh, began_at",
        "installations: operator, tail, position, from_at, from_by, from_name, part_number, serial_number, \
         to_at, to_by, to_name",
        "observed_installations: operator, tail, position, from_at, from_upload, part_number, serial_number, \
         to_at, to_upload",
        "movements: operator, part_number, serial_number, occurred_at, event_id, tail, position, inward",
        "inbox: operator, part_number, serial_number, recorded_at, upload_id, since",
        "set_aside: operator, part_number, serial_number, recorded_at, upload_id, reason, detail, set_aside_at",
        "exclusions: operator, part_number, serial_number, recorded_at, upload_id, overhaul_index, \
         generation, reason, detail",
        "board_units: operator, part_number, serial_number, tail, position, place_known, overhaul_index, generation, \
         prognosis_fence, standing, as_of_at, body, stamp, horizon_fh, first_end_fh, p05_fh, p10_fh, p25_fh, p50_fh",
        "board_curves: operator, part_number, serial_number, draws, horizon_fh, ends",
        "board_tails: operator, tail, positions, failed, unknown, newest_inconsistent, newest_ok, \
         newest_beyond_horizon, oldest, p10_fh, flown_until, fh_per_day, stamp",
    ];

    /// A column more or less and no stored checksum of its table holds any longer.
    #[tokio::test]
    async fn checksums_cover_what_they_covered_when_rows_were_stored() -> Result<(), StoreError> {
        let mut covered = Vec::new();
        sources!(list(&mut covered));
        derived!(list(&mut covered));
        assert_eq!(
            covered, COVERED,
            "stored checksums do not hold any longer: a migration must take them away (CONTRIBUTING.md, Add a column); \
             then change the list"
        );
        Ok(())
    }
}
