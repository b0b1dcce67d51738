//! The back-EMF map: what the motor reveals of its windings and its air gap.
//!
//! What: an estimate of the back-EMF coefficient per electrical degree, from terminal voltage, current
//! and speed. Update rule: for each *pass* of the rotor through a bin, mean voltage V = V_p - V_n of the
//! active pair, mean current i = (i_p - i_n)/2, mean speed w; the pass counts if |w| exceeds the gate;
//! y = (V - R i - L di/dt)/w with *nominal* R and L, r = R i/(k_nom w); a bin's value is the unweighted
//! mean over its passes. Two guard bins on each side of a commutation take the value of the nearest kept
//! bin; kept bins are averaged over a window of two bins each side that never leaves the sector.
//! Source: Berri 2021, eq. 6.2; the load ratio is an addition.

use crate::{
    commutation::{BINS, FIRST_COMMUTATION_BIN, SECTOR_BINS},
    motor::Motor,
    observer::{Observer, Sample},
};

/// Slower passes are discarded, rad/s.
pub const GATE_RAD_S: f64 = 100.0;
/// Bins on each side of a commutation whose own value is not used.
pub const GUARD_BINS: usize = 2;
/// Bins on each side that a value is averaged over.
pub const WINDOW_BINS: usize = 2;

/// A back-EMF map and the load under which it was taken, one entry per bin.
#[derive(Debug, Clone, PartialEq)]
pub struct BackEmfMap {
    /// Back-EMF coefficient in units of k_nom; `None` where no pass gave a value.
    pub y: Vec<Option<f64>>,
    /// Load ratio r = R i/(k_nom w), dimensionless; `None` where `y` is.
    pub r: Vec<Option<f64>>,
    /// R sum(w i)/(k_nom sum w^2) over all gated passes; `None` if there was none.
    pub mean_r: Option<f64>,
    /// Gated passes of the bin that the value is centred on.
    pub passes: Vec<u32>,
}

/// Bins that a simulation waits for, as an aircraft that fills a mask.
#[derive(Debug, Clone, Copy)]
pub struct Awaited<'a> {
    /// The bins, each below [`BINS`]; a guard bin stands for the kept bin whose value it takes.
    pub bins: &'a [usize],
    /// Gated passes that each of them needs.
    pub passes: u32,
    /// Time from which passes count, s: the motion has settled.
    pub from_s: f64,
}

/// Gathers passes; feed it by either model or by measurements.
#[derive(Debug, Clone)]
pub struct MapAccumulator {
    nominal: Nominal,
    pass: Option<Pass>,
    bins: Vec<BinSums>,
    sum_speed_current: f64,
    sum_speed_squared: f64,
    awaited: Vec<bool>,
    awaited_passes: u32,
    /// Awaited bins that lack passes; `None` when there is nothing to wait for.
    lacking: Option<usize>,
    /// Time until passes count, s.
    unsettled_s: f64,
}

#[derive(Debug, Clone, Copy)]
struct Nominal {
    resistance: f64,
    inductance: f64,
    back_emf: f64,
}

#[derive(Debug, Clone, Copy)]
struct Pass {
    bin: usize,
    steps: u32,
    voltage: f64,
    current: f64,
    speed: f64,
    first_current: f64,
    last_current: f64,
    step_s: f64,
}

#[derive(Debug, Clone, Copy, Default)]
struct BinSums {
    back_emf: f64,
    current_per_speed: f64,
    passes: u32,
}

impl MapAccumulator {
    /// An empty map, to be estimated with the nominal parameters of `nominal`.
    pub fn new(nominal: &Motor) -> Self {
        let nominal = Nominal {
            resistance: nominal.resistance_ohm,
            inductance: nominal.inductance_h,
            back_emf: nominal.back_emf_v_s_rad,
        };
        Self {
            nominal,
            pass: None,
            bins: vec![BinSums::default(); BINS],
            sum_speed_current: 0.0,
            sum_speed_squared: 0.0,
            awaited: vec![false; BINS],
            awaited_passes: 0,
            lacking: None,
            unsettled_s: 0.0,
        }
    }

