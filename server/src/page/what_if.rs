//! The form that asks what would be if a tail flew otherwise, and its answer beside what is.

use domain::{OperatorId, Timestamp};
use proto::{
    answer::{FailureProbability, RulAnswer, RulQuantiles, WhatIfAnswer},
    json::WhatIfBody,
};

use super::words::{grouped, hours};
use crate::{path::Place, query, refusal::Refusal, state::Shared, what_if};

/// The question as it was typed; what is empty is not assumed.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Typed {
    pub utilisation: String,
    pub load_factor: String,
    pub temperature_offset: String,
    pub by: String,
    pub within_fh: String,
}

/// The form with what was typed, and what is answered to it.
pub struct WhatIfForm {
    /// What was typed.
    pub typed: Typed,
    /// Whether anything was asked.
    pub is_asked: bool,
    /// Why there is no answer.
    pub refused: Option<String>,
    /// A figure, as it is, as assumed.
    pub rows: Vec<(String, String, String)>,
    /// How far past lives reach, where the question reaches further.
    pub extrapolation: Option<String>,
}

impl WhatIfForm {
    /// Answers what was asked of a place, if anything was.
    pub async fn of(shared: &Shared, operator: &OperatorId, place: &Place, typed: Typed) -> Result<Self, Refusal> {
        let is_asked = typed != Typed::default();
        let mut form = Self { typed, is_asked, refused: None, rows: Vec::new(), extrapolation: None };
        if !is_asked {
            return Ok(form);
        }
        match form.typed.ask(shared, operator, place).await {
            Ok(answer) => {
                form.rows = rows(&answer);
                form.extrapolation = answer.extrapolation_reason;
            }
            Err(Refusal::Internal) => return Err(Refusal::Internal),
            Err(refusal) => form.refused = Some(refusal.to_string()),
        }
        Ok(form)
    }
}

impl Typed {
    async fn ask(&self, shared: &Shared, operator: &OperatorId, place: &Place) -> Result<WhatIfAnswer, Refusal> {
        let assumption = self.body()?.checked((shared.state.clock)())?;
        what_if::what_if(shared, operator, (&place.tail, &place.position), &assumption).await
    }

    fn body(&self) -> Result<WhatIfBody, Refusal> {
        let number = |name: &str, text: &str| match (text, text.parse::<f64>()) {
            ("", _) => Ok(None),
            (_, Ok(number)) => Ok(Some(number)),
            _ => Err(Refusal::parameter(name, query::must_be(text, "a number"))),
        };
        Ok(WhatIfBody {
            utilisation_fh_per_day: number("utilisation", &self.utilisation)?,
            load_factor: number("load_factor", &self.load_factor)?,
            temperature_offset_c: number("temperature_offset", &self.temperature_offset)?,
            by: Some(self.by.clone()).filter(|by| !by.is_empty()),
            within_fh: number("within_fh", &self.within_fh)?,
        })
    }
}

fn rows(answer: &WhatIfAnswer) -> Vec<(String, String, String)> {
    let both =
        |what: &str, told: &dyn Fn(&RulAnswer) -> String| (what.to_owned(), told(&answer.now), told(&answer.assumed));
    let quantile = |which: fn(&RulQuantiles) -> Option<f64>| {
        move |body: &RulAnswer| hours(body.horizon_fh, body.rul_fh.as_ref().and_then(which))
    };
    let mut rows = vec![
        both("Remaining life, 10 % quantile", &quantile(|rul| rul.p10)),
        both("Remaining life, median", &quantile(|rul| rul.p50)),
        both("End of life, 10 %", &|body| date(body, |end| end.date_p10.as_ref())),
        both("End of life, median", &|body| date(body, |end| end.date_p50.as_ref())),
        both("Flight hours a day", &flown),
    ];
    if let Some(asked) = &answer.probability {
        let by = asked.by.as_ref().and_then(|by| by.parse::<Timestamp>().ok());
        let what = by.map_or_else(|| "Fails within these hours".to_owned(), |by| format!("Fails before {by}"));
        rows.push((what, probability(asked.now.as_ref()), probability(asked.assumed.as_ref())));
    }
    rows
}

fn date(body: &RulAnswer, which: fn(&proto::answer::EndOfLife) -> Option<&String>) -> String {
    match &body.end_of_life {
        None => "unknown".to_owned(),
        Some(end) => which(end).cloned().unwrap_or_else(|| "later".to_owned()),
    }
}

fn flown(body: &RulAnswer) -> String {
    let told = |end: &proto::answer::EndOfLife| {
        format!("{:.1}, {}", end.utilisation_fh_per_day, end.utilisation_source.as_str())
    };
    body.end_of_life.as_ref().map_or_else(|| "unknown".to_owned(), told)
}

fn probability(asked: Option<&FailureProbability>) -> String {
    let Some(asked) = asked else { return "unknown".to_owned() };
    let hours = grouped(asked.within_fh);
    match asked.p.zip(asked.standard_error) {
        Some((p, error)) => format!("{:.1} % \u{b1} {:.1}, in {hours} fh", 100.0 * p, 100.0 * error),
        None => format!("unknown beyond the horizon, in {hours} fh"),
    }
}
