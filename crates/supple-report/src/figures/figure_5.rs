//! Figure 5: force on the tip at a low and a high stiffness, aligned at the first touch.

use super::axis::Axis;
use super::canvas::draw_canvas;
use super::error::FigureError;
use super::panel::{Area, LegendSymbol, Margins, Panel, legend};
use super::style::{BLUE, REFERENCE, VERMILION, px};
use super::ticks::{Ticks, extent};
use plotters::style::RGBColor;
use supple_experiment::{Demo, Sample};

/// Force above which the tip counts as touching, well above the noise of the sensor \[N\].
const TOUCH_N: f64 = 0.5;
/// Time shown before the first touch \[s\].
const BEFORE_S: f64 = 0.25;
/// Time after the first touch that the close-up shows \[s\].
const CLOSE_UP_S: f64 = 0.1;
/// The two stiffnesses of the paper's figure, which differ by a factor of 25 \[N/m\].
const SHOWN_N_PER_M: [f64; 2] = [5.0, 125.0];

/// Time since the first touch \[s\] and force \[N\] of each sample.
type Contact = Vec<(f64, f64)>;

/// One probing run.
pub struct Probing {
    /// `K` \[N/m\].
    pub stiffness_n_per_m: f64,
    /// One series per stroke (descent and return of the reference) with contact.
    pub contacts: Vec<Contact>,
}

impl Probing {
    /// Splits a run into strokes at the times at which the reference starts to move down.
    pub fn new(stiffness_n_per_m: f64, samples: &[Sample]) -> Probing {
        let descends = |pair: &[Sample]| pair[1].reference_m[2] < pair[0].reference_m[2] - 1e-9;
        let down: Vec<bool> = samples.windows(2).map(descends).collect();
        let mut starts: Vec<usize> = (0..down.len())
            .filter(|k| down[*k] && (*k == 0 || !down[k - 1]))
            .collect();
        starts.push(samples.len());
        let contacts = starts
            .windows(2)
            .filter_map(|pair| contact(&samples[pair[0]..pair[1]]))
            .collect();
        Probing {
            stiffness_n_per_m,
            contacts,
        }
    }
}

/// Collects the probing runs at the stiffnesses of the paper's figure.
pub fn probings(demo: &Demo) -> Vec<Probing> {
    let shown = demo
        .probing
        .iter()
        .filter(|run| SHOWN_N_PER_M.contains(&run.summary.stiffness_n_per_m));
    shown
        .map(|run| Probing::new(run.summary.stiffness_n_per_m, &run.run.trace.samples))
        .collect()
}

fn contact(stroke: &[Sample]) -> Option<Contact> {
    let touch_s = stroke.iter().find(|s| s.force_n > TOUCH_N)?.time_s;
    Some(
        stroke
            .iter()
            .map(|s| (s.time_s - touch_s, s.force_n))
            .collect(),
    )
}

/// Draws the figure as SVG.
pub fn draw(probings: &[Probing]) -> Result<String, FigureError> {
    let alt_text = "Force on the tip over time at a low and at a high stiffness, aligned at the first \
                 touch, and the first transient close up";
    draw_canvas((760, 480), alt_text, |area| {
        let (whole, close) = area.split_vertically(px(250.0));
        let (left, right) = whole.split_horizontally(px(380.0));
        let force = force_ticks(probings, f64::INFINITY);
        let colours = [BLUE, VERMILION];
        for ((probing, area), (letter, colour)) in probings
            .iter()
            .zip([&left, &right])
            .zip([("(a)", BLUE), ("(b)", VERMILION)])
        {
            let title = format!("{letter}  K = {} N/m", probing.stiffness_n_per_m);
            whole_contact(area, &title, probing, &force, colour)?;
        }
        close_up(&close, probings, colours)
    })
}

fn force_ticks(probings: &[Probing], until_s: f64) -> Ticks {
    let shown = probings.iter().flat_map(|p| p.contacts.iter().flatten());
    let forces = shown.filter(|(t, _)| *t <= until_s).map(|(_, f)| *f);
    Ticks::around(0.0..extent(forces).end.max(1.0), 5)
}

