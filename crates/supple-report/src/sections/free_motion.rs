//! Free motion: figures 3 and 4, the arc, the perturbed models, and equation (3.6) exactly as printed.

use super::row::{Row, Section, quadrants_with_models, row};
use crate::table::{plants, worst};
use crate::units::{mm, newton_metres, seconds};
use supple_experiment::metrics::median;
use supple_experiment::summary::{QuadrantSummary, Summary, TrackingError};
use supple_experiment::{CalibratedRuns, JointTorque};

/// Formats RMS and maximum error, and the reason if the run ended early.
fn error(tracking: &TrackingError) -> String {
    let errors = format!("{}, {}", mm(tracking.rms_error_m), mm(tracking.max_error_m));
    match &tracking.ended {
        None => errors,
        Some(ended) => format!("{errors} until {}: {}", seconds(ended.ended_s), ended.fault),
    }
}

pub(super) fn sinusoid(summary: &Summary) -> Section {
    let mut rows: Vec<Row> = calibrated(summary);
    let (ideal, _) = plants(summary);
    for at in &summary.sinusoid_by_speed {
        let quantity = format!(
            "{ideal}{}: error at {} \u{d7} the speed: RMS, maximum",
            match summary.model {
                Some(_) => "",
                None => ", perturbed model",
            },
            at.speed
        );
        rows.push(row(quantity, error(&at.tracking)));
    }
    Section {
        figure: "figure_3a",
        title: "Sinusoid in free space",
        paper_reference: "Section 4.2, figure 3a",
        paper: "The tip is to follow x(t) = 0.6 + 0.2 sin(\u{3c0} t / 4) m with 5 N/m and 1.5 N s/m on the \
                diagonal of K and B, so that a centimetre of displacement causes a force equal to the weight of \
                five grams. The paper states that the tip follows closely; it plots the error without giving a \
                number. It states that faster trajectories are followed essentially as well.",
        measured_here: "Reference and true tip position for the same sinusoid, after a start from rest; below, the error by \
               component, and the distance from the reference at half, equal and twice the speed, over \
               the periods. The controller's model is perturbed. The first rows are the headline: a plant with elastic \
               cables, ripple, friction that warms up and varies, errors of amplifiers, encoders, mounting and tool, \
               and a controller calibrated on that arm that learns for 24 s before the errors count. The figure and all other rows are of the ideal plant, \
               which has none of these, unless plant options were given; the figure and the last rows have the perturbed \
               model.",
        rows,
    }
}

/// Returns the rows of the controllers that were calibrated on their arm, of the realistic plant first.
fn calibrated(summary: &Summary) -> Vec<Row> {
    let (ideal, imperfect) = plants(summary);
    let runs = [(&summary.realistic, imperfect), (&summary.ideal, ideal)];
    let runs = runs.into_iter().filter_map(|(found, plant)| {
        let found = found.as_ref()?;
        Some(calibrated_on(found, plant))
    });
    runs.flatten().collect()
}

fn calibrated_on(found: &CalibratedRuns, plant: &str) -> Vec<Row> {
    let errors = |errors: &[f64]| {
        format!(
            "{}, {}",
            mm(median(errors).unwrap_or(f64::NAN)),
            mm(worst(errors))
        )
    };
    let of = format!(
        "{plant}, calibrated and learning, {} seeds",
        found.sinusoid_rms_m.len()
    );
    let named = [
        (format!("{of}: RMS, median, worst"), &found.sinusoid_rms_m),
        (
            "the same after 20 min of warm-up".to_owned(),
            &found.warm_rms_m,
        ),
        ("the same on the arc".to_owned(), &found.arc_rms_m),
        (
            "the sinusoid at 0.5 N/m after learning at 5 N/m".to_owned(),
            &found.soft_rms_m,
        ),
        (
            "the sinusoid, calibrated alone: cold".to_owned(),
            &found.calibrated_sinusoid_rms_m,
        ),
        (
            "calibrated alone: warm".to_owned(),
            &found.calibrated_warm_rms_m,
        ),
        (
            "calibrated alone: arc".to_owned(),
            &found.calibrated_arc_rms_m,
        ),
    ];
    let named = named.into_iter().filter(|(_, of)| !of.is_empty());
    let mut rows: Vec<Row> = named.map(|(name, of)| row(name, errors(of))).collect();
    rows.push(row(
        "false reports of contact while learning",
        found.false_latches.to_string(),
    ));
    for failure in &found.failed {
        let name = format!("{plant}, seed {}: no result", failure.seed);
        rows.push(row(name, failure.reason.clone()));
    }
    rows
}

