//! On an arm with every torque term, the terms that each consumer of a record receives sum to the commanded torque.

use crate::common::{self, N};
use std::num::NonZeroU64;
use std::path::Path;
use supple_core::config::{ApparentInertia, RippleTable, Role};
use supple_core::controller::{CycleRecord, LearningSwitch, Mode, Request};
use supple_core::dynamics::aba;
use supple_core::friction::LoadTorque;
use supple_core::learned::LearnedParameters;
use supple_core::math::{Matrix3, Vector3};
use supple_core::record::{Cell, for_each_column};
use supple_core::ripple::Harmonic;
use supple_core::torques::TERMS;
use supple_core::trajectory::Line;
use supple_core::{Config, Controller, Friction, Input, Output, State, Trajectory, Vector, step};
use supple_log::{Extras, Reader, Writer, export_csv};

const STEPS: u64 = 1_500;
/// Rounding of a sum of 14 numbers of some 10 N m.
const ROUNDING_NM: f64 = 1e-12;

/// An arm with friction, ripple, compliance, a chosen inertia, and a hard stop so near that its spring acts.
fn config() -> Config<N> {
    let config = common::description().config::<N>().expect("four joints");
    let home = common::description().home::<N>().expect("four joints");
    let friction = Friction {
        presliding_rad: 2e-3,
        viscous_asymmetry_nm_s_per_rad: -0.01,
        breakaway_nm: 0.07,
        stribeck_offset_nm: 0.01,
        load_coefficient: 0.1,
        load_torque: LoadTorque::Motor,
        coulomb_at_nm: 0.2,
        ..Friction::coulomb(0.02, 0.05)
    };
    let harmonic = Harmonic {
        harmonic: 3,
        sine_nm: 0.002,
        cosine_nm: 0.001,
        sine_share: 0.01,
        cosine_share: -0.02,
    };
    let mut config = Config {
        roles: [Role::Active; N],
        friction: [friction; N],
        ripple: [RippleTable::new(&[harmonic]).expect("a table"); N],
        compliance_rad_per_nm: Vector::repeat(1e-5),
        ..config
    };
    config.law.measured_stribeck = true;
    config.law.inertia = ApparentInertia::Chosen(Matrix3::identity() * 3.0);
    config.limits.position_upper_rad[0] = home[0] + 0.5 * config.limits.soft_zone_rad;
    config
}

fn request(k: u64, home: &Vector<N>, tip: Vector3<f64>) -> Option<Request<N>> {
    match k {
        0 => Some(Request::GravityHold),
        50 => Some(Request::Learning(LearningSwitch::On)),
        800 => Some(Request::LearnedParameters(LearnedParameters {
            offset_nm: Vector::repeat(0.02),
            ..LearnedParameters::zero()
        })),
        100 => Some(Request::Move {
            target_rad: home + Vector::from([-0.01, 0.03, 0.02, -0.03]),
            duration_s: 0.5,
        }),
        700 => Some(Request::Track(Trajectory::Line(Line {
            from_m: tip,
            to_m: tip + Vector3::new(0.02, 0.0, -0.02),
            duration_s: 0.7,
        }))),
        _ => None,
    }
}

/// Runs the simulated arm without friction, and calls `on_cycle` with each step.
fn run(mut on_cycle: impl FnMut(u64, &Input<N>, &Output<N>)) {
    let config = config();
    let controller = Controller::new(config).expect("a valid configuration");
    let mut state = State::new(&controller);
    let home = common::description().home::<N>().expect("four joints");
    let (mut q, mut qd, mut tip) = (home, Vector::<N>::zeros(), Vector3::zeros());
    for k in 0..STEPS {
        let input = Input {
            cycle: k,
            position_rad: core::array::from_fn(|i| Some(q[i])),
            tip_force_n: Some(Vector3::new(0.3, -0.2, 0.1)),
            drives_active: true,
            request: request(k, &home, tip),
        };
        let output = step(&controller, &mut state, &input);
        assert_eq!((output.fault, output.refusal), (None, None), "step {k}");
        tip = output.tip_position_m;
        on_cycle(k, &input, &output);
        qd += aba(&config.arm, &q, &qd, &output.torque_nm) * config.period_s;
        q += qd * config.period_s;
    }
}

