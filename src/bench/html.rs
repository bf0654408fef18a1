//! The report as one HTML file that needs nothing else.

use std::fmt::Write as _;

use plotters::prelude::*;

use super::markup::escape;
use super::report::{Plot, Report, Table};

const STYLE: &str = "body{font:16px/1.5 system-ui,sans-serif;max-width:70em;margin:2em auto;padding:0 1em;color:#222}\
table{border-collapse:collapse;font-variant-numeric:tabular-nums;font-size:.85em}\
td,th{padding:.15em .7em;text-align:right;border-bottom:1px solid #ddd}\
td:first-child,th:first-child{text-align:left}\
.pass{color:#060}.short,.warning{color:#a00}svg{max-width:100%;height:auto}";

/// Size of a plot in SVG units.
const PLOT: (u32, u32) = (1000, 560);

/// The whole report as HTML with inline SVG.
pub fn to_html(report: &Report) -> String {
    let Report { benchmark, version, machine, backend, threads, .. } = report;
    let title = format!("lightmesh bench {benchmark}");
    let mut html = format!(
        "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><title>{title}</title>\
         <style>{STYLE}</style></head><body>\n<h1>{title}</h1>\n<p>lightmesh {}, {}, {threads} threads. {}</p>\n",
        escape(version),
        escape(backend),
        escape(&machine.to_string())
    );
    if machine.busy() {
        html.push_str(
            "<p class=\"warning\">Measured while the machine did other things: trust ratios only.</p>\n",
        );
    }
    if report.quick {
        html.push_str("<p class=\"warning\">Quick run: the numbers say nothing about speed.</p>\n");
    }
    if !report.goals.is_empty() {
        html.push_str("<h2>Goals</h2>\n<ul>\n");
        for goal in &report.goals {
            let class = if goal.pass { "pass" } else { "short" };
            // Writing to a string cannot fail.
            let _ = writeln!(html, "<li class=\"{class}\">{}</li>", escape(&goal.to_string()));
        }
        html.push_str("</ul>\n");
    }
    for plot in &report.plots {
        // A plot without points has no axes and is left out.
        if let Some(svg) = to_svg(plot) {
            let _ = writeln!(html, "<h2>{}</h2>\n{svg}", escape(&plot.title));
        }
    }
    for plot in &report.bars {
        if let Some(svg) = plot.to_svg() {
            let _ = writeln!(html, "<h2>{}</h2>\n{svg}", escape(&plot.title));
        }
    }
    for table in &report.tables {
        push_table(&mut html, table);
    }
    let failures = report.results.iter().flat_map(|results| &results.failures);
    let failures: Vec<String> =
        failures.map(|failure| format!("<li class=\"short\">{}</li>\n", escape(&failure.error))).collect();
    if !failures.is_empty() {
        let _ = writeln!(html, "<h2>Not measured</h2>\n<ul>\n{}</ul>", failures.concat());
    }
    html.push_str("<h2>Raw times</h2>\n<details><summary>All measurements in seconds</summary>\n");
    let raw = Table {
        title: String::new(),
        columns: ["measurement", "median", "all"].map(str::to_owned).to_vec(),
        rows: report
            .measurements
            .iter()
            .map(|one| {
                let all: Vec<String> = one.seconds.0.iter().map(|value| format!("{value:.5}")).collect();
                vec![one.name.clone(), format!("{:.5}", one.median), all.join(" ")]
            })
            .collect(),
    };
    push_table(&mut html, &raw);
    html.push_str("</details>\n</body></html>\n");
    html
}

fn push_table(html: &mut String, table: &Table) {
    if !table.title.is_empty() {
        let _ = writeln!(html, "<h2>{}</h2>", escape(&table.title));
    }
    html.push_str("<table>\n");
    for (line, cell) in
        std::iter::once((&table.columns, "th")).chain(table.rows.iter().map(|row| (row, "td")))
    {
        html.push_str("<tr>");
        for text in line {
            let _ = write!(html, "<{cell}>{}</{cell}>", escape(text));
        }
        html.push_str("</tr>\n");
    }
    html.push_str("</table>\n");
}

