//! `supple log plot`: draws the standard figures of a log.

use crate::figures::log::{Curve, LogPanel, Points, draw};
use crate::figures::{Figure, FigureError};
use serde::Serialize;
use std::path::PathBuf;
use supple_cli::arguments::PlotArgs;
use supple_cli::console::{json, print_json, print_line};
use supple_cli::exit::Failure;
use supple_cli::out::Staging;
use supple_core::Vector;
use supple_core::controller::CycleRecord;
use supple_core::nalgebra::Vector3;
use supple_core::torques::Torques;
use supple_log::Reader;
use supple_model::with_dof;

#[derive(Serialize)]
struct Summary<'a> {
    log: &'a PathBuf,
    arm: String,
    experiment: String,
    duration_s: f64,
    cycles: usize,
    /// RMS distance of the tip from its reference over all cycles that had one \[m\].
    rms_error_m: Option<f64>,
    faults: Vec<String>,
    figures: Vec<PathBuf>,
}

/// Curves of the torque, each with the terms that it sums. A further curve sums all other terms, so that the curves add up to
/// the torque before its limits.
const TERM_CURVES: [(&str, &[&str]); 4] = [
    ("gravity", &["gravity"]),
    ("friction", &["friction"]),
    ("inertia", &["inertial", "jacobian_rate", "coriolis"]),
    ("feedback", &["stiffness", "damping", "joint_pd"]),
];
/// Name of the curve that sums the other terms.
const OTHER_TERMS: &str = "other";

/// Computes the sums of [`TERM_CURVES`], and the sum of the other terms \[N m\].
fn sums_of_terms<const N: usize>(torques: &Torques<N>) -> [Vector<N>; TERM_CURVES.len() + 1] {
    let mut sums = [Vector::zeros(); TERM_CURVES.len() + 1];
    for (name, torque_nm) in torques.named() {
        let curve = TERM_CURVES
            .iter()
            .position(|(_, terms)| terms.contains(&name));
        sums[curve.unwrap_or(TERM_CURVES.len())] += torque_nm;
    }
    sums
}

/// Curves of a log.
#[derive(Default)]
struct Content {
    cycles: usize,
    duration_s: f64,
    tip_m: [Points; 3],
    reference_m: [Points; 3],
    error_mm: Points,
    force_n: Points,
    contacts_s: Vec<(f64, f64)>,
    faults: Vec<(f64, String)>,
    /// For each joint: commanded torque, then each of [`TERM_CURVES`], then the sum of the other terms.
    torques: Vec<[Points; TERM_CURVES.len() + 2]>,
    step_us: Points,
    period_us: Points,
}

/// Runs `supple log plot`.
///
/// # Errors
/// [`Failure`].
pub fn run(args: &PlotArgs) -> Result<(), Failure> {
    let reader = Reader::open(&args.file)?;
    let joints = &reader.metadata().joints;
    let content = with_dof!(joints.len(), N => read::<N>(&reader))??;
    let figures = figures(&content, joints)?;
    let names: Vec<String> = figures
        .iter()
        .flat_map(|figure| ["svg", "png"].map(|kind| format!("{}.{kind}", figure.name)))
        .chain(["summary.json".to_owned()])
        .collect();
    let names: Vec<&str> = names.iter().map(String::as_str).collect();
    let staging = Staging::new(&args.out, &names)?;
    for figure in &figures {
        staging.write(&format!("{}.svg", figure.name), figure.svg.as_bytes())?;
        staging.write(&format!("{}.png", figure.name), &figure.png()?)?;
    }
    let squares: f64 = content.error_mm.iter().map(|(_, mm)| mm * mm).sum();
    let tracked = content.error_mm.len();
    let summary = Summary {
        log: &args.file,
        arm: reader.description()?.name().to_owned(),
        experiment: reader.metadata().experiment.clone(),
        duration_s: content.duration_s,
        cycles: content.cycles,
        rms_error_m: (tracked > 0).then(|| 1e-3 * (squares / tracked as f64).sqrt()),
        faults: content
            .faults
            .iter()
            .map(|(_, text)| text.clone())
            .collect(),
        figures: figures
            .iter()
            .map(|figure| args.out.join(format!("{}.svg", figure.name)))
            .collect(),
    };
    staging.write("summary.json", format!("{}\n", json(&summary)?).as_bytes())?;
    staging.publish()?;
    if args.json {
        return print_json(&summary);
    }
    for figure in &summary.figures {
        print_line(&figure.display().to_string())?;
    }
    Ok(())
}

