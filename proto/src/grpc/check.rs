//! The checks of a tail.

use domain::{Checks, Day, Invalid, TailNumber, Violation};

use super::upload::timestamp;
use crate::{
    answer::{CheckItem, ChecksAnswer},
    json::CheckBody,
    v1,
};

/// The tail and its checks that are set `today`, or everything that is wrong with them.
pub fn into_checks(request: v1::SetChecksRequest, today: Day) -> Result<(TailNumber, Checks), Invalid> {
    let mut invalid = Invalid::default();
    let tail = invalid.check("#/tail", request.tail.parse());
    let body = |check: v1::Check| CheckBody {
        name: check.name,
        date: check.date,
        remaining_fh: check.remaining_fh,
        as_of: check.as_of,
    };
    let bodies: Vec<_> = request.checks.into_iter().map(body).collect();
    let checks = match CheckBody::checked(&bodies, today) {
        Ok(checks) => Some(checks),
        Err(refused) => {
            let place = |violation: Violation| Violation {
                pointer: violation.pointer.replacen('#', "#/checks", 1),
                detail: violation.detail,
            };
            invalid.violations.extend(refused.violations.into_iter().map(place));
            None
        }
    };
    invalid.into_result(tail.zip(checks))
}

impl From<ChecksAnswer> for v1::TailChecks {
    fn from(answer: ChecksAnswer) -> Self {
        let check = |item: CheckItem| v1::ExpectedCheck {
            check: Some(v1::Check {
                name: item.name,
                date: item.date,
                remaining_fh: item.remaining_fh,
                as_of: item.as_of,
            }),
            expected_date: item.expected_date,
            utilisation_source: v1::UtilisationSource::told(item.utilisation_source),
            past: item.past,
        };
        Self {
            tail: answer.tail,
            set_at: answer.set_at.map(timestamp),
            set_by: answer.set_by,
            checks: answer.checks.into_iter().map(check).collect(),
        }
    }
}
