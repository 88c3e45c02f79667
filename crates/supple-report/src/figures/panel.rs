//! A panel: one pair of axes and its contents. Only this module uses the chart API of the drawing library.

use super::axis::{Axis, Scale};
use super::error::FigureError;
use super::style::{self, GRID, TEXT_COLOUR, TEXT_PX, px, stroke, text};
use plotters::chart::ChartContext;
use plotters::coord::Shift;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, VPos};
use std::ops::Range;

/// A part of a figure.
pub type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;
type Axes = Cartesian2d<Scale, Scale>;

/// Distance between the edge and the label of the y axis \[px\].
const EDGE_PX: f64 = 4.0;

/// Margins around the axes \[px\].
#[derive(Clone, Copy, Debug)]
pub struct Margins {
    /// Margin above the axes.
    pub top: f64,
    /// Margin to the right.
    pub right: f64,
    /// Margin below, for the labels of x.
    pub bottom: f64,
    /// Margin to the left, for the labels of y.
    pub left: f64,
}

impl Margins {
    /// Returns the size of the axes on an area of the given size \[px\].
    pub fn axes_px(&self, width_px: f64, height_px: f64) -> (f64, f64) {
        (
            width_px - EDGE_PX - self.left - self.right,
            height_px - self.top - self.bottom,
        )
    }
}

impl Default for Margins {
    fn default() -> Margins {
        Margins {
            top: 26.0,
            right: 16.0,
            bottom: 38.0,
            left: 54.0,
        }
    }
}

/// Axes on an area, with drawing functions.
pub struct Panel<'a, 'b> {
    chart: ChartContext<'a, SVGBackend<'b>, Axes>,
    x: Range<f64>,
    y: Range<f64>,
}

impl<'a, 'b> Panel<'a, 'b> {
    /// Draws grid, axes and title.
    pub fn new(
        area: &'a Area<'b>,
        title: &str,
        margins: Margins,
        x: &Axis<'_>,
        y: &Axis<'_>,
    ) -> Result<Self, FigureError> {
        let (x_range, y_range) = (x.scale.range(), y.scale.range());
        let mut chart = ChartBuilder::on(area)
            .margin_top(px(margins.top))
            .margin_left(px(EDGE_PX))
            .margin_right(px(margins.right))
            .x_label_area_size(px(margins.bottom))
            .y_label_area_size(px(margins.left))
            .build_cartesian_2d(x.scale.clone(), y.scale.clone())?;
        let label = text(TEXT_PX - 1.0, TEXT_COLOUR, HPos::Center, VPos::Center);
        chart
            .configure_mesh()
            .light_line_style(TRANSPARENT)
            .bold_line_style(stroke(GRID, 0.8))
            .axis_style(stroke(TEXT_COLOUR, 0.9))
            .set_all_tick_mark_size(px(3.5))
            .label_style(label)
            .axis_desc_style(text(TEXT_PX, TEXT_COLOUR, HPos::Center, VPos::Center))
            .x_desc(x.label)
            .y_desc(y.label)
            .draw()?;
        let at = (px(margins.left + EDGE_PX), px(margins.top - 8.0));
        area.draw_text(
            title,
            &text(TEXT_PX + 0.5, TEXT_COLOUR, HPos::Left, VPos::Bottom),
            at,
        )?;
        Ok(Panel {
            chart,
            x: x_range,
            y: y_range,
        })
    }

    /// Draws a curve; points outside the panel's range of x are omitted.
    pub fn line(
        &mut self,
        points: impl IntoIterator<Item = (f64, f64)>,
        colour: RGBColor,
        width_px: f64,
    ) -> Result<(), FigureError> {
        let x = self.x.clone();
        let inside = points
            .into_iter()
            .filter(move |(value, _)| x.start <= *value && *value <= x.end);
        self.chart
            .draw_series(LineSeries::new(inside, stroke(colour, width_px)))?;
        Ok(())
    }

    /// Draws marks; points outside the panel's range of x are omitted.
    pub fn marks(
        &mut self,
        points: &[(f64, f64)],
        mark: Mark,
        colour: RGBColor,
    ) -> Result<(), FigureError> {
        let inside = |(x, _): &&(f64, f64)| self.x.start <= *x && *x <= self.x.end;
        for point in points.iter().filter(inside) {
            let (area, at) = self.pixel_of(*point);
            mark.draw_at(&area, at, colour)?;
        }
        Ok(())
    }

    /// Draws a vertical line through the panel.
    pub fn vertical(&mut self, at: f64, colour: RGBColor) -> Result<(), FigureError> {
        let y = self.y.clone();
        self.line([(at, y.start), (at, y.end)], colour, 1.0)
    }

