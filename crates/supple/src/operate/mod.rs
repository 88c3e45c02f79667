//! Talking to a running system: what it does, and asking for something else.
//!
//! Every request is checked by the controller; what is printed is its answer.

mod approach;
mod pendant;
mod session;
mod status;

pub use approach::Approach;
pub use pendant::{Pendant, pendant};
pub use session::Session;
pub use status::status;

use crate::arms;
use crate::cli::{Course, GainsArgs, ModeName, Place, Shape, TrackArgs};
use crate::console::{say, say_json};
use crate::exit::Failure;
use crate::up::stop_running;
use core::time::Duration;
use serde::Serialize;
use supple_core::Trajectory;
use supple_core::config::Gains;
use supple_core::controller::{Mode, Request};
use supple_core::math::Vector3;
use supple_experiment::scenario;
use supple_ipc::message::{OperatorReply, Outcome, Telemetry};
use supple_ipc::{Domain, TelemetryReader, ask_for_idle};
use supple_model::{Description, with_dof};

/// Cap of an arm without a tool \[m\].
const CAP_M: f64 = 0.02;
/// Longest wait for a sign of life.
const ALIVE_WITHIN: Duration = Duration::from_secs(2);

/// The answer to a request, as `--json` gives it.
#[derive(Serialize)]
struct Answer {
    accepted: bool,
    mode: &'static str,
    cycle: u64,
}

/// The system of a place, with its latest telemetry.
///
/// # Errors
/// [`Failure::NotRunning`] where there is none.
fn running(place: &Place) -> Result<(Domain, TelemetryReader, Telemetry), Failure> {
    let domain = Domain::new(place.prefix.as_deref())?;
    let mut reader = TelemetryReader::new(&domain)?;
    match reader.wait(ALIVE_WITHIN)? {
        Some(telemetry) => Ok((domain, reader, telemetry)),
        None => Err(Failure::NotRunning {
            prefix: domain.prefix().to_owned(),
        }),
    }
}

/// To idle or to gravity hold.
///
/// # Errors
/// [`Failure`].
pub fn mode(mode: ModeName, place: &Place) -> Result<(), Failure> {
    match mode {
        ModeName::Idle => idle(place),
        ModeName::GravityHold => simple(place, Simple::GravityHold),
    }
}

/// To idle, on a way that takes no reader's or operator's place, no shared memory and no lock.
fn idle(place: &Place) -> Result<(), Failure> {
    let domain = Domain::new(place.prefix.as_deref())?;
    match ask_for_idle(&domain, ALIVE_WITHIN)? {
        Some(answer) if answer.outcome == Outcome::Refused => Err(Failure::Refused {
            words: answer.words,
        }),
        Some(answer) => told(place, answer.mode, answer.cycle),
        None => Err(Failure::NotRunning {
            prefix: domain.prefix().to_owned(),
        }),
    }
}

/// Out of a fault.
///
/// # Errors
/// [`Failure`].
pub fn reset(place: &Place) -> Result<(), Failure> {
    simple(place, Simple::Reset)
}

#[derive(Clone, Copy)]
enum Simple {
    GravityHold,
    Reset,
    Gains(Gains, f64),
}

fn simple(place: &Place, wish: Simple) -> Result<(), Failure> {
    fn ask<const N: usize>(domain: &Domain, wish: Simple) -> Result<OperatorReply, Failure> {
        let request: Request<N> = match wish {
            Simple::GravityHold => Request::GravityHold,
            Simple::Reset => Request::Reset,
            Simple::Gains(gains, ramp_s) => Request::Gains { gains, ramp_s },
        };
        Session::<N>::new(domain)?.ask(&request, None)
    }
    let (domain, _reader, telemetry) = running(place)?;
    let dof = usize::from(telemetry.state.dof);
    let reply = with_dof!(dof, N => ask::<N>(&domain, wish))??;
    answered(place, &reply)
}

