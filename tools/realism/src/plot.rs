//! Small plots as SVG.

use std::fmt::Write;

/// Points or a line of a plot.
#[derive(Clone, Debug)]
pub struct Series {
    /// Name in the legend.
    pub name: String,
    /// Points of the series.
    pub points: Vec<(f64, f64)>,
    /// Whether a line is drawn through the points, or dots.
    pub line: bool,
}

/// A plot with linear axes.
#[derive(Clone, Debug)]
pub struct Plot {
    /// Title above the plot.
    pub title: String,
    /// Label of the horizontal axis, with its unit.
    pub x: String,
    /// Label of the vertical axis, with its unit.
    pub y: String,
    /// Series, each drawn in its own colour.
    pub series: Vec<Series>,
    /// A band of y: the range of the reference.
    pub band: Option<(f64, f64)>,
}

const COLOURS: [&str; 8] = [
    "#1b6e53", "#c26a1b", "#3a5ba0", "#a03a6b", "#6b6b1b", "#555555", "#2b9fb3", "#8a4f2d",
];
const SIZE: (f64, f64) = (460.0, 300.0);
/// Left, top, right and bottom margins of the plot.
const MARGIN: [f64; 4] = [54.0, 28.0, 12.0, 40.0];

impl Plot {
    /// The plot as the text of an SVG file.
    #[must_use]
    pub fn to_svg(&self) -> String {
        let all = || self.series.iter().flat_map(|s| s.points.iter());
        let span = |values: &mut dyn Iterator<Item = f64>| {
            let (low, high) = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| {
                (l.min(v), h.max(v))
            });
            if low < high {
                (low, high)
            } else {
                (low - 0.5, low + 0.5)
            }
        };
        let (x0, x1) = span(&mut all().map(|p| p.0));
        let band = self.band.into_iter().flat_map(|b| [b.0, b.1]);
        let (y0, y1) = span(&mut all().map(|p| p.1).chain(band));
        let [left, top, right, bottom] = MARGIN;
        let (width, height) = (SIZE.0 - left - right, SIZE.1 - top - bottom);
        let sx = |x: f64| left + width * (x - x0) / (x1 - x0);
        let sy = |y: f64| top + height * (1.0 - (y - y0) / (y1 - y0));
        let mut out = format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {} {}\" \
             font-family=\"sans-serif\" font-size=\"11\">\n\
             <rect width=\"100%\" height=\"100%\" fill=\"#fff\"/>\n",
            SIZE.0, SIZE.1
        );
        if let Some((low, high)) = self.band {
            let _ = writeln!(
                out,
                "<rect x=\"{left}\" y=\"{:.1}\" width=\"{width}\" height=\"{:.1}\" \
                 fill=\"#dfeee6\"/>",
                sy(high),
                sy(low) - sy(high)
            );
        }
        let _ = writeln!(
            out,
            "<rect x=\"{left}\" y=\"{top}\" width=\"{width}\" height=\"{height}\" fill=\"none\" \
             stroke=\"#888\"/>"
        );
        for i in 0..=4 {
            let share = f64::from(i) / 4.0;
            let (x, y) = (x0 + share * (x1 - x0), y0 + share * (y1 - y0));
            let _ = writeln!(
                out,
                "<text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"middle\">{}</text><text x=\"{:.1}\" \
                 y=\"{:.1}\" text-anchor=\"end\">{}</text>",
                sx(x),
                SIZE.1 - bottom + 14.0,
                number(x, x1 - x0),
                left - 4.0,
                sy(y) + 4.0,
                number(y, y1 - y0)
            );
        }
        let (middle_x, middle_y) = (left + width / 2.0, top + height / 2.0);
        let _ = writeln!(
            out,
            "<text x=\"{middle_x}\" y=\"17\" text-anchor=\"middle\" font-size=\"13\">{}</text>\n\
             <text x=\"{middle_x}\" y=\"{}\" text-anchor=\"middle\">{}</text>\n\
             <text transform=\"translate(13 {middle_y}) rotate(-90)\" \
             text-anchor=\"middle\">{}</text>",
            escape(&self.title),
            SIZE.1 - 8.0,
            escape(&self.x),
            escape(&self.y)
        );
        for (i, series) in self.series.iter().enumerate() {
            let colour = COLOURS[i % COLOURS.len()];
            if series.line {
                let path: Vec<String> = series
                    .points
                    .iter()
                    .map(|(x, y)| format!("{:.1},{:.1}", sx(*x), sy(*y)))
                    .collect();
                let _ = writeln!(
                    out,
                    "<polyline points=\"{}\" fill=\"none\" stroke=\"{colour}\" \
                     stroke-width=\"1.5\"/>",
                    path.join(" ")
                );
            } else {
                // Dots are lines without length and with round ends, which take few bytes.
                let dot = |(x, y): &(f64, f64)| format!("M{:.0},{:.0}h0", sx(*x), sy(*y));
                let dots: String = series.points.iter().map(dot).collect();
                let _ = writeln!(
                    out,
                    "<path d=\"{dots}\" fill=\"none\" stroke=\"{colour}\" stroke-opacity=\"0.6\" \
                     stroke-width=\"3\" stroke-linecap=\"round\"/>"
                );
            }
            let _ = writeln!(
                out,
                "<text x=\"{}\" y=\"{}\" text-anchor=\"end\" fill=\"{colour}\">{}</text>",
                SIZE.0 - right - 5.0,
                top + 13.0 * (i as f64 + 1.0),
                escape(&series.name)
            );
        }
        out.push_str("</svg>\n");
        out
    }
}

/// A number with as many decimal places as the span needs.
fn number(value: f64, span: f64) -> String {
    let places = if span >= 20.0 {
        0
    } else if span >= 2.0 {
        1
    } else {
        2
    };
    format!("{value:.places$}")
}

fn escape(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;")
}
