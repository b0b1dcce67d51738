//! The settings of an operator, as they are sent.

use domain::{Function, Invalid, Settings};
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

/// The settings of an operator. What is left out has its default. Unknown fields are refused.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, ToSchema)]
#[serde(default, deny_unknown_fields)]
pub struct SettingsBody {
    /// Days: a unit is to be acted on now when the date on which one in ten has failed lies within them; default 14.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(minimum = 0, maximum = 365, example = 14.0)]
    pub act_within_days: Option<f64>,
    /// Flight hours: or when the hours after which one in ten has failed do; default 100.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(minimum = 0, maximum = 10000, example = 100.0)]
    pub act_within_fh: Option<f64>,
    /// The probability of failure before a check above which a unit does not reach it; default 0.1.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(exclusive_minimum = 0, exclusive_maximum = 1, example = 0.1)]
    pub risk: Option<f64>,
    /// Days after which data are stale, 0.01 to 3650; default: as the server was told.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(maximum = 3650, example = 30.0)]
    pub stale_after_days: Option<f64>,
    /// The time zone of dates, by its name in the IANA database; default UTC.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(example = "Europe/Madrid")]
    pub time_zone: Option<String>,
    /// The time of day at which a working day begins; default 06:00.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(example = "06:00")]
    pub day_begins: Option<String>,
    /// Functions that several units serve together, at most 100; default none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub functions: Option<Vec<FunctionBody>>,
}

/// A function that several units of a tail serve together. A position serves at most one.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct FunctionBody {
    /// Its name, 1 to 32 characters.
    #[schema(max_length = 32, example = "roll")]
    pub name: String,
    /// The positions of the units that serve it, at most 64.
    #[schema(example = json!(["AIL-L", "AIL-R"]))]
    pub positions: Vec<String>,
    /// How many of them have to work: at most as many as there are.
    #[schema(minimum = 1, example = 1)]
    pub needed: u32,
}

impl SettingsBody {
    /// The settings, or everything that is wrong with them.
    pub fn checked(self) -> Result<Settings, Invalid> {
        let (mut invalid, default) = (Invalid::default(), Settings::default());
        let time_zone = self.time_zone.map(|name| invalid.check("#/time_zone", name.parse()));
        let day_begins = self.day_begins.map(|time| invalid.check("#/day_begins", time.parse()));
        let functions = self.functions.into_iter().flatten().enumerate();
        let functions: Vec<_> = functions.filter_map(|(i, body)| body.function(i, &mut invalid)).collect();
        let settings = Settings {
            act_within_days: self.act_within_days.unwrap_or(default.act_within_days),
            act_within_fh: self.act_within_fh.unwrap_or(default.act_within_fh),
            risk: self.risk.unwrap_or(default.risk),
            stale_after_days: self.stale_after_days,
            time_zone: time_zone.flatten().unwrap_or(default.time_zone),
            day_begins: day_begins.flatten().unwrap_or(default.day_begins),
            functions,
        };
        match settings.checked() {
            Ok(settings) => invalid.into_result(Some(settings)),
            Err(more) => {
                invalid.violations.extend(more.violations);
                Err(invalid)
            }
        }
    }
}

impl FunctionBody {
    fn function(self, i: usize, invalid: &mut Invalid) -> Option<Function> {
        let named = self.positions.iter().enumerate();
        let positions: Vec<_> =
            named.map(|(at, name)| invalid.check(&format!("#/functions/{i}/positions/{at}"), name.parse())).collect();
        let positions = positions.into_iter().collect::<Option<Vec<_>>>()?;
        Some(Function { name: self.name, positions, needed: self.needed as usize })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::json::{BodyError, parse};

    fn pointers(json: &str) -> Vec<String> {
        let refused = match parse::<SettingsBody>(json.as_bytes()) {
            Ok(body) => body.checked().unwrap_err(),
            Err(BodyError::Invalid(invalid) | BodyError::Malformed(invalid)) => invalid,
        };
        refused.violations.into_iter().map(|violation| violation.pointer).collect()
    }

    #[test]
    fn what_is_left_out_has_its_default() {
        let read = |json: &str| parse::<SettingsBody>(json.as_bytes()).unwrap().checked().unwrap();
        assert_eq!(read("{}"), Settings::default());
        let some = read(r#"{"risk":0.05,"time_zone":"Europe/Madrid","stale_after_days":null}"#);
        assert_eq!((some.risk, some.time_zone.name()), (0.05, "Europe/Madrid"));
        assert_eq!(some.act_within_days, 14.0);
    }

    #[test]
    fn whatever_is_wrong_is_named_by_its_place() {
        let function = |function: &str| format!(r#"{{"functions":[{function}]}}"#);
        for (json, expected) in [
            ("[]".to_owned(), "#"),
            (r#"{"risk":0}"#.to_owned(), "#/risk"),
            (r#"{"risk":1}"#.to_owned(), "#/risk"),
            (r#"{"risk":"low"}"#.to_owned(), "#/risk"),
            (r#"{"act_within_days":-1}"#.to_owned(), "#/act_within_days"),
            (r#"{"time_zone":"Europe/Atlantis"}"#.to_owned(), "#/time_zone"),
            (r#"{"day_begins":"6"}"#.to_owned(), "#/day_begins"),
            (r#"{"act_within":14}"#.to_owned(), "#/act_within"),
            (function(r#"{"name":"roll","positions":["AIL-L"],"needed":2}"#), "#/functions/0/needed"),
            (function(r#"{"name":"roll","positions":["AIL L"],"needed":1}"#), "#/functions/0/positions/0"),
            (function(r#"{"name":"roll","positions":["AIL-L","AIL-L"],"needed":1}"#), "#/functions/0/positions/1"),
            (function(r#"{"name":"roll","needed":1}"#), "#/functions/0/positions"),
        ] {
            assert_eq!(pointers(&json), [expected], "{json}");
        }
    }
}