pub(super) fn quadrant(summary: &Summary) -> Section {
    let mut rows = Vec::new();
    for (quadrant, model) in quadrants_with_models(summary) {
        let name = format!("{:.3} m/s, {model}", quadrant.speed_m_per_s);
        rows.push(row(
            format!("{name}: error, RMS, maximum"),
            error(&quadrant.tracking),
        ));
        rows.push(row(
            format!("{name}: last quarter over peak, per edge"),
            decay(quadrant),
        ));
    }
    Section {
        figure: "figure_3b",
        title: "Quadrant with corners",
        paper_reference: "Section 4.2, figure 3b",
        paper: "A circular quadrant with unequal axes, whose commanded velocity jumps at the corners; its \
                maximum commanded speed is 0.1\u{3c0}. The paper calls errors at the corners inevitable; they decay \
                along each segment, at rates that depend on the joints involved and on how well \
                the model, above all its friction, fits them.",
        measured_here: "A quarter ellipse and the two straight edges that close it, in the vertical plane, at \
               constant speed on each piece; two rounds. First with the plant's own parameters, then \
               with a perturbed model, then at the paper's maximum speed. A corner there changes the velocity by \
               0.3 to 0.4 m/s at once; no torque follows that, so the arm keeps the difference, which the \
               damping takes away with the time constant m / B: about a second for the WAM's 1.4 kg and 1.5 N s/m, as \
               long as a piece lasts. With 15 N s/m it dies out. With a reference that stops at each corner, by an acceleration \
               that the law feeds forward, it does not arise.",
        rows,
    }
}

/// Formats the ratio of the mean error over the last quarter of each edge to its peak error.
fn decay(quadrant: &QuadrantSummary) -> String {
    let ratios = quadrant.edges.iter().map(|edge| {
        let ratio = edge.last_quarter_error_m / edge.peak_error_m;
        format!("{} {ratio:.2}", edge.segment)
    });
    ratios.collect::<Vec<_>>().join(", ")
}

pub(super) fn torques(summary: &Summary) -> Section {
    let of = |name: &str, torque: &JointTorque| {
        let terms = [
            torque.gravity,
            torque.friction,
            torque.inertial,
            torque.feedback,
        ];
        let terms = terms.map(newton_metres).join(", ");
        row(
            format!("{name}: gravity, friction, inertial, feedback, RMS"),
            terms,
        )
    };
    Section {
        figure: "figure_4",
        title: "Torque components",
        paper_reference: "Section 4.2, figure 4",
        paper: "During the sinusoid, on shoulder pitch and elbow, the gravity torque of the model is \
                substantially above both the friction feed-forward and the feedback torque, friction \
                dominates feedback, and the terms that depend on acceleration and velocity are \
                negligible.",
        measured_here: "The controller's torque terms in the same run as above. The inertial term contains the velocity products, \
               J\u{307}q\u{307} and M Xo\u{308}; the feedback term contains stiffness and damping.",
        rows: vec![
            of("shoulder pitch", &summary.torque_rms.shoulder_pitch),
            of("elbow", &summary.torque_rms.elbow),
        ],
    }
}

pub(super) fn arc(summary: &Summary) -> Section {
    Section {
        figure: "arc",
        title: "Arc that moves the base",
        paper_reference: "no figure",
        paper: "The sinusoid of figure 3a does not rotate the base. The paper rotates it between passes over \
                the object, and gives no error.",
        measured_here: "Back and forth at 0.65 m from the base axis, 0.4 rad to both sides. The controller's model \
               is perturbed.",
        rows: vec![row("error: RMS, maximum", error(&summary.arc))],
    }
}

pub(super) fn perturbed_models(summary: &Summary) -> Section {
    let worst_m = worst(&summary.perturbed_rms_m);
    let exact = &summary.sinusoid_exact_model;
    Section {
        figure: "perturbed_models",
        title: "Required model accuracy",
        paper_reference: "Section 3.2",
        paper: "Inertial and viscous parameters come from 1600 samples, Coulomb friction from breakaway \
                tests. The paper does not state their errors; it attributes the remaining tracking errors to the model, \
                above all to friction.",
        measured_here: "The sinusoid with models that have the error of a good identification, one bar per seed; \
               lines show the same with the plant's own parameters, once with Coulomb friction as in \
               (3.2), once with the Stribeck effect that the plant has.",
        rows: vec![
            row(
                format!(
                    "{} perturbed models: median, worst",
                    summary.perturbed_rms_m.len()
                ),
                format!(
                    "{}, {}",
                    mm(median(&summary.perturbed_rms_m).unwrap_or(f64::NAN)),
                    mm(worst_m)
                ),
            ),
            row(
                "exact model, plant without load friction, Coulomb: RMS, maximum",
                error(&exact.coulomb),
            ),
            row(
                "exact model, plant without load friction, Stribeck: RMS, maximum",
                error(&exact.stribeck),
            ),
        ],
    }
}

pub(super) fn law_as_printed(summary: &Summary) -> Section {
    let paper_law = &summary.law_as_printed;
    let measured = match &paper_law.ended {
        None => error(paper_law),
        Some(ended) => format!("ended at {}: {}", seconds(ended.ended_s), ended.fault),
    };
    Section {
        figure: "law_as_printed",
        title: "The law exactly as printed",
        paper_reference: "Equations (3.2), (3.3) and (3.6)",
        paper: "In (3.6) friction is compensated at the arm's own joint velocity, D(q\u{307}), and the \
                impedance (3.3) that it is derived from has no term for the acceleration of the \
                reference. The paper says that its experiments use this law, and does not mention \
                instability.",
        measured_here: "The sinusoid under exactly this law. Compensation at the measured velocity cancels the arm's own \
               damping and vanishes at rest: at low gains the arm is then almost undamped, or it sticks. \
               The supervisor ends the run when a limit is exceeded. All other runs compensate friction at \
               the velocity of the reference and add M Xo\u{308}.",
        rows: vec![row("the sinusoid under this law", measured)],
    }
}
