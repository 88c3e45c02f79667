//! Figure 3a: the tip along x over time, its error, and the error at other paces.

use super::axis::Axis;
use super::panel::{Key, Panel, Room, legend};
use super::style::{BLUE, GREEN, PURPLE, REFERENCE, VERMILION};
use super::ticks::{Ticks, extent};
use super::{FigureError, distance, mm, sheet};
use plotters::style::RGBColor;
use supple_core::trajectory::Sinusoid;
use supple_experiment::{Demo, Sample};

/// Runs of the sinusoid.
pub struct Paces<'a> {
    /// At the paper's pace.
    pub paper: &'a [Sample],
    /// Pace and run, all of them.
    pub all: Vec<(f64, &'a [Sample])>,
}

impl<'a> Paces<'a> {
    /// Of a demo.
    pub fn of(demo: &'a Demo) -> Paces<'a> {
        let all: Vec<_> = demo
            .sinusoids
            .iter()
            .map(|(pace, run)| (*pace, run.trace.samples.as_slice()))
            .collect();
        let paper = all.iter().find(|(pace, _)| *pace == 1.0);
        Paces {
            paper: paper.map_or(&[], |(_, samples)| samples),
            all,
        }
    }
}

/// The SVG.
pub fn draw(paces: &Paces<'_>) -> Result<String, FigureError> {
    let words = "Tip along x over time for the sinusoid, its error, and the error at three paces";
    sheet((760, 640), words, |area| {
        let (position, rest) = area.split_vertically(super::style::px(235.0));
        let (components, by_pace) = rest.split_vertically(super::style::px(195.0));
        let time = time_ticks(paces.paper);

        let x = |s: &Sample| [s.reference_m[0], s.tip_m[0]];
        let y_ticks = Ticks::around(extent(paces.paper.iter().flat_map(x)), 5);
        let mut panel = Panel::new(
            &position,
            "(i)  reference and actual tip, K = 5 N/m, B = 1.5 N s/m",
            Room::default(),
            &Axis::new("time [s]", time.clone()),
            &Axis::new("x [m]", y_ticks),
        )?;
        panel.line(
            paces.paper.iter().map(|s| (s.time_s, s.reference_m[0])),
            REFERENCE,
            5.0,
        )?;
        panel.line(
            paces.paper.iter().map(|s| (s.time_s, s.tip_m[0])),
            BLUE,
            1.6,
        )?;
        legend(
            &position,
            (560.0, 14.0),
            &[
                ("reference", Key::Line(5.0), REFERENCE),
                ("actual", Key::Line(1.6), BLUE),
            ],
        )?;

        let error = |s: &Sample, axis: usize| mm(s.tip_m[axis] - s.reference_m[axis]);
        let all = paces
            .paper
            .iter()
            .flat_map(|s| [0, 1, 2].map(|axis| error(s, axis)));
        let mut panel = Panel::new(
            &components,
            "(ii)  its error, by component",
            Room::default(),
            &Axis::new("time [s]", time),
            &Axis::new("error [mm]", Ticks::around(extent(all), 4)),
        )?;
        for (axis, colour) in [(1, GREEN), (2, VERMILION), (0, BLUE)] {
            panel.line(
                paces.paper.iter().map(|s| (s.time_s, error(s, axis))),
                colour,
                1.4,
            )?;
        }
        legend(
            &components,
            (590.0, 14.0),
            &[
                ("x", Key::Line(1.6), BLUE),
                ("y", Key::Line(1.6), GREEN),
                ("z", Key::Line(1.6), VERMILION),
            ],
        )?;

        let off = |s: &Sample| mm(distance(&s.tip_m, &s.reference_m));
        let all = paces
            .all
            .iter()
            .flat_map(|(_, samples)| samples.iter().map(off));
        let greatest = extent(all).end;
        let periods = |pace: f64, s: &Sample| s.time_s / Sinusoid::paper(pace).period_s();
        let mut panel = Panel::new(
            &by_pace,
            "(iii)  distance from the reference at three paces",
            Room::default(),
            &Axis::new(
                "time [periods]",
                Ticks::stepped(0.0..last(paces, periods), 0.25),
            ),
            &Axis::new("distance [mm]", Ticks::around(0.0..1.05 * greatest, 4)),
        )?;
        let colours: [RGBColor; 3] = [GREEN, BLUE, PURPLE];
        let mut entries = Vec::new();
        for ((pace, samples), colour) in paces.all.iter().zip(colours.into_iter().cycle()) {
            panel.line(
                samples.iter().map(|s| (periods(*pace, s), off(s))),
                colour,
                1.4,
            )?;
            entries.push((format!("{pace} \u{d7}"), colour));
        }
        let entries: Vec<_> = entries
            .iter()
            .map(|(label, colour)| (label.as_str(), Key::Line(1.6), *colour))
            .collect();
        legend(&by_pace, (520.0, 14.0), &entries)
    })
}

fn time_ticks(samples: &[Sample]) -> Ticks {
    Ticks::stepped(0.0..samples.last().map_or(1.0, |s| s.time_s.floor()), 2.0)
}

fn last(paces: &Paces<'_>, periods: impl Fn(f64, &Sample) -> f64) -> f64 {
    let ends = paces
        .all
        .iter()
        .filter_map(|(pace, samples)| samples.last().map(|s| periods(*pace, s)));
    ends.fold(0.25, f64::max).floor().max(0.25)
}
