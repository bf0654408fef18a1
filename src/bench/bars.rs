//! Bars in SVG, one below the other, so that names of any length have room.

use std::fmt::Write as _;

use super::markup::escape;

/// Bars of one kind.
#[derive(Clone, Debug)]
pub struct BarPlot {
    /// What it shows.
    pub title: String,
    /// What the parts of a bar are.
    pub series: Vec<String>,
    /// What lengths mean.
    pub scale: Scale,
    /// The bars from top to bottom.
    pub bars: Vec<Bar>,
}

/// One bar.
#[derive(Clone, Debug)]
pub struct Bar {
    /// Its name, to the left.
    pub label: String,
    /// Its parts, one per series.
    pub parts: Vec<f64>,
    /// Its value in words, to the right.
    pub text: String,
}

/// What the lengths of bars mean.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Scale {
    /// Parts from 0 to 1 follow one another; so does the whole bar.
    Share,
    /// The one part is a ratio; the bar goes from 1 to it, logarithmically.
    Ratio,
}

/// Width of the plot, of the names to the left and of the values to the right, SVG units.
const WIDTH: f64 = 1000.0;
const LABELS: f64 = 380.0;
const TEXTS: f64 = 90.0;
/// Height of a bar with the space below it.
const ROW: f64 = 22.0;
/// Names are cut to their last characters, which tell scenes of one folder apart.
const LABEL_CHARACTERS: usize = 52;

const COLOURS: [&str; 4] = ["#4878a8", "#e49444", "#6a9f58", "#a87c9f"];

impl BarPlot {
    /// The bars as SVG; `None` where there is nothing to show.
    pub fn to_svg(&self) -> Option<String> {
        if self.bars.is_empty() {
            return None;
        }
        let (low, high) = self.range();
        let place = |value: f64| {
            let share = ((value - low) / (high - low)).clamp(0.0, 1.0);
            LABELS + share * (WIDTH - LABELS - TEXTS)
        };
        let rows = self.bars.len() + 1;
        let mut svg = format!(
            "<svg viewBox=\"0 0 {WIDTH} {:.0}\" xmlns=\"http://www.w3.org/2000/svg\" font-family=\"sans-serif\" \
             font-size=\"13\">\n",
            ROW * rows as f64
        );
        // Writing to a string cannot fail.
        if self.series.len() > 1 {
            for (index, series) in self.series.iter().enumerate() {
                let x = LABELS + 120.0 * index as f64;
                let (colour, name) = (COLOURS[index % COLOURS.len()], escape(series));
                let _ = writeln!(
                    svg,
                    "<rect x=\"{x}\" y=\"4\" width=\"12\" height=\"12\" fill=\"{colour}\"/>\
                     <text x=\"{}\" y=\"15\">{name}</text>",
                    x + 18.0
                );
            }
        }
        for (index, bar) in self.bars.iter().enumerate() {
            let top = ROW * (index + 1) as f64;
            let baseline = top + 14.0;
            let _ = writeln!(
                svg,
                "<text x=\"{}\" y=\"{baseline}\" text-anchor=\"end\">{}</text>",
                LABELS - 8.0,
                escape(&ending(&bar.label))
            );
            let mut end = place(0.0);
            for (part, (from, to)) in self.spans(bar).into_iter().enumerate() {
                let (from, to) = (place(from), place(to));
                end = end.max(from).max(to);
                let _ = writeln!(
                    svg,
                    "<rect x=\"{:.1}\" y=\"{top}\" width=\"{:.1}\" height=\"{}\" fill=\"{}\"/>",
                    from.min(to),
                    (from - to).abs(),
                    ROW - 6.0,
                    COLOURS[part % COLOURS.len()]
                );
            }
            let text = escape(&bar.text);
            let _ = writeln!(svg, "<text x=\"{:.1}\" y=\"{baseline}\">{text}</text>", end + 6.0);
        }
        let zero = place(0.0);
        let _ = writeln!(
            svg,
            "<line x1=\"{zero:.1}\" y1=\"{ROW}\" x2=\"{zero:.1}\" y2=\"{:.0}\" stroke=\"#222\"/>\n</svg>",
            ROW * rows as f64
        );
        Some(svg)
    }