/// A plot with logarithmic axes; `None` where there is nothing to show.
fn to_svg(plot: &Plot) -> Option<String> {
    let points = || plot.series.iter().flat_map(|series| series.points.iter().copied()).filter(drawable);
    let range = |pick: fn((f64, f64)) -> f64| {
        let (low, high) = points()
            .map(pick)
            .fold((f64::INFINITY, 0.0), |(low, high): (f64, f64), value| (low.min(value), high.max(value)));
        // Room around the points, also where all are alike.
        low / 1.25..high * 1.25
    };
    points().next()?;
    let (x, y) = (range(|point| point.0), range(|point| point.1));
    let mut svg = String::new();
    draw(plot, &mut svg, (x, y)).ok()?;
    Some(svg)
}

/// Whether a point has a place on logarithmic axes.
fn drawable(&(x, y): &(f64, f64)) -> bool {
    x.is_finite() && y.is_finite() && x > 0.0 && y > 0.0
}

type Range = std::ops::Range<f64>;

fn draw(plot: &Plot, svg: &mut String, (x, y): (Range, Range)) -> Result<(), Box<dyn std::error::Error>> {
    let root = SVGBackend::with_string(svg, PLOT).into_drawing_area();
    root.fill(&WHITE)?;
    let mut chart = ChartBuilder::on(&root)
        .margin(12)
        .x_label_area_size(48)
        .y_label_area_size(70)
        .build_cartesian_2d(x.log_scale(), y.log_scale())?;
    chart
        .configure_mesh()
        .x_desc(&plot.x)
        .y_desc(&plot.y)
        .x_label_formatter(&|value| short(*value))
        .y_label_formatter(&|value| short(*value))
        .light_line_style(BLACK.mix(0.05))
        .draw()?;
    for (index, series) in plot.series.iter().enumerate() {
        let color = Palette99::pick(index).to_rgba();
        let points: Vec<(f64, f64)> = series.points.iter().copied().filter(drawable).collect();
        chart
            .draw_series(LineSeries::new(points, color.stroke_width(2)).point_size(3))?
            .label(&series.label)
            .legend(move |(x, y)| PathElement::new(vec![(x, y), (x + 18, y)], color.stroke_width(2)));
    }
    chart
        .configure_series_labels()
        .position(SeriesLabelPosition::UpperRight)
        .background_style(WHITE.mix(0.85))
        .border_style(BLACK.mix(0.3))
        .draw()?;
    root.present()?;
    Ok(())
}

/// A number with as many digits as an axis needs.
fn short(value: f64) -> String {
    match value {
        1e6.. => format!("{}M", value / 1e6),
        1e3..1e6 => format!("{}k", value / 1e3),
        _ => format!("{}", (value * 1e4).round() / 1e4),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bench::machine::Machine;
    use crate::bench::report::Series;

    /// The file refers to nothing outside of itself, and names can't break out into markup.
    #[test]
    fn the_report_is_self_contained_and_escaped() {
        let plot = |points| Plot {
            title: "a < b".to_owned(),
            x: "x".to_owned(),
            y: "y".to_owned(),
            series: vec![Series { label: "one".to_owned(), points }],
        };
        let report = Report {
            benchmark: "headline",
            version: "0",
            machine: Machine::here(),
            backend: "<script>".to_owned(),
            threads: 1,
            quick: true,
            measurements: Vec::new(),
            goals: Vec::new(),
            tables: vec![Table::new("t & u", &["a"])],
            bars: Vec::new(),
            curves: Vec::new(),
            adaptive: Vec::new(),
            results: None,
            plots: vec![plot(vec![(1.0, 2.0), (10.0, 0.5)]), plot(Vec::new()), plot(vec![(0.0, f64::NAN)])],
        };
        let html = to_html(&report);
        assert_eq!(html.matches("<svg").count(), 1, "plots without points are left out");
        assert!(html.contains("&lt;script&gt;") && html.contains("t &amp; u") && html.contains("a &lt; b"));
        assert!(!html.contains("src=") && !html.contains("href="));
    }
}
