//! Tracking error of the sinusoid for perturbed models, one bar per seed, and for an exact model.

use super::axis::Axis;
use super::canvas::{draw_canvas, mm};
use super::error::FigureError;
use super::panel::{Area, Margins, Panel};
use super::style::{BLUE, GREEN, TEXT_COLOUR, VERMILION};
use super::ticks::{Ticks, extent};
use plotters::style::text_anchor::HPos;
use supple_experiment::Demo;
use supple_experiment::metrics::median;

const SIZE_PX: (u32, u32) = (760, 330);

/// Root mean square errors \[m\].
pub struct PerturbedModels {
    /// Perturbed models.
    pub perturbed_m: Vec<f64>,
    /// Exact model, Coulomb feed-forward.
    pub coulomb_m: f64,
    /// Exact model, Stribeck feed-forward.
    pub stribeck_m: f64,
}

impl PerturbedModels {
    /// Collects the errors of a demo.
    pub fn of(demo: &Demo) -> PerturbedModels {
        let exact = &demo.summary.sinusoid_exact_model;
        PerturbedModels {
            perturbed_m: demo.summary.perturbed_rms_m.clone(),
            coulomb_m: exact.coulomb.rms_error_m,
            stribeck_m: exact.stribeck.rms_error_m,
        }
    }
}

/// Draws the figure as SVG.
pub fn draw(errors: &PerturbedModels) -> Result<String, FigureError> {
    let alt_text = "Root mean square error of the sinusoid for each perturbed model, their median, \
                 and that of an exact model";
    draw_canvas(SIZE_PX, alt_text, |area| draw_on(area, errors))
}

fn draw_on(area: &Area<'_>, errors: &PerturbedModels) -> Result<(), FigureError> {
    let mut sorted = errors.perturbed_m.clone();
    sorted.sort_by(f64::total_cmp);
    let exact = [errors.coulomb_m, errors.stribeck_m];
    let max = mm(extent(sorted.iter().chain(&exact).copied()).end);
    let count = sorted.len() as f64;
    let ranks = Ticks {
        at: (1..=sorted.len()).map(|k| k as f64).collect(),
        decimals: 0,
    };
    let margins = Margins {
        right: 190.0,
        ..Margins::default()
    };
    let mut panel = Panel::new(
        area,
        "",
        margins,
        &Axis::bounded("perturbed models, sorted by error", ranks, 0.4..count + 0.6),
        &Axis::new("sinusoid, RMS error [mm]", Ticks::around(0.0..max, 5)),
    )?;
    for (k, rms_m) in sorted.iter().enumerate() {
        let at = k as f64 + 1.0;
        panel.bar(at - 0.32..at + 0.32, mm(*rms_m), BLUE)?;
    }
    let mut lines = vec![
        (errors.coulomb_m, "exact model, Coulomb", VERMILION),
        (errors.stribeck_m, "exact model, Stribeck", GREEN),
    ];
    lines.extend(median(&sorted).map(|middle| (middle, "median", TEXT_COLOUR)));
    lines.sort_by(|a, b| a.0.total_cmp(&b.0));
    let (y, (_, high_px)) = (
        panel.y(),
        margins.axes_px(f64::from(SIZE_PX.0), f64::from(SIZE_PX.1)),
    );
    let mm_per_px = (y.end - y.start) / high_px;
    let mut lowest_mm = f64::MIN;
    for (rms_m, label, colour) in lines {
        panel.horizontal(mm(rms_m), colour, 1.4)?;
        // Stack the labels of lines that are close together.
        let label_mm = mm(rms_m).max(lowest_mm);
        lowest_mm = label_mm + 14.0 * mm_per_px;
        let label = format!("{label}: {:.1} mm", mm(rms_m));
        panel.note(
            &label,
            (count + 0.6, label_mm),
            (6.0, 0.0),
            HPos::Left,
            colour,
        )?;
    }
    Ok(())
}
