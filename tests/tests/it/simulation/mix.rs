//! What goes wrong in a run, and how often.

use super::dice::Dice;

/// A mix of traffic and faults. Each seed draws its own: many are left out entirely, so that the others meet in
/// combinations that an even mix would hardly ever show.
#[derive(Debug, Clone)]
pub struct Mix {
    /// Operators beside each other.
    pub operators: usize,
    /// Workers.
    pub workers: usize,
    /// Uploads of one operator, about.
    pub flights: usize,
    /// Messages that an operator's clients have under way at most.
    pub window: usize,
    /// How much later than its neighbours an input is sent, in inputs.
    pub lateness: f64,
    /// A request is lost.
    pub lost_requests: f64,
    /// An answer is lost, and the client asks again.
    pub lost_answers: f64,
    /// A request arrives twice.
    pub duplicates: f64,
    /// A client hangs up while its request is answered.
    pub hang_ups: f64,
    /// Weight of a worker's step against that of a delivery.
    pub diligence: f64,
    /// A worker dies before a step.
    pub killed_workers: f64,
    /// A worker stops for longer than its lease before a step.
    pub sleeping_workers: f64,
    /// The service is stopped, or killed, and comes back on the same database.
    pub restarts: f64,
    /// Days pass at once.
    pub leaps: f64,
    /// Traffic rests until workers have nothing to do: then nothing may be left undone.
    pub rests: f64,
    /// Another model is activated.
    pub activations: f64,
    /// An activation is for all lives, and not only for those that begin from then on.
    pub all_lives: f64,
    /// A credential is replaced by another one.
    pub rotations: f64,
    /// What happens to the units of an operator.
    pub story: Story,
}

/// How often something happens between two flights of a unit.
#[derive(Debug, Clone)]
pub struct Story {
    /// Two units change places, or a spare comes in.
    pub swaps: f64,
    /// A change of places is reported by its events, and not only seen in uploads.
    pub reported: f64,
    /// A unit is overhauled.
    pub overhauls: f64,
    /// A unit is found failed, or serviceable.
    pub findings: f64,
    /// An upload says something that cannot be, or little.
    pub odd_uploads: f64,
    /// A name is used twice for different content.
    pub conflicts: f64,
    /// An input is taken back.
    pub voids: f64,
    /// An upload is tried again.
    pub retries: f64,
    /// A sensor configuration is put in force, often from a past time on.
    pub configurations: f64,
}

impl Mix {
    /// The mix of a seed.
    pub fn draw(seed: u64) -> Self {
        let mut dice = Dice::new(seed, &["mix"]);
        let mut share = |most: f64| if dice.chance(0.35) { 0.0 } else { dice.number(0.0..most) };
        let story = Story {
            swaps: share(0.15),
            reported: share(1.0),
            overhauls: share(0.12),
            findings: share(0.1),
            odd_uploads: share(0.15),
            conflicts: share(0.1),
            voids: share(0.15),
            retries: share(0.1),
            configurations: share(0.15),
        };
        Self {
            lateness: share(20.0),
            lost_requests: share(0.3),
            lost_answers: share(0.3),
            duplicates: share(0.4),
            hang_ups: share(0.1),
            diligence: 0.1 + share(0.6),
            killed_workers: share(0.2),
            sleeping_workers: share(0.2),
            restarts: share(0.03),
            leaps: share(0.03),
            rests: share(0.08),
            activations: share(0.02),
            all_lives: share(1.0),
            rotations: share(0.05),
            operators: dice.whole(1..4),
            workers: dice.whole(1..5),
            flights: dice.whole(10..60),
            window: dice.whole(1..9),
            story,
        }
    }

    /// The same, with nothing that goes wrong: whatever was begun comes to its end.
    pub fn healed(&self) -> Self {
        Self {
            lost_requests: 0.0,
            lost_answers: 0.0,
            hang_ups: 0.0,
            killed_workers: 0.0,
            sleeping_workers: 0.0,
            restarts: 0.0,
            ..self.clone()
        }
    }
}
