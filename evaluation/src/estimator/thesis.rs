//! The estimator of the thesis, as it stands there, for comparison.
//!
//! - What: identifies x' = A x + B u from the last 200 h and carries it to the boundary; the draws
//!   repeat this with noise on the observations.
//! - Update rule: along the window, A and B by least squares of finite differences on observed states
//!   and inputs (eq. 2.27), zero while underdetermined; the state as gamma times the observation plus
//!   the rest of the model's prediction (eq. 2.31). From the last observation on Euler steps with A, B
//!   and the window's mean inputs (eq. 2.32) until the boundary calls a step faulty (eq. 2.33).
//! - Requirements: more steps in the window than faults and inputs, else nothing grows.
//! - Source: Berri 2021, section 2.4. The error of an observation sits in the state and, negative, in
//!   the difference that follows, which pulls the diagonal of A towards -1/dt: with real noise the
//!   identified model is stable and never fails.

use domain::{FaultModel, Propagation};
use numerics::{LeastSquares, Stream};
use prognosis::{Boundary, Estimator, Follower, Observation, PredictionSettings, RulEstimate};

use super::recent::Recent;

const NAME: &str = "thesis";
/// Weight of an observation in the filter.
const GAMMA: f64 = 0.05;
/// u = [1, load, temperature].
const INPUTS: usize = 3;
/// Inputs of a window that knows neither load nor temperature: those of the mean flight.
const MEAN_FLIGHT: [f64; INPUTS] = [1.0, 1.0, 0.0];
/// The search for the first faulty step looks every 2^6 steps before it halves.
const HALVINGS: usize = 6;

/// The thesis's own [`Estimator`].
pub struct Thesis<'a> {
    /// Names, nominal values and groups of the faults.
    pub model: &'a FaultModel,
    /// The boundary at which life ends.
    pub boundary: &'a dyn Boundary,
}

impl Estimator for Thesis<'_> {
    fn name(&self) -> &'static str {
        NAME
    }

    fn follow(&self) -> Box<dyn Follower + '_> {
        Box::new(Life { thesis: self, recent: Recent::default() })
    }
}

struct Life<'a> {
    thesis: &'a Thesis<'a>,
    recent: Recent,
}

impl Follower for Life<'_> {
    fn observe(&mut self, observation: &Observation) {
        self.recent.push(observation);
    }

    fn predict(&self, now_fh: f64, settings: &PredictionSettings, stream: &Stream) -> RulEstimate {
        let model = self.thesis.model;
        let window = Window::new(model, self.recent.before(now_fh));
        let mut spread = Spread::new(model.len());
        let end = |draw: usize| {
            let identified = window.identify(&window.with_noise(&mut stream.substream(draw as u64)));
            spread.add(&identified.coefficients);
            let end_fh = self.thesis.failure_fh(&window, &identified, now_fh, settings.horizon_fh)?;
            Some((end_fh - now_fh).max(0.0)).filter(|&end_fh| end_fh < settings.horizon_fh)
        };
        let ends_fh = (0..settings.draws).map(end).collect();
        let fitted = window.identify(&window.deviations);
        let propagation = propagation(&fitted.coefficients, &spread.sigma(), model.len(), self.recent.seen);
        RulEstimate { ends_fh, propagation: Some(propagation), doubted: false }
    }
}

/// The observations that a prediction rests on; rows are observations.
struct Window {
    faults: usize,
    t_fh: Vec<f64>,
    /// Deviations from nominal, row by row.
    deviations: Vec<f64>,
    sigma: Vec<f64>,
    inputs: Vec<[f64; INPUTS]>,
    mean_inputs: [f64; INPUTS],
}

/// What a window says of the present: state and model.
struct Identified {
    /// Filtered deviation at the last observation.
    state: Vec<f64>,
    /// [A B] transposed: one row per entry of x and of u, one column per fault; 1/h.
    coefficients: Vec<f64>,
}

