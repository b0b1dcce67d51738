//! Charts as inline SVG.

use std::fmt::Write as _;

/// Room for ticks and names of the axes: left, top, right, bottom.
const MARGIN: [f64; 4] = [56.0, 10.0, 12.0, 42.0];
/// About so many intervals on an axis.
const INTERVALS: f64 = 5.0;

/// One axis.
#[derive(Debug, Clone, Copy)]
pub struct Axis<'a> {
    /// Its name with the unit.
    pub name: &'a str,
    /// Its start, left or below.
    pub start: f64,
    /// Its end.
    pub end: f64,
}

/// The places of five quantiles: whiskers, box and median.
pub type Quantiles = [f64; 5];

/// A chart under construction. What lies beyond its frame is cut off.
#[derive(Debug)]
pub struct Chart<'a> {
    x: Axis<'a>,
    y: Axis<'a>,
    size: [f64; 2],
    /// Names instead of numbers on the horizontal axis, one for each whole number from zero.
    categories: Vec<String>,
    marks: String,
}

impl<'a> Chart<'a> {
    /// An empty chart of a width and a height, pixels.
    pub fn new(size: [f64; 2], x: Axis<'a>, y: Axis<'a>) -> Self {
        Self { x, y, size, categories: Vec::new(), marks: String::new() }
    }

    /// Puts names at 0, 1, 2 ... of the horizontal axis; they are without markup.
    pub fn with_categories(self, categories: Vec<String>) -> Self {
        Self { categories, ..self }
    }