/// Other stiffness and damping, reached along a ramp. What is not given stays.
///
/// # Errors
/// [`Failure`].
pub fn gains(args: &GainsArgs) -> Result<(), Failure> {
    let (_, _, telemetry) = running(&args.place)?;
    let axes = |given: &[f64], now: [f64; 3]| match given {
        [] => Vector3::from(now),
        [all] => Vector3::repeat(*all),
        [x, y, z, ..] => Vector3::new(*x, *y, *z),
        [x, y] => Vector3::new(*x, *y, now[2]),
    };
    let gains = Gains {
        stiffness_n_per_m: axes(&args.stiffness, telemetry.stiffness_n_per_m),
        damping_n_s_per_m: axes(&args.damping, telemetry.damping_n_s_per_m),
    };
    simple(&args.place, Simple::Gains(gains, args.ramp_s))
}

/// What a system follows, with its duration \[s\].
pub fn course(course: Course, description: &Description) -> (Trajectory, f64) {
    match course {
        Course::Sinusoid => scenario::sinusoid(1.0),
        Course::Arc => scenario::arc(),
        Course::Quadrant => {
            let (quadrant, duration_s) = scenario::quadrant(scenario::QUADRANT_SPEED_M_PER_S);
            (Trajectory::Quadrant(quadrant), duration_s)
        }
        Course::Probe => {
            let radius_m = description.tool().map_or(CAP_M, |tool| tool.cap_radius_m);
            let (probe, duration_s) = scenario::probe(radius_m);
            (Trajectory::Probe(probe), duration_s)
        }
    }
}

/// To the start of a trajectory, and along it.
///
/// # Errors
/// [`Failure`].
pub fn track(args: &TrackArgs) -> Result<(), Failure> {
    let (trajectory, duration_s) = match args.shape {
        Shape::Sinusoid => scenario::sinusoid(args.speed),
        Shape::Arc => scenario::arc(),
        Shape::Quadrant => {
            let speed_m_per_s = args.speed * scenario::QUADRANT_SPEED_M_PER_S;
            let (quadrant, duration_s) = scenario::quadrant(speed_m_per_s);
            (Trajectory::Quadrant(quadrant), duration_s)
        }
    };
    let description = arms::find(&args.arm, args.strict)?;
    follow(&args.place, &description, trajectory, duration_s)
}

/// To the start of the probing cycle, and along it.
///
/// # Errors
/// [`Failure`].
pub fn probe(arm: &str, strict: bool, place: &Place) -> Result<(), Failure> {
    let description = arms::find(arm, strict)?;
    let (trajectory, duration_s) = course(Course::Probe, &description);
    follow(place, &description, trajectory, duration_s)
}

fn follow(
    place: &Place,
    description: &Description,
    trajectory: Trajectory,
    duration_s: f64,
) -> Result<(), Failure> {
    fn sized<const N: usize>(
        domain: &Domain,
        telemetry: &Telemetry,
        description: &Description,
        trajectory: Trajectory,
        duration_s: f64,
    ) -> Result<OperatorReply, Failure> {
        let approach = Approach::<N>::new(&description.config()?, trajectory, duration_s)?;
        let position = core::array::from_fn(|i| telemetry.position_rad[i]);
        let mut session = Session::<N>::new(domain)?;
        session.follow(&approach, &position.into(), None)?;
        session.wait_for_all(approach.longest_wait(&position.into()))
    }
    let (domain, _reader, telemetry) = running(place)?;
    let reply = with_dof!(description.dof(), N => sized::<N>(
        &domain, &telemetry, description, trajectory, duration_s
    ))??;
    answered(place, &reply)
}

/// Ends the `supple up` of a system.
///
/// # Errors
/// [`Failure::NotRunning`].
pub fn stop(place: &Place) -> Result<(), Failure> {
    let domain = Domain::new(place.prefix.as_deref())?;
    if stop_running(&domain)? {
        return Ok(());
    }
    Err(Failure::NotRunning {
        prefix: domain.prefix().to_owned(),
    })
}

fn answered(place: &Place, reply: &OperatorReply) -> Result<(), Failure> {
    told(place, reply.mode(), reply.cycle)
}

/// Says what a request that was accepted has led to; a fault is no success.
fn told(place: &Place, mode: Option<Mode>, cycle: u64) -> Result<(), Failure> {
    let name = mode.map_or("unknown", |mode| mode.name());
    match place.json {
        true => say_json(&Answer {
            accepted: true,
            mode: name,
            cycle,
        })?,
        false => say(&format!("mode {name} since cycle {cycle}"))?,
    }
    match mode {
        Some(Mode::Fault) => Err(Failure::InFault),
        _ => Ok(()),
    }
}
