//! `supple teach`, `supple play` and `supple track FILE`: motions that are taught by hand or given as points.
//!
//! A motion is repeated as set-points that wait in the controller for their cycle, so that neither this process nor the load of
//! the machine affects the motion. If this process ends, the reference stops after the last set-point.

use super::arm::{arm_of_system, check_arm};
use super::system_request::{print_mode, running};
use super::{Approach, OperatorSession};
use crate::cli::{PlayArgs, SystemArgs, TeachArgs};
use core::time::Duration;
use serde::Serialize;
use std::path::Path;
use std::time::Instant;
use supple_cli::arms;
use supple_cli::console::{print_json, print_line, print_status};
use supple_cli::exit::Failure;
use supple_cli::interrupt;
use supple_core::Controller;
use supple_core::config::Gains;
use supple_core::controller::{Mode, Request};
use supple_core::math::Vector3;
use supple_experiment::ExperimentError;
use supple_experiment::metrics::Rms;
use supple_experiment::teaching::{
    Points, RecordedMotion, Repetition, read_points, time_waypoints,
};
use supple_ipc::message::Telemetry;
use supple_ipc::{Domain, TelemetryReader};
use supple_model::{Description, with_dof};

/// Time between two samples of a recording \[ns\].
const SAMPLE_NS: u64 = 5_000_000;
/// Maximum duration of a recording \[s\].
const MAX_TEACH_S: f64 = 3600.0;
/// Number of set-points that wait in the controller; one operator may have 8.
const AHEAD: usize = 6;
/// Time from the request of the hold at the start to the first motion \[s\].
const LEAD_S: f64 = 0.3;
/// Time in which the arm comes to rest after the motion \[s\].
const SETTLE_S: f64 = 0.5;
/// Time without telemetry after which a system counts as ended.
const SILENCE: Duration = Duration::from_secs(5);
/// Fraction of the limits of speed and acceleration with which waypoints are passed.
const LIMIT_SHARE: f64 = 0.8;

/// Stream of telemetry, which fails if the system ends.
struct TelemetryStream<'a> {
    reader: &'a mut TelemetryReader,
    prefix: &'a str,
    last: Instant,
}

impl TelemetryStream<'_> {
    /// Returns the next cycle, or `None` after a short wait.
    fn next(&mut self) -> Result<Option<Telemetry>, Failure> {
        let next = self.reader.wait(Duration::from_millis(20));
        match next.map_err(Failure::system)? {
            Some(telemetry) => {
                self.last = Instant::now();
                Ok(Some(telemetry))
            }
            None if self.last.elapsed() > SILENCE => Err(Failure::NotRunning {
                prefix: self.prefix.to_owned(),
            }),
            None => Ok(None),
        }
    }
}

/// Result of `supple teach`, in the form that `--json` prints.
#[derive(Serialize)]
struct TeachResult<'a> {
    file: &'a Path,
    samples: usize,
    duration_s: f64,
    /// Number of cycles missing in the recording.
    lost: u64,
    /// Mode at the end of the recording.
    ended_by: &'static str,
}

/// Runs `supple teach`: enters float and records the motion until it is ended.
///
/// # Errors
/// [`Failure`]; the recording until a fault is written.
pub fn teach(args: &TeachArgs) -> Result<(), Failure> {
    supple_files::check_output(&args.file)
        .map_err(|error| Failure::file("create", &args.file, error))?;
    let (domain, mut reader, telemetry) = running(&args.system)?;
    let dof = usize::from(telemetry.state.dof);
    with_dof!(dof, N => teach_sized::<N>(args, &domain, &mut reader))?
}

