//! Runs a test case in virtual time. All requests are queued before the first cycle, so every run is bit-identical.

use super::evaluation::evaluate;
use super::metrics::{ControllerSample, RowMetrics, angle_is_wrong_ns, stuck_error_rad};
use super::row::Row;
use super::spec::{Activation, DriveShutdown, Event, InvalidRequest, Spec, TestTask};
use super::task::{Script, law_force_n, weight_n};
use super::test_arms::TestArm;
use super::trace::{self, TraceRow};
use crate::cli::{PlantKind, UpArgs, UpTrajectory};
use crate::up::{START_S, System};
use core::time::Duration;
use std::path::PathBuf;
use std::time::Instant;
use supple_cli::arguments::{PlantArgs, UrdfArgs};
use supple_cli::exit::Failure;
use supple_core::dynamics::{jacobian, potential_energy};
use supple_core::{Config, Vector};
use supple_ipc::Domain;
use supple_model::Description;
use supple_plant::{Injection, InjectionKind, Trigger};

/// Vertical clearance between the start of the trajectory (height 0) and the top face of the block, without the cap
/// radius \[m\].
const BLOCK_CLEARANCE_M: f64 = 0.05;
/// The same for an arm that is only pushed and does not travel far \[m\].
const PUSHED_BLOCK_CLEARANCE_M: f64 = 0.01;
/// The same for the ramp of the breakaway task \[m\].
const RAMPED_BLOCK_CLEARANCE_M: f64 = 0.004;
/// Cap radius of an arm without a tool \[m\].
const CAP_M: f64 = 0.02;
/// Observation time after the event \[s\].
const OBSERVED_S: f64 = 1.5;
/// Time from disabling the drives until the operator activates them again; second value: with an emergency stop in
/// between \[s\].
const REENABLE_S: (f64, f64) = (1.0, 3.0);
/// Timeout of a run in wall-clock time; the longest run takes seconds.
const TIMEOUT: Duration = Duration::from_secs(120);
/// Speed at which a pushed tip hits a block \[m/s\].
const PUSHED_M_PER_S: f64 = 0.25;

