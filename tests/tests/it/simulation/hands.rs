//! A worker that takes one step at a time: lease, analyse, complete.

use std::time::Duration;

use store::{Completion, Lease};
use worker::{Analysis, Analyst};

use crate::in_process::{clock::Clock, service::Service};

/// How long a component is claimed at first.
pub const LEASE: Duration = Duration::from_secs(60);

/// One worker and what it holds.
pub struct Hands {
    analyst: Analyst,
    held: Held,
}

/// Where a worker stands.
enum Held {
    Nothing,
    Leased(Lease),
    Analysed(Lease, Analysis),
}

/// What a step did.
pub enum Stepped {
    /// There was nothing to lease.
    Idle,
    /// It has claimed a component.
    Leased(Lease),
    /// It knows the results.
    Analysed,
    /// It has tried to write them.
    Completed(Lease, Completion),
}

impl Hands {
    /// A worker that has just started.
    pub fn new(service: &Service, clock: &Clock) -> Self {
        Self { analyst: Analyst::new(service.store().clone(), clock.asked()), held: Held::Nothing }
    }

    /// What it holds, if anything.
    pub fn lease(&self) -> Option<&Lease> {
        match &self.held {
            Held::Nothing => None,
            Held::Leased(lease) | Held::Analysed(lease, _) => Some(lease),
        }
    }

    /// Takes its next step.
    pub async fn step(&mut self, service: &Service) -> Stepped {
        match std::mem::replace(&mut self.held, Held::Nothing) {
            Held::Nothing => match service.store().lease(LEASE).await.expect("the queue answers") {
                None => Stepped::Idle,
                Some(lease) => {
                    self.held = Held::Leased(lease.clone());
                    Stepped::Leased(lease)
                }
            },
            Held::Leased(lease) => {
                let analysis = self.analyst.analyse(&lease).await;
                let analysis = analysis.unwrap_or_else(|error| panic!("{:?}: {error}", lease.component));
                self.held = Held::Analysed(lease, analysis);
                Stepped::Analysed
            }
            Held::Analysed(lease, analysis) => {
                let completion = self.analyst.complete(&lease, analysis).await.expect("results can be written");
                Stepped::Completed(lease, completion)
            }
        }
    }
}
