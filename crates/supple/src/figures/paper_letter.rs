//! The law to the letter of (3.6): its error until the supervisor ends the run.

use super::axis::Axis;
use super::panel::{Key, Panel, Room, legend};
use super::style::{BLUE, INK, MUTED, REFERENCE, VERMILION};
use super::ticks::{Ticks, extent};
use super::{FigureError, distance, mm, sheet};
use plotters::style::text_anchor::HPos;
use supple_experiment::{Demo, Ended, Sample};

/// What is shown after the end \[s\].
const AFTER_S: f64 = 0.5;

/// The run and what it is compared with.
pub struct Letter<'a> {
    /// (3.6) to the letter.
    pub letter: &'a [Sample],
    /// How it ended, if early.
    pub ended: Option<&'a Ended>,
    /// The same sinusoid and the same model under the law that is used.
    pub used: &'a [Sample],
}

impl<'a> Letter<'a> {
    /// Of a demo.
    pub fn of(demo: &'a Demo) -> Letter<'a> {
        Letter {
            letter: &demo.paper_letter.trace.samples,
            ended: demo.paper_letter.ended.as_ref(),
            used: super::figure_4::samples(demo),
        }
    }
}

/// The SVG.
pub fn draw(runs: &Letter<'_>) -> Result<String, FigureError> {
    let words = "Distance from the reference over time under the law to the letter of (3.6), until \
                 the supervisor ends it, and under the law that is used";
    sheet((760, 330), words, |area| {
        let off = |s: &Sample| (s.time_s, mm(distance(&s.tip_m, &s.reference_m)));
        let whole_s = runs.letter.last().map_or(1.0, |s| s.time_s);
        let end_s = runs.ended.map_or(whole_s, |ended| ended.ended_s + AFTER_S);
        let shown = |s: &&Sample| s.time_s <= end_s;
        let all = runs.letter.iter().chain(runs.used.iter().filter(shown));
        let greatest = extent(all.map(|s| off(s).1)).end;
        let mut panel = Panel::new(
            area,
            "",
            Room::default(),
            &Axis::bounded("time [s]", Ticks::around(0.0..end_s, 8), 0.0..end_s),
            &Axis::bounded(
                "distance from the reference [mm]",
                Ticks::around(0.0..greatest, 5),
                0.0..1.25 * greatest,
            ),
        )?;
        panel.line(runs.used.iter().map(off), BLUE, 1.6)?;
        panel.line(runs.letter.iter().map(off), VERMILION, 1.8)?;
        if let Some(ended) = runs.ended {
            panel.vertical(ended.ended_s, REFERENCE)?;
            let at = (ended.ended_s, panel.y().end);
            let words = format!("ended by the supervisor at {:.2} s", ended.ended_s);
            let (side, dx) = match ended.ended_s < 0.5 * end_s {
                true => (HPos::Left, 8.0),
                false => (HPos::Right, -8.0),
            };
            panel.note(&words, at, (dx, 12.0), side, INK)?;
            panel.note(&ended.fault, at, (dx, 28.0), side, MUTED)?;
        }
        legend(
            area,
            (60.0, 13.0),
            &[
                ("(3.6) to the letter", Key::Line(1.8), VERMILION),
                ("the law that is used, same model", Key::Line(1.6), BLUE),
            ],
        )
    })
}
