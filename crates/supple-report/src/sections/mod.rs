//! Text of the report: results of the paper and of the simulation, figure by figure.

mod contact;
mod free_motion;
mod row;

pub use row::{Row, Section, quadrants_with_models};

use supple_experiment::FaultEnd;
use supple_experiment::summary::Summary;

/// Returns all sections, in the order of the report.
pub fn sections(summary: &Summary) -> Vec<Section> {
    vec![
        free_motion::sinusoid(summary),
        free_motion::quadrant(summary),
        free_motion::torques(summary),
        free_motion::arc(summary),
        contact::force(summary),
        contact::impulse(summary),
        contact::trade_off(summary),
        free_motion::perturbed_models(summary),
        free_motion::law_as_printed(summary),
    ]
}

/// Lists the runs that ended with an unexpected fault. Runs in which a fault is a valid result are excluded: runs with equation
/// (3.6) exactly as printed and, for an arm whose gains and limits were derived from its model, runs on the realistic plant.
pub fn faults(summary: &Summary) -> Vec<(String, &FaultEnd)> {
    let mut runs: Vec<(String, &Option<FaultEnd>)> = Vec::new();
    for run in &summary.sinusoid_by_speed {
        runs.push((
            format!("sinusoid at {} times the paper's speed", run.speed),
            &run.tracking.ended,
        ));
    }
    let of_realistic = summary.realistic.iter().flat_map(|runs| &runs.ended);
    let of_realistic = of_realistic.filter(|_| summary.derived.is_none());
    let realistic = of_realistic.map(|ended| {
        let name = format!("realistic plant, seed {}", ended.seed);
        (name, &ended.fault)
    });
    for (k, run) in summary.perturbed_runs.iter().enumerate() {
        runs.push((format!("sinusoid, perturbed model {k}"), &run.ended));
    }
    runs.push(("arc".to_owned(), &summary.arc.ended));
    for (quadrant, model) in quadrants_with_models(summary) {
        let name = format!("quadrant at {:.3} m/s, {model}", quadrant.speed_m_per_s);
        runs.push((name, &quadrant.tracking.ended));
    }
    let exact = &summary.sinusoid_exact_model;
    for (name, tracking) in [("Coulomb", &exact.coulomb), ("Stribeck", &exact.stribeck)] {
        runs.push((format!("sinusoid, exact model, {name}"), &tracking.ended));
    }
    for (kind, runs_by_stiffness) in [
        ("identified model", &summary.probing),
        ("friction left on", &summary.probing_fade_off),
        ("exact model", &summary.probing_exact_model),
        ("rubber", &summary.probing_rubber),
        ("apparent inertia", &summary.probing_apparent_inertia),
    ] {
        for run in runs_by_stiffness {
            let name = format!("probing at {} N/m, {kind}", run.stiffness_n_per_m);
            runs.push((name, &run.ended));
        }
    }
    let apparent = &summary.sinusoid_apparent_inertia;
    runs.push(("sinusoid, apparent inertia".to_owned(), &apparent.ended));
    let runs = runs.into_iter();
    realistic
        .chain(runs.filter_map(|(name, ended)| Some((name, ended.as_ref()?))))
        .collect()
}