/// Writes a log of all steps, and returns the steps whose torque no limit reduced.
fn logged(path: &Path) -> Vec<CycleRecord<N>> {
    let description = common::description();
    let mut writer =
        Writer::create(path, &description, &config(), &common::run_info()).expect("created");
    let mut records = Vec::new();
    run(|k, input, output| {
        let time_ns = k * common::CYCLE_NS;
        let extras = Extras::default();
        writer
            .write(time_ns, input, output, &extras)
            .expect("written");
        records.push(CycleRecord::new(k, input, output));
    });
    writer.finish().expect("finished");
    records.retain(|record| !(record.torque_limited || record.rate_limited));
    records
}

fn assert_sum_is_torque(sum_nm: Vector<N>, record: &CycleRecord<N>) {
    let off = (sum_nm - record.torque_nm).amax();
    assert!(off < ROUNDING_NM, "step {}: off by {off} N m", record.step);
}

#[test]
fn terms_in_every_consumer_sum_to_the_torque() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("run.mcap");
    let records = logged(&path);
    assert!(records.len() > 1_000, "{} without a limit", records.len());
    assert!(
        records
            .iter()
            .any(|record| record.mode() == Some(Mode::Track))
    );
    for term in TERMS {
        let largest_nm = records.iter().flat_map(|record| record.torques.named());
        let largest_nm = largest_nm.filter(|(name, _)| *name == term.name);
        let largest_nm = largest_nm.map(|(_, nm)| nm.amax()).fold(0.0, f64::max);
        assert!(largest_nm > 1e-6, "the arm has no {}", term.name);
    }

    for record in &records {
        assert_sum_is_torque(record.torques.total(), record);
        // The words of telemetry, and the table of the last cycles before a fault.
        let mut words = vec![0; CycleRecord::<N>::words(N)];
        record.pack(&mut words);
        assert_sum_is_torque(CycleRecord::<N>::unpack(&words, N).torques.total(), record);
        let mut sum_nm = Vector::<N>::zeros();
        for_each_column(CycleRecord::<N>::FIELDS, &words, N, |column, cell| {
            if let (Some(_), Cell::Number(nm)) = (column.term, cell) {
                let name = column.to_string();
                let joint = name.rsplit('.').next().expect("a joint");
                sum_nm[joint.parse::<usize>().expect("a number")] += nm;
            }
        });
        assert_sum_is_torque(sum_nm, record);
    }

    let reader = Reader::open(&path).expect("opened");
    for logged in reader.records::<N>().expect("four joints") {
        let logged = logged.expect("whole").value;
        if records.iter().any(|record| record.step == logged.step) {
            assert_sum_is_torque(logged.torques.total(), &logged);
        }
    }

    let mut table = Vec::new();
    export_csv(&path, "/controller_state", NonZeroU64::MIN, &mut table).expect("exported");
    let table = String::from_utf8(table).expect("text");
    let mut lines = table.lines();
    let heading: Vec<&str> = lines.next().expect("a heading").split(',').collect();
    let step_column = heading
        .iter()
        .position(|name| *name == "step")
        .expect("a column");
    let joints = ["joint1", "joint2", "joint3", "joint4"];
    for line in lines {
        let cells: Vec<&str> = line.split(',').collect();
        let step: u64 = cells[step_column].parse().expect("a number");
        let Some(record) = records.iter().find(|record| record.step == step) else {
            continue;
        };
        let sum_of = |joint: &str| -> f64 {
            let of_joint = heading.iter().zip(&cells).filter(|(name, _)| {
                name.starts_with("torques.") && name.ends_with(&format!(".{joint}"))
            });
            of_joint
                .map(|(_, cell)| cell.parse::<f64>().expect("a number"))
                .sum()
        };
        assert_sum_is_torque(Vector::from(joints.map(sum_of)), record);
    }
}
