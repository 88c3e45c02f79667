//! Runs a test case in virtual time. All requests are queued before the first cycle, so every run is bit-identical.

use super::evaluation::evaluate;
use super::metrics::{ControllerSample, RowMetrics};
use super::observable::observable_ns;
use super::row::Row;
use super::spec::{Activation, DriveShutdown, Event, FaultTime, InvalidRequest, Spec, TestTask};
use super::task::{Script, law_force_n, weight_n};
use super::test_arms::TestArm;
use super::trace::{self, TraceRow};
use crate::cli::{PlantKind, UpArgs};
use crate::up::{START_S, System};
use core::time::Duration;
use std::time::Instant;
use supple_cli::arguments::PlantArgs;
use supple_cli::exit::Failure;
use supple_core::dynamics::{jacobian, potential_energy};
use supple_core::{Config, Vector};
use supple_ipc::Domain;
use supple_model::Description;
use supple_plant::{Injection, InjectionKind, Trigger};

/// Vertical clearance between the start of the trajectory (height 0) and the top face of the block, without the cap
/// radius \[m\].
const BLOCK_CLEARANCE_M: f64 = 0.05;
/// Vertical clearance for an arm that is only pushed and does not travel far \[m\].
const PUSHED_BLOCK_CLEARANCE_M: f64 = 0.01;
/// Vertical clearance for the ramp of the breakaway task \[m\].
const RAMPED_BLOCK_CLEARANCE_M: f64 = 0.004;
/// Cap radius of an arm without a tool \[m\].
const CAP_M: f64 = 0.02;
/// Observation time after the event \[s\].
const OBSERVED_S: f64 = 1.5;
/// Time from the emergency stop until its release \[s\].
const RELEASE_S: f64 = 0.5;
/// Time from disabling the drives until the operator activates them again \[s\].
const REENABLE_S: f64 = 1.0;
/// Time in which an arm with idle drives sinks from its home pose onto its stops \[s\].
const SUNK_S: f64 = 4.5;
/// Timeout of a run in wall-clock time; the longest run takes seconds.
const TIMEOUT: Duration = Duration::from_secs(120);
/// Speed at which a pushed tip hits a block \[m/s\].
const PUSHED_M_PER_S: f64 = 0.25;

/// Runs without an event for comparison, one for each plant and task.
#[derive(Default)]
pub struct BaselineRuns {
    runs: Vec<((PlantKind, TestTask, bool), Vec<TraceRow>)>,
}

impl BaselineRuns {
    /// Returns the trace of a task without an event; runs the task on the first call.
    fn lines<const N: usize>(
        &mut self,
        spec: &Spec,
        arm: &TestArm,
    ) -> Result<&[TraceRow], Failure> {
        let key = (spec.plant, spec.task, spec.realistic);
        let index = match self.runs.iter().position(|(of, _)| *of == key) {
            Some(index) => index,
            None => {
                let event = Event::Nothing { wall: false };
                let lines = Run::<N>::perform(&Spec { event, ..*spec }, arm)?.lines;
                self.runs.push((key, lines));
                self.runs.len() - 1
            }
        };
        Ok(&self.runs[index].1)
    }
}

/// Runs a test case in virtual time.
///
/// # Errors
/// If the system cannot be started, or one of its processes exits.
pub fn perform<const N: usize>(
    spec: &Spec,
    arm: &TestArm,
    undisturbed: &mut BaselineRuns,
) -> Result<Row, Failure> {
    let run = Run::<N>::perform(spec, arm)?;
    let (config, script) = (&run.config, &run.script);
    let event_ns = run.event_ns(spec);
    let mut metrics = RowMetrics::new(
        &run.lines,
        &run.samples,
        run.at(script.task_start_cycle),
        event_ns,
    );
    if let Event::Injected { kind, .. } = spec.event {
        let undisturbed = undisturbed.lines::<N>(spec, arm)?;
        let at_ns = observable_ns(kind, config, &run.lines, undisturbed, event_ns);
        metrics.observable_at(at_ns, event_ns);
    }
    metrics.law_force_n = law_force_n(spec.task, config, &script.start_rad);
    // An obstacle that stops the joint of a ramp cannot be distinguished from a stuck encoder: the arm brakes and leans on it.
    if spec.task == TestTask::Breakaway && metrics.braked_after_ms.is_some() {
        metrics.weight_n = Some(weight_n(config, &script.start_rad));
    }
    if let Event::Injected {
        kind: InjectionKind::MotorDead { .. },
        ..
    } = spec.event
    {
        metrics.energy_since_fault(&run.lines, &run.samples, event_ns, |position_rad| {
            potential_energy(&config.arm, &Vector::from_fn(|i, _| position_rad[i]))
        });
    }
    let (outcome, deviations) = evaluate(spec, &metrics, &run.refusals);
    Ok(Row::lockstep(spec, metrics, outcome, deviations))
}

/// A run in virtual time.
struct Run<const N: usize> {
    config: Config<N>,
    script: Script<N>,
    /// Start of the script \[s\].
    start_s: f64,
    lines: Vec<TraceRow>,
    samples: Vec<ControllerSample>,
    refusals: Vec<String>,
}

