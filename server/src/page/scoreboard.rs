//! The scoreboard for people: the quality of the served forecasts, in words.

use askama::Template;
use axum::{extract::State as Extract, response::Response};
use domain::{
    Scoreboard,
    scoreboard::{AtRul, Coverage, RulBin},
};
use proto::json::ScoreboardBody;

use super::{
    html,
    words::{grouped, percent},
};
use crate::{auth::Caller, refusal::Refusal, scoreboard, state::Shared};

/// With fewer lives the figures say little yet.
const FEW_LIVES: usize = 30;

#[derive(Template)]
#[template(path = "scoreboard.html")]
struct ScoreboardPage {
    lives: usize,
    predictions: usize,
    every: String,
    few: bool,
    verdict: Option<Verdict>,
    advisory: &'static str,
}

/// The statement of the metrics.
struct Verdict {
    /// The promises, and what was held of them.
    sentences: Vec<String>,
    /// By remaining life: range, lives, forecasts, mean error, share of the 80 % intervals that held.
    rows: Vec<[String; 5]>,
}

/// `GET /scoreboard`
pub async fn get(Extract(shared): Extract<Shared>, caller: Caller) -> Result<Response, Refusal> {
    let board = scoreboard::read(&shared.state, caller.operator()).await?;
    let ScoreboardBody { lives, predictions, every_fh, scoreboard, .. } = board;
    html(&ScoreboardPage {
        lives,
        predictions,
        every: grouped(every_fh),
        few: lives < FEW_LIVES,
        verdict: scoreboard.as_ref().map(Verdict::of),
        advisory: domain::ADVISORY,
    })
}

impl Verdict {
    fn of(board: &Scoreboard) -> Self {
        let mut sentences = held("", &board.coverage);
        sentences.extend(held("Within the last 1\u{202f}000 flight hours: ", &board.coverage_below_1000_fh));
        sentences.extend(board.at_rul.iter().filter(|at| at.runs > 0).map(median_error));
        sentences.extend(board.undecided.filter(|share| *share > 0.0).map(|share| {
            let share = percent(share);
            format!("{share} of the forecasts said \u{201c}not soon\u{201d} only: their median was beyond the horizon.")
        }));
        sentences.extend(board.crps_fh.map(|crps_fh| {
            let hours = grouped(crps_fh);
            format!(
                "The mean error of the whole forecast (continuous ranked probability score) is {hours} flight hours."
            )
        }));
        Self { sentences, rows: board.by_rul.iter().filter(|bin| bin.predictions > 0).map(row).collect() }
    }
}

/// The share that intervals held of what they promised.
fn held(when: &str, coverage: &Coverage) -> Vec<String> {
    let levels = [(80, coverage.level_80), (95, coverage.level_95)];
    let told = |(promised, held): (u32, Option<f64>)| {
        Some(format!("{when}intervals that promise {promised} % held the truth in {}.", percent(held?)))
    };
    let capital = |sentence: String| match sentence.strip_prefix("intervals") {
        Some(rest) => format!("Intervals{rest}"),
        None => sentence,
    };
    levels.into_iter().filter_map(told).map(capital).collect()
}

fn median_error(at: &AtRul) -> String {
    let (hours, runs) = (grouped(at.rul_fh), at.runs);
    let lives = if runs == 1 { "1 life".to_owned() } else { format!("{runs} lives") };
    match at.relative_error {
        None => format!("About {hours} flight hours before the failure, the median was beyond the horizon ({lives})."),
        Some(error) => {
            let side = if error < 0.0 { "too short" } else { "too long" };
            let size = percent(error.abs());
            format!("About {hours} flight hours before the failure, the median was typically {size} {side} ({lives}).")
        }
    }
}

fn row(bin: &RulBin) -> [String; 5] {
    let range = match bin.to_fh {
        Some(to_fh) => format!("{} to {} fh", grouped(bin.from_fh), grouped(to_fh)),
        None => format!("from {} fh", grouped(bin.from_fh)),
    };
    let unknown = || "unknown".to_owned();
    [
        range,
        bin.runs.to_string(),
        bin.predictions.to_string(),
        bin.crps_fh.map_or_else(unknown, |crps_fh| format!("{} fh", grouped(crps_fh))),
        bin.coverage.level_80.map_or_else(unknown, percent),
    ]
}
