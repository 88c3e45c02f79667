//! Free motion: figures 3 and 4, the arc, the models, the law to the letter.

use super::{Row, Section, kinds_of_quadrant, row};
use crate::units::{mm, newton_metres, seconds};
use supple_experiment::JointTorque;
use supple_experiment::metrics::median;
use supple_experiment::summary::{QuadrantSummary, Summary, Tracking};

/// Root mean square and greatest error, or how the run ended.
fn error(tracking: &Tracking) -> String {
    let errors = format!("{}, {}", mm(tracking.rms_error_m), mm(tracking.max_error_m));
    match &tracking.ended {
        None => errors,
        Some(ended) => format!("{errors} until {}: {}", seconds(ended.ended_s), ended.fault),
    }
}

pub(super) fn sinusoid(summary: &Summary) -> Section {
    let mut rows: Vec<Row> = Vec::new();
    for at in &summary.sinusoid_by_speed {
        let quantity = format!("error at {} \u{d7} the pace: RMS, greatest", at.speed);
        rows.push(row(quantity, error(&at.tracking)));
    }
    Section {
        figure: "figure_3a",
        title: "Sinusoid in free space",
        place: "Section 4.2, figure 3a",
        paper: "The tip is to follow x(t) = 0.6 + 0.2 sin(\u{3c0} t / 4) m with 5 N/m and 1.5 N s/m on the \
                diagonal of K and B, so that a centimetre of displacement is answered by the weight of \
                five grams. It is said to follow closely; the error is drawn, not given as a number. \
                Faster trajectories are said to be followed essentially as well.",
        here: "Reference and true tip of the same sinusoid, after a start from rest; below its error by \
               component, and the distance from the reference at half, the same and twice the pace, over \
               the periods. The controller's model is perturbed.",
        rows,
    }
}

pub(super) fn quadrant(summary: &Summary) -> Section {
    let mut rows = Vec::new();
    for (quadrant, model) in kinds_of_quadrant(summary) {
        let name = format!("{:.3} m/s, {model}", quadrant.speed_m_per_s);
        rows.push(row(
            format!("{name}: error, RMS, greatest"),
            error(&quadrant.tracking),
        ));
        rows.push(row(
            format!("{name}: last quarter over peak, edge by edge"),
            decay(quadrant),
        ));
    }
    Section {
        figure: "figure_3b",
        title: "Quadrant with corners",
        place: "Section 4.2, figure 3b",
        paper: "A circular quadrant with unequal axes, whose commanded velocity jumps at the corners; its \
                greatest commanded speed is 0.1\u{3c0}. Errors at the corners are called inevitable; they die \
                out along each segment, at rates that differ with the joints involved and with how well \
                the model, friction above all, fits them.",
        here: "A quarter ellipse and the two straight edges that close it, in the vertical plane, at \
               constant speed on each piece; twice round. First with the plant's own parameters, then \
               with a perturbed model, then at the paper's greatest speed.",
        rows,
    }
}

/// Mean error over the last quarter of each edge over its peak.
fn decay(quadrant: &QuadrantSummary) -> String {
    let shares = quadrant.edges.iter().map(|edge| {
        let share = edge.last_quarter_error_m / edge.peak_error_m;
        format!("{} {share:.2}", edge.piece)
    });
    shares.collect::<Vec<_>>().join(", ")
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
        title: "What the torque is made of",
        place: "Section 4.2, figure 4",
        paper: "During the sinusoid, on shoulder pitch and elbow, the gravity torque of the model is \
                substantially above both the friction feed-forward and the feedback torque, friction \
                dominates feedback, and the terms that depend on acceleration and velocity are \
                negligible.",
        here: "The controller's terms in the same run as above. Inertial are the products of velocity, \
               the term in J\u{307}q\u{307} and M Xo\u{308}; feedback is stiffness and damping together.",
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
        place: "no figure",
        paper: "The sinusoid of figure 3a does not turn the base. The paper turns it between passes over \
                the object, and gives no error.",
        here: "Back and forth at 0.65 m from the base axis, 0.4 rad to both sides. The controller's model \
               is perturbed.",
        rows: vec![row("error: RMS, greatest", error(&summary.arc))],
    }
}

pub(super) fn seeds(summary: &Summary) -> Section {
    let worst = summary.seeds.iter().copied().fold(f64::NAN, f64::max);
    let exact = &summary.sinusoid_exact_model;
    Section {
        figure: "seeds",
        title: "How good the model has to be",
        place: "Section 3.2",
        paper: "Inertial and viscous parameters come from 1600 samples, Coulomb friction from breakaway \
                tests. What error they have is not said; that the errors which remain come from the model, \
                friction above all, is.",
        here: "The sinusoid with models that are off by what a good identification leaves, one bar a seed; \
               lines show the same with the plant's own parameters, once with Coulomb friction as in \
               (3.2), once with the Stribeck dip that the plant has.",
        rows: vec![
            row(
                format!("{} perturbed models: median, worst", summary.seeds.len()),
                format!(
                    "{}, {}",
                    mm(median(&summary.seeds).unwrap_or(f64::NAN)),
                    mm(worst)
                ),
            ),
            row("exact model, Coulomb: RMS, greatest", error(&exact.coulomb)),
            row(
                "exact model, Stribeck: RMS, greatest",
                error(&exact.stribeck),
            ),
        ],
    }
}

pub(super) fn paper_letter(summary: &Summary) -> Section {
    let letter = &summary.paper_letter;
    let measured = match &letter.ended {
        None => error(letter),
        Some(ended) => format!("ended at {}: {}", seconds(ended.ended_s), ended.fault),
    };
    Section {
        figure: "paper_letter",
        title: "The law to the letter",
        place: "Equations (3.2), (3.3) and (3.6)",
        paper: "In (3.6) friction is compensated at the arm's own joint velocity, D(q\u{307}), and the \
                impedance (3.3) that it is derived from has no term for the acceleration of the \
                reference. It is the law that the experiments are said to use; nothing is said of \
                instability.",
        here: "The sinusoid under exactly that. Compensation at the measured velocity takes the arm's own \
               damping away, and at rest it is zero: what the low gains leave is hardly damped, or sticks. \
               The supervisor ends the run where its limits are passed. All other runs take friction at \
               the velocity of the reference and add M Xo\u{308}.",
        rows: vec![row("the sinusoid under it", measured)],
    }
}