/// Runs a test case in virtual time.
///
/// # Errors
/// If the system cannot be started, or one of its processes exits.
pub fn perform<const N: usize>(spec: &Spec, arm: &TestArm) -> Result<Row, Failure> {
    let description = &match arm.rate_hz {
        Some(rate_hz) => arm.description.clone().at_rate(f64::from(rate_hz))?,
        None => arm.description.clone(),
    };
    let config = description.config::<N>()?;
    let home_rad = description.home::<N>()?;
    let script = Script::new(spec, &config, description, &home_rad)?;
    let prefix = format!("drill-{}", std::process::id());
    let domain = Domain::new(Some(&prefix)).map_err(Failure::system)?;
    let file = domain.folder().join(format!("{prefix}.csv"));
    let cap_m = description.tool().map_or(CAP_M, |tool| tool.cap_radius_m);
    let start_s = START_S[usize::from(spec.plant == PlantKind::Emu)];
    let event_s = start_s + script.event_cycle as f64 * config.period_s;
    let back_s = match spec.event {
        Event::Drives(DriveShutdown::EStop) => REENABLE_S.1,
        Event::Drives(_) | Event::Activation(Activation::InFault) => REENABLE_S.0,
        _ => 0.0,
    };
    let at_rest = matches!(spec.task, TestTask::GravityHold | TestTask::Float);
    let pushed = spec.event == Event::Obstacle && at_rest;
    let push_rad_per_s = -PUSHED_M_PER_S / jacobian(&config.arm, &script.start_rad)[(2, 1)];
    let up = UpArgs {
        urdf: UrdfArgs::default(),
        plant: spec.plant,
        arm: arm.name.clone(),
        strict: arm.strict,
        track: UpTrajectory::Sinusoid,
        bus: None,
        budget: false,
        zero_at_home: false,
        learn: false,
        tare: false,
        block_m: (spec.event == Event::Obstacle).then_some(match spec.task {
            TestTask::Probe => 0.0,
            // The ramp moves the tip by some millimetres only.
            TestTask::Breakaway => -(RAMPED_BLOCK_CLEARANCE_M + cap_m),
            _ if at_rest => -(PUSHED_BLOCK_CLEARANCE_M + cap_m),
            _ => -(BLOCK_CLEARANCE_M + cap_m),
        }),
        inject: injections(spec, event_s, back_s, pushed.then_some(push_rad_per_s)),
        misbehave: Vec::new(),
        plant_options: PlantArgs::default(),
        trace: Some(file.clone()),
        rate_hz: arm.rate_hz,
        for_s: Some(event_s + back_s + OBSERVED_S),
        virtual_time: true,
        log: PathBuf::new(),
        no_log: true,
        view: false,
        prefix: Some(prefix),
        no_realtime: true,
        json: true,
    };
    let performed = run::<N>(spec, &up, &script, description, &domain, event_s, back_s);
    let row = performed.and_then(|(samples, refusals)| {
        // Samples after the end of the run belong to the shutdown.
        let end_ns = samples.last().map_or(0, |sample| sample.time_ns);
        let mut lines = trace::read(&file)?;
        lines.retain(|line| line.time_ns <= end_ns);
        let at = |cycles: u64| {
            let cycle = (start_s / config.period_s).round() as u64 + cycles;
            let found = samples.iter().find(|sample| sample.cycle >= cycle);
            found.map_or(u64::MAX, |sample| sample.time_ns)
        };
        let task_start_ns = at(script.task_start_cycle);
        let event_ns = match spec.event {
            Event::Injected { at_once: true, .. } => {
                let active = lines.iter().find(|line| line.active);
                active.map_or(u64::MAX, |line| line.time_ns)
            }
            Event::Injected { .. } => {
                let begun = lines.iter().find(|line| line.injections > 0);
                begun.map_or(u64::MAX, |line| line.time_ns)
            }
            Event::Obstacle => task_start_ns,
            _ => at(script.event_cycle),
        };
        let mut metrics = RowMetrics::new(&lines, &samples, task_start_ns, event_ns);
        metrics.observable_at(observable_ns(spec, &config, &lines, event_ns), event_ns);
        metrics.law_force_n = law_force_n(spec.task, &config, &script.start_rad);
        // An obstacle that stops the joint of a ramp looks like an encoder that sticks: the arm brakes and leans on it.
        if spec.task == TestTask::Breakaway && metrics.braked_after_ms.is_some() {
            metrics.weight_n = Some(weight_n(&config, &script.start_rad));
        }
        if let Event::Injected {
            kind: InjectionKind::MotorDead { .. },
            ..
        } = spec.event
        {
            metrics.energy_since_fault(&lines, &samples, event_ns, |position_rad| {
                potential_energy(&config.arm, &Vector::from_fn(|i, _| position_rad[i]))
            });
        }
        let (outcome, deviations) = evaluate(spec, &metrics, &refusals);
        Ok(Row::lockstep(spec, metrics, outcome, deviations))
    });
    // The trace file belongs to this test case only.
    let _ = std::fs::remove_file(&file);
    row
}

/// When the fault of a sensor could be observed \[ns\]; none where that cannot be computed from the trace.
fn observable_ns<const N: usize>(
    spec: &Spec,
    config: &Config<N>,
    lines: &[TraceRow],
    event_ns: u64,
) -> Option<u64> {
    let resolution_rad = config.plausible.stuck_rad;
    let Event::Injected { kind, .. } = spec.event else {
        return None;
    };
    match kind {
        InjectionKind::EncoderStuck { joint } => {
            angle_is_wrong_ns(lines, event_ns, resolution_rad, |turned_rad| {
                stuck_error_rad(turned_rad, joint)
            })
        }
        InjectionKind::MotorEncoderStuck { motor } => {
            let joint_from_motor = config.joint_from_motor;
            let motor_from_joint = joint_from_motor.try_inverse()?;
            angle_is_wrong_ns(lines, event_ns, resolution_rad, |turned_rad| {
                let turned = motor_from_joint * Vector::<N>::from_column_slice(turned_rad);
                (joint_from_motor.column(motor) * turned[motor]).amax()
            })
        }
        InjectionKind::EncoderOffset { .. }
        | InjectionKind::EncoderNan { .. }
        | InjectionKind::ReplyLost { .. } => Some(event_ns),
        _ => None,
    }
}