impl Window {
    fn new<'a>(model: &FaultModel, observations: impl Iterator<Item = &'a Observation> + Clone) -> Self {
        let mean = |value: fn(&Observation) -> Option<f64>, otherwise: f64| {
            let (mut sum, mut known) = (0.0, 0.0);
            for value in observations.clone().filter_map(value) {
                sum += value;
                known += 1.0;
            }
            if known > 0.0 { sum / known } else { otherwise }
        };
        let mean_inputs = [MEAN_FLIGHT[0], mean(|o| o.load, MEAN_FLIGHT[1]), mean(|o| o.temperature, MEAN_FLIGHT[2])];
        let inputs = |o: &Observation| [1.0, o.load.unwrap_or(mean_inputs[1]), o.temperature.unwrap_or(mean_inputs[2])];
        Self {
            faults: model.len(),
            t_fh: observations.clone().map(|o| o.t_fh).collect(),
            deviations: observations.clone().flat_map(|o| model.deviation(&o.fault_vector)).collect(),
            sigma: observations.clone().flat_map(|o| o.sigma.iter().copied()).collect(),
            inputs: observations.clone().map(inputs).collect(),
            mean_inputs,
        }
    }

    /// The observations with noise of their own size on top.
    fn with_noise(&self, stream: &mut Stream) -> Vec<f64> {
        self.deviations.iter().zip(&self.sigma).map(|(x, sigma)| x + sigma * stream.normal()).collect()
    }

    /// Mean time between observations, the step of the extrapolation; `None` without two of different times.
    fn step_fh(&self) -> Option<f64> {
        let (first, last) = (self.t_fh.first()?, self.t_fh.last()?);
        Some((last - first) / (self.t_fh.len() - 1) as f64).filter(|step_fh| *step_fh > 0.0)
    }

    /// Equations 2.27 and 2.31 along the window.
    fn identify(&self, deviations: &[f64]) -> Identified {
        let faults = self.faults;
        let unknowns = faults + INPUTS;
        let observed: Vec<&[f64]> = deviations.chunks_exact(faults).collect();
        let mut system = LeastSquares::new(unknowns, faults);
        let mut coefficients = vec![0.0; unknowns * faults];
        let mut state = observed.first().map_or_else(|| vec![0.0; faults], |first| first.to_vec());
        let mut growth = vec![0.0; faults];
        let mut equation = Vec::with_capacity(unknowns + faults);
        for next in 1..observed.len() {
            let (here, dt_h) = (next - 1, self.t_fh[next] - self.t_fh[next - 1]);
            if dt_h > 0.0 {
                derivative(&coefficients, &state, &self.inputs[here], &mut growth);
                state.iter_mut().zip(&growth).for_each(|(x, growth)| *x += growth * dt_h);
                equation.clear();
                equation.extend(observed[here].iter().chain(&self.inputs[here]));
                equation.extend(observed[next].iter().zip(observed[here]).map(|(next, here)| (next - here) / dt_h));
                system.add(&mut equation);
                if system.equations() > unknowns {
                    system.solve(&mut coefficients);
                }
            }
            state.iter_mut().zip(observed[next]).for_each(|(x, observed)| *x = GAMMA * observed + (1.0 - GAMMA) * *x);
        }
        Identified { state, coefficients }
    }
}

/// A x + B u (eq. 2.26).
fn derivative(coefficients: &[f64], state: &[f64], inputs: &[f64; INPUTS], growth: &mut [f64]) {
    growth.fill(0.0);
    for (value, row) in state.iter().chain(inputs).zip(coefficients.chunks_exact(growth.len())) {
        growth.iter_mut().zip(row).for_each(|(growth, coefficient)| *growth += value * coefficient);
    }
}

impl Thesis<'_> {
    /// The time at which the extrapolated state is first faulty, hours since the start of the life; `None` when it
    /// is not within the horizon.
    fn failure_fh(&self, window: &Window, identified: &Identified, now_fh: f64, horizon_fh: f64) -> Option<f64> {
        let last_fh = *window.t_fh.last()?;
        if !self.healthy(&identified.state) {
            return Some(last_fh);
        }
        let step_fh = window.step_fh()?;
        let steps = ((now_fh - last_fh + horizon_fh) / step_fh) as u64 + 1;
        let step = Affine::euler(&identified.coefficients, &window.mean_inputs, window.faults, step_fh);
        Some(last_fh + self.first_faulty_step(identified.state.clone(), step, steps)? as f64 * step_fh)
    }

    /// The first faulty one of so many steps. Between two looks a path that is healthy at both counts
    /// as healthy.
    fn first_faulty_step(&self, mut state: Vec<f64>, step: Affine, steps: u64) -> Option<u64> {
        let mut ladder = vec![step];
        for rung in 0..HALVINGS {
            ladder.push(ladder[rung].twice());
        }
        let mut done = 0;
        while done < steps {
            let next = ladder[HALVINGS].apply(&state);
            if next == state {
                return None;
            }
            if self.healthy(&next) {
                (state, done) = (next, done + (1 << HALVINGS));
                continue;
            }
            for rung in (0..HALVINGS).rev() {
                let next = ladder[rung].apply(&state);
                if self.healthy(&next) {
                    (state, done) = (next, done + (1 << rung));
                }
            }
            return Some(done + 1);
        }
        None
    }

    /// Faults are shares: beyond [0, 1] the assessment sees the bound. A state beyond all numbers has failed.
    fn healthy(&self, deviation: &[f64]) -> bool {
        let faults: Vec<f64> =
            deviation.iter().zip(&self.model.nominal).map(|(x, nominal)| (x + nominal).clamp(0.0, 1.0)).collect();
        deviation.iter().all(|x| x.is_finite()) && self.boundary.margin(&faults) > 0.0
    }
}

/// x <- M x + c.
struct Affine {
    /// M, row by row.
    matrix: Vec<f64>,
    offset: Vec<f64>,
}