    /// Where the parts of a bar begin and end; those without a value are left out.
    fn spans(&self, bar: &Bar) -> Vec<(f64, f64)> {
        match self.scale {
            Scale::Ratio => {
                let drawable = |ratio: &&f64| ratio.is_finite() && **ratio > 0.0;
                bar.parts.iter().filter(drawable).take(1).map(|ratio| (0.0, ratio.ln())).collect()
            }
            Scale::Share => {
                let mut end = 0.0;
                let parts = bar.parts.iter().map(|part| if part.is_finite() { part.max(0.0) } else { 0.0 });
                let span = |part: f64| {
                    let from = end;
                    end += part;
                    (from, end)
                };
                parts.map(span).collect()
            }
        }
    }

    /// The least and the largest end of a bar, 0 and something above it included.
    fn range(&self) -> (f64, f64) {
        let ends = || self.bars.iter().flat_map(|bar| self.spans(bar)).map(|(_, end)| end);
        let low = ends().fold(0.0, f64::min);
        let high = ends().fold(0.0, f64::max);
        (low, if high > low { high } else { low + 1.0 })
    }
}

/// The last characters of a name.
fn ending(name: &str) -> String {
    let count = name.chars().count();
    if count <= LABEL_CHARACTERS {
        return name.to_owned();
    }
    std::iter::once('…').chain(name.chars().skip(count + 1 - LABEL_CHARACTERS)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plot(scale: Scale, bars: &[&[f64]]) -> BarPlot {
        let bar =
            |parts: &&[f64]| Bar { label: "<a>".to_owned(), parts: parts.to_vec(), text: "&".to_owned() };
        let series = ["one", "two"].map(str::to_owned).to_vec();
        BarPlot { title: String::new(), series, scale, bars: bars.iter().map(bar).collect() }
    }

    /// A ratio and its inverse reach equally far to both sides of 1; parts of a share follow one another.
    #[test]
    fn bars_begin_where_their_scale_does() {
        let ratios = plot(Scale::Ratio, &[&[4.0], &[0.25], &[f64::NAN], &[0.0]]);
        let ends: Vec<_> = ratios.bars.iter().map(|bar| ratios.spans(bar)).collect();
        assert_eq!(ends[0][0].1, -ends[1][0].1);
        assert!(ends[2].is_empty() && ends[3].is_empty());
        let shares = plot(Scale::Share, &[&[0.25, 0.5]]);
        assert_eq!(shares.spans(&shares.bars[0]), [(0.0, 0.25), (0.25, 0.75)]);
    }

    /// No name becomes markup, no number that isn't one is drawn, and no bars are no plot.
    #[test]
    fn any_bars_can_be_drawn() {
        for bars in [&[&[f64::NAN, f64::INFINITY][..]][..], &[&[1.0]], &[&[0.0, 0.0], &[]]] {
            for scale in [Scale::Ratio, Scale::Share] {
                let svg = plot(scale, bars).to_svg().unwrap();
                assert!(!svg.contains("NaN") && !svg.contains("inf"), "{svg}");
                assert!(svg.contains("&lt;a&gt;") && svg.contains("&amp;"));
            }
        }
        assert_eq!(plot(Scale::Share, &[]).to_svg(), None);
    }

    /// What is cut from a long name is its beginning.
    #[test]
    fn long_names_keep_their_end() {
        let name = format!("{}/scene.toml", "é".repeat(60));
        assert_eq!(ending(&name).chars().count(), LABEL_CHARACTERS);
        assert!(ending(&name).ends_with("é/scene.toml"));
        assert_eq!(ending("scene.toml"), "scene.toml");
    }
}
