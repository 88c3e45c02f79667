//! The sinusoid's error for perturbed models, one bar a seed, beside that of an exact model.

use super::axis::Axis;
use super::panel::{Area, Panel, Room};
use super::style::{BLUE, GREEN, INK, VERMILION};
use super::ticks::{Ticks, extent};
use super::{FigureError, mm, sheet};
use plotters::style::text_anchor::HPos;
use supple_experiment::Demo;
use supple_experiment::metrics::median;

const SIZE_PX: (u32, u32) = (760, 330);

/// Root mean square errors \[m\].
pub struct Seeds {
    /// Perturbed models.
    pub perturbed_m: Vec<f64>,
    /// Exact model, Coulomb feed-forward.
    pub coulomb_m: f64,
    /// Exact model, Stribeck feed-forward.
    pub stribeck_m: f64,
}

impl Seeds {
    /// Of a demo.
    pub fn of(demo: &Demo) -> Seeds {
        let exact = &demo.summary.sinusoid_exact_model;
        Seeds {
            perturbed_m: demo.summary.seeds.clone(),
            coulomb_m: exact.coulomb.rms_error_m,
            stribeck_m: exact.stribeck.rms_error_m,
        }
    }
}

/// The SVG.
pub fn draw(seeds: &Seeds) -> Result<String, FigureError> {
    let words = "Root mean square error of the sinusoid for each perturbed model, their median, \
                 and that of an exact model";
    sheet(SIZE_PX, words, |area| draw_on(area, seeds))
}

fn draw_on(area: &Area<'_>, seeds: &Seeds) -> Result<(), FigureError> {
    let mut sorted = seeds.perturbed_m.clone();
    sorted.sort_by(f64::total_cmp);
    let exact = [seeds.coulomb_m, seeds.stribeck_m];
    let greatest = mm(extent(sorted.iter().chain(&exact).copied()).end);
    let count = sorted.len() as f64;
    let ranks = Ticks {
        at: (1..=sorted.len()).map(|k| k as f64).collect(),
        decimals: 0,
    };
    let room = Room {
        right: 190.0,
        ..Room::default()
    };
    let mut panel = Panel::new(
        area,
        "",
        room,
        &Axis::bounded(
            "perturbed models, in order of their error",
            ranks,
            0.4..count + 0.6,
        ),
        &Axis::new("sinusoid, RMS error [mm]", Ticks::around(0.0..greatest, 5)),
    )?;
    for (k, rms_m) in sorted.iter().enumerate() {
        let at = k as f64 + 1.0;
        panel.bar(at - 0.32..at + 0.32, mm(*rms_m), BLUE)?;
    }
    let mut lines = vec![
        (seeds.coulomb_m, "exact model, Coulomb", VERMILION),
        (seeds.stribeck_m, "exact model, Stribeck", GREEN),
    ];
    lines.extend(median(&sorted).map(|middle| (middle, "median", INK)));
    lines.sort_by(|a, b| a.0.total_cmp(&b.0));
    let (y, (_, high_px)) = (
        panel.y(),
        room.axes_px(f64::from(SIZE_PX.0), f64::from(SIZE_PX.1)),
    );
    let mm_per_px = (y.end - y.start) / high_px;
    let mut lowest_mm = f64::MIN;
    for (rms_m, words, colour) in lines {
        panel.horizontal(mm(rms_m), colour, 1.4)?;
        // Words of lines close together stand one above the other.
        let words_mm = mm(rms_m).max(lowest_mm);
        lowest_mm = words_mm + 14.0 * mm_per_px;
        let words = format!("{words}: {:.1} mm", mm(rms_m));
        panel.note(
            &words,
            (count + 0.6, words_mm),
            (6.0, 0.0),
            HPos::Left,
            colour,
        )?;
    }
    Ok(())
}