    /// Lets it be done as soon as every awaited bin has its passes.
    pub fn until(mut self, awaited: Awaited) -> Self {
        for &bin in awaited.bins {
            self.awaited[kept_bin(bin)] = true;
        }
        self.awaited_passes = awaited.passes.max(1);
        self.unsettled_s = awaited.from_s;
        self.lacking = Some(self.awaited.iter().filter(|awaited| **awaited).count());
        self
    }

    /// The map of the completed passes.
    pub fn map(&self) -> BackEmfMap {
        let y = |bin: &BinSums| bin.back_emf / f64::from(bin.passes) / self.nominal.back_emf;
        let r = |bin: &BinSums| {
            self.nominal.resistance / self.nominal.back_emf * bin.current_per_speed / f64::from(bin.passes)
        };
        let mean = self.nominal.resistance * self.sum_speed_current / (self.nominal.back_emf * self.sum_speed_squared);
        BackEmfMap {
            y: (0..BINS).map(|bin| self.windowed(bin, y)).collect(),
            r: (0..BINS).map(|bin| self.windowed(bin, r)).collect(),
            mean_r: (self.sum_speed_squared > 0.0).then_some(mean),
            passes: (0..BINS).map(|bin| self.bins[kept_bin(bin)].passes).collect(),
        }
    }

    /// Mean of a figure of the bins that have one, over the window of the nearest kept bin.
    fn windowed(&self, bin: usize, figure: impl Fn(&BinSums) -> f64) -> Option<f64> {
        let centre = kept_bin(bin);
        if self.bins[centre].passes == 0 {
            return None;
        }
        let position = position_in_sector(centre);
        let start = centre + BINS - position;
        let low = position.saturating_sub(WINDOW_BINS).max(GUARD_BINS);
        let high = (position + WINDOW_BINS).min(SECTOR_BINS - 1 - GUARD_BINS);
        let window = (low..=high).map(|p| &self.bins[(start + p) % BINS]).filter(|bin| bin.passes > 0);
        let (sum, count) = window.fold((0.0, 0.0), |(sum, count), bin| (sum + figure(bin), count + 1.0));
        Some(sum / count)
    }

    #[cold]
    fn begin(&mut self, sample: &Sample) {
        self.end();
        self.pass = Some(Pass {
            bin: sample.bin,
            steps: 1,
            voltage: sample.voltage_v,
            current: sample.current_a,
            speed: sample.speed_rad_s,
            first_current: sample.current_a,
            last_current: sample.next_current_a,
            step_s: sample.step_s,
        });
    }

    /// Completes the pass under way.
    fn end(&mut self) {
        let Some(pass) = self.pass.take() else { return };
        let steps = f64::from(pass.steps);
        let (voltage, current, speed) = (pass.voltage / steps, pass.current / steps, pass.speed / steps);
        if speed.abs() <= GATE_RAD_S {
            return;
        }
        let slope = (pass.last_current - pass.first_current) / (steps * pass.step_s);
        let Nominal { resistance, inductance, .. } = self.nominal;
        let bin = &mut self.bins[pass.bin];
        bin.back_emf += (voltage - resistance * current - inductance * slope) / speed;
        bin.current_per_speed += current / speed;
        bin.passes += 1;
        self.sum_speed_current += speed * current;
        self.sum_speed_squared += speed * speed;
        if self.awaited[pass.bin] && bin.passes == self.awaited_passes {
            self.lacking = self.lacking.map(|bins| bins - 1);
        }
    }
}

impl Observer for MapAccumulator {
    #[inline]
    fn observe(&mut self, sample: &Sample) {
        if self.unsettled_s > 0.0 {
            self.unsettled_s -= sample.step_s;
            return;
        }
        match &mut self.pass {
            Some(pass) if pass.bin == sample.bin => {
                pass.steps += 1;
                pass.voltage += sample.voltage_v;
                pass.current += sample.current_a;
                pass.speed += sample.speed_rad_s;
                pass.last_current = sample.next_current_a;
            }
            _ => self.begin(sample),
        }
    }

    fn done(&self) -> bool {
        self.lacking == Some(0)
    }
}

fn position_in_sector(bin: usize) -> usize {
    (bin + BINS - FIRST_COMMUTATION_BIN) % SECTOR_BINS
}