impl<const N: usize> Run<N> {
    fn perform(spec: &Spec, arm: &TestArm) -> Result<Run<N>, Failure> {
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
        let start_s = START_S[usize::from(spec.plant == PlantKind::Emu)];
        let times = EventTimes {
            event_s: start_s + script.event_cycle as f64 * config.period_s,
            back_s: match spec.event {
                Event::Drives(DriveShutdown::EStop) => 0.0,
                Event::Drives(DriveShutdown::IdleAtHome) => SUNK_S,
                Event::Drives(_) | Event::Activation(Activation::InFault) => REENABLE_S,
                _ => 0.0,
            },
        };
        let cap_m = description.tool().map_or(CAP_M, |tool| tool.cap_radius_m);
        let push_rad_per_s = -PUSHED_M_PER_S / jacobian(&config.arm, &script.start_rad)[(2, 1)];
        let up = UpArgs {
            trace: Some(file.clone()),
            prefix: Some(prefix),
            ..times.up(spec, arm, cap_m, push_rad_per_s)
        };
        let performed = run::<N>(spec, &up, &script, description, &domain, &times);
        let run = performed.and_then(|(samples, refusals)| {
            // Samples after the end of the run belong to the shutdown.
            let end_ns = samples.last().map_or(0, |sample| sample.time_ns);
            let mut lines = trace::read(&file)?;
            lines.retain(|line| line.time_ns <= end_ns);
            Ok(Run {
                config,
                script,
                start_s,
                lines,
                samples,
                refusals,
            })
        });
        // The trace file belongs to this run only.
        let _ = std::fs::remove_file(&file);
        run
    }

    /// Returns the time of a cycle of the script on the arm's clock \[ns\].
    fn at(&self, cycles: u64) -> u64 {
        let cycle = (self.start_s / self.config.period_s).round() as u64 + cycles;
        let found = self.samples.iter().find(|sample| sample.cycle >= cycle);
        found.map_or(u64::MAX, |sample| sample.time_ns)
    }

    fn event_ns(&self, spec: &Spec) -> u64 {
        let first = |begun: fn(&&TraceRow) -> bool| {
            self.lines
                .iter()
                .find(begun)
                .map_or(u64::MAX, |line| line.time_ns)
        };
        match spec.event {
            Event::Injected {
                when: FaultTime::FromTheStart,
                ..
            } => first(|line| line.active),
            Event::Injected { .. } => first(|line| line.injections > 0),
            Event::Obstacle => self.at(self.script.task_start_cycle),
            _ => self.at(self.script.event_cycle),
        }
    }
}

/// Times of the events of a run \[s\].
struct EventTimes {
    /// Time of the event, from the start.
    event_s: f64,
    /// Time from the event until the drives are activated again.
    back_s: f64,
}

impl EventTimes {
    /// Arguments of the system of a test case.
    fn up(&self, spec: &Spec, arm: &TestArm, cap_m: f64, push_rad_per_s: f64) -> UpArgs {
        let at_rest = matches!(spec.task, TestTask::GravityHold | TestTask::Float);
        let pushed = spec.event == Event::Obstacle && at_rest;
        UpArgs {
            strict: arm.strict,
            block_m: (spec.event == Event::Obstacle).then_some(match spec.task {
                TestTask::Probe => 0.0,
                // The ramp moves the tip by some millimetres only.
                TestTask::Breakaway => -(RAMPED_BLOCK_CLEARANCE_M + cap_m),
                _ if at_rest => -(PUSHED_BLOCK_CLEARANCE_M + cap_m),
                _ => -(BLOCK_CLEARANCE_M + cap_m),
            }),
            inject: injections(spec, self, pushed.then_some(push_rad_per_s)),
            plant_options: PlantArgs {
                realistic: spec.realistic,
                ..PlantArgs::default()
            },
            rate_hz: arm.rate_hz,
            for_s: Some(self.event_s + self.back_s + OBSERVED_S),
            virtual_time: true,
            no_realtime: true,
            ..UpArgs::with_defaults(spec.plant, arm.name.clone())
        }
    }
}

/// Returns the faults to inject, with times relative to the activation of the drives.
fn injections(spec: &Spec, times: &EventTimes, push: Option<f64>) -> Vec<Injection> {
    let EventTimes { event_s, back_s } = *times;
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
            when: FaultTime::FromTheStart,
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

/// Returns the buttons to press on the pendant of an emulated arm.
fn presses(spec: &Spec, times: &EventTimes) -> Vec<String> {
    let EventTimes { event_s, back_s } = *times;
    let at = |button: &str, after_s: f64| format!("{button}@held+{:.4}", event_s + after_s);
    match spec.event {
        Event::Drives(
            DriveShutdown::Idle | DriveShutdown::IdleWhenStiff | DriveShutdown::IdleAtHome,
        ) => {
            vec![at("idle", 0.0), at("activate", back_s)]
        }
        // The arm loses its position reference with its power, and then waits for the confirmation of its home pose.
        Event::Drives(DriveShutdown::EStop) => vec![
            at("e-stop", 0.0),
            at("release", RELEASE_S),
            at("idle", RELEASE_S + 0.1),
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
    times: &EventTimes,
) -> Result<(Vec<ControllerSample>, Vec<String>), Failure> {
    let mut system = System::<N>::new(up, description, domain)?;
    let activate = spec.event != Event::Request(InvalidRequest::WhileIdle);
    let presses = presses(spec, times);
    let mut refusals = system.start_scripted(&script.requests, activate, &presses)?;
    let (mut samples, begin) = (Vec::new(), Instant::now());
    loop {
        let telemetry = system.poll_telemetry()?;
        samples.extend(telemetry.as_ref().map(ControllerSample::of));
        refusals.extend(system.refusals()?);
        if telemetry.is_none() {
            match system.clock_has_ended() {
                Ok(true) => break,
                // The arm is not in its home pose: no confirmation is given.
                Ok(false)
                    if spec.event == Event::Drives(DriveShutdown::EStop)
                        && domain.home_pose_confirmation().requested_pose().is_some() =>
                {
                    break;
                }
                Ok(false) => {}
                Err(failure) => return Err(failure),
            }
        }
        if begin.elapsed() > TIMEOUT {
            return Err(Failure::DidNotReachTracking);
        }
    }
    system.end()?;
    Ok((samples, refusals))
}
