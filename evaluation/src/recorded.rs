//! Recorded lives, as estimators are judged on them.

use prognosis::Told;

use crate::{Law, backtest::Run};

/// The regime of a life whose growth never changes.
pub const CONSTANT_GROWTH: &str = "constant";

/// One run with the regime that it belongs to.
#[derive(Debug)]
pub struct Recorded {
    /// The run; the noise of its observations is not known yet.
    pub run: Run,
    /// What the file calls its regime.
    pub regime: Option<String>,
    /// Whether it is known to go on, so that what follows its newest observation is asked, too.
    pub goes_on: bool,
    /// What is true of its growth, for the oracle, where that is known.
    pub law: Option<Law>,
    /// What is told of its missions, hours since its start, in ascending order.
    pub plan: Vec<Told>,
}

impl Recorded {
    /// Whether growth may change after what is known of it.
    pub fn growth_may_change(&self) -> bool {
        self.regime.as_deref() != Some(CONSTANT_GROWTH)
    }
}