/// The bin itself, or the nearest one that is no guard bin.
fn kept_bin(bin: usize) -> usize {
    let position = position_in_sector(bin);
    let kept = position.clamp(GUARD_BINS, SECTOR_BINS - 1 - GUARD_BINS);
    (bin + BINS + kept - position) % BINS
}

#[cfg(test)]
mod tests {
    use super::*;

    /// One pass of one bin at a steady speed, with a back-EMF coefficient and a current.
    fn pass(map: &mut MapAccumulator, bin: usize, speed_rad_s: f64, back_emf: f64, current_a: f64) {
        let motor = Motor::default();
        let (step_s, steps, slope) = (1e-6, 7, 300.0);
        for step in 0..steps {
            let current = current_a + slope * step_s * (f64::from(step) - 0.5 * f64::from(steps - 1));
            let voltage_v = back_emf * speed_rad_s + motor.resistance_ohm * current + motor.inductance_h * slope;
            map.observe(&Sample {
                step_s,
                bin,
                voltage_v,
                current_a: current,
                next_current_a: current + slope * step_s,
                speed_rad_s,
                command_rad: 0.0,
                output_rad: 0.0,
                motor_rad: 0.0,
            });
        }
    }

    fn turn(map: &mut MapAccumulator, speed_rad_s: f64, back_emf: impl Fn(usize) -> f64) {
        (0..=BINS).for_each(|bin| pass(map, bin % BINS, speed_rad_s, back_emf(bin % BINS), 2.0));
    }

    fn accumulator() -> MapAccumulator {
        MapAccumulator::new(&Motor::default())
    }

    #[test]
    fn a_linear_coefficient_is_recovered_where_the_window_is_whole() {
        let k_nom = Motor::default().back_emf_v_s_rad;
        let truth = |bin: usize| 1.0 + 1e-3 * position_in_sector(bin) as f64;
        let mut accumulator = accumulator();
        turn(&mut accumulator, -150.0, |bin| k_nom * truth(bin));
        let map = accumulator.map();
        for bin in (0..BINS).filter(|bin| (4..=55).contains(&position_in_sector(*bin))) {
            assert!((map.y[bin].unwrap() - truth(bin)).abs() < 1e-12, "bin {bin}");
            // r = R i/(k w) with the sign of motion.
            assert!((map.r[bin].unwrap() + 2.13 * 2.0 / (k_nom * 150.0)).abs() < 1e-12);
        }
        assert!((map.mean_r.unwrap() - map.r[0].unwrap()).abs() < 1e-12);
    }

    #[test]
    fn guard_bins_take_the_nearest_kept_value_and_windows_stay_in_their_sector() {
        let k_nom = Motor::default().back_emf_v_s_rad;
        let mut accumulator = accumulator();
        // Guard bins carry nonsense, sectors differ.
        turn(&mut accumulator, 150.0, |bin| {
            let sector = crate::commutation::sector(bin) as f64;
            if kept_bin(bin) == bin { k_nom * (1.0 + sector) } else { 50.0 }
        });
        for (bin, y) in accumulator.map().y.iter().enumerate() {
            let sector = crate::commutation::sector(bin) as f64;
            assert!((y.unwrap() - 1.0 - sector).abs() < 1e-12, "bin {bin}: {y:?}");
        }
    }

    #[test]
    fn slow_passes_do_not_count() {
        let mut accumulator = accumulator();
        turn(&mut accumulator, 99.9, |_| 0.07);
        let map = accumulator.map();
        assert!(map.y.iter().chain(&map.r).all(Option::is_none));
        assert_eq!((map.mean_r, map.passes), (None, vec![0; BINS]));
    }

    #[test]
    fn a_map_is_done_with_the_last_awaited_pass() {
        // Bin 31 is a guard bin of the commutation at 30: bin 32 stands for it.
        let mut accumulator = accumulator().until(Awaited { bins: &[31, 100], passes: 2, from_s: 0.0 });
        turn(&mut accumulator, 150.0, |_| 0.07);
        (0..=100).for_each(|bin| pass(&mut accumulator, bin, 150.0, 0.07, 1.0));
        assert!(!accumulator.done());
        pass(&mut accumulator, 101, 150.0, 0.07, 1.0);
        assert!(accumulator.done());
        assert_eq!(accumulator.map().passes[31], 2);
    }
}
