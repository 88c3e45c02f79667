//! A row in virtual time: everything is asked for before the first cycle, so that each run is the same to the bit.

use super::judge::judge;
use super::measure::{Measures, Said};
use super::row::Row;
use super::spec::{Event, Lowered, Spec, Work, Wrong};
use super::trace;
use super::work::Script;
use crate::cli::{Course, DrillArgs, PlantKind, UpArgs};
use crate::exit::Failure;
use crate::up::{START_S, System};
use core::time::Duration;
use std::path::PathBuf;
use std::time::Instant;
use supple_core::dynamics::jacobian;
use supple_ipc::Domain;
use supple_model::Description;
use supple_plant::{Injection, InjectionKind, Trigger};

/// Height of a block's face beneath the start of the trajectory, whose height is 0, less the cap \[m\].
const BENEATH_M: f64 = 0.05;
/// The same where the arm is only pushed: it does not come far.
const CLOSE_M: f64 = 0.01;
/// Cap of an arm without a tool \[m\].
const CAP_M: f64 = 0.02;
/// What is watched after it happened \[s\].
const WATCHED_S: f64 = 1.5;
/// From drives that are lowered to the button that activates them, and with an emergency stop in between \[s\].
const BACK_S: (f64, f64) = (1.0, 3.0);
/// Longest run by the wall clock; the longest takes seconds.
const WITHIN: Duration = Duration::from_secs(120);
/// Speed at which a tip that is pushed meets a block \[m/s\].
const PUSHED_M_PER_S: f64 = 0.25;

/// Performs a row.
///
/// # Errors
/// A system that cannot be started, or a process of it that ends.
pub fn perform<const N: usize>(
    spec: &Spec,
    args: &DrillArgs,
    description: &Description,
) -> Result<Row, Failure> {
    let config = description.config::<N>()?;
    let home_rad = description.home::<N>()?;
    let script = Script::new(spec, &config, description, &home_rad)?;
    let prefix = format!("drill-{}", std::process::id());
    let domain = Domain::new(Some(&prefix))?;
    let file = domain.folder().join(format!("{prefix}.csv"));
    let cap_m = description.tool().map_or(CAP_M, |tool| tool.cap_radius_m);
    let start_s = START_S[usize::from(spec.plant == PlantKind::Emu)];
    let event_s = start_s + script.event_at as f64 * config.period_s;
    let back_s = match spec.event {
        Event::Drives(Lowered::EStop) => BACK_S.1,
        Event::Drives(_) => BACK_S.0,
        _ => 0.0,
    };
    let pushed = (spec.event, spec.work) == (Event::Obstacle, Work::GravityHold);
    let push_rad_per_s = -PUSHED_M_PER_S / jacobian(&config.arm, &script.start_rad)[(2, 1)];
    let up = UpArgs {
        plant: spec.plant,
        arm: args.arm.clone(),
        strict: args.strict,
        track: Course::Sinusoid,
        bus: None,
        zero_at_home: false,
        tare: false,
        block_m: (spec.event == Event::Obstacle).then_some(match spec.work {
            Work::Probe => 0.0,
            Work::GravityHold => -(CLOSE_M + cap_m),
            _ => -(BENEATH_M + cap_m),
        }),
        inject: injections(spec, event_s, back_s, pushed.then_some(push_rad_per_s)),
        trace: Some(file.clone()),
        rate_hz: None,
        for_s: Some(event_s + back_s + WATCHED_S),
        virtual_time: true,
        log: PathBuf::new(),
        no_log: true,
        prefix: Some(prefix),
        no_realtime: true,
        json: true,
    };
    let performed = run::<N>(spec, &up, &script, description, &domain, event_s, back_s);
    let row = performed.and_then(|(said, refusals)| {
        // What acts once the run is over is the way in which a system ends.
        let end_ns = said.last().map_or(0, |said| said.time_ns);
        let mut lines = trace::read(&file)?;
        lines.retain(|line| line.time_ns <= end_ns);
        let at = |cycles: u64| {
            let cycle = (start_s / config.period_s).round() as u64 + cycles;
            let found = said.iter().find(|said| said.cycle >= cycle);
            found.map_or(u64::MAX, |said| said.time_ns)
        };
        let work_ns = at(script.work_at);
        let event_ns = match spec.event {
            Event::Injected { at_once: true, .. } => {
                let active = lines.iter().find(|line| line.active);
                active.map_or(u64::MAX, |line| line.time_ns)
            }
            Event::Injected { .. } => {
                let begun = lines.iter().find(|line| line.injections > 0);
                begun.map_or(u64::MAX, |line| line.time_ns)
            }
            Event::Obstacle => work_ns,
            _ => at(script.event_at),
        };
        let seen = Measures::new(&lines, &said, work_ns, event_ns);
        let (outcome, wrong) = judge(spec, &seen, &refusals);
        Ok(Row::lockstep(spec, seen, outcome, wrong))
    });
    // It was this drill's alone; a next one writes its own.
    let _ = std::fs::remove_file(&file);
    row
}

/// What is put into the arm, and when: counted from active drives.
fn injections(spec: &Spec, event_s: f64, back_s: f64, push: Option<f64>) -> Vec<Injection> {
    let active_s = match spec.plant {
        PlantKind::Emu => crate::up::HELD_S,
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
        trigger: Trigger::AtOnce,
    };
    let on_sim = spec.plant == PlantKind::Sim;
    match spec.event {
        Event::Injected {
            kind,
            at_once: true,
        } => vec![at_once(kind)],
        Event::Injected { kind, .. } => vec![at(kind)],
        Event::Drives(_) if on_sim => vec![at(InjectionKind::DrivesIdle {
            for_s: Some(back_s),
        })],
        Event::Request(Wrong::WhileIdle) if on_sim => {
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

/// What an operator does at the pendant of an emulated arm.
fn presses(spec: &Spec, event_s: f64, back_s: f64) -> Vec<String> {
    let at = |button: &str, after_s: f64| format!("{button}@held+{:.4}", event_s + after_s);
    match spec.event {
        Event::Drives(Lowered::Idle | Lowered::IdleWhenStiff) => {
            vec![at("idle", 0.0), at("activate", back_s)]
        }
        Event::Drives(Lowered::EStop) => vec![
            at("e-stop", 0.0),
            at("release", 0.5),
            at("idle", 0.6),
            at("activate", back_s),
        ],
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
) -> Result<(Vec<Said>, Vec<String>), Failure> {
    let mut system = System::<N>::new(up, description, domain)?;
    let activate = spec.event != Event::Request(Wrong::WhileIdle);
    let presses = presses(spec, event_s, back_s);
    system.start_scripted(&script.requests, activate, &presses)?;
    let (mut said, mut refusals, begin) = (Vec::new(), Vec::new(), Instant::now());
    loop {
        let heard = system.hear()?;
        said.extend(heard.as_ref().map(Said::of));
        refusals.extend(system.refusals()?);
        if heard.is_none() && system.clock_has_ended()? {
            break;
        }
        if begin.elapsed() > WITHIN {
            return Err(Failure::NotTracking);
        }
    }
    system.end()?;
    Ok((said, refusals))
}
