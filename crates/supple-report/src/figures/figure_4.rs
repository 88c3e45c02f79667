//! Figure 4: torque components of shoulder pitch and elbow during the sinusoid.

use super::axis::Axis;
use super::canvas::draw_canvas;
use super::error::FigureError;
use super::panel::{Area, LegendSymbol, Margins, Panel, legend};
use super::style::{BLUE, GREEN, PURPLE, VERMILION, px};
use super::ticks::{Ticks, extent};
use plotters::style::RGBColor;
use supple_experiment::{Demo, JointTorque, Sample};

/// Name of a torque term, its colour, its value.
type Term = (&'static str, RGBColor, fn(&JointTorque) -> f64);

const TERMS: [Term; 4] = [
    ("gravity", PURPLE, |t| t.gravity),
    ("inertial", GREEN, |t| t.inertial),
    ("feedback", BLUE, |t| t.feedback),
    ("friction", VERMILION, |t| t.friction),
];

/// Samples of the sinusoid at the paper's speed (speed factor 1).
pub fn samples(demo: &Demo) -> &[Sample] {
    let paper = demo.sinusoids.iter().find(|(speed, _)| *speed == 1.0);
    paper.map_or(&[], |(_, run)| &run.trace.samples)
}

/// Draws the figure as SVG.
pub fn draw(samples: &[Sample]) -> Result<String, FigureError> {
    let alt_text = "Torque components of shoulder pitch and elbow over time: gravity, friction, \
                 inertial, feedback; below the same without gravity";
    draw_canvas((760, 470), alt_text, |area| {
        let (head, body) = area.split_vertically(px(24.0));
        let entries = TERMS.map(|(name, colour, _)| (name, LegendSymbol::Line(2.0), colour));
        legend(&head, (170.0, 13.0), &entries)?;
        let (with_gravity, without_gravity) = body.split_vertically(px(235.0));
        let names = ["(a)  shoulder pitch, joint 2", "(b)  elbow, joint 3"];
        for (joint, (upper, lower)) in halves(&with_gravity)
            .iter()
            .zip(&halves(&without_gravity))
            .enumerate()
        {
            panel(upper, names[joint], samples, joint, &TERMS)?;
            panel(
                lower,
                "the same without gravity",
                samples,
                joint,
                &TERMS[1..],
            )?;
        }
        Ok(())
    })
}

fn halves<'a>(area: &Area<'a>) -> [Area<'a>; 2] {
    let (left, right) = area.split_horizontally(px(380.0));
    [left, right]
}

fn panel(
    area: &Area<'_>,
    title: &str,
    samples: &[Sample],
    joint: usize,
    terms: &[Term],
) -> Result<(), FigureError> {
    let values = samples.iter().flat_map(|s| {
        terms
            .iter()
            .map(move |(_, _, value)| value(&s.torques[joint]))
    });
    let range = extent(values.chain([0.0]));
    let end = samples.last().map_or(1.0, |s| s.time_s.floor());
    let mut panel = Panel::new(
        area,
        title,
        Margins::default(),
        &Axis::new("time [s]", Ticks::stepped(0.0..end, 4.0)),
        &Axis::new("torque [N m]", Ticks::around(range, 5)),
    )?;
    for (_, colour, value) in terms {
        let curve = samples.iter().map(|s| (s.time_s, value(&s.torques[joint])));
        panel.line(curve, *colour, 1.6)?;
    }
    Ok(())
}
