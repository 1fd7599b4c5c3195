//! What all pictures share: colours, letters, headline, legend and axes.

use anyhow::Result;
use plotters::coord::Shift;
use plotters::coord::types::RangedCoordf64;
use plotters::prelude::*;
use plotters::series::DashedLineSeries;
use plotters::style::text_anchor::{HPos, Pos, VPos};

/// The command: Okabe and Ito's blue.
pub const COMMAND: RGBColor = RGBColor(0, 114, 178);
/// The tool, or what is without a prefilter: their vermillion.
pub const CONTRAST: RGBColor = RGBColor(213, 94, 0);
/// Limits and tolerances: their bluish green.
pub const LIMIT: RGBColor = RGBColor(0, 158, 115);
/// The programmed path and other backgrounds.
pub const BACKGROUND: RGBColor = RGBColor(190, 190, 190);
/// Letters.
pub const INK: RGBColor = RGBColor(40, 40, 40);
const FAINT: RGBColor = RGBColor(228, 228, 228);

/// Part of a picture.
pub type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;
/// Axes in a part of a picture.
pub type Chart<'a, 'b> =
    ChartContext<'a, SVGBackend<'b>, Cartesian2d<RangedCoordf64, RangedCoordf64>>;
/// A point of a chart.
pub type Point = (f64, f64);

/// Drawing units a pixel: the library draws in whole units, and lines in whole pixels
/// would go in steps.
pub const UNITS: u32 = 4;

const FONT: &str = "Helvetica, Arial, sans-serif";
const TITLE: u32 = 30 * UNITS;
const TEXT: u32 = 19 * UNITS;

/// Height of the headline with its second line and the legend.
const HEAD: u32 = 108 * UNITS;
/// Height of the words above a part of a picture.
const CAPTION: u32 = 30 * UNITS;
/// Space for the numbers and the name of an axis: X below, Y to the left.
const LABELS: (u32, u32) = (58 * UNITS, 74 * UNITS);
const MARGIN: u32 = 16 * UNITS;
const MARGIN_TOP: u32 = 4 * UNITS;

/// A line of a legend.
pub struct Entry<'a> {
    /// Colour of its stroke.
    pub colour: RGBColor,
    /// Width of its stroke.
    pub width: u32,
    /// Whether the stroke is dashed.
    pub dashed: bool,
    /// What it stands for.
    pub label: &'a str,
}

/// A line of a legend with a full stroke.
pub fn full(colour: RGBColor, width: u32, label: &str) -> Entry<'_> {
    Entry {
        colour,
        width,
        dashed: false,
        label,
    }
}

/// A line of a legend with a dashed stroke: a limit.
pub fn limit(label: &str) -> Entry<'_> {
    Entry {
        colour: LIMIT,
        width: 2,
        dashed: true,
        label,
    }
}

