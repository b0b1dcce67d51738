//! The course of a life: charts of its remaining life and its faults over flight hours.

use domain::{Component, FaultModel, FaultTrend, State as Block, rul::QUANTILE_LEVELS};
use store::{HistoryOf, LifeRecord};

use super::chart::{Chart, Sample};
use crate::{answer, refusal::Refusal, state::State};

/// Blocks on a chart: 20,000 flight hours.
const MAX_BLOCKS: u32 = 1000;

/// Charts of a life.
pub struct Course {
    /// Remaining life; `None` with too few blocks.
    pub rul: Option<Chart>,
    /// Its faults.
    pub faults: Vec<Chart>,
}

impl Course {
    /// Reads the course of a life: its newest blocks, as many as fit a chart.
    pub async fn read(state: &State, component: &Component, life: &LifeRecord) -> Result<Self, Refusal> {
        let newest_fh = life.last.as_ref().map_or(0.0, |last| last.flight_hours);
        let from_fh = (newest_fh - f64::from(MAX_BLOCKS) * domain::block::BLOCK_FH).max(0.0);
        let of = HistoryOf::from(Some(life.overhaul_index));
        let blocks = state.store.states(component, of, Some(from_fh), None, None, MAX_BLOCKS).await?;
        let models = answer::fault_models(state).await?;
        let faults = models.iter().find(|(hash, _)| *hash == life.generation.model).map(|(_, faults)| faults);
        Ok(Self { rul: rul_chart(&blocks), faults: fault_charts(&blocks, faults) })
    }
}

/// The quantiles of remaining life as they were known at the end of each block; a censored one lies
/// at the horizon.
fn rul_chart(blocks: &[Block]) -> Option<Chart> {
    let horizon = blocks.iter().map(|block| block.horizon_fh).fold(0.0, f64::max);
    let at = |level: usize| move |block: &Block| block.rul_quantiles_fh[level].unwrap_or(block.horizon_fh);
    let sample = |low: usize, high: usize| -> Vec<Sample> {
        let of = |block: &Block| Sample { x: block.as_of.flight_hours, low: at(low)(block), high: at(high)(block) };
        blocks.iter().map(of).collect()
    };
    let censored = blocks.iter().any(|block| block.rul_quantiles_fh.iter().any(Option::is_none));
    let chart = Chart::new("Remaining useful life, flight hours")
        .band(
            "wide",
            &format!("{:.0} to {:.0} %", 100.0 * QUANTILE_LEVELS[0], 100.0 * QUANTILE_LEVELS[6]),
            sample(0, 6),
        )
        .band("narrow", "25 to 75 %", sample(2, 4))
        .line("median", "median", sample(3, 3));
    let chart = if censored { chart.rule(horizon, "horizon: beyond is unknown") } else { chart };
    chart.with_zero().size(940.0, 300.0).draw()
}

/// One chart per fault: the filtered value within two standard deviations.
fn fault_charts(blocks: &[Block], faults: Option<&FaultModel>) -> Vec<Chart> {
    let count = blocks.last().map_or(0, |block| block.faults.len());
    let chart = |i: usize| {
        let spread = |sigmas: f64| -> Vec<Sample> {
            let of = |block: &Block, fault: &FaultTrend| Sample {
                x: block.as_of.flight_hours,
                low: fault.value - sigmas * fault.sigma,
                high: fault.value + sigmas * fault.sigma,
            };
            blocks.iter().filter_map(|block| Some(of(block, block.faults.get(i)?))).collect()
        };
        let chart = Chart::new(&format!("Fault {}", blocks.last()?.faults[i].name))
            .band("wide", "two standard deviations", spread(2.0))
            .line("median", "filtered value", spread(0.0));
        let nominal = faults.and_then(|faults| faults.nominal.get(i).copied());
        let chart = match nominal {
            Some(nominal) => chart.rule(nominal, "nominal"),
            None => chart,
        };
        chart.size(370.0, 220.0).draw()
    };
    (0..count).filter_map(chart).collect()
}
