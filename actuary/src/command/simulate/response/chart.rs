//! Responses as a chart (SVG): panels over a common time axis, one colour per curve.

use std::fmt::Write as _;

use ema::response::ResponsePoint;
use evaluation::chart::round_step;

use super::Response;

const WIDTH: f64 = 900.0;
const PANEL_HEIGHT: f64 = 190.0;
const GAP: f64 = 22.0;
/// Room for title and legend, and for the names of the axes: left, top, right, bottom.
const MARGIN: [f64; 4] = [88.0, 74.0, 24.0, 52.0];
/// Colours that people with any colour vision can tell apart (Okabe and Ito).
const COLOURS: [&str; 8] = ["#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#000000", "#8c6d31"];
const STYLE: &str = "text{font:13px system-ui,'Segoe UI',Helvetica,Arial,sans-serif;fill:#222}
.title{font-size:16px;font-weight:600}.tick{font-size:11px;fill:#555}
.grid{stroke:#e3e3e3;stroke-width:1}.frame{fill:none;stroke:#999;stroke-width:1}
polyline{fill:none;stroke-width:1.6;stroke-linejoin:round}.command{stroke:#777;stroke-dasharray:5 4;stroke-width:1.3}";

/// What a panel shows.
struct Panel {
    name: &'static str,
    value: fn(&ResponsePoint) -> f64,
}

const PANELS: [Panel; 4] = [
    Panel { name: "output, rad", value: |point| point.output_rad },
    Panel { name: "error, mrad", value: |point| 1e3 * (point.command_rad - point.output_rad) },
    Panel { name: "motor speed, rad/s", value: |point| point.speed_rad_s },
    Panel { name: "current, A", value: |point| point.current_a },
];

/// The chart of responses over the same time.
pub fn draw(title: &str, responses: &[Response]) -> String {
    let height = MARGIN[1] + PANELS.len() as f64 * (PANEL_HEIGHT + GAP) - GAP + MARGIN[3];
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {WIDTH} {height}\" width=\"{WIDTH}\" height=\"{height}\" \
         role=\"img\">\n<title>{title}</title>\n<style>{STYLE}</style>\n\
         <rect width=\"{WIDTH}\" height=\"{height}\" fill=\"#fff\"/>\n\
         <text class=\"title\" x=\"{}\" y=\"26\">{title}</text>\n",
        MARGIN[0]
    );
    legend(&mut svg, responses);
    let end_s = responses.iter().filter_map(|response| response.points.last()).map(|point| point.time_s);
    let time = Scale { low: 0.0, high: end_s.fold(f64::MIN_POSITIVE, f64::max) };
    for (index, panel) in PANELS.iter().enumerate() {
        let frame = Frame { top: MARGIN[1] + index as f64 * (PANEL_HEIGHT + GAP), time, value: panel.scale(responses) };
        frame.axes(&mut svg, panel.name, index + 1 == PANELS.len());
        if index == 0 {
            frame.line(&mut svg, "class=\"command\"", &responses[0].points, |point| point.command_rad);
        }
        for (response, colour) in responses.iter().zip(COLOURS) {
            frame.line(&mut svg, &format!("stroke=\"{colour}\""), &response.points, panel.value);
        }
    }
    svg += "</svg>\n";
    svg
}

fn legend(svg: &mut String, responses: &[Response]) {
    let mut x = MARGIN[0];
    let mut entry = |style: &str, label: &str| {
        let words = x + 26.0;
        writeln!(
            svg,
            "<polyline {style} points=\"{x:.0},48 {:.0},48\"/><text x=\"{words:.0}\" y=\"52\">{label}</text>",
            x + 20.0
        )
        .expect("writing to a string");
        x = words + 7.6 * label.chars().count() as f64 + 20.0;
    };
    entry("class=\"command\"", "command");
    for (response, colour) in responses.iter().zip(COLOURS) {
        entry(&format!("stroke=\"{colour}\""), &response.case.label);
    }
}

impl Panel {
    /// Around all curves, the command of the first panel included.
    fn scale(&self, responses: &[Response]) -> Scale {
        let points = || responses.iter().flat_map(|response| &response.points);
        let values = points().map(self.value);
        let commands = points().filter(|_| self.name.starts_with("output")).map(|point| point.command_rad);
        let (low, high) =
            values.chain(commands).fold((0.0, 0.0), |(low, high): (f64, f64), value| (low.min(value), high.max(value)));
        let room = if high > low { 0.06 * (high - low) } else { 1.0 };
        Scale { low: if low < 0.0 { low - room } else { 0.0 }, high: high + room }
    }
}

/// An interval of values.
#[derive(Clone, Copy)]
struct Scale {
    low: f64,
    high: f64,
}

impl Scale {
    fn share(&self, value: f64) -> f64 {
        (value - self.low) / (self.high - self.low)
    }

    /// Round values about `count` to the interval.
    fn ticks(&self, count: f64) -> Vec<(f64, String)> {
        let step = round_step((self.high - self.low) / count);
        let decimals = (-step.log10().floor()).max(0.0) as usize;
        let (first, last) = ((self.low / step).ceil() as i64, (self.high / step + 1e-9).floor() as i64);
        let tick = |index| {
            let value = index as f64 * step;
            (value, if decimals > 5 { format!("{value:.0e}") } else { format!("{value:.decimals$}") })
        };
        (first..=last).map(tick).collect()
    }
}

/// Where a panel lies and what it spans.
struct Frame {
    top: f64,
    time: Scale,
    value: Scale,
}

impl Frame {
    fn across(&self, time_s: f64) -> f64 {
        MARGIN[0] + self.time.share(time_s) * (WIDTH - MARGIN[0] - MARGIN[2])
    }

    fn up(&self, value: f64) -> f64 {
        self.top + (1.0 - self.value.share(value)) * PANEL_HEIGHT
    }

    fn axes(&self, svg: &mut String, name: &str, last: bool) {
        let (left, right, bottom) = (MARGIN[0], WIDTH - MARGIN[2], self.top + PANEL_HEIGHT);
        let mut put = |line: String| writeln!(svg, "{line}").expect("writing to a string");
        for (value, label) in self.value.ticks(6.0) {
            let y = self.up(value);
            put(format!("<line class=\"grid\" x1=\"{left}\" x2=\"{right}\" y1=\"{y:.1}\" y2=\"{y:.1}\"/>"));
            put(format!(
                "<text class=\"tick\" x=\"{}\" y=\"{:.1}\" text-anchor=\"end\">{label}</text>",
                left - 8.0,
                y + 4.0
            ));
        }
        for (time, label) in self.time.ticks(8.0) {
            let x = self.across(time);
            put(format!("<line class=\"grid\" x1=\"{x:.1}\" x2=\"{x:.1}\" y1=\"{}\" y2=\"{bottom}\"/>", self.top));
            if last {
                put(format!(
                    "<text class=\"tick\" x=\"{x:.1}\" y=\"{}\" text-anchor=\"middle\">{label}</text>",
                    bottom + 18.0
                ));
            }
        }
        put(format!(
            "<rect class=\"frame\" x=\"{left}\" y=\"{}\" width=\"{}\" height=\"{PANEL_HEIGHT}\"/>",
            self.top,
            right - left
        ));
        let middle = self.top + 0.5 * PANEL_HEIGHT;
        put(format!("<text transform=\"translate(22 {middle}) rotate(-90)\" text-anchor=\"middle\">{name}</text>"));
        if last {
            put(format!(
                "<text x=\"{}\" y=\"{}\" text-anchor=\"middle\">time, s</text>",
                0.5 * (left + right),
                bottom + 40.0
            ));
        }
    }

    /// A curve; of the points within a pixel, only the first, the least and the largest.
    fn line(&self, svg: &mut String, style: &str, points: &[ResponsePoint], value: fn(&ResponsePoint) -> f64) {
        write!(svg, "<polyline {style} points=\"").expect("writing to a string");
        for group in points.chunk_by(|a, b| self.across(a.time_s).floor() == self.across(b.time_s).floor()) {
            let order = |a: &&ResponsePoint, b: &&ResponsePoint| value(a).total_cmp(&value(b));
            let mut kept = [group.first(), group.iter().min_by(order), group.iter().max_by(order)]
                .map(|point| point.expect("chunks are not empty"));
            kept.sort_by(|a, b| a.time_s.total_cmp(&b.time_s));
            let distinct = if group.len() > 2 { &kept[..] } else { &kept[..1] };
            for point in distinct {
                write!(svg, "{:.1},{:.1} ", self.across(point.time_s), self.up(value(point)))
                    .expect("writing to a string");
            }
        }
        *svg += "\"/>\n";
    }
}
