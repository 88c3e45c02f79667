//! A panel: one pair of axes and what is drawn in it. The only place that speaks the drawing library's
//! language of charts; figures say what is in them.

use super::FigureError;
use super::axis::{Axis, Scale};
use super::style::{self, GRID, INK, TEXT_PX, px, stroke, text};
use plotters::chart::ChartContext;
use plotters::coord::Shift;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, VPos};
use std::ops::Range;

/// A part of a figure.
pub type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;
type Axes = Cartesian2d<Scale, Scale>;

/// Between the edge and the name of the y axis \[px\].
const EDGE_PX: f64 = 4.0;

/// Room around the axes \[px\].
#[derive(Clone, Copy, Debug)]
pub struct Room {
    /// Above.
    pub top: f64,
    /// To the right.
    pub right: f64,
    /// Below, for the labels of x.
    pub bottom: f64,
    /// To the left, for the labels of y.
    pub left: f64,
}

impl Room {
    /// Size of the axes on an area of a size \[px\].
    pub fn axes_px(&self, width_px: f64, height_px: f64) -> (f64, f64) {
        (
            width_px - EDGE_PX - self.left - self.right,
            height_px - self.top - self.bottom,
        )
    }
}

impl Default for Room {
    fn default() -> Room {
        Room {
            top: 26.0,
            right: 16.0,
            bottom: 38.0,
            left: 54.0,
        }
    }
}

/// Axes on an area, ready to be drawn in.
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
        room: Room,
        x: &Axis<'_>,
        y: &Axis<'_>,
    ) -> Result<Self, FigureError> {
        let (x_range, y_range) = (x.scale.range(), y.scale.range());
        let mut chart = ChartBuilder::on(area)
            .margin_top(px(room.top))
            .margin_left(px(EDGE_PX))
            .margin_right(px(room.right))
            .x_label_area_size(px(room.bottom))
            .y_label_area_size(px(room.left))
            .build_cartesian_2d(x.scale.clone(), y.scale.clone())?;
        let label = text(TEXT_PX - 1.0, INK, HPos::Center, VPos::Center);
        chart
            .configure_mesh()
            .light_line_style(TRANSPARENT)
            .bold_line_style(stroke(GRID, 0.8))
            .axis_style(stroke(INK, 0.9))
            .set_all_tick_mark_size(px(3.5))
            .label_style(label)
            .axis_desc_style(text(TEXT_PX, INK, HPos::Center, VPos::Center))
            .x_desc(x.label)
            .y_desc(y.label)
            .draw()?;
        let at = (px(room.left + EDGE_PX), px(room.top - 8.0));
        area.draw_text(
            title,
            &text(TEXT_PX + 0.5, INK, HPos::Left, VPos::Bottom),
            at,
        )?;
        Ok(Panel {
            chart,
            x: x_range,
            y: y_range,
        })
    }

    /// A curve; points out of the panel's range of x are left out.
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

    /// Marks; points out of the panel's range of x are left out.
    pub fn marks(
        &mut self,
        points: &[(f64, f64)],
        mark: Mark,
        colour: RGBColor,
    ) -> Result<(), FigureError> {
        let inside = |(x, _): &&(f64, f64)| self.x.start <= *x && *x <= self.x.end;
        for point in points.iter().filter(inside) {
            let (area, at) = self.place(*point);
            mark.draw_at(&area, at, colour)?;
        }
        Ok(())
    }

    /// A vertical line through the panel.
    pub fn vertical(&mut self, at: f64, colour: RGBColor) -> Result<(), FigureError> {
        let y = self.y.clone();
        self.line([(at, y.start), (at, y.end)], colour, 1.0)
    }

    /// A horizontal line through the panel.
    pub fn horizontal(
        &mut self,
        at: f64,
        colour: RGBColor,
        width_px: f64,
    ) -> Result<(), FigureError> {
        let x = self.x.clone();
        self.line([(x.start, at), (x.end, at)], colour, width_px)
    }

    /// A bar from zero.
    pub fn bar(&mut self, x: Range<f64>, to: f64, colour: RGBColor) -> Result<(), FigureError> {
        let bar = Rectangle::new([(x.start, to), (x.end, 0.0)], style::fill(colour, 1.0));
        self.chart.plotting_area().draw(&bar)?;
        Ok(())
    }

    /// A shaded stretch of x.
    pub fn band(&mut self, from: f64, to: f64) -> Result<(), FigureError> {
        let (from, to) = (from.max(self.x.start), to.min(self.x.end));
        if from < to {
            let corners = [(from, self.y.end), (to, self.y.start)];
            let band = Rectangle::new(corners, style::fill(style::REFERENCE, 0.18));
            self.chart.plotting_area().draw(&band)?;
        }
        Ok(())
    }

    /// Words at a point, moved by whole shown pixels.
    pub fn note(
        &mut self,
        words: &str,
        at: (f64, f64),
        offset_px: (f64, f64),
        h: HPos,
        colour: RGBColor,
    ) -> Result<(), FigureError> {
        let style = text(TEXT_PX - 1.0, colour, h, VPos::Center);
        let (area, (x, y)) = self.place(at);
        area.draw_text(words, &style, (x + px(offset_px.0), y + px(offset_px.1)))?;
        Ok(())
    }

    /// A point of the axes as a place on the area of the axes.
    fn place(&self, point: (f64, f64)) -> (Area<'b>, (i32, i32)) {
        let place = self.chart.plotting_area();
        let (x, y) = place.map_coordinate(&point);
        let (x0, y0) = place.get_base_pixel();
        (place.strip_coord_spec(), (x - x0, y - y0))
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
    /// Ring.
    Ring,
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
            Mark::Ring => area.draw(&Circle::new(at, px(4.2), stroke(colour, 1.6)))?,
            _ => {
                let corners = self.outline();
                let corners: Vec<_> = corners.iter().map(|c| (at.0 + c.0, at.1 + c.1)).collect();
                area.draw(&Polygon::new(corners, style::fill(colour, 1.0)))?;
            }
        }
        Ok(())
    }
}

/// How an entry of a legend looks.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Key {
    /// Line of a width \[px\].
    Line(f64),
    /// Mark.
    Mark(Mark),
}

/// A row of legend entries that starts at a point of the area \[px\].
pub fn legend(
    area: &Area<'_>,
    start_px: (f64, f64),
    entries: &[(&str, Key, RGBColor)],
) -> Result<(), FigureError> {
    let (mut x, y) = start_px;
    for (label, key, colour) in entries {
        match key {
            Key::Line(width_px) => {
                let ends = vec![(px(x), px(y)), (px(x + 20.0), px(y))];
                area.draw(&PathElement::new(ends, stroke(*colour, *width_px)))?;
            }
            Key::Mark(mark) => mark.draw_at(area, (px(x + 12.0), px(y)), *colour)?,
        }
        let at = (px(x + 26.0), px(y));
        area.draw_text(
            label,
            &text(TEXT_PX - 0.5, INK, HPos::Left, VPos::Center),
            at,
        )?;
        x += 26.0 + width_px(label, TEXT_PX - 0.5) + 18.0;
    }
    Ok(())
}

/// Width of words, from the mean width of the letters of the embedded face.
fn width_px(words: &str, size_px: f64) -> f64 {
    0.53 * size_px * words.chars().count() as f64
}