/// Faults to inject, with their times counted from active drives.
fn injections(spec: &Spec, event_s: f64, back_s: f64, push: Option<f64>) -> Vec<Injection> {
    let active_s = match spec.plant {
        PlantKind::Emu => crate::up::GRAVITY_HOLD_S,
        _ => 0.0,
    };
    let at = |kind| Injection {
        kind,
        trigger: Trigger::Active {
            at_s: event_s - active_s,
        },
    };
    let at_once = |kind| Injection {
        kind,
        trigger: Trigger::AtStart,
    };
    let on_sim = spec.plant == PlantKind::Sim;
    match spec.event {
        Event::Injected {
            kind,
            at_once: true,
        } => vec![at_once(kind)],
        Event::Injected { kind, .. } => vec![at(kind)],
        Event::Activation(Activation::InFault) => vec![at(InjectionKind::EncoderOffset {
            joint: Some(1),
            offset_rad: 0.2,
        })],
        Event::Drives(_) if on_sim => vec![at(InjectionKind::DrivesIdle {
            for_s: Some(back_s),
        })],
        Event::Request(InvalidRequest::WhileIdle) if on_sim => {
            vec![at_once(InjectionKind::DrivesIdle { for_s: None })]
        }
        _ => push
            .map(|speed_rad_per_s| {
                at(InjectionKind::Bump {
                    joint: 1,
                    speed_rad_per_s,
                })
            })
            .into_iter()
            .collect(),
    }
}

/// Buttons that an operator presses on the pendant of an emulated arm.
fn presses(spec: &Spec, event_s: f64, back_s: f64) -> Vec<String> {
    let at = |button: &str, after_s: f64| format!("{button}@held+{:.4}", event_s + after_s);
    match spec.event {
        Event::Drives(DriveShutdown::Idle | DriveShutdown::IdleWhenStiff) => {
            vec![at("idle", 0.0), at("activate", back_s)]
        }
        Event::Drives(DriveShutdown::EStop) => vec![
            at("e-stop", 0.0),
            at("release", 0.5),
            at("idle", 0.6),
            at("activate", back_s),
        ],
        Event::Activation(_) => vec![at("activate", back_s)],
        _ => Vec::new(),
    }
}

fn run<const N: usize>(
    spec: &Spec,
    up: &UpArgs,
    script: &Script<N>,
    description: &Description,
    domain: &Domain,
    event_s: f64,
    back_s: f64,
) -> Result<(Vec<ControllerSample>, Vec<String>), Failure> {
    let mut system = System::<N>::new(up, description, domain)?;
    let activate = spec.event != Event::Request(InvalidRequest::WhileIdle);
    let presses = presses(spec, event_s, back_s);
    let mut refusals = system.start_scripted(&script.requests, activate, &presses)?;
    let (mut samples, begin) = (Vec::new(), Instant::now());
    loop {
        let telemetry = system.poll_telemetry()?;
        samples.extend(telemetry.as_ref().map(ControllerSample::of));
        refusals.extend(system.refusals()?);
        if telemetry.is_none() && system.clock_has_ended()? {
            break;
        }
        if begin.elapsed() > TIMEOUT {
            return Err(Failure::DidNotReachTracking);
        }
    }
    system.end()?;
    Ok((samples, refusals))
}