/// Draws a picture of that size in pixels.
pub fn picture(
    (width, height): (u32, u32),
    draw: impl FnOnce(&Area<'_>) -> Result<()>,
) -> Result<String> {
    let mut svg = String::new();
    let units = (width * UNITS, height * UNITS);
    {
        let root = SVGBackend::with_string(&mut svg, units).into_drawing_area();
        root.fill(&WHITE)?;
        draw(&root)?;
        root.present()?;
    }
    let drawn = format!(r#"width="{}" height="{}""#, units.0, units.1);
    let shown = format!(r#"width="{width}" height="{height}""#);
    Ok(svg.replacen(&drawn, &shown, 1))
}

/// Draws headline, second line and legend; yields what is left below.
pub fn headed<'a>(
    area: &Area<'a>,
    title: &str,
    subtitle: &str,
    legend: &[Entry<'_>],
) -> Result<Area<'a>> {
    let (head, body) = area.split_vertically(HEAD);
    let unit = UNITS as i32;
    let left = MARGIN as i32;
    head.draw_text(
        title,
        &style(TITLE).into_text_style(&head),
        (left, 14 * unit),
    )?;
    let text = style(TEXT).into_text_style(&head);
    head.draw_text(subtitle, &text, (left, 51 * unit))?;
    let mut x = left;
    let (stroke_y, text_y) = (91 * unit, 82 * unit);
    for entry in legend {
        let stroke = entry.colour.stroke_width(entry.width * UNITS);
        // (start, end) of each dash
        let dashes = match entry.dashed {
            true => vec![(0, 8), (13, 21), (26, 34)],
            false => vec![(0, 34)],
        };
        for (from, to) in dashes {
            let line = [(x + from * unit, stroke_y), (x + to * unit, stroke_y)];
            head.draw(&PathElement::new(line, stroke))?;
        }
        head.draw_text(entry.label, &text, (x + 42 * unit, text_y))?;
        x += (42 + 30 + entry.label.chars().count() as i32 * 9) * unit;
    }
    Ok(body)
}

/// Axes with their names; `ranges` is what they show.
pub fn axes<'a, 'b>(
    area: &'a Area<'b>,
    ranges: [(f64, f64); 2],
    names: [&str; 2],
    ticks: [usize; 2],
) -> Result<Chart<'a, 'b>> {
    let [(x0, x1), (y0, y1)] = ranges;
    let mut chart = ChartBuilder::on(area)
        .margin(MARGIN)
        .margin_top(MARGIN_TOP)
        .x_label_area_size(LABELS.0)
        .y_label_area_size(LABELS.1)
        .build_cartesian_2d(x0..x1, y0..y1)?;
    chart
        .configure_mesh()
        .light_line_style(TRANSPARENT)
        .bold_line_style(FAINT.stroke_width(UNITS))
        .axis_style(INK.mix(0.6).stroke_width(UNITS))
        .set_all_tick_mark_size(5 * UNITS)
        .label_style(style(TEXT))
        .axis_desc_style(style(TEXT))
        .x_desc(names[0])
        .y_desc(names[1])
        .x_labels(ticks[0])
        .y_labels(ticks[1])
        .x_label_formatter(&|value| number(*value))
        .y_label_formatter(&|value| number(*value))
        .draw()?;
    Ok(chart)
}

/// Units that [`axes`] leaves for the plot.
pub fn plot_size(area: &Area<'_>) -> (f64, f64) {
    let (width, height) = area.dim_in_pixel();
    let taken = (LABELS.1 + 2 * MARGIN, LABELS.0 + MARGIN + MARGIN_TOP);
    (
        f64::from(width.saturating_sub(taken.0).max(1)),
        f64::from(height.saturating_sub(taken.1).max(1)),
    )
}

/// Draws full lines.
pub fn lines(
    chart: &mut Chart<'_, '_>,
    parts: impl IntoIterator<Item = Vec<Point>>,
    colour: impl Into<RGBAColor>,
    width: u32,
) -> Result<()> {
    let stroke = Into::<RGBAColor>::into(colour).stroke_width(width * UNITS);
    for part in parts {
        chart.draw_series(LineSeries::new(part, stroke))?;
    }
    Ok(())
}

/// Draws dashed lines.
pub fn dashed(
    chart: &mut Chart<'_, '_>,
    parts: impl IntoIterator<Item = Vec<Point>>,
    colour: RGBColor,
) -> Result<()> {
    for part in parts {
        let series =
            DashedLineSeries::new(part, 8 * UNITS, 5 * UNITS, colour.stroke_width(2 * UNITS));
        chart.draw_series(series)?;
    }
    Ok(())
}

/// Marks a point.
pub fn dot(chart: &mut Chart<'_, '_>, at: Point, colour: RGBColor) -> Result<()> {
    chart.draw_series([Circle::new(at, 4 * UNITS, colour.filled())])?;
    Ok(())
}

/// Writes beside a point, `offset` pixels away.
pub fn note(
    chart: &Chart<'_, '_>,
    text: &str,
    at: Point,
    offset: (i32, i32),
    colour: RGBColor,
) -> Result<()> {
    let offset = (offset.0 * UNITS as i32, offset.1 * UNITS as i32);
    let area = chart.plotting_area();
    let style = style(TEXT)
        .with_color(colour)
        .into_text_style(area)
        .pos(Pos::new(HPos::Center, VPos::Center));
    let text = EmptyElement::at(at) + Text::new(text.to_owned(), offset, style);
    area.draw(&text)?;
    Ok(())
}

/// Writes at the top of a part of a picture, in its middle.
pub fn caption<'a>(area: &Area<'a>, text: &str) -> Result<Area<'a>> {
    let (head, body) = area.split_vertically(CAPTION);
    let (width, _) = head.dim_in_pixel();
    let middle = (width + LABELS.1) as i32 / 2;
    let style = style(TEXT)
        .into_text_style(&head)
        .pos(Pos::new(HPos::Center, VPos::Top));
    head.draw_text(text, &style, (middle, 8 * UNITS as i32))?;
    Ok(body)
}

fn style(size: u32) -> TextStyle<'static> {
    (FONT, size).into_font().color(&INK)
}

/// A number of an axis, without needless zeros.
fn number(value: f64) -> String {
    let rounded = (value * 1e4).round() / 1e4;
    format!("{}", if rounded == 0.0 { 0.0 } else { rounded })
}
