//! The settings of an operator.

use domain::{Invalid, Settings};

use super::upload::timestamp;
use crate::{
    answer::{FunctionItem, SettingsAnswer},
    json::{FunctionBody, SettingsBody},
    v1,
};

/// The settings, or everything that is wrong with them.
pub fn into_settings(request: v1::SetSettingsRequest) -> Result<Settings, Invalid> {
    let function = |function: v1::Function| FunctionBody {
        name: function.name,
        positions: function.positions,
        needed: function.needed,
    };
    let body = SettingsBody {
        act_within_days: request.act_within_days,
        act_within_fh: request.act_within_fh,
        risk: request.risk,
        stale_after_days: request.stale_after_days,
        time_zone: request.time_zone,
        day_begins: request.day_begins,
        functions: Some(request.functions.into_iter().map(function).collect()),
    };
    body.checked()
}

impl From<SettingsAnswer> for v1::OperatorSettings {
    fn from(answer: SettingsAnswer) -> Self {
        let function = |function: FunctionItem| v1::Function {
            name: function.name,
            positions: function.positions,
            needed: function.needed,
        };
        Self {
            act_within_days: answer.act_within_days,
            act_within_fh: answer.act_within_fh,
            risk: answer.risk,
            stale_after_days: answer.stale_after_days,
            time_zone: answer.time_zone,
            day_begins: answer.day_begins,
            functions: answer.functions.into_iter().map(function).collect(),
            set_at: answer.set_at.map(timestamp),
            set_by: answer.set_by,
        }
    }
}
