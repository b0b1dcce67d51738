//! How the missions of a fleet differ and change, and what one life is expected to fly.
//!
//! - What: the log of the mean pace of a life: the level of its mission, which may change, what comes and goes about it,
//!   such as seasons, and what windows of a life show of both, with the scatter of a window.
//! - Update rule: a Kalman filter over the windows for each of the likeliest courses of changes; each is weighted by its
//!   evidence. What comes and goes is an Ornstein-Uhlenbeck process.
//! - Requirements: windows in the order of the life.
//! - Source: Kalman 1960; Adams and MacKay 2007 for changes; Uhlenbeck and Ornstein 1930.

use numerics::{
    Stream,
    log_sum_exp::{log_sum, normalised},
};
use serde::{Deserialize, Serialize};

/// Length of the windows in which a mission is seen, hours.
pub(crate) const WINDOW_FH: f64 = 100.0;
/// Spreads of load and temperature between lives, from mission to mission of one, of what comes and goes, and of windows:
/// those of aircraft, where nothing was learned.
const USUAL_LIFE: [f64; 2] = [0.17, 0.4];
const USUAL_CHANGE: [f64; 2] = [0.2, 0.4];
const USUAL_PASSING: [f64; 2] = [0.05, 0.3];
const USUAL_WINDOW: [f64; 2] = [0.08, 0.1];
/// Hours from change to change, and of what comes and goes, likewise.
const USUAL_CHANGES_FH: f64 = 6000.0;
const USUAL_PASSING_FH: f64 = 500.0;
/// Courses of changes that are followed.
const COURSES: usize = 12;
/// Rounds of the search, and the factors by which it begins and ends.
const ROUNDS: usize = 60;
const FIRST_FACTOR: f64 = 2.0;
const LAST_FACTOR: f64 = 1.02;
/// What spreads are sought within, and times, hours.
const SPREADS: [f64; 2] = [1e-3, 3.0];
const TIMES_FH: [f64; 2] = [100.0, 50_000.0];

/// A window of a life in which a mission is seen.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Window {
    /// Its middle, hours since the first flight.
    pub centre_fh: f64,
    /// Its length, hours.
    pub fh: f64,
    /// Log of its mean pace.
    pub log_pace: f64,
}

/// The missions of a fleet.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Missions {
    /// Mean over lives of the log of the pace.
    pub mean: f64,
    /// Its standard deviation between lives at their beginning.
    pub life_sd: f64,
    /// Standard deviation of what a change of the mission adds.
    pub change_sd: f64,
    /// Hours from change to change, on average.
    pub changes_fh: f64,
    /// Standard deviation of what comes and goes.
    pub passing_sd: f64,
    /// Time after which that is forgotten to a part of e, hours.
    pub passing_fh: f64,
    /// Standard deviation of a window of 100 hours about both.
    pub window_sd: f64,
}

/// What is known of the missions of a life.
#[derive(Debug, Clone, PartialEq)]
pub struct Mission {
    law: Missions,
    /// The likeliest first.
    courses: Vec<Course>,
    /// When they were seen last, hours since the first flight.
    seen_fh: f64,
}

/// A course of changes: normal in the level of the mission and in what comes and goes about it.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Course {
    log_weight: f64,
    level: f64,
    passing: f64,
    level_variance: f64,
    covariance: f64,
    passing_variance: f64,
}

impl Missions {
    /// Those of aircraft with these coefficients.
    pub(crate) fn usual(exponent: f64, temperature: f64) -> Self {
        let spread = |[load, warmth]: [f64; 2]| libm::hypot(exponent * load, temperature * warmth).max(SPREADS[0]);
        Self {
            mean: 0.0,
            life_sd: spread(USUAL_LIFE),
            change_sd: spread(USUAL_CHANGE),
            changes_fh: USUAL_CHANGES_FH,
            passing_sd: spread(USUAL_PASSING),
            passing_fh: USUAL_PASSING_FH,
            window_sd: spread(USUAL_WINDOW),
        }
    }