fn whole_contact(
    area: &Area<'_>,
    title: &str,
    probing: &Probing,
    force: &Ticks,
    colour: RGBColor,
) -> Result<(), FigureError> {
    let touching = probing
        .contacts
        .iter()
        .flatten()
        .filter(|(_, f)| *f > TOUCH_N);
    let end = extent(touching.map(|(t, _)| *t)).end.max(1.0) + BEFORE_S;
    let mut panel = Panel::new(
        area,
        title,
        Margins::default(),
        &Axis::bounded(
            "time since the first touch [s]",
            Ticks::around(0.0..end, 5),
            -BEFORE_S..end,
        ),
        &Axis::new("force [N]", force.clone()),
    )?;
    let mut contacts = probing.contacts.iter();
    let first = contacts.next();
    for contact in contacts {
        panel.line(contact.iter().copied(), REFERENCE, 1.0)?;
    }
    panel.line(first.into_iter().flatten().copied(), colour, 1.5)?;
    legend(
        area,
        (182.0, 40.0),
        &[
            ("first stroke", LegendSymbol::Line(1.6), colour),
            ("others", LegendSymbol::Line(1.2), REFERENCE),
        ],
    )
}

fn close_up(
    area: &Area<'_>,
    probings: &[Probing],
    colours: [RGBColor; 2],
) -> Result<(), FigureError> {
    let mut panel = Panel::new(
        area,
        "(c)  the first transient of both, close up",
        Margins::default(),
        &Axis::new(
            "time since the first touch [ms]",
            Ticks::stepped(-10.0..1e3 * CLOSE_UP_S, 10.0),
        ),
        &Axis::new("force [N]", force_ticks(probings, CLOSE_UP_S)),
    )?;
    let mut entries = Vec::new();
    for (probing, colour) in probings.iter().zip(colours) {
        if let Some(first) = probing.contacts.first() {
            panel.line(first.iter().map(|(t, f)| (1e3 * t, *f)), colour, 1.8)?;
        }
        entries.push((format!("K = {} N/m", probing.stiffness_n_per_m), colour));
    }
    let entries: Vec<_> = entries
        .iter()
        .map(|(label, colour)| (label.as_str(), LegendSymbol::Line(1.8), *colour))
        .collect();
    legend(area, (520.0, 42.0), &entries)
}

#[cfg(test)]
mod tests {
    use super::*;
    use supple_experiment::JointTorque;

    /// Returns two strokes of 2 s down and up; the first touches at 0.5 s, the second does not touch.
    fn samples() -> Vec<Sample> {
        let sample = |k: u32| {
            let time_s = f64::from(k) * 1e-3;
            let stroke_time_s = time_s % 2.0;
            let depth = if stroke_time_s < 1.0 {
                stroke_time_s
            } else {
                2.0 - stroke_time_s
            };
            let touches = time_s < 2.0 && (0.5..0.6).contains(&stroke_time_s);
            Sample {
                time_s,
                reference_m: [0.7, 0.0, -0.1 * depth],
                tip_m: [0.7, 0.0, -0.1 * depth],
                torques: [JointTorque::default(); 2],
                force_n: if touches { 20.0 } else { 0.0 },
                in_contact: false,
            }
        };
        (0..4000).map(sample).collect()
    }

    #[test]
    fn strokes_begin_where_the_reference_turns_down_and_are_aligned_at_the_touch() {
        let probing = Probing::new(5.0, &samples());
        let [contact] = probing.contacts.as_slice() else {
            panic!("one stroke touched: {}", probing.contacts.len());
        };
        let pushing: Vec<_> = contact.iter().filter(|(_, f)| *f > 0.0).collect();
        assert!(pushing[0].0.abs() < 1e-9, "{:?}", pushing[0]);
        assert!((pushing[pushing.len() - 1].0 - 0.099).abs() < 1e-9);
        assert!(
            (contact[0].0 + 0.5).abs() < 2e-3,
            "the stroke from its start"
        );
    }

    #[test]
    fn runs_without_contact_can_be_drawn() {
        let untouched = |k| Probing::new(k, &samples()[2000..]);
        assert!(draw(&[untouched(5.0), untouched(125.0)]).is_ok());
        assert!(draw(&[]).is_ok());
    }
}