impl Affine {
    /// One Euler step: M = I + A dt, c = B u dt (eq. 2.32).
    fn euler(coefficients: &[f64], inputs: &[f64; INPUTS], faults: usize, dt_h: f64) -> Self {
        let entry = |row: usize, column: usize| {
            let unit = if row == column { 1.0 } else { 0.0 };
            unit + coefficients[column * faults + row] * dt_h
        };
        let offset = |row: usize| {
            let terms = inputs.iter().enumerate();
            terms.map(|(input, u)| coefficients[(faults + input) * faults + row] * u * dt_h).sum()
        };
        Self {
            matrix: (0..faults * faults).map(|i| entry(i / faults, i % faults)).collect(),
            offset: (0..faults).map(offset).collect(),
        }
    }

    fn apply(&self, x: &[f64]) -> Vec<f64> {
        let rows = self.matrix.chunks_exact(x.len()).zip(&self.offset);
        rows.map(|(row, offset)| row.iter().zip(x).map(|(m, x)| m * x).sum::<f64>() + offset).collect()
    }

    /// The map applied to itself.
    fn twice(&self) -> Self {
        let faults = self.offset.len();
        let entry = |row: usize, column: usize| -> f64 {
            (0..faults).map(|k| self.matrix[row * faults + k] * self.matrix[k * faults + column]).sum()
        };
        Self {
            matrix: (0..faults * faults).map(|i| entry(i / faults, i % faults)).collect(),
            offset: self.apply(&self.offset),
        }
    }
}

/// Standard deviation of every coefficient over the draws.
struct Spread {
    draws: f64,
    sums: Vec<f64>,
    squares: Vec<f64>,
}

impl Spread {
    fn new(faults: usize) -> Self {
        let coefficients = (faults + INPUTS) * faults;
        Self { draws: 0.0, sums: vec![0.0; coefficients], squares: vec![0.0; coefficients] }
    }

    fn add(&mut self, coefficients: &[f64]) {
        self.draws += 1.0;
        for ((sum, square), value) in self.sums.iter_mut().zip(&mut self.squares).zip(coefficients) {
            *sum += value;
            *square += value * value;
        }
    }

    fn sigma(&self) -> Vec<f64> {
        let draws = self.draws.max(1.0);
        let sigma = |(sum, square): (&f64, &f64)| (square / draws - (sum / draws) * (sum / draws)).max(0.0).sqrt();
        self.sums.iter().zip(&self.squares).map(sigma).collect()
    }
}

fn propagation(coefficients: &[f64], sigma: &[f64], faults: usize, observations: usize) -> Propagation {
    let part = |values: &[f64], from: usize, columns: usize| -> Vec<Vec<f64>> {
        let row = |row: usize| (0..columns).map(|column| values[(from + column) * faults + row]).collect();
        (0..faults).map(row).collect()
    };
    Propagation {
        state_matrix: part(coefficients, 0, faults),
        state_matrix_sigma: part(sigma, 0, faults),
        control_matrix: part(coefficients, faults, INPUTS),
        control_matrix_sigma: part(sigma, faults, INPUTS),
        estimator: NAME.to_owned(),
        observations,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Faulty from a sum of deviations of 0.3 on.
    struct Sum;

    impl Boundary for Sum {
        fn margin(&self, k: &[f64]) -> f64 {
            0.3 - (k.iter().sum::<f64>() - 1.0)
        }
    }

    #[test]
    fn the_search_finds_the_step_that_one_by_one_finds() {
        let model = FaultModel::electrical();
        let thesis = Thesis { model: &model, boundary: &Sum };
        let mut random = Stream::new(1, &["search"]);
        let mut found = 0;
        for _ in 0..200 {
            let mut coefficients: Vec<f64> = (0..40).map(|_| 1e-5 * random.uniform()).collect();
            (0..5).for_each(|i| coefficients[6 * i] += 2e-3 * random.uniform());
            let step = || Affine::euler(&coefficients, &[1.0, 1.0, 0.3], 5, 2.0);
            let start: Vec<f64> = (0..5).map(|_| 0.01 * random.uniform()).collect();
            let mut x = start.clone();
            let one_by_one = (1..=600).find(|_| {
                x = step().apply(&x);
                !thesis.healthy(&x)
            });
            let searched = thesis.first_faulty_step(start, step(), 600).filter(|&step| step <= 600);
            assert_eq!(searched, one_by_one);
            found += usize::from(searched.is_some());
        }
        assert!((20..180).contains(&found), "{found}");
    }

    #[test]
    fn a_path_at_rest_and_one_that_leaves_all_numbers_end_the_search() {
        let model = FaultModel::electrical();
        let thesis = Thesis { model: &model, boundary: &Sum };
        let step = |rate: f64| {
            let mut coefficients = vec![0.0; 40];
            coefficients[0] = rate;
            Affine::euler(&coefficients, &[1.0, 1.0, 0.0], 5, 2.0)
        };
        assert_eq!(thesis.first_faulty_step(vec![0.05; 5], step(-0.5), u64::MAX), None);
        let start = vec![1e-300, 0.0, 0.0, 0.0, 0.0];
        assert!(thesis.first_faulty_step(start, step(1e200), 10).is_some_and(|step| step <= 3));
    }
}