fn teach_sized<const N: usize>(
    args: &TeachArgs,
    domain: &Domain,
    reader: &mut TelemetryReader,
) -> Result<(), Failure> {
    let stop = interrupt::shutdown_on_interrupt();
    let mut session = OperatorSession::<N>::new(domain)?;
    let since = session.send_request(&Request::Float, None)?.cycle;
    print_status("the arm floats: guide it by hand; end with Ctrl-C or with another mode");
    let lost_before = reader.lost();
    let mut stream = TelemetryStream {
        reader,
        prefix: domain.prefix(),
        last: Instant::now(),
    };
    let mut recorded = RecordedMotion::default();
    let (mut start_ns, mut next_ns) = (None, 0);
    let until_s = args.for_s.unwrap_or(MAX_TEACH_S);
    let ended = loop {
        if stop.shutdown_requested() {
            break Mode::Float;
        }
        let Some(telemetry) = stream.next()? else {
            continue;
        };
        if telemetry.state.cycle < since {
            continue;
        }
        let record = telemetry.record_of::<N>();
        let mode = record.mode();
        if mode != Some(Mode::Float) {
            break mode.unwrap_or(Mode::Idle);
        }
        let stamp_ns = telemetry.state.stamp_ns;
        let start_ns = *start_ns.get_or_insert(stamp_ns);
        let time_s = stamp_ns.saturating_sub(start_ns) as f64 / 1e9;
        if time_s > until_s {
            break Mode::Float;
        }
        if stamp_ns >= next_ns {
            next_ns = stamp_ns + SAMPLE_NS;
            let tip_m = Vector3::from(record.tip_position_m);
            recorded.push(time_s, tip_m, record.position_rad.as_slice());
        }
    };
    let lost = stream.reader.lost() - lost_before;
    if ended == Mode::Float {
        session.send_request(&Request::GravityHold, None)?;
    }
    let taught = recorded.trimmed().ok_or(Failure::NothingTaught)?;
    taught
        .write(&args.file)
        .map_err(|error| Failure::Points(Box::new(error)))?;
    let report = TeachResult {
        file: &args.file,
        samples: taught.time_s.len(),
        duration_s: taught.duration_s(),
        lost,
        ended_by: match ended {
            Mode::Float => "request",
            mode => mode.name(),
        },
    };
    if let (Some(for_s), true) = (args.for_s, ended != Mode::Float) {
        print_status(&format!(
            "warning: the mode {} ended the recording before {for_s} s had passed: teach again when nothing else requests a mode, such \
             as `supple up` until it tracks",
            ended.name()
        ));
    }
    match args.system.json {
        true => print_json(&report)?,
        false => print_line(&format!(
            "{}: {:.1} s of motion; repeat it with `supple play {}`",
            args.file.display(),
            report.duration_s,
            args.file.display()
        ))?,
    }
    match ended {
        Mode::Fault => Err(Failure::SystemInFault),
        _ => Ok(()),
    }
}

/// A motion to repeat on a running system.
pub struct Playback<'a> {
    /// File of the motion.
    pub file: &'a Path,
    /// Speed relative to the recording, or relative to the speed that the limits allow for waypoints.
    pub speed: f64,
    /// Name or path of the arm.
    pub arm: &'a str,
    /// Whether to reject a URDF that is not read completely.
    pub strict: bool,
    /// Stiffness to set before the motion: one value, or three.
    pub stiffness: &'a [f64],
    /// Damping to set before the motion: one value, or three.
    pub damping: &'a [f64],
    /// System to use.
    pub system: &'a SystemArgs,
}

/// Result of a repetition, in the form that `--json` prints.
#[derive(Serialize)]
struct PlaybackResult {
    duration_s: f64,
    /// Ratio of the duration to that of the taught or timed motion.
    slowdown: f64,
    set_points: usize,
    /// RMS distance of the tip from the taught motion \[m\].
    rms_error_m: f64,
    max_error_m: f64,
    /// Number of compared cycles, and below of cycles whose telemetry was lost.
    cycles: u64,
    lost: u64,
}

/// Runs `supple play`.
///
/// # Errors
/// The same as those of [`perform`].
pub fn play(args: &PlayArgs) -> Result<(), Failure> {
    perform(&Playback {
        file: &args.file,
        speed: args.speed,
        arm: &arm_of_system(&args.system, args.arm.as_deref(), &args.urdf)?,
        strict: args.strict,
        stiffness: &args.stiffness,
        damping: &args.damping,
        system: &args.system,
    })
}

/// Repeats a motion: checks it, moves the arm to its start, then follows it.
///
/// # Errors
/// [`Failure`]; the arm does not move if the controller would refuse any part of the motion.
pub fn perform(performance: &Playback<'_>) -> Result<(), Failure> {
    let description = arms::find(performance.arm, performance.strict)?;
    let points = read_points(performance.file).map_err(|error| Failure::Points(Box::new(error)))?;
    let (domain, mut reader, telemetry) = running(performance.system)?;
    check_arm(&domain, performance.arm, &description, &telemetry)?;
    with_dof!(description.dof(), N => perform_sized::<N>(
        performance, &description, &points, &domain, &mut reader, &telemetry
    ))?
}

