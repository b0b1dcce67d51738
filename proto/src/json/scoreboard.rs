//! How good served forecasts were: the noun itself travels.

use domain::Scoreboard;
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

/// Prognostic metrics of issued prognoses on finished lives of one operator.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct ScoreboardBody {
    /// Whose lives: operators never mix.
    #[schema(example = "default")]
    pub operator: String,
    /// Finished lives that are judged: those that were found failed last, at most 500.
    #[schema(example = 12)]
    pub lives: usize,
    /// Prognoses that are judged: of each life the first in every stretch of `every_fh` before its failure.
    #[schema(example = 240)]
    pub predictions: usize,
    /// Length of such a stretch, flight hours.
    #[schema(example = 200.0)]
    pub every_fh: f64,
    /// The metrics; null until a life has finished.
    #[schema(required, value_type = Option<ScoreboardSchema>)]
    pub scoreboard: Option<Scoreboard>,
    /// What the numbers may be used for.
    pub advisory: String,
}

/// How good forecasts were, pooled over lives. Means of nothing are null.
#[derive(ToSchema)]
#[schema(as = Scoreboard)]
#[allow(dead_code, reason = "documentation only: the noun itself is written")]
pub struct ScoreboardSchema {
    /// Lives.
    #[schema(example = 12)]
    runs: usize,
    /// Predictions before their failure.
    #[schema(example = 240)]
    predictions: usize,
    /// Mean continuous ranked probability score, flight hours.
    #[schema(required, example = 161.0)]
    crps_fh: Option<f64>,
    /// Of all predictions.
    coverage: CoverageSchema,
    /// Of those within the last 1,000 h.
    coverage_below_1000_fh: CoverageSchema,
    /// Share of the predictions in each tenth of the probability integral transform; even when calibrated.
    #[schema(required)]
    pit: Option<Vec<f64>>,
    /// Share of the predictions whose median is beyond the horizon: that say nothing but "not soon".
    #[schema(required, example = 0.02)]
    undecided: Option<f64>,
    /// Scores against the true remaining life.
    by_rul: Vec<RulBinSchema>,
    /// Errors of the median at given true remaining lives.
    at_rul: Vec<AtRulSchema>,
    /// Lives that meet the criterion at given shares of their length.
    alpha_lambda: Vec<AlphaLambdaSchema>,
    /// How early the criterion is met.
    prognostic_horizon: HorizonsSchema,
    /// How early the median is near the truth.
    life_horizon: LifeHorizonsSchema,
    /// Mean over lives.
    #[schema(required, example = 0.82)]
    cumulative_relative_accuracy: Option<f64>,
    /// Mean over lives of that of the absolute time of failure, which flatters.
    #[schema(required, example = 0.95)]
    cumulative_event_accuracy: Option<f64>,
}

/// Share of the central intervals that hold the truth.
#[derive(ToSchema)]
#[schema(as = Coverage)]
#[allow(dead_code, reason = "documentation only")]
pub struct CoverageSchema {
    /// Of the 80 % intervals.
    #[schema(required, example = 0.79)]
    level_80: Option<f64>,
    /// Of the 95 % intervals.
    #[schema(required, example = 0.94)]
    level_95: Option<f64>,
}

/// Predictions of like true remaining life.
#[derive(ToSchema)]
#[schema(as = RulBin)]
#[allow(dead_code, reason = "documentation only")]
pub struct RulBinSchema {
    /// Least true remaining life, flight hours.
    #[schema(example = 500.0)]
    from_fh: f64,
    /// True remaining lives are below; null in the last bin.
    #[schema(required, example = 1000.0)]
    to_fh: Option<f64>,
    /// Lives with a prediction here.
    runs: usize,
    /// Predictions.
    predictions: usize,
    /// Mean continuous ranked probability score, flight hours.
    #[schema(required)]
    crps_fh: Option<f64>,
    /// Of these predictions.
    coverage: CoverageSchema,
}

/// Lives at one true remaining life.
#[derive(ToSchema)]
#[schema(as = AtRul)]
#[allow(dead_code, reason = "documentation only")]
pub struct AtRulSchema {
    /// The true remaining life, flight hours.
    #[schema(example = 1500.0)]
    rul_fh: f64,
    /// Lives that were long enough.
    runs: usize,
    /// Median over lives of the relative error of the predicted median; null when that is censored.
    #[schema(required, example = 0.04)]
    relative_error: Option<f64>,
}