    /// The likeliest by the windows of lives, sought from a guess in steps that become smaller.
    pub(crate) fn learn(lives: &[Vec<Window>], guess: Self) -> Self {
        let (mut best, mut factor) = (guess, FIRST_FACTOR);
        let mut score = best.log_likelihood(lives);
        for _ in 0..ROUNDS {
            let found = best.neighbours(factor).map(|other| (other, other.log_likelihood(lives)));
            let found = found.into_iter().reduce(|a, b| if b.1 > a.1 { b } else { a }).expect("neighbours");
            if found.1 > score {
                (best, score) = found;
                continue;
            }
            factor = factor.sqrt();
            if factor < LAST_FACTOR {
                break;
            }
        }
        best
    }

    fn neighbours(&self, factor: f64) -> [Self; 14] {
        let spread = |sd: f64| sd.clamp(SPREADS[0], SPREADS[1]);
        let time = |fh: f64| fh.clamp(TIMES_FH[0], TIMES_FH[1]);
        let both = |change: &dyn Fn(f64) -> Self| [change(factor), change(1.0 / factor)];
        let pairs = [
            both(&|by| Self { mean: self.mean + libm::log(by) * self.life_sd, ..*self }),
            both(&|by| Self { life_sd: spread(by * self.life_sd), ..*self }),
            both(&|by| Self { change_sd: spread(by * self.change_sd), ..*self }),
            both(&|by| Self { changes_fh: time(by * self.changes_fh), ..*self }),
            both(&|by| Self { passing_sd: spread(by * self.passing_sd), ..*self }),
            both(&|by| Self { passing_fh: time(by * self.passing_fh), ..*self }),
            both(&|by| Self { window_sd: spread(by * self.window_sd), ..*self }),
        ];
        std::array::from_fn(|index| pairs[index / 2][index % 2])
    }

    fn log_likelihood(&self, lives: &[Vec<Window>]) -> f64 {
        lives.iter().map(|windows| self.follow(windows).1).sum()
    }

    /// What these windows of a life tell of its missions.
    pub(crate) fn seen(&self, windows: &[Window]) -> Mission {
        self.follow(windows).0
    }

    fn follow(&self, windows: &[Window]) -> (Mission, f64) {
        let start = Course {
            log_weight: 0.0,
            level: self.mean,
            passing: 0.0,
            level_variance: self.life_sd * self.life_sd,
            covariance: 0.0,
            passing_variance: self.passing_sd * self.passing_sd,
        };
        let mut mission = Mission { law: *self, courses: vec![start], seen_fh: 0.0 };
        let log_likelihood = windows.iter().map(|window| mission.take(window)).sum();
        (mission, log_likelihood)
    }

    /// Over so many hours, what remains of what comes and goes, and the variance that comes to it.
    fn step(&self, fh: f64) -> (f64, f64) {
        let remains = libm::exp(-fh / self.passing_fh);
        (remains, self.passing_sd * self.passing_sd * (1.0 - remains * remains))
    }
}

impl Mission {
    /// The log of the pace of the present mission, with what comes and goes as it is now.
    pub fn log_pace(&self) -> f64 {
        self.mean(|course| course.level + course.passing)
    }

    /// The log of a pace that it will hardly exceed, now or later.
    pub(crate) fn greatest_log_pace(&self) -> f64 {
        const FAR: f64 = 3.0;
        let level = self.mean(|course| course.level);
        let variance = self.mean(|course| {
            course.level_variance + (course.level - level) * (course.level - level) + course.passing_variance.max(0.0)
        });
        level + FAR * (variance + self.law.change_sd * self.law.change_sd).sqrt()
    }

    fn mean(&self, of: impl Fn(&Course) -> f64) -> f64 {
        self.weights().iter().zip(&self.courses).map(|(weight, course)| weight * of(course)).sum()
    }