    /// A line through points; `class` is a class of the page's style.
    pub fn line(&mut self, class: &str, points: &[(f64, f64)]) {
        let path = self.path(points);
        self.mark(format_args!(r#"<polyline class="line {class}" points="{path}"/>"#));
    }

    /// The area inside a closed line.
    pub fn area(&mut self, class: &str, outline: &[(f64, f64)]) {
        let path = self.path(outline);
        self.mark(format_args!(r#"<polygon class="area {class}" points="{path}"/>"#));
    }

    /// The area between a lower and an upper line of the same places.
    pub fn band(&mut self, class: &str, low: &[(f64, f64)], high: &[(f64, f64)]) {
        let outline: Vec<_> = low.iter().chain(high.iter().rev()).copied().collect();
        self.area(class, &outline);
    }

    /// A bar from the axis to a height.
    pub fn bar(&mut self, class: &str, [from, to]: [f64; 2], height: f64) {
        let (left, right) = (self.across(from), self.across(to));
        let (top, floor) = (self.up(height), self.up(self.y.start));
        let (width, height) = (right - left, floor - top);
        self.mark(format_args!(
            r#"<rect class="bar {class}" x="{left:.1}" y="{top:.1}" width="{width:.1}" height="{height:.1}"/>"#
        ));
    }

    /// A box with whiskers about a place.
    pub fn quantiles(&mut self, class: &str, x: f64, width: f64, [low, lower, median, upper, high]: Quantiles) {
        self.line(&format!("{class} solid"), &[(x, low), (x, high)]);
        let (left, right) = (x - 0.5 * width, x + 0.5 * width);
        self.area(&format!("{class} box"), &[(left, lower), (right, lower), (right, upper), (left, upper)]);
        self.line(&format!("{class} solid"), &[(left, median), (right, median)]);
    }

    /// A dot with a text that is shown on hovering.
    pub fn dot(&mut self, class: &str, (x, y): (f64, f64), title: &str) {
        let (x, y) = (self.across(x), self.up(y));
        self.mark(format_args!(
            r#"<circle class="dot {class}" cx="{x:.1}" cy="{y:.1}" r="2.3"><title>{title}</title></circle>"#
        ));
    }

    /// A triangle at the upper edge: a value beyond it.
    pub fn beyond(&mut self, class: &str, x: f64, title: &str) {
        let (x, top) = (self.across(x), MARGIN[1] + 2.0);
        let points = format!("{:.1},{:.1} {x:.1},{top:.1} {:.1},{:.1}", x - 4.0, top + 7.0, x + 4.0, top + 7.0);
        self.mark(format_args!(r#"<polygon class="dot {class}" points="{points}"><title>{title}</title></polygon>"#));
    }

    /// The chart; `label` says what it shows to those who cannot see it. It is without markup.
    pub fn finish(self, label: &str) -> String {
        let [width, height] = self.size;
        let [left, top, right, bottom] = MARGIN;
        let (inner_width, inner_height) = (width - left - right, height - top - bottom);
        // A nested image cuts off what is beyond it and needs no name on the page.
        format!(
            concat!(
                r#"<svg viewBox="0 0 {} {}" role="img" aria-label="{}">{}"#,
                r#"<svg x="{}" y="{}" width="{}" height="{}" viewBox="{} {} {} {}">{}</svg></svg>"#
            ),
            width,
            height,
            label,
            self.grid(),
            left,
            top,
            inner_width,
            inner_height,
            left,
            top,
            inner_width,
            inner_height,
            self.marks
        )
    }

    fn mark(&mut self, mark: std::fmt::Arguments) {
        self.marks.write_fmt(mark).expect("writing to a string");
    }

    fn grid(&self) -> String {
        let [left, top, right, bottom] = MARGIN;
        let (floor, edge) = (self.size[1] - bottom, self.size[0] - right);
        let mut grid = String::new();
        let mut put = |mark: std::fmt::Arguments| grid.write_fmt(mark).expect("writing to a string");
        let named = self.categories.iter().enumerate().map(|(i, name)| (i as f64, name.clone()));
        let numbered = ticks(self.x).into_iter().map(|tick| (tick, written(tick)));
        let across: Vec<_> = if self.categories.is_empty() { numbered.collect() } else { named.collect() };
        for (tick, name) in across {
            let (x, under) = (self.across(tick), floor + 15.0);
            if self.categories.is_empty() {
                put(format_args!(r#"<line class="grid" x1="{x:.1}" x2="{x:.1}" y1="{top}" y2="{floor}"/>"#));
            }
            put(format_args!(r#"<text class="tick" x="{x:.1}" y="{under}" text-anchor="middle">{name}</text>"#));
        }
        for tick in ticks(self.y) {
            let (y, beside, name) = (self.up(tick), left - 6.0, written(tick));
            let class = if tick == 0.0 { "grid zero" } else { "grid" };
            put(format_args!(r#"<line class="{class}" x1="{left}" x2="{edge}" y1="{y:.1}" y2="{y:.1}"/>"#));
            let y = y + 3.5;
            put(format_args!(r#"<text class="tick" x="{beside}" y="{y:.1}" text-anchor="end">{name}</text>"#));
        }
        let (middle_x, middle_y, under) = (0.5 * (left + edge), 0.5 * (top + floor), self.size[1] - 8.0);
        let (x_name, y_name) = (self.x.name, self.y.name);
        put(format_args!(r#"<text class="name" x="{middle_x}" y="{under}" text-anchor="middle">{x_name}</text>"#));
        put(format_args!(
            r#"<text class="name" text-anchor="middle" transform="translate(13 {middle_y}) rotate(-90)">{y_name}</text>"#
        ));
        grid
    }

    fn path(&self, points: &[(f64, f64)]) -> String {
        points.iter().map(|&(x, y)| format!("{:.1},{:.1}", self.across(x), self.up(y))).collect::<Vec<_>>().join(" ")
    }

    fn across(&self, x: f64) -> f64 {
        MARGIN[0] + (x - self.x.start) / (self.x.end - self.x.start) * (self.size[0] - MARGIN[0] - MARGIN[2])
    }

    /// Values far beyond the frame are drawn just beyond it, which saves viewers from huge numbers.
    fn up(&self, y: f64) -> f64 {
        let share = ((y - self.y.start) / (self.y.end - self.y.start)).clamp(-4.0, 5.0);
        self.size[1] - MARGIN[3] - share * (self.size[1] - MARGIN[1] - MARGIN[3])
    }
}

/// Round numbers along an axis.
fn ticks(axis: Axis) -> Vec<f64> {
    let step = round_step((axis.end - axis.start).abs() / INTERVALS);
    let (low, high) = (axis.start.min(axis.end), axis.start.max(axis.end));
    // Multiples of a decimal step are printed without the dust of binary fractions.
    let first = (low / step - 1e-9).ceil() as i64;
    let last = (high / step + 1e-9).floor() as i64;
    (first..=last).map(|i| (i as f64 * step * 1e6).round() / 1e6).collect()
}

/// The least of 1, 2, 5 and 10 times a power of ten that is not below `rough`.
pub fn round_step(rough: f64) -> f64 {
    let power = 10f64.powf(rough.log10().floor());
    let steps = [1.0, 2.0, 5.0, 10.0].map(|factor| factor * power);
    steps.into_iter().find(|step| *step >= rough).unwrap_or(10.0 * power)
}

/// The text of a tick, with a true minus sign; thousands and millions by their letter where there is no room for zeros.
fn written(tick: f64) -> String {
    let size = tick.abs();
    let text = match size {
        1e6.. => format!("{}M", size / 1e6),
        1e4.. => format!("{}k", size / 1e3),
        _ => size.to_string(),
    };
    if tick < 0.0 { format!("\u{2212}{text}") } else { text }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn axis(start: f64, end: f64) -> Axis<'static> {
        Axis { name: "t", start, end }
    }

    #[test]
    fn ticks_have_room_for_their_numbers() {
        let told = [0.0, 0.2, 8000.0, -10_000.0, 450_000.0, 2.5e6].map(written);
        assert_eq!(told, ["0", "0.2", "8000", "\u{2212}10k", "450k", "2.5M"]);
    }

    #[test]
    fn ticks_are_round() {
        assert_eq!(ticks(axis(0.0, 1.0)), [0.0, 0.2, 0.4, 0.6, 0.8, 1.0]);
        assert_eq!(ticks(axis(0.0, 3456.0)), [0.0, 1000.0, 2000.0, 3000.0]);
        assert_eq!(ticks(axis(0.0, 0.3)), [0.0, 0.1, 0.2, 0.3]);
        assert_eq!(ticks(axis(-1.0, 1.0)), [-1.0, -0.5, 0.0, 0.5, 1.0]);
        assert_eq!(ticks(axis(4000.0, 0.0)), [0.0, 1000.0, 2000.0, 3000.0, 4000.0]);
        assert_eq!(written(-0.5), "\u{2212}0.5");
    }

    #[test]
    fn the_start_is_at_the_corner_and_the_end_at_the_opposite_one() {
        let mut chart = Chart::new([420.0, 280.0], axis(0.0, 10.0), axis(-4.0, 4.0));
        chart.line("truth", &[(0.0, -4.0), (10.0, 4.0)]);
        assert!(chart.finish("a line").contains(r#"points="56.0,238.0 408.0,10.0""#));
        let mut falling = Chart::new([420.0, 280.0], axis(10.0, 0.0), axis(0.0, 4.0));
        falling.line("truth", &[(10.0, 0.0), (0.0, 4.0)]);
        assert!(falling.finish("a line").contains(r#"points="56.0,238.0 408.0,10.0""#));
    }
}