/// The alpha-lambda metric at one share of life; a life without a later prediction does not meet it.
#[derive(ToSchema)]
#[schema(as = AlphaLambda)]
#[allow(dead_code, reason = "documentation only")]
pub struct AlphaLambdaSchema {
    /// Half width of the band, relative to the true remaining life.
    #[schema(example = 0.25)]
    alpha: f64,
    /// Least share of the draws inside.
    #[schema(example = 0.5)]
    beta: f64,
    /// Share of the life that has passed.
    #[schema(example = 0.7)]
    lambda: f64,
    /// Share of the lives that meet it.
    #[schema(required, example = 0.8)]
    met: Option<f64>,
}

/// How early the criterion is met, over lives.
#[derive(ToSchema)]
#[schema(as = Horizons)]
#[allow(dead_code, reason = "documentation only")]
pub struct HorizonsSchema {
    /// Half width of the band, relative to the true remaining life.
    #[schema(example = 0.25)]
    alpha: f64,
    /// Least share of the draws inside.
    #[schema(example = 0.5)]
    beta: f64,
    /// Share of the lives that ever meet it.
    #[schema(required)]
    met: Option<f64>,
    /// Median over all lives of the remaining life when it is first met, flight hours; zero for one that
    /// never does.
    #[schema(required)]
    median_fh: Option<f64>,
    /// The same of the remaining life from which on it is met until failure.
    #[schema(required)]
    sustained_median_fh: Option<f64>,
}

/// How early the median comes and stays within a share of the whole life of the truth, over lives.
#[derive(ToSchema)]
#[schema(as = LifeHorizons)]
#[allow(dead_code, reason = "documentation only")]
pub struct LifeHorizonsSchema {
    /// Half width of the band, relative to the life.
    #[schema(example = 0.1)]
    share_of_life: f64,
    /// When it first comes, flight hours before failure.
    #[schema(required)]
    median_fh: Option<f64>,
    /// From when on it stays.
    #[schema(required)]
    sustained_median_fh: Option<f64>,
}

#[cfg(test)]
mod tests {
    use domain::scoreboard::{AlphaLambda, AtRul, Coverage, Horizons, LifeHorizons, RulBin};
    use serde_json::Value;

    use super::*;

    fn scoreboard() -> Scoreboard {
        let coverage = Coverage { level_80: Some(0.8), level_95: None };
        Scoreboard {
            runs: 1,
            predictions: 1,
            crps_fh: Some(100.0),
            coverage,
            coverage_below_1000_fh: coverage,
            pit: None,
            undecided: None,
            by_rul: vec![RulBin { from_fh: 0.0, to_fh: None, runs: 1, predictions: 1, crps_fh: None, coverage }],
            at_rul: vec![AtRul { rul_fh: 500.0, runs: 1, relative_error: None }],
            alpha_lambda: vec![AlphaLambda { alpha: 0.25, beta: 0.5, lambda: 0.5, met: None }],
            prognostic_horizon: Horizons {
                alpha: 0.25,
                beta: 0.5,
                met: None,
                median_fh: None,
                sustained_median_fh: None,
            },
            life_horizon: LifeHorizons { share_of_life: 0.1, median_fh: None, sustained_median_fh: None },
            cumulative_relative_accuracy: None,
            cumulative_event_accuracy: None,
        }
    }

    /// Whether the documented schema `T` names the fields of the noun at `pointer`, and no others.
    fn documents<T: utoipa::PartialSchema>(noun: &Value, pointer: &str) {
        let schema = serde_json::to_value(T::schema()).unwrap();
        let names = |value: &Value| -> Vec<String> {
            let mut names: Vec<String> = value.as_object().unwrap().keys().cloned().collect();
            names.sort_unstable();
            names
        };
        assert_eq!(names(&schema["properties"]), names(noun.pointer(pointer).unwrap()), "{pointer}");
    }

    #[test]
    fn the_document_names_the_fields_of_the_nouns() {
        let noun = serde_json::to_value(scoreboard()).unwrap();
        documents::<ScoreboardSchema>(&noun, "");
        documents::<CoverageSchema>(&noun, "/coverage");
        documents::<RulBinSchema>(&noun, "/by_rul/0");
        documents::<AtRulSchema>(&noun, "/at_rul/0");
        documents::<AlphaLambdaSchema>(&noun, "/alpha_lambda/0");
        documents::<HorizonsSchema>(&noun, "/prognostic_horizon");
        documents::<LifeHorizonsSchema>(&noun, "/life_horizon");
    }
}