fn perform_sized<const N: usize>(
    performance: &Playback<'_>,
    description: &Description,
    points: &Points,
    domain: &Domain,
    reader: &mut TelemetryReader,
    telemetry: &Telemetry,
) -> Result<(), Failure> {
    let controller = Controller::<N>::new(description.config()?).map_err(ExperimentError::from)?;
    let config = controller.config();
    let refused = |reason: String| Failure::Motion {
        file: performance.file.to_owned(),
        reason,
    };
    let (recorded, speed) = match points {
        Points::RecordedMotion(recorded) => (recorded.clone(), performance.speed),
        Points::Waypoints(points_m) => {
            let share = LIMIT_SHARE * performance.speed.min(1.0);
            let limits = &config.limits;
            let timed = time_waypoints(
                points_m,
                share * limits.tip_speed_m_per_s,
                share * limits.tip_acceleration_m_per_s2,
            );
            (timed.map_err(|error| refused(error.to_string()))?, 1.0)
        }
    };
    let repetition = Repetition::plan(&controller, &recorded, speed)
        .map_err(|error| refused(error.to_string()))?;
    if repetition.slowdown * speed > 1.05 {
        print_status(&format!(
            "the limits of the arm need {:.1} times the time",
            repetition.slowdown * speed
        ));
    }

    let mut session = OperatorSession::<N>::new(domain)?;
    let now = telemetry.record_of::<N>();
    if !(performance.stiffness.is_empty() && performance.damping.is_empty()) {
        let gains = Gains {
            stiffness_n_per_m: super::axes(
                "--stiffness",
                performance.stiffness,
                now.stiffness_n_per_m,
            )?,
            damping_n_s_per_m: super::axes(
                "--damping",
                performance.damping,
                now.damping_n_s_per_m,
            )?,
        };
        let ramp_s = 0.5;
        session.send_request(&Request::Gains { gains, ramp_s }, None)?;
    }
    let mut stream = TelemetryStream {
        reader,
        prefix: domain.prefix(),
        last: Instant::now(),
    };
    let approach = Approach::from_pose(config, repetition.start(), repetition.start_rad);
    session.follow(&approach, &now.position_rad, None)?;
    // The last pending request is the hold at the start of the motion.
    let holds_since = loop {
        stream.next()?;
        if let (Some(reply), false) = (session.check()?, session.is_pending()) {
            break reply.cycle;
        }
    };
    let start_cycle = holds_since + (LEAD_S / config.period_s).round() as u64;
    let end_cycle = repetition.end_cycle(start_cycle);
    let settled_cycle = end_cycle + (SETTLE_S / config.period_s).round() as u64;
    let lost_before = stream.reader.lost();
    let (mut sent, mut error) = (0, Rms::default());
    let mut cycles = 0;
    let last = loop {
        while sent < repetition.len() && session.pending() < AHEAD {
            let (request, at_cycle) = repetition.request(sent, start_cycle);
            session.queue(&request, at_cycle)?;
            sent += 1;
        }
        let telemetry = stream.next()?;
        session.check()?;
        let Some(telemetry) = telemetry else { continue };
        let cycle = telemetry.state.cycle;
        let record = telemetry.record_of::<N>();
        if cycle > holds_since && record.mode != Mode::Track as u8 {
            let mode = record.mode().map_or("another", |mode| mode.name());
            return Err(match mode {
                "fault" => Failure::SystemInFault,
                _ => refused(format!("the mode became {mode} on the way")),
            });
        }
        if (start_cycle..=end_cycle).contains(&cycle) {
            let shown_m = recorded
                .tip_at(recorded.time_s[0] + repetition.recorded_time_s(start_cycle, cycle));
            error.add((Vector3::from(record.tip_position_m) - shown_m).norm());
            cycles += 1;
        }
        if cycle >= settled_cycle {
            break telemetry;
        }
    };
    let report = PlaybackResult {
        duration_s: (end_cycle - start_cycle) as f64 * config.period_s,
        slowdown: repetition.slowdown,
        set_points: repetition.len(),
        rms_error_m: error.rms(),
        max_error_m: error.max_abs(),
        cycles,
        lost: stream.reader.lost() - lost_before,
    };
    if performance.system.json {
        return print_json(&report);
    }
    print_line(&format!(
        "{:.1} s repeated; the tip was {:.1} mm from the motion (RMS), at most {:.1} mm",
        report.duration_s,
        1e3 * report.rms_error_m,
        1e3 * report.max_error_m
    ))?;
    print_mode(
        performance.system,
        last.record_of::<N>().mode(),
        last.state.cycle,
    )
}
