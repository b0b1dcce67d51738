//! Line charts as inline SVG.

use std::fmt::Write as _;

const WIDTH: f64 = 420.0;
const HEIGHT: f64 = 280.0;
/// Room for ticks and names of the axes: left, top, right, bottom.
const MARGIN: [f64; 4] = [56.0, 12.0, 14.0, 44.0];
/// About so many intervals on an axis.
const INTERVALS: f64 = 5.0;

/// An axis from zero.
#[derive(Debug, Clone, Copy)]
pub struct Axis<'a> {
    /// Its name with the unit.
    pub name: &'a str,
    /// Its end.
    pub end: f64,
}

/// A chart under construction. What lies beyond its frame is cut off.
#[derive(Debug)]
pub struct Chart<'a> {
    x: Axis<'a>,
    y: Axis<'a>,
    /// Identifies the frame among the charts of a page.
    id: usize,
    marks: String,
}

impl<'a> Chart<'a> {
    /// An empty chart; `id` differs between the charts of a page.
    pub fn new(id: usize, x: Axis<'a>, y: Axis<'a>) -> Self {
        Self { x, y, id, marks: String::new() }
    }

    /// A line through points; `class` is a class of the page's style.
    pub fn line(&mut self, class: &str, points: &[(f64, f64)]) {
        let path = self.path(points);
        write!(self.marks, r#"<polyline class="line {class}" points="{path}"/>"#).expect("writing to a string");
    }

    /// The area inside a closed line.
    pub fn area(&mut self, class: &str, outline: &[(f64, f64)]) {
        let path = self.path(outline);
        write!(self.marks, r#"<polygon class="area {class}" points="{path}"/>"#).expect("writing to a string");
    }

    /// A dot with a text that is shown on hovering.
    pub fn dot(&mut self, class: &str, (x, y): (f64, f64), title: &str) {
        let (x, y) = (self.across(x), self.up(y));
        let dot =
            format!(r#"<circle class="dot {class}" cx="{x:.1}" cy="{y:.1}" r="2.6"><title>{title}</title></circle>"#);
        self.marks += &dot;
    }

    /// A triangle at the upper edge: a value beyond it.
    pub fn beyond(&mut self, class: &str, x: f64, title: &str) {
        let (x, top) = (self.across(x), MARGIN[1] + 2.0);
        let points = format!("{:.1},{:.1} {x:.1},{top:.1} {:.1},{:.1}", x - 4.0, top + 7.0, x + 4.0, top + 7.0);
        let triangle = format!(r#"<polygon class="dot {class}" points="{points}"><title>{title}</title></polygon>"#);
        self.marks += &triangle;
    }

    /// The chart; `label` says what it shows to those who cannot see it. Both are without markup.
    pub fn finish(self, label: &str) -> String {
        let [left, top, right, bottom] = MARGIN;
        let (inner_width, inner_height) = (WIDTH - left - right, HEIGHT - top - bottom);
        let Self { id, marks, .. } = &self;
        format!(
            concat!(
                r#"<svg viewBox="0 0 {width} {height}" role="img" aria-label="{label}">"#,
                r#"<clipPath id="frame{id}"><rect x="{left}" y="{top}" width="{inner_width}" height="{inner_height}"/></clipPath>"#,
                r#"{grid}<g clip-path="url(#frame{id})">{marks}</g></svg>"#
            ),
            width = WIDTH,
            height = HEIGHT,
            label = label,
            id = id,
            left = left,
            top = top,
            inner_width = inner_width,
            inner_height = inner_height,
            grid = self.grid(),
            marks = marks,
        )
    }

    fn grid(&self) -> String {
        let [left, top, right, bottom] = MARGIN;
        let (floor, edge) = (HEIGHT - bottom, WIDTH - right);
        let mut grid = String::new();
        for tick in ticks(self.x.end) {
            let x = self.across(tick);
            grid += &format!(r#"<line class="grid" x1="{x:.1}" x2="{x:.1}" y1="{top}" y2="{floor}"/>"#);
            grid +=
                &format!(r#"<text class="tick" x="{x:.1}" y="{}" text-anchor="middle">{tick}</text>"#, floor + 15.0);
        }
        for tick in ticks(self.y.end) {
            let y = self.up(tick);
            grid += &format!(r#"<line class="grid" x1="{left}" x2="{edge}" y1="{y:.1}" y2="{y:.1}"/>"#);
            grid +=
                &format!(r#"<text class="tick" x="{}" y="{:.1}" text-anchor="end">{tick}</text>"#, left - 6.0, y + 3.5);
        }
        let (middle_x, middle_y) = (0.5 * (left + edge), 0.5 * (top + floor));
        let (x_name, y_name) = (self.x.name, self.y.name);
        grid +=
            &format!(r#"<text class="name" x="{middle_x}" y="{}" text-anchor="middle">{x_name}</text>"#, HEIGHT - 8.0);
        grid += &format!(
            r#"<text class="name" text-anchor="middle" transform="translate(13 {middle_y}) rotate(-90)">{y_name}</text>"#
        );
        grid
    }

    fn path(&self, points: &[(f64, f64)]) -> String {
        points.iter().map(|&(x, y)| format!("{:.1},{:.1}", self.across(x), self.up(y))).collect::<Vec<_>>().join(" ")
    }

    fn across(&self, x: f64) -> f64 {
        MARGIN[0] + x / self.x.end * (WIDTH - MARGIN[0] - MARGIN[2])
    }

    fn up(&self, y: f64) -> f64 {
        HEIGHT - MARGIN[3] - y / self.y.end * (HEIGHT - MARGIN[1] - MARGIN[3])
    }
}

/// Round numbers from zero to the end.
fn ticks(end: f64) -> Vec<f64> {
    let rough = end / INTERVALS;
    let power = 10f64.powf(rough.log10().floor());
    let step = [1.0, 2.0, 5.0, 10.0].map(|factor| factor * power).into_iter().find(|step| *step >= rough);
    let step = step.unwrap_or(10.0 * power);
    // Multiples of a decimal step are printed without the dust of binary fractions.
    (0..=(end / step + 1e-9) as u32).map(|i| (f64::from(i) * step * 1e6).round() / 1e6).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_are_round() {
        assert_eq!(ticks(1.0), [0.0, 0.2, 0.4, 0.6, 0.8, 1.0]);
        assert_eq!(ticks(3456.0), [0.0, 1000.0, 2000.0, 3000.0]);
        assert_eq!(ticks(0.3), [0.0, 0.1, 0.2, 0.3]);
    }

    #[test]
    fn zero_is_at_the_corner_and_the_end_at_the_opposite_one() {
        let mut chart = Chart::new(0, Axis { name: "t", end: 10.0 }, Axis { name: "y", end: 4.0 });
        chart.line("truth", &[(0.0, 0.0), (10.0, 4.0)]);
        assert!(chart.finish("a line").contains(r#"points="56.0,236.0 406.0,12.0""#));
    }
}
