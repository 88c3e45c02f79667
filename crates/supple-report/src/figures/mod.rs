//! The figures of a demo. Each module draws an SVG from plain series; the PNG is rendered from that SVG with an
//! embedded font, so that it does not depend on installed fonts.

mod arc;
mod axis;
mod canvas;
mod error;
mod figure_3a;
mod figure_3b;
mod figure_4;
mod figure_5;
mod figure_6;
pub mod identification;
mod law_as_printed;
pub mod log;
mod outline;
mod panel;
mod perturbed_models;
mod png;
mod style;
mod ticks;
mod trade_off;

pub use canvas::Figure;
pub use error::FigureError;

use supple_experiment::{Demo, scenario};

/// All figures whose runs were not left out, in the order of the report.
///
/// # Errors
/// [`FigureError::Draw`].
pub fn all(demo: &Demo) -> Result<Vec<Figure>, FigureError> {
    let sinusoids = demo.sinusoids.iter().all(|(_, run)| !run.is_left_out());
    let quadrants = demo.quadrants.iter().all(|(_, run)| !run.is_left_out());
    let summary = &demo.summary;
    let all = scenario::PROBING_STIFFNESS_N_PER_M.len();
    let probing = [&demo.probing, &demo.probing_fade_off]
        .iter()
        .all(|runs| runs.len() == all);
    let exact = &summary.sinusoid_exact_model;
    let exact = exact.coulomb.rms_error_m.is_finite() && exact.stribeck.rms_error_m.is_finite();
    type Draw<'a> = Box<dyn Fn() -> Result<String, FigureError> + 'a>;
    let figures: [(&'static str, bool, Draw<'_>); 9] = [
        (
            "figure_3a",
            sinusoids,
            Box::new(|| figure_3a::draw(&figure_3a::SinusoidRuns::of(demo))),
        ),
        (
            "figure_3b",
            quadrants,
            Box::new(|| figure_3b::draw(&figure_3b::quadrant_runs(demo))),
        ),
        (
            "figure_4",
            sinusoids,
            Box::new(|| figure_4::draw(figure_4::samples(demo))),
        ),
        (
            "figure_5",
            probing,
            Box::new(|| figure_5::draw(&figure_5::probings(demo))),
        ),
        (
            "figure_6",
            probing,
            Box::new(|| figure_6::draw(&figure_6::Impulses::of(demo))),
        ),
        (
            "trade_off",
            probing,
            Box::new(|| trade_off::draw(&trade_off::points(demo))),
        ),
        (
            "law_as_printed",
            sinusoids && !demo.law_as_printed.is_left_out(),
            Box::new(|| law_as_printed::draw(&law_as_printed::PaperLawRuns::of(demo))),
        ),
        (
            "perturbed_models",
            exact && summary.model.is_none() && !summary.perturbed_rms_m.is_empty(),
            Box::new(|| perturbed_models::draw(&perturbed_models::PerturbedModels::of(demo))),
        ),
        (
            "arc",
            !demo.arc.is_left_out(),
            Box::new(|| arc::draw(&demo.arc.trace.samples)),
        ),
    ];
    figures
        .into_iter()
        .filter(|(_, has_its_runs, _)| *has_its_runs)
        .map(|(name, _, draw)| draw().map(|svg| Figure { name, svg }))
        .collect()
}