    /// Draws a horizontal line through the panel.
    pub fn horizontal(
        &mut self,
        at: f64,
        colour: RGBColor,
        width_px: f64,
    ) -> Result<(), FigureError> {
        let x = self.x.clone();
        self.line([(x.start, at), (x.end, at)], colour, width_px)
    }

    /// Draws a bar from zero.
    pub fn bar(&mut self, x: Range<f64>, to: f64, colour: RGBColor) -> Result<(), FigureError> {
        let bar = Rectangle::new([(x.start, to), (x.end, 0.0)], style::fill(colour, 1.0));
        self.chart.plotting_area().draw(&bar)?;
        Ok(())
    }

    /// Shades an interval of x.
    pub fn band(&mut self, from: f64, to: f64) -> Result<(), FigureError> {
        let (from, to) = (from.max(self.x.start), to.min(self.x.end));
        if from < to {
            let corners = [(from, self.y.end), (to, self.y.start)];
            let band = Rectangle::new(corners, style::fill(style::REFERENCE, 0.18));
            self.chart.plotting_area().draw(&band)?;
        }
        Ok(())
    }

    /// Draws a label at a point, moved by an offset in displayed pixels.
    pub fn note(
        &mut self,
        label: &str,
        at: (f64, f64),
        offset_px: (f64, f64),
        h: HPos,
        colour: RGBColor,
    ) -> Result<(), FigureError> {
        let style = text(TEXT_PX - 1.0, colour, h, VPos::Center);
        let (area, (x, y)) = self.pixel_of(at);
        area.draw_text(label, &style, (x + px(offset_px.0), y + px(offset_px.1)))?;
        Ok(())
    }

    /// Converts a point in axis coordinates to a pixel of the plotting area.
    fn pixel_of(&self, point: (f64, f64)) -> (Area<'b>, (i32, i32)) {
        let area = self.chart.plotting_area();
        let (x, y) = area.map_coordinate(&point);
        let (x0, y0) = area.get_base_pixel();
        (area.strip_coord_spec(), (x - x0, y - y0))
    }

    /// Range of y.
    pub fn y(&self) -> Range<f64> {
        self.y.clone()
    }
}

/// Shape of a point.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mark {
    /// Disc.
    Dot,
    /// Square.
    Square,
    /// Triangle, point up.
    Triangle,
}

impl Mark {
    fn outline(self) -> Vec<(i32, i32)> {
        let r = px(4.2);
        match self {
            Mark::Square => vec![(-r, -r), (r, -r), (r, r), (-r, r)],
            _ => vec![(0, -r - px(0.6)), (r + px(0.4), r), (-r - px(0.4), r)],
        }
    }

    fn draw_at(self, area: &Area<'_>, at: (i32, i32), colour: RGBColor) -> Result<(), FigureError> {
        match self {
            Mark::Dot => area.draw(&Circle::new(at, px(4.2), style::fill(colour, 1.0)))?,
            _ => {
                let corners = self.outline();
                let corners: Vec<_> = corners.iter().map(|c| (at.0 + c.0, at.1 + c.1)).collect();
                area.draw(&Polygon::new(corners, style::fill(colour, 1.0)))?;
            }
        }
        Ok(())
    }
}

/// Symbol of a legend entry.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum LegendSymbol {
    /// Line of a width \[px\].
    Line(f64),
    /// Mark.
    Mark(Mark),
}

/// Draws a row of legend entries that starts at a point of the area \[px\].
pub fn legend(
    area: &Area<'_>,
    start_px: (f64, f64),
    entries: &[(&str, LegendSymbol, RGBColor)],
) -> Result<(), FigureError> {
    let (mut x, y) = start_px;
    for (label, key, colour) in entries {
        match key {
            LegendSymbol::Line(width_px) => {
                let ends = vec![(px(x), px(y)), (px(x + 20.0), px(y))];
                area.draw(&PathElement::new(ends, stroke(*colour, *width_px)))?;
            }
            LegendSymbol::Mark(mark) => mark.draw_at(area, (px(x + 12.0), px(y)), *colour)?,
        }
        let at = (px(x + 26.0), px(y));
        area.draw_text(
            label,
            &text(TEXT_PX - 0.5, TEXT_COLOUR, HPos::Left, VPos::Center),
            at,
        )?;
        x += 26.0 + width_px(label, TEXT_PX - 0.5) + 18.0;
    }
    Ok(())
}

/// Width of a label, estimated from the mean letter width of the embedded font.
fn width_px(label: &str, size_px: f64) -> f64 {
    0.53 * size_px * label.chars().count() as f64
}