fn read<const N: usize>(reader: &Reader) -> Result<Content, Failure> {
    let start_ns = reader.metadata().start_ns;
    let seconds = |time_ns: u64| time_ns.saturating_sub(start_ns) as f64 * 1e-9;
    let mut content = Content {
        torques: vec![Default::default(); N],
        ..Content::default()
    };
    let (mut fault, mut contact_since_s) = (0, None);
    for record in reader.records::<N>()? {
        let record = record?;
        let (t, cycle) = (seconds(record.time_ns), record.value);
        content.cycles += 1;
        content.duration_s = t;
        content.add(t, &cycle);
        if cycle.fault != fault {
            fault = cycle.fault;
            if fault != 0 {
                content.faults.push((t, cycle.fault_text.to_string()));
            }
        }
        match (cycle.in_contact, contact_since_s) {
            (true, None) => contact_since_s = Some(t),
            (false, Some(since_s)) => {
                content.contacts_s.push((since_s, t));
                contact_since_s = None;
            }
            _ => {}
        }
    }
    content
        .contacts_s
        .extend(contact_since_s.map(|since_s| (since_s, content.duration_s)));
    for timing in reader.timings()? {
        let timing = timing?;
        let t = seconds(timing.time_ns);
        content
            .step_us
            .push((t, timing.value.step_ns as f64 * 1e-3));
        content
            .period_us
            .push((t, timing.value.period_ns as f64 * 1e-3));
    }
    Ok(content)
}

impl Content {
    fn add<const N: usize>(&mut self, t: f64, cycle: &CycleRecord<N>) {
        for axis in 0..3 {
            self.tip_m[axis].push((t, cycle.tip_position_m[axis]));
            if cycle.has_reference {
                self.reference_m[axis].push((t, cycle.reference_position_m[axis]));
            }
        }
        if let Some(error_m) = cycle.tip_error_m() {
            self.error_mm.push((t, 1e3 * error_m));
        }
        let force_n = Vector3::from(cycle.external_force_n).norm();
        self.force_n.push((t, force_n));
        let sums = sums_of_terms(&cycle.torques);
        for (joint, curves) in self.torques.iter_mut().enumerate() {
            let values = [&cycle.torque_nm].into_iter().chain(&sums);
            for (curve, value) in curves.iter_mut().zip(values) {
                curve.push((t, value[joint]));
            }
        }
    }

    fn panel(&self, title: impl Into<String>, unit: &'static str, curves: Vec<Curve>) -> LogPanel {
        LogPanel {
            title: title.into(),
            unit,
            curves,
            wide_first: false,
            shaded_s: self.contacts_s.clone(),
            marked_s: self.faults.iter().map(|(t, _)| *t).collect(),
        }
    }
}

fn curve(name: &'static str, points: &Points) -> Curve {
    Curve {
        name,
        points: points.clone(),
    }
}

fn figures(content: &Content, joints: &[String]) -> Result<Vec<Figure>, FigureError> {
    let mut tracking: Vec<LogPanel> = ["x", "y", "z"]
        .into_iter()
        .enumerate()
        .map(|(axis, name)| LogPanel {
            wide_first: true,
            ..content.panel(
                format!("tip along {name}"),
                "position [m]",
                vec![
                    curve("reference", &content.reference_m[axis]),
                    curve("actual", &content.tip_m[axis]),
                ],
            )
        })
        .collect();
    tracking.push(content.panel(
        "distance of the tip from its reference",
        "distance [mm]",
        vec![curve("distance", &content.error_mm)],
    ));
    tracking.push(content.panel(
        "observed force on the tip; contact is shaded",
        "force [N]",
        vec![curve("force", &content.force_n)],
    ));
    let torques: Vec<LogPanel> = content
        .torques
        .iter()
        .enumerate()
        .map(|(joint, curves)| {
            let terms = TERM_CURVES.iter().map(|(name, _)| *name);
            let names = ["commanded"].into_iter().chain(terms).chain([OTHER_TERMS]);
            let name = joints.get(joint).map_or("joint", String::as_str);
            LogPanel {
                wide_first: true,
                ..content.panel(
                    name,
                    "torque [N m]",
                    names
                        .zip(curves)
                        .map(|(name, points)| curve(name, points))
                        .collect(),
                )
            }
        })
        .collect();
    let mut figures = vec![
        draw(
            "tracking",
            "Tip and reference along each axis, their distance, and the observed force, over time",
            &tracking,
        )?,
        draw("torques", "Torque terms of every joint over time", &torques)?,
    ];
    if !content.step_us.is_empty() {
        let timing = [
            content.panel(
                "time between the beginnings of two steps",
                "period [us]",
                vec![curve("period", &content.period_us)],
            ),
            content.panel(
                "time of the step",
                "step [us]",
                vec![curve("step", &content.step_us)],
            ),
        ];
        figures.push(draw(
            "timing",
            "Period and duration of the steps over time",
            &timing,
        )?);
    }
    Ok(figures)
}

#[cfg(test)]
mod tests {
    use super::*;
    use supple_core::record::{Recorded, Unpack};
    use supple_core::torques::TERMS;

    #[test]
    fn the_curves_add_up_to_all_terms() {
        let mut words = vec![0; TERMS.len()];
        for (place, word) in words.iter_mut().enumerate() {
            *word = f64::from(1 << place).to_bits();
        }
        let torques = <Torques<1> as Recorded<1>>::unpack(&mut Unpack::new(&words, 1));
        let sums = sums_of_terms(&torques);
        let sum: Vector<1> = sums.iter().sum();
        assert_eq!(sum[0], f64::from((1 << TERMS.len()) - 1));
        assert!(sums.iter().all(|sum| sum[0] > 0.0), "{sums:?}");
        for (_, terms) in TERM_CURVES {
            for term in terms {
                assert!(TERMS.iter().any(|known| known.name == *term), "{term}");
            }
        }
    }
}
