//! How often the mechanics of a simulated fleet act, as the command line says it.

use clap::Args;
use simulator::Upkeep;

/// Overhauls and swaps.
#[derive(Debug, Clone, Copy, Args)]
pub struct UpkeepArguments {
    /// Planned overhauls per 1000 flight hours of an actuator that has flown for 500; half of those that fail are
    /// overhauled, too. With 0 none is.
    #[arg(long, value_name = "RATE", default_value_t = 0.2, allow_negative_numbers = true)]
    overhauls: f64,
    /// Swaps with the same position of another aircraft per 1000 flight hours of an actuator.
    #[arg(long, value_name = "RATE", default_value_t = 0.2, allow_negative_numbers = true)]
    swaps: f64,
}

impl From<UpkeepArguments> for Upkeep {
    fn from(UpkeepArguments { overhauls, swaps }: UpkeepArguments) -> Self {
        Self { overhauls, swaps }
    }
}