    fn weights(&self) -> Vec<f64> {
        normalised(&self.courses.iter().map(|course| course.log_weight).collect::<Vec<_>>())
    }

    /// Takes a window in; returns its log-likelihood.
    fn take(&mut self, window: &Window) -> f64 {
        let fh = window.centre_fh - self.seen_fh;
        let first = self.seen_fh == 0.0;
        self.seen_fh = window.centre_fh;
        let (remains, comes) = self.law.step(fh);
        let changes = if first { 0.0 } else { -libm::expm1(-fh / self.law.changes_fh) };
        let before = log_sum(&self.courses.iter().map(|course| course.log_weight).collect::<Vec<_>>());
        let mut courses = Vec::with_capacity(2 * self.courses.len());
        for course in &self.courses {
            let on = Course {
                log_weight: course.log_weight + libm::log1p(-changes),
                passing: remains * course.passing,
                covariance: remains * course.covariance,
                passing_variance: remains * remains * course.passing_variance + comes,
                ..*course
            };
            courses.push(on);
            if changes > 0.0 {
                courses.push(Course {
                    log_weight: course.log_weight + libm::log(changes),
                    level_variance: on.level_variance + self.law.change_sd * self.law.change_sd,
                    ..on
                });
            }
        }
        let noise = self.law.window_sd * self.law.window_sd * WINDOW_FH / window.fh;
        courses.iter_mut().for_each(|course| course.correct(window.log_pace, noise));
        courses.sort_by(|a, b| b.log_weight.total_cmp(&a.log_weight));
        courses.truncate(COURSES);
        self.courses = courses;
        log_sum(&self.courses.iter().map(|course| course.log_weight).collect::<Vec<_>>()) - before
    }

    /// Draws the log of its pace now and at some later times, hours from now in ascending order.
    pub(crate) fn draw(&self, times_fh: &[f64], stream: &mut Stream) -> Vec<f64> {
        let mut left = stream.uniform();
        let chosen = self.weights().iter().position(|weight| {
            left -= weight;
            left < 0.0
        });
        let course = &self.courses[chosen.unwrap_or(0)];
        let sd = course.level_variance.max(0.0).sqrt();
        let z = stream.normal();
        let shared = if sd > 0.0 { course.covariance / sd } else { 0.0 };
        let rest = (course.passing_variance - shared * shared).max(0.0).sqrt();
        let mut level = course.level + sd * z;
        let mut passing = course.passing + shared * z + rest * stream.normal();
        let mut change_fh = self.law.changes_fh * stream.exponential();
        let mut before_fh = 0.0;
        let at = |t_fh: &f64| {
            let (remains, comes) = self.law.step(t_fh - before_fh);
            before_fh = *t_fh;
            passing = remains * passing + comes.sqrt() * stream.normal();
            while change_fh <= *t_fh {
                level += self.law.change_sd * stream.normal();
                change_fh += self.law.changes_fh * stream.exponential();
            }
            // The mean pace of a mission is that of its windows, which scatter about it.
            level + passing + 0.5 * self.law.window_sd * self.law.window_sd
        };
        times_fh.iter().map(at).collect()
    }
}

impl Course {
    /// Takes the log of the pace of a window in, seen with some variance.
    fn correct(&mut self, log_pace: f64, noise: f64) {
        let with = [self.level_variance + self.covariance, self.passing_variance + self.covariance];
        let variance = with[0] + with[1] + noise;
        let surprise = log_pace - self.level - self.passing;
        let gain = with.map(|with| with / variance);
        self.level += gain[0] * surprise;
        self.passing += gain[1] * surprise;
        self.level_variance -= gain[0] * with[0];
        self.passing_variance -= gain[1] * with[1];
        self.covariance -= gain[0] * with[1];
        self.log_weight -= 0.5 * (libm::log(variance) + surprise * surprise / variance);
    }
}
