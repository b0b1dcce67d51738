//! A quantile dotplot: twenty equally likely ends of life, and what has to be lasted for as a line. Whoever counts the dots
//! before the line has the probability in twentieths.

use std::fmt::Write as _;

use crate::due::{ENDS, Ends};

/// Where the axis ends, in periods that have to be lasted for.
const PERIODS: f64 = 2.2;
/// Columns of dots.
const COLUMNS: usize = 33;
/// Distance of columns, and of dots of a column as long as there is room, units of the picture.
const STEP: f64 = 7.0;
const HEIGHT: f64 = 44.0;
const RADIUS: f64 = 2.8;

/// The plot of ends of life in flight hours (`None`: beyond the horizon) against the hours that have to be lasted for.
pub fn plot(ends_fh: &Ends, within_fh: f64) -> String {
    let position = |end: f64| end / within_fh.max(1.0) / PERIODS;
    let line = (STEP * COLUMNS as f64) / PERIODS;
    let mut columns = [(); COLUMNS].map(|()| Vec::new());
    let mut before = 0;
    for end in ends_fh {
        let is_before = end.is_some_and(|end| end <= within_fh);
        before += usize::from(is_before);
        let column = end.map_or(COLUMNS - 1, |end| ((position(end) * COLUMNS as f64) as usize).min(COLUMNS - 1));
        columns[column].push(is_before);
    }
    let width = STEP * COLUMNS as f64;
    let mut svg = format!(
        "<svg class=\"dots\" viewBox=\"0 0 {width} {HEIGHT}\" role=\"img\" aria-label=\"{before} of {ENDS} equally likely ends of \
         life come before\"><line class=\"axis\" x1=\"0\" x2=\"{width}\" y1=\"{HEIGHT}\" y2=\"{HEIGHT}\"/><line \
         class=\"until\" x1=\"{line:.1}\" x2=\"{line:.1}\" y1=\"0\" y2=\"{HEIGHT}\"/>"
    );
    for (column, dots) in columns.iter().enumerate() {
        let step = STEP.min((HEIGHT - 2.0 * RADIUS) / dots.len().max(1) as f64);
        for (i, is_before) in dots.iter().enumerate() {
            let class = if *is_before { "before" } else { "later" };
            let (x, y) = ((column as f64 + 0.5) * STEP, HEIGHT - RADIUS - 1.0 - step * i as f64);
            write!(svg, "<circle class=\"{class}\" cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"{RADIUS}\"/>")
                .expect("writing to a string");
        }
    }
    svg + "</svg>"
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dots_before_the_line_are_filled_and_all_are_there() {
        let ends = std::array::from_fn(|i| (i < 19).then_some(100.0 * i as f64));
        let svg = plot(&ends, 450.0);
        assert_eq!(svg.matches("class=\"before\"").count(), 5);
        assert_eq!(svg.matches("class=\"later\"").count(), 15);
        assert!(svg.contains("5 of 20 equally likely"));
        assert!(!svg.contains("NaN") && !plot(&[Some(0.0); ENDS], 0.0).contains("NaN"));
    }
}
