//! The due list.

use super::answer::each;
use crate::{answer, v1};

impl From<answer::DueAnswer> for v1::ListDueResponse {
    fn from(body: answer::DueAnswer) -> Self {
        let answer::DueTotals { components, due, unknown } = body.totals;
        Self {
            within_fh: body.within_fh,
            by: body.by.map(Into::into),
            check: body.check,
            risk: body.risk,
            totals: Some(v1::DueTotals { components, due, unknown }),
            items: each(body.items),
            unknown: each(body.unknown),
            next_cursor: body.next_cursor,
            advisory: body.advisory,
        }
    }
}

impl From<answer::DueItem> for v1::DueItem {
    fn from(item: answer::DueItem) -> Self {
        Self {
            tail: item.tail,
            position: item.position,
            part_number: item.part_number,
            serial_number: item.serial_number,
            life: item.life,
            status: v1::Status::from(item.status).into(),
            dominant_fault: item.dominant_fault,
            p: item.p,
            standard_error: item.standard_error,
            latest_safe: item.latest_safe.map(Into::into),
            as_of: item.as_of.map(Into::into),
            doubts: each(item.doubts.unwrap_or_default()),
            reason: item.reason,
            urgency: v1::Urgency::from(item.urgency).into(),
            before: Some(item.before.into()),
            was_due_by: item.was_due_by.map(Into::into),
            data_age_days: item.data_age_days,
        }
    }
}

impl From<answer::LatestSafe> for v1::LatestSafe {
    fn from(safe: answer::LatestSafe) -> Self {
        let answer::LatestSafe { remaining_fh, flight_hours, date, utilisation_source } = safe;
        let utilisation_source = v1::UtilisationSource::told(utilisation_source);
        Self { remaining_fh, flight_hours, date, utilisation_source }
    }
}
