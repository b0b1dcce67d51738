//! The lifting line against another way to solve it: horseshoe vortices by fixed-point iteration.

use airframe::{LiftingLine, Wing};

use crate::wing::{close, thesis_case};

/// The reference wing in equal strips, each a horseshoe vortex.
struct Strips {
    /// Angle of attack from zero lift at the middle of each strip, rad.
    incidence_rad: Vec<f64>,
    width_m: f64,
    /// Factor on the downwash: 1 is right.
    downwash: f64,
}

impl Strips {
    fn new(strips: usize, downwash: f64) -> Self {
        let (wing, case) = (Wing::reference(), thesis_case());
        let width_m = wing.span_m / strips as f64;
        let incidence = |i: usize| {
            let y_m = (i as f64 + 0.5) * width_m - 0.5 * wing.span_m;
            let on = |surface: &airframe::ControlSurface| (surface.inboard_m..surface.outboard_m).contains(&y_m.abs());
            let flap = if on(&wing.flap) { case.flap_rad * wing.flap.effectiveness() } else { 0.0 };
            let aileron = if on(&wing.aileron) { case.aileron_rad * wing.aileron.effectiveness() } else { 0.0 };
            case.angle_of_attack_rad - wing.zero_lift_angle_rad + flap + aileron * y_m.signum()
        };
        Self { incidence_rad: (0..strips).map(incidence).collect(), width_m, downwash }
    }

    /// Circulation over airspeed, m, after so many steps of this relaxation from none.
    fn iterate(&self, relaxation: f64, steps: usize) -> Vec<f64> {
        let (n, slope) = (self.incidence_rad.len(), Wing::reference().section_lift_slope_per_rad);
        let mut circulation = vec![0.0; n];
        for _ in 0..steps {
            // A trailing vortex leaves at every edge with what the circulation loses there.
            let trailing: Vec<f64> = (0..=n)
                .map(|edge| {
                    let at = |i: Option<usize>| i.and_then(|i| circulation.get(i)).copied().unwrap_or(0.0);
                    at(Some(edge)) - at(edge.checked_sub(1))
                })
                .collect();
            for (i, circulation) in circulation.iter_mut().enumerate() {
                let distance_m = |edge: usize| (i as f64 + 0.5 - edge as f64) * self.width_m;
                let sum: f64 = trailing.iter().enumerate().map(|(edge, lost)| lost / distance_m(edge)).sum();
                let downwash = self.downwash * sum / (4.0 * std::f64::consts::PI);
                let next = 0.5 * slope * (self.incidence_rad[i] - downwash);
                *circulation += relaxation * (next - *circulation);
            }
        }
        circulation
    }

    /// CL = 2/(V S) sum Gamma dy.
    fn lift_coefficient(&self, circulation: &[f64]) -> f64 {
        2.0 * circulation.iter().sum::<f64>() * self.width_m / Wing::reference().area_m2()
    }
}

/// The strips come to the lifting line's lift as they get finer; twice the downwash, as printed in
/// Berri 2021, eq. 4.2, does not.
#[test]
fn fixed_point_iteration_comes_to_the_same_lift() {
    let lift = |strips, downwash, relaxation| {
        let strips = Strips::new(strips, downwash);
        strips.lift_coefficient(&strips.iterate(relaxation, 1000))
    };
    close(lift(160, 1.0, 0.06), 0.8315, 2e-4);
    close(lift(160, 2.0, 0.03), 0.720, 5e-4);
    let converged = LiftingLine::new(Wing::reference(), 400).loading(&thesis_case()).lift_coefficient();
    close(converged, 0.829_305, 1e-5);
    let (coarse, fine) = (lift(160, 1.0, 0.06) - converged, lift(320, 1.0, 0.03) - converged);
    assert!(coarse > 0.0 && fine > 0.0 && fine < 0.6 * coarse, "{coarse} {fine}");
}

/// The largest relaxation that is stable falls with the strips: a circulation that alternates from strip
/// to strip has the downwash Gamma/(2 width), which every step overshoots.
#[test]
fn fixed_point_iteration_is_stable_up_to_its_limit() {
    for (strips, limit) in [(10, 0.80), (20, 0.50), (40, 0.285), (80, 0.154), (160, 0.080)] {
        let largest = |relaxation| {
            let circulation = Strips::new(strips, 1.0).iterate(relaxation, 400);
            circulation.iter().fold(0.0_f64, |largest, gamma| largest.max(gamma.abs()))
        };
        assert!(largest(0.97 * limit) < 1.0, "{strips}: stable below {limit}");
        assert!(largest(1.03 * limit) > 1e3, "{strips}: unstable above {limit}");
    }
}
