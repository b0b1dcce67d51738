//! Charts: series over flight hours, laid out in pixels; the template draws them as SVG.

use super::words::grouped;

const LEFT: f64 = 62.0;
const RIGHT: f64 = 30.0;
const TOP: f64 = 24.0;
const BOTTOM: f64 = 40.0;
/// Ticks that fit, about.
const TICKS: f64 = 5.0;

/// A value, or a range of values, at some flight hours.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sample {
    /// Flight hours.
    pub x: f64,
    /// Lower end.
    pub low: f64,
    /// Upper end.
    pub high: f64,
}

struct Series {
    class: &'static str,
    label: String,
    samples: Vec<Sample>,
    filled: bool,
}

/// The picture that is to be drawn.
pub struct Plan {
    title: String,
    series: Vec<Series>,
    rules: Vec<(f64, &'static str)>,
    with_zero: bool,
    width: f64,
    height: f64,
}

/// A chart in pixels.
pub struct Chart {
    /// What it shows.
    pub title: String,
    /// The last values in words, for those who do not see it.
    pub description: String,
    /// Width.
    pub width: f64,
    /// Height.
    pub height: f64,
    /// Edges of the plotting area.
    pub left: f64,
    /// See `left`.
    pub right: f64,
    /// See `left`.
    pub top: f64,
    /// See `left`.
    pub bottom: f64,
    /// Filled bands: class, points of a polygon.
    pub bands: Vec<(&'static str, String)>,
    /// Lines: class, points of a polyline.
    pub lines: Vec<(&'static str, String)>,
    /// Horizontal rules: height, label.
    pub rules: Vec<(String, &'static str)>,
    /// Ticks over flight hours: place, label.
    pub x_ticks: Vec<(String, String)>,
    /// Ticks over values: place, label.
    pub y_ticks: Vec<(String, String)>,
    /// Legend: class, label.
    pub legend: Vec<(&'static str, String)>,
}

impl Chart {
    /// Begins a plan.
    #[allow(clippy::new_ret_no_self, reason = "a chart is drawn from a plan")]
    pub fn new(title: &str) -> Plan {
        let title = title.to_owned();
        Plan { title, series: Vec::new(), rules: Vec::new(), with_zero: false, width: 760.0, height: 300.0 }
    }
}

impl Plan {
    /// A filled band between the ends of the samples.
    pub fn band(mut self, class: &'static str, label: &str, samples: Vec<Sample>) -> Self {
        self.series.push(Series { class, label: label.to_owned(), samples, filled: true });
        self
    }

    /// A line through the lower ends of the samples.
    pub fn line(mut self, class: &'static str, label: &str, samples: Vec<Sample>) -> Self {
        self.series.push(Series { class, label: label.to_owned(), samples, filled: false });
        self
    }

    /// A horizontal rule.
    pub fn rule(mut self, value: f64, label: &'static str) -> Self {
        self.rules.push((value, label));
        self
    }

    /// Lets the axis of values begin at zero.
    pub fn with_zero(mut self) -> Self {
        self.with_zero = true;
        self
    }

    /// Size in pixels.
    pub fn size(mut self, width: f64, height: f64) -> Self {
        (self.width, self.height) = (width, height);
        self
    }

    /// Lays it out; `None` with fewer than two samples.
    pub fn draw(self) -> Option<Chart> {
        let samples = || self.series.iter().flat_map(|series| &series.samples);
        if self.series.iter().all(|series| series.samples.len() < 2) {
            return None;
        }
        let x = Axis::around(samples().map(|s| s.x), LEFT, self.width - RIGHT)?;
        let zero = self.with_zero.then_some(0.0);
        let values = samples().flat_map(|s| [s.low, s.high]).chain(self.rules.iter().map(|rule| rule.0)).chain(zero);
        let y = Axis::around(values, self.height - BOTTOM, TOP)?;
        let of = |filled: bool| {
            let wanted = self.series.iter().filter(move |series| series.filled == filled);
            wanted.map(|series| (series.class, outline(series, &x, &y))).collect()
        };
        Some(Chart {
            description: description(&self.series),
            left: LEFT,
            right: self.width - RIGHT,
            top: TOP,
            bottom: self.height - BOTTOM,
            bands: of(true),
            lines: of(false),
            rules: self.rules.iter().map(|&(value, label)| (y.place(value), label)).collect(),
            x_ticks: x.ticks(),
            y_ticks: y.ticks(),
            legend: self.series.iter().map(|series| (series.class, series.label.clone())).collect(),
            title: self.title,
            width: self.width,
            height: self.height,
        })
    }
}

fn outline(series: &Series, x: &Axis, y: &Axis) -> String {
    let point = |at: f64, value: f64| format!("{},{}", x.place(at), y.place(value));
    let lower = series.samples.iter().map(|s| point(s.x, s.low));
    let upper = series.samples.iter().rev().map(|s| point(s.x, s.high));
    let points: Vec<_> = if series.filled { lower.chain(upper).collect() } else { lower.collect() };
    points.join(" ")
}

fn description(series: &[Series]) -> String {
    let last = |series: &Series| {
        let s = series.samples.last()?;
        let range = if s.low == s.high { short(s.low) } else { format!("{} to {}", short(s.low), short(s.high)) };
        Some(format!("{}: {range}", series.label))
    };
    let values: Vec<_> = series.iter().filter_map(last).collect();
    format!("Latest values: {}.", values.join("; "))
}

fn short(value: f64) -> String {
    if value.abs() < 100.0 { format!("{value:.4}") } else { grouped(value) }
}

/// Maps values to pixels.
struct Axis {
    min: f64,
    max: f64,
    step: f64,
    from_px: f64,
    to_px: f64,
}

impl Axis {
    /// An axis from tick to tick around finite values.
    fn around(values: impl Iterator<Item = f64>, from_px: f64, to_px: f64) -> Option<Self> {
        let mut range: Option<(f64, f64)> = None;
        for value in values.filter(|value| value.is_finite()) {
            let (min, max) = range.unwrap_or((value, value));
            range = Some((min.min(value), max.max(value)));
        }
        let (min, max) = range?;
        // Equal values still need an axis of some length.
        let span = (max - min).max(1e-3 * max.abs()).max(1e-3);
        let step = round_step(span / TICKS);
        let min = (min / step).floor() * step;
        let max = ((max / step).ceil() * step).max(min + step);
        Some(Self { min, max, step, from_px, to_px })
    }

    fn place(&self, value: f64) -> String {
        let share = (value - self.min) / (self.max - self.min);
        format!("{:.1}", self.from_px + share * (self.to_px - self.from_px))
    }

    fn ticks(&self) -> Vec<(String, String)> {
        let count = ((self.max - self.min) / self.step).round() as usize;
        let decimals = (-self.step.log10().floor()).max(0.0) as usize;
        let tick = |i: usize| {
            let value = self.min + i as f64 * self.step;
            let label = if decimals == 0 { grouped(value) } else { format!("{value:.decimals$}") };
            (self.place(value), label)
        };
        (0..=count).map(tick).collect()
    }
}

/// The next of 1, 2, 5 times a power of ten.
fn round_step(step: f64) -> f64 {
    let power = 10_f64.powf(step.log10().floor());
    let rounded = [1.0, 2.0, 5.0].into_iter().find(|factor| factor * power >= step * 0.999);
    rounded.unwrap_or(10.0) * power
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(x: f64, low: f64, high: f64) -> Sample {
        Sample { x, low, high }
    }

    #[test]
    fn the_axes_hold_every_sample() {
        let samples = vec![at(20.0, -0.01, 0.02), at(940.0, 0.03, 0.07)];
        let chart = Chart::new("t").band("wide", "band", samples).rule(0.5, "limit").draw().unwrap();
        let numbers = chart.bands[0].1.split([' ', ',']).map(|text| text.parse::<f64>().unwrap());
        for (i, number) in numbers.enumerate() {
            let (low, high) = if i % 2 == 0 { (chart.left, chart.right) } else { (chart.top, chart.bottom) };
            assert!((low..=high).contains(&number), "{number}");
        }
        assert_eq!(chart.x_ticks.first().unwrap().1, "0");
        assert_eq!(chart.x_ticks.last().unwrap().1, "1\u{202f}000");
        assert_eq!(chart.y_ticks.last().unwrap().1, "0.6");
    }

    #[test]
    fn constant_and_missing_series_are_no_error() {
        assert!(Chart::new("t").line("l", "l", vec![at(0.0, 1.0, 1.0)]).draw().is_none());
        let flat = Chart::new("t").line("l", "l", vec![at(0.0, 1.0, 1.0), at(1.0, 1.0, 1.0)]).draw().unwrap();
        assert!(!flat.lines[0].1.contains("NaN"));
    }

    #[test]
    fn steps_are_round() {
        for (step, rounded) in [(0.9, 1.0), (1.0, 1.0), (1.1, 2.0), (3.0, 5.0), (7.0, 10.0), (0.03, 0.05)] {
            assert!((round_step(step) - rounded).abs() < 1e-12, "{step}");
        }
    }
}
