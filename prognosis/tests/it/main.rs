//! What the prognosis promises, on simulated and on recorded lives.

mod checkpoint;
mod consistency;
mod forecast;
mod growth;
mod growth_changes;
mod hierarchy;
#[allow(dead_code, reason = "the tests of `evaluation` read more of a life")]
mod histories;
mod labelled;
mod mixture;
mod noise;
mod pace;
mod simulated;
mod surrogate;
