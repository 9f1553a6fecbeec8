//! Plots of scores, as SVG files.

use super::scores::Histogram;
use plotters::prelude::*;
use skep::io::write_file;
use skep::{Error, Result};
use std::io::Write;
use std::path::Path;

/// Width and height in pixels.
const SIZE: (u32, u32) = (720, 440);
/// Colors of up to three series, which differ in lightness too.
const COLORS: [RGBColor; 3] = [RGBColor(31, 119, 180), RGBColor(214, 120, 20), RGBColor(60, 60, 60)];
const FONT: &str = "sans-serif";
/// Names of views below bars.
const MOST_NAMES: usize = 40;

/// A named line or row of bars.
pub struct Series<'a, T> {
    pub name: &'a str,
    pub values: Vec<T>,
}

type Drawn = std::result::Result<(), Box<dyn std::error::Error>>;

/// Lines over a logarithmic axis, with values from 0 to 1.
pub fn curves(path: &Path, title: &str, x_label: &str, series: &[Series<(f64, f64)>]) -> Result<()> {
    draw(path, |area| {
        let places = || series.iter().flat_map(|series| series.values.iter().map(|(x, _)| *x));
        let (least, most) = (places().fold(f64::INFINITY, f64::min), places().fold(0.0, f64::max));
        let mut chart = ChartBuilder::on(&area)
            .caption(title, (FONT, 18))
            .margin(14)
            .x_label_area_size(40)
            .y_label_area_size(48)
            .build_cartesian_2d((least..most.max(2.0 * least)).log_scale(), 0.0..1.0)?;
        chart.configure_mesh().x_desc(x_label).light_line_style(WHITE).draw()?;
        for (series, color) in series.iter().zip(COLORS) {
            chart
                .draw_series(LineSeries::new(series.values.iter().copied(), color.stroke_width(2)))?
                .label(series.name)
                .legend(move |(x, y)| PathElement::new([(x, y), (x + 16, y)], color.stroke_width(2)));
        }
        chart
            .configure_series_labels()
            .position(SeriesLabelPosition::UpperLeft)
            .background_style(WHITE.mix(0.8))
            .draw()?;
        Ok(area.present()?)
    })
}

/// The share of the values in each bin.
pub fn histogram(path: &Path, title: &str, x_label: &str, histogram: &Histogram) -> Result<()> {
    draw(path, |area| {
        let bins = histogram.counts.len();
        let total = histogram.counts.iter().sum::<u64>().max(1) as f64;
        let shares: Vec<f64> = histogram.counts.iter().map(|count| *count as f64 / total).collect();
        let most = shares.iter().copied().fold(0.01, f64::max) * 1.05;
        let ends = histogram.first()..histogram.end(bins - 1);
        let mut chart = ChartBuilder::on(&area)
            .caption(title, (FONT, 18))
            .margin(14)
            .x_label_area_size(40)
            .y_label_area_size(48)
            .build_cartesian_2d(ends.log_scale(), 0.0..most)?;
        chart.configure_mesh().x_desc(x_label).disable_x_mesh().light_line_style(WHITE).draw()?;
        chart.draw_series(shares.iter().enumerate().map(|(bin, share)| {
            let start = if bin == 0 { histogram.first() } else { histogram.end(bin - 1) };
            Rectangle::new([(start, 0.0), (histogram.end(bin), *share)], COLORS[0].filled())
        }))?;
        Ok(area.present()?)
    })
}

/// Bars for each view, beside each other, with values from 0 to 1.
pub fn bars(path: &Path, title: &str, names: &[&str], series: &[Series<f64>]) -> Result<()> {
    draw(path, |area| {
        let views = names.len();
        // The legend lies above the bars, the names below them.
        let mut chart = ChartBuilder::on(&area)
            .caption(title, (FONT, 18))
            .margin(14)
            .x_label_area_size(120)
            .y_label_area_size(48)
            .build_cartesian_2d(0.0..views as f64, 0.0..1.25)?;
        chart.configure_mesh().disable_x_mesh().light_line_style(WHITE).x_labels(0).draw()?;
        let width = 0.8 / series.len() as f64;
        for (index, (series, color)) in series.iter().zip(COLORS).enumerate() {
            let rectangle = |(view, value): (usize, &f64)| {
                let start = view as f64 + 0.1 + width * index as f64;
                Rectangle::new([(start, 0.0), (start + width, *value)], color.filled())
            };
            chart
                .draw_series(series.values.iter().enumerate().map(rectangle))?
                .label(series.name)
                .legend(move |(x, y)| Rectangle::new([(x, y - 4), (x + 16, y + 4)], color.filled()));
        }
        let style = (FONT, 11).into_font().transform(FontTransform::Rotate90);
        // Of many views some names.
        let labels = names.iter().enumerate().step_by(views.div_ceil(MOST_NAMES));
        let label = |(view, name): (usize, &&str)| {
            Text::new((*name).to_owned(), (view as f64 + 0.6, -0.03), style.clone())
        };
        chart.draw_series(labels.map(label))?;
        chart
            .configure_series_labels()
            .position(SeriesLabelPosition::UpperRight)
            .background_style(WHITE.mix(0.8))
            .draw()?;
        Ok(area.present()?)
    })
}

/// Draws into a text, then writes the file.
fn draw(
    path: &Path,
    body: impl FnOnce(DrawingArea<SVGBackend<'_>, plotters::coord::Shift>) -> Drawn,
) -> Result<()> {
    let mut text = String::new();
    let area = SVGBackend::with_string(&mut text, SIZE).into_drawing_area();
    let drawn = area.fill(&WHITE).map_err(Into::into).and_then(|()| body(area));
    drawn.map_err(|error| Error::file(path, format!("cannot be drawn: {error}")))?;
    write_file(path, |out| out.write_all(text.as_bytes()))
}
