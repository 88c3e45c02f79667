//! A sample run for the log tests: a controller moves the four-joint arm, simulated without friction, through several modes, with
//! accepted and refused requests, a lost encoder reply and a fault.

#![allow(dead_code, reason = "each test program uses only some of these items")]

use std::path::Path;
use supple_core::config::Gains;
use supple_core::controller::Request;
use supple_core::dynamics::aba;
use supple_core::math::Vector3;
use supple_core::trajectory::{Line, Probe};
use supple_core::{Config, Controller, Friction, Input, Output, State, Trajectory, Vector, step};
use supple_log::{CycleTiming, Extras, LogError, LogSummary, PlantTruth, RunInfo, Writer};
use supple_model::Description;

pub const N: usize = 4;
pub const CYCLE_NS: u64 = 1_000_000;
/// First cycle of two lost encoder replies, which cause a fault.
pub const FAULT_CYCLE: u64 = 1_500;
/// Number of steps of a complete run.
pub const STEPS: u64 = 1_800;

pub fn description() -> Description {
    Description::asset("wam4").expect("a built-in arm")
}

/// Configuration of the arm without friction, because the simulated arm has none.
pub fn config() -> Config<N> {
    let config = description().config::<N>().expect("four joints");
    Config {
        friction: [Friction::NONE; N],
        ..config
    }
}

pub fn run_info() -> RunInfo {
    RunInfo {
        experiment: "sample".into(),
        seed: Some(7),
        start_ns: 0,
        notes: [("stiffness_n_per_m".to_owned(), "200".to_owned())].into(),
    }
}

/// Data of one step for the log.
#[derive(Clone)]
pub struct Cycle {
    pub time_ns: u64,
    pub input: Input<N>,
    pub output: Output<N>,
    pub extras: Extras<N>,
}

/// Runs `steps` steps and calls `on_cycle` with each.
pub fn run(steps: u64, mut on_cycle: impl FnMut(&Cycle)) {
    let config = config();
    let controller = Controller::new(config).expect("a valid configuration");
    let mut state = State::new(&controller);
    let home = description().home::<N>().expect("four joints");
    let (mut q, mut qd) = (home, Vector::<N>::zeros());
    let mut tip = Vector3::zeros();
    for k in 0..steps {
        let input = Input {
            cycle: k,
            position_rad: core::array::from_fn(|i| encoder_replies(k, i).then_some(q[i])),
            tip_force_n: (k >= 600).then(|| Vector3::new(0.1 * k as f64, -0.3, 1.0 / 3.0)),
            drives_active: true,
            request: request(k, &home, tip),
        };
        let output = step(&controller, &mut state, &input);
        tip = output.tip_position_m;
        let truth = PlantTruth {
            position_rad: q.into(),
            velocity_rad_per_s: qd.into(),
            tip_position_m: tip.into(),
            tip_velocity_m_per_s: output.tip_velocity_m_per_s.into(),
            contact_force_n: [0.0; 3],
            friction_torque_nm: [0.0; N],
            motor_torque_nm: output.torque_nm.into(),
        };
        let timing = CycleTiming {
            period_ns: CYCLE_NS,
            latency_ns: 100 + k,
            step_ns: 2_000,
        };
        on_cycle(&Cycle {
            time_ns: k * CYCLE_NS,
            input,
            output,
            extras: Extras {
                truth: Some(truth),
                timing: Some(timing),
                ..Extras::default()
            },
        });
        qd += aba(&config.arm, &q, &qd, &output.torque_nm) * config.period_s;
        q += qd * config.period_s;
    }
}

/// Returns whether encoder `joint` replies in cycle `k`.
fn encoder_replies(k: u64, joint: usize) -> bool {
    let lost =
        (k == 1_300 && joint == 1) || ((FAULT_CYCLE..FAULT_CYCLE + 2).contains(&k) && joint == 2);
    !lost
}

fn request(k: u64, home: &Vector<N>, tip: Vector3<f64>) -> Option<Request<N>> {
    match k {
        0 | 1_530 => Some(Request::GravityHold),
        100 => Some(Request::Move {
            target_rad: home + Vector::from([0.05, 0.05, 0.0, -0.05]),
            duration_s: 0.4,
        }),
        600 => Some(Request::Track(Trajectory::Line(Line {
            from_m: tip,
            to_m: tip + Vector3::new(0.03, 0.0, -0.03),
            duration_s: 1.0,
        }))),
        800 => Some(Request::Gains {
            gains: Gains::isotropic(200.0, 20.0),
            ramp_s: 0.1,
        }),
        1_200 => Some(Request::Track(Trajectory::Probe(Probe {
            // Beyond the reach of the arm: the controller refuses this request.
            radius_m: 30.0,
            strokes: 3,
            radial_step_m: 0.01,
            top_m: 0.0,
            stroke_m: 0.1,
            azimuth_rad: 0.0,
            azimuth_step_rad: 0.1,
            speed_m_per_s: 0.04,
            ramp_s: 0.1,
            dwell_s: 0.0,
        }))),
        1_510 => Some(Request::Reset),
        _ => None,
    }
}

/// Logs a run of `steps` steps.
pub fn write(path: &Path, steps: u64) -> Result<LogSummary, LogError> {
    let mut writer = Writer::create(path, &description(), &config(), &run_info())?;
    let mut failed = None;
    run(steps, |cycle| {
        if failed.is_none() {
            let written = writer.write(cycle.time_ns, &cycle.input, &cycle.output, &cycle.extras);
            failed = written.err();
        }
    });
    match failed {
        Some(error) => Err(error),
        None => writer.finish(),
    }
}
