//! Calibration arm whose controller and plant are processes.

use crate::cli::{PlantKind, UpArgs};
use crate::operate::OperatorSession;
use crate::up::{CONTROLLER, ChildProcesses, Plan, Recorder, SHUTDOWN_TIMEOUT};
use core::time::Duration;
use std::collections::VecDeque;
use std::path::{Path, PathBuf};
use std::time::Instant;
use supple_cli::console::print_status;
use supple_cli::exit::Failure;
use supple_core::Vector;
use supple_core::codes::fault_kind;
use supple_core::controller::{Mode, Request};
use supple_experiment::Step;
use supple_experiment::procedure::{
    Motion, MotionArm, PerformedMotion, ProcedureError, StopCause, Stopped, moves_joints,
};
use supple_ipc::message::{Drives, OperatorReply, Telemetry};
use supple_ipc::{Domain, TelemetryReader};
use supple_model::{Description, MotorConstants};
use supple_plant::PlantOptions;
use supple_realtime::{Stop, pause};

/// Name of the folder for the model of the controller, in the folder of the results.
const MODEL: &str = "controller";
/// Timeout for a process to join, for a reply and for telemetry.
const TIMEOUT: Duration = Duration::from_secs(20);
/// Timeout for an arm without a pendant to become active \[s\], and number of attempts. All attempts together take longer
/// than laying the arm down, which takes some ten seconds.
const ENABLING_S: f64 = 1.0;
const ENABLING_ATTEMPTS: usize = 40;
/// Timeout for an operator to activate a real arm.
const ACTIVATION_TIMEOUT: Duration = Duration::from_secs(300);
/// Maximum duration of one wait for telemetry.
const POLL_INTERVAL: Duration = Duration::from_millis(20);
/// Maximum number of messages that may be waiting for this reader.
const MAX_WAITING: u32 = 20_000;
/// Time for which a mode is kept before the next change \[s\].
const SETTLE_S: f64 = 0.2;
/// Time after which a stopped arm stands still \[s\].
const REST_S: f64 = 1.5;

/// A system of processes with its arm.
pub struct RunningArm<const N: usize> {
    args: UpArgs,
    description: Description,
    domain: Domain,
    plan: Plan,
    children: ChildProcesses,
    reader: TelemetryReader,
    session: OperatorSession<N>,
    prefix: String,
    plant: PlantKind,
    /// Whether this program starts the processes; otherwise the system is already running.
    starts: bool,
    /// Whether a model has been loaded.
    loaded: bool,
    virtual_time: bool,
    options: PlantOptions,
    folder: PathBuf,
    logs: PathBuf,
    /// Folder in which the controller stores the description of the arm with the learned terms.
    learned: PathBuf,
    model: Description,
    stop: Stop,
    recorder: Option<Recorder<N>>,
    last: Option<Telemetry>,
    /// Cycle of the last gravity hold that this program requested.
    gravity_hold_cycle: u64,
}

impl<const N: usize> RunningArm<N> {
    /// Prepares a system without starting processes.
    ///
    /// # Errors
    /// If an option does not fit the plant, or shared memory cannot be used.
    pub fn new(
        args: &UpArgs,
        starts: bool,
        description: &Description,
        domain: &Domain,
        out: &Path,
        stop: Stop,
    ) -> Result<Self, Failure> {
        let out = std::path::absolute(out).map_err(|error| Failure::file("find", out, error))?;
        Ok(RunningArm {
            args: args.clone(),
            description: description.clone(),
            domain: domain.clone(),
            plan: Plan::new(args, description, domain, None)?,
            children: ChildProcesses::new(domain, args.virtual_time),
            reader: TelemetryReader::for_log(domain).map_err(Failure::system)?,
            session: OperatorSession::for_system(domain)?,
            prefix: domain.prefix().to_owned(),
            plant: args.plant,
            starts,
            loaded: false,
            virtual_time: args.virtual_time,
            options: args.plant_options.options(description)?,
            folder: out.join(MODEL),
            learned: domain.learned_folder(),
            logs: out.join(supple_experiment::procedure::LOGS),
            model: description.clone(),
            stop,
            recorder: None,
            last: None,
            gravity_hold_cycle: 0,
        })
    }

    /// Ends the processes in order: the controller sets the drives to idle first. If the system was already running, requests
    /// gravity hold and ends no process.
    ///
    /// # Errors
    /// If a process cannot be waited for, or the log cannot be completed.
    pub fn end(&mut self) -> Result<(), Failure> {
        while let Some(telemetry) = self.reader.receive().map_err(Failure::system)? {
            self.last = Some(telemetry);
        }
        let idle = self
            .last
            .as_ref()
            .is_some_and(|last| last.record().mode() == Some(Mode::Idle));
        if !self.starts && self.loaded && !idle {
            // The processes continue to run, but the requested motion must end. The controller may have ended.
            let _ = self.session.begin_request(&Request::GravityHold, None);
        }
        let log = self.finish_log();
        let reader = &mut self.reader;
        let mut drain = || -> Result<(), Failure> {
            while reader.receive().map_err(Failure::system)?.is_some() {}
            Ok(())
        };
        let within = self.plan.clock_owner_timeout();
        let children = &mut self.children;
        let controller = children.end(CONTROLLER, SHUTDOWN_TIMEOUT, &mut drain);
        let clock_owner = children.end(self.plan.clock_owner.name, within, &mut drain);
        let arm = match &self.plan.arm {
            Some(arm) => children.end(arm.name, SHUTDOWN_TIMEOUT, &mut || Ok(())),
            None => Ok(()),
        };
        log.and(controller).and(clock_owner).and(arm)
    }

    fn finish_log(&mut self) -> Result<(), Failure> {
        self.recorder.take().map_or(Ok(()), Recorder::finish)
    }

    /// Waits briefly for the next telemetry and adds it to the log.
    fn poll(&mut self) -> Result<Option<Telemetry>, Failure> {
        if self.stop.shutdown_requested() {
            return Err(Failure::Interrupted);
        }
        let telemetry = self.reader.wait(POLL_INTERVAL).map_err(Failure::system)?;
        match &telemetry {
            Some(telemetry) => {
                if let Some(recorder) = &mut self.recorder {
                    recorder.add(telemetry)?;
                }
                self.last = Some(*telemetry);
            }
            None => self.children.check()?,
        }
        Ok(telemetry)
    }

    /// Reads telemetry until `condition` holds.
    fn wait_for(
        &mut self,
        within: Duration,
        mut condition: impl FnMut(&Telemetry) -> bool,
    ) -> Result<bool, Failure> {
        let start = Instant::now();
        while start.elapsed() < within {
            if let Some(telemetry) = self.poll()?
                && condition(&telemetry)
            {
                return Ok(true);
            }
        }
        Ok(false)
    }

    /// Sends a request for a cycle, or for the next one. Reads telemetry until a controller is connected.
    fn begin(&mut self, request: &Request<N>, at_cycle: Option<u64>) -> Result<u64, Failure> {
        let start = Instant::now();
        loop {
            if let Some(sequence) = self.session.begin_request(request, at_cycle)? {
                return Ok(sequence);
            }
            self.poll()?;
            if start.elapsed() > TIMEOUT {
                return Err(self.not_running());
            }
        }
    }

    /// Waits for the reply to a request and reads telemetry into `unprocessed` meanwhile, because in virtual time the controller
    /// blocks if the queue of telemetry is full.
    fn wait_for_reply(
        &mut self,
        sequence: u64,
        unprocessed: &mut VecDeque<Telemetry>,
    ) -> Result<OperatorReply, Failure> {
        let start = Instant::now();
        loop {
            if let Some(reply) = self.session.reply_to(sequence)? {
                return Ok(reply);
            }
            unprocessed.extend(self.poll()?);
            if start.elapsed() > TIMEOUT {
                return Err(self.not_running());
            }
        }
    }

    fn request(&mut self, request: &Request<N>) -> Result<OperatorReply, Failure> {
        self.request_at(request, None)
    }

    fn request_at(
        &mut self,
        request: &Request<N>,
        at_cycle: Option<u64>,
    ) -> Result<OperatorReply, Failure> {
        let sequence = self.begin(request, at_cycle)?;
        self.wait_for_reply(sequence, &mut VecDeque::new())
    }

    /// Requests gravity hold. If the cycle `unless_idle_since` is given, the request is for that cycle, so that the controller
    /// refuses it if an operator requested idle in that cycle or later.
    fn request_gravity_hold(&mut self, unless_idle_since: Option<u64>) -> Result<(), Failure> {
        let reply = self.request_at(&Request::GravityHold, unless_idle_since)?;
        self.gravity_hold_cycle = reply.cycle;
        Ok(())
    }

    /// Waits as [`RunningArm::wait_for`] does, and fails if an operator requests another mode.
    fn wait_in_gravity_hold(
        &mut self,
        within: Duration,
        mut condition: impl FnMut(&Telemetry) -> bool,
    ) -> Result<bool, Failure> {
        let (gravity_hold_cycle, mut other) = (self.gravity_hold_cycle, None);
        let ended = self.wait_for(within, |telemetry| {
            let mode = telemetry.record().mode();
            let is_other = !matches!(mode, None | Some(Mode::GravityHold | Mode::Fault));
            if is_other && telemetry.state.cycle >= gravity_hold_cycle {
                other = mode;
            }
            other.is_some() || condition(telemetry)
        })?;
        match other {
            Some(mode) => Err(Failure::OtherMode { mode: mode.name() }),
            None => Ok(ended),
        }
    }

    fn not_running(&self) -> Failure {
        Failure::NotRunning {
            prefix: self.prefix.clone(),
        }
    }

    /// Starts the processes, or restarts the controller.
    fn launch(&mut self) -> Result<(), Failure> {
        let mut controller = self.plan.controller.clone();
        let folder = self.folder.display().to_string();
        let arm = controller.arguments.iter().position(|text| text == "--arm");
        if let Some(arm) = arm {
            controller.arguments[arm + 1] = folder;
        }
        if self.loaded {
            let reader = &mut self.reader;
            let mut drain = || -> Result<(), Failure> {
                while reader.receive().map_err(Failure::system)?.is_some() {}
                Ok(())
            };
            self.children
                .end(CONTROLLER, SHUTDOWN_TIMEOUT, &mut drain)?;
            return self.children.start(&controller);
        }
        self.loaded = true;
        if let Some(arm) = &self.plan.arm {
            self.children.start(arm)?;
        }
        if let Some(pendant) = self.plan.pendant.clone() {
            let children = &mut self.children;
            pendant.wait(TIMEOUT, &mut || children.check())?;
            pendant.press("idle")?;
        }
        self.children.start(&controller)?;
        self.children.start(&self.plan.clock_owner)
    }

    /// Activates an arm without a pendant. It becomes active soon after gravity hold requests torque. After a loss, for example
    /// of the controller, the plant first lays the arm down, and enables the motors only if idle was requested since then.
    fn activate_without_pendant(
        &mut self,
        mut unless_idle_since: Option<u64>,
    ) -> Result<(), Failure> {
        let period_s = self.model.settings().period_s;
        let cycles = |time_s: f64| (time_s / period_s) as u64;
        for _ in 0..ENABLING_ATTEMPTS {
            self.request_gravity_hold(unless_idle_since)?;
            let since = self.gravity_hold_cycle;
            self.wait_in_gravity_hold(TIMEOUT, |telemetry| {
                telemetry.state.drives() == Drives::Active
                    || telemetry.state.cycle >= since + cycles(ENABLING_S)
            })?;
            let active = self
                .last
                .as_ref()
                .is_some_and(|last| last.state.drives() == Drives::Active);
            let fault = self
                .last
                .as_ref()
                .is_some_and(|last| last.record().fault != 0);
            if active || fault {
                return Ok(());
            }
            let since = self.request(&Request::Idle)?.cycle;
            unless_idle_since = Some(since + 1);
            self.wait_for(TIMEOUT, |telemetry| {
                telemetry.state.cycle >= since + cycles(SETTLE_S)
            })?;
        }
        Err(Failure::DrivesNotActive)
    }

    /// Enters gravity hold and waits until the drives are active, unless an operator requested idle in the given cycle or later.
    fn activate(&mut self, unless_idle_since: Option<u64>) -> Result<(), Failure> {
        if self.plan.lays_down {
            self.activate_without_pendant(unless_idle_since)?;
        } else {
            self.request_gravity_hold(unless_idle_since)?;
        }
        let requested = self.gravity_hold_cycle;
        let period_s = self.model.settings().period_s;
        let held = requested + (SETTLE_S / period_s) as u64;
        let active = |telemetry: &Telemetry| telemetry.state.drives() == Drives::Active;
        self.wait_in_gravity_hold(TIMEOUT, |telemetry| {
            telemetry.state.cycle >= held || active(telemetry)
        })?;
        let mut within = TIMEOUT;
        if let Some(pendant) = &self.plan.pendant {
            let already_active = self.last.as_ref().is_some_and(active);
            if !already_active {
                pendant.press("activate")?;
            }
        } else if self.plant == PlantKind::Can
            && !self.plan.lays_down
            && !self.last.as_ref().is_some_and(active)
        {
            print_status("the controller is in gravity hold: press Shift-Activate on the pendant");
            within = ACTIVATION_TIMEOUT;
        }
        let mut fault = None;
        let up = self.wait_in_gravity_hold(within, |telemetry| {
            fault = fault_since(telemetry, requested);
            fault.is_some() || active(telemetry)
        })?;
        let settled = self.last.as_ref().map_or(0, |last| last.state.cycle);
        let settled = settled + (SETTLE_S / period_s) as u64;
        if up && fault.is_none() {
            self.wait_in_gravity_hold(TIMEOUT, |telemetry| {
                fault = fault_since(telemetry, requested);
                fault.is_some() || telemetry.state.cycle >= settled
            })?;
        }
        match fault {
            Some(fault) => Err(Failure::RunFault { faults: fault }),
            None if up && self.last.as_ref().is_some_and(active) => Ok(()),
            None => Err(Failure::DrivesNotActive),
        }
    }

    fn perform_steps(&mut self, steps: &[Step<N>]) -> Result<PerformedMotion, Failure> {
        let period_s = self.model.settings().period_s;
        let mut performed = PerformedMotion::default();
        let (mut unprocessed, mut queued) = (VecDeque::new(), None);
        for (number, step) in steps.iter().enumerate() {
            let sequence = match queued.take() {
                Some(sequence) => sequence,
                None => self.begin(&step.request, None)?,
            };
            let reply = self.wait_for_reply(sequence, &mut unprocessed)?;
            let end = reply.cycle + (step.duration_s / period_s).round() as u64;
            if let (false, Some(next)) = (step.until_done, steps.get(number + 1)) {
                queued = Some(self.begin(&next.request, Some(end))?);
            }
            let mut collector = Motion::collector::<N>();
            let mut silent = Instant::now();
            loop {
                let next = match unprocessed.pop_front() {
                    Some(telemetry) => Some(telemetry),
                    None => self.poll()?,
                };
                let Some(telemetry) = next else {
                    if silent.elapsed() > TIMEOUT {
                        return Err(self.not_running());
                    }
                    continue;
                };
                silent = Instant::now();
                if telemetry.state.cycle < reply.cycle {
                    continue;
                }
                if telemetry.state.cycle >= end {
                    unprocessed.push_front(telemetry);
                    break;
                }
                let record = telemetry.record_of::<N>();
                let mode = record.mode();
                if record.fault != 0 {
                    performed.stopped = Some(Stopped {
                        step: number,
                        fault: record.fault_text.to_string(),
                        cause: StopCause::of_fault(is_contact(record.fault)),
                    });
                    break;
                }
                if mode.is_some_and(moves_joints) {
                    performed.moved_s += period_s;
                }
                // No step requests this mode: another operator did.
                if mode == Some(Mode::Idle) {
                    return Err(Failure::OtherMode {
                        mode: Mode::Idle.name(),
                    });
                }
                if step.until_done && mode != reply.mode() {
                    break;
                }
                if telemetry.state.drives() != Drives::Active {
                    performed.stopped = Some(Stopped {
                        step: number,
                        fault: "the drives are not active".to_owned(),
                        cause: StopCause::Drives,
                    });
                    break;
                }
                if step.recorded {
                    let error_m = match mode {
                        Some(Mode::Track) => record.tip_error_m(),
                        _ => None,
                    };
                    collector.add(
                        telemetry.state.stamp_ns as f64 * 1e-9,
                        record.position_rad,
                        // The fit has no ripple: the compensation of it is left out.
                        record.torque_nm - record.torques.ripple,
                        error_m,
                        record.in_contact,
                    );
                }
            }
            if step.recorded {
                performed.motions.push(collector.finish());
            }
            if performed.stopped.is_some() {
                break;
            }
        }
        Ok(performed)
    }
}

/// Returns the fault of a cycle, unless the cycle is before `cycle`: queued telemetry may be from before a reset.
fn fault_since(telemetry: &Telemetry, cycle: u64) -> Option<String> {
    let record = telemetry.record();
    let faulted = record.fault != 0 && telemetry.state.cycle >= cycle;
    faulted.then(|| record.fault_text.to_string())
}

/// Whether a contact can cause the fault; a joint that an obstacle holds back exceeds its tracking error.
fn is_contact(fault: u8) -> bool {
    matches!(
        fault,
        fault_kind::JOINT_COLLISION | fault_kind::TIP_COLLISION | fault_kind::JOINT_TRACKING_ERROR
    )
}

impl<const N: usize> MotionArm<N> for RunningArm<N> {
    type Error = Failure;

    fn load(&mut self, model: &Description) -> Result<(), Failure> {
        model.save(&self.folder)?;
        self.model = model.clone();
        // An idle request that an operator sent to the new controller is not overridden.
        let unless_idle_since = self.starts.then_some(0);
        if self.starts {
            self.launch()?;
        } else if self.loaded {
            return Err(Failure::OtherModelNeeded {
                folder: self.folder.clone(),
            });
        }
        self.loaded = true;
        self.activate(unless_idle_since)
    }

    fn refusal(error: &Failure) -> Option<&str> {
        match error {
            Failure::Refused { reason } => Some(reason),
            _ => None,
        }
    }

    fn motors(&mut self) -> Vec<MotorConstants> {
        match self.description.bus() {
            // Without the file, as of an older program on the bus, the calibration lacks these numbers only.
            Some(_) => MotorConstants::read(&self.domain.motors_file()).unwrap_or_default(),
            None => Vec::new(),
        }
    }

    fn position_rad(&mut self) -> Result<Vector<N>, Failure> {
        // Telemetry may be queued; the last one has the present position.
        let mut waiting = 0;
        while waiting < MAX_WAITING
            && let Some(telemetry) = self.reader.receive().map_err(Failure::system)?
        {
            self.last = Some(telemetry);
            waiting += 1;
        }
        if !self.wait_for(TIMEOUT, |_| true)? {
            return Err(self.not_running());
        }
        let last = self
            .last
            .as_ref()
            .map(|last| last.record_of::<N>().position_rad);
        last.ok_or_else(|| self.not_running())
    }

    fn perform(&mut self, name: &str, steps: &[Step<N>]) -> Result<PerformedMotion, Failure> {
        let file = self.logs.join(format!("{name}.mcap"));
        let config = self.model.config::<N>()?;
        let recorder = Recorder::create(
            &file,
            &self.model,
            &config,
            self.virtual_time,
            &self.options,
        )?;
        self.recorder = Some(recorder);
        let performed = self.perform_steps(steps);
        // The log is completed even after an error.
        let finished = self.finish_log();
        let performed = performed?;
        finished.map(|()| performed)
    }

    fn recover(&mut self) -> Result<(), Failure> {
        let from = self.last.as_ref().map_or(0, |last| last.state.cycle);
        let rested = from + (REST_S / self.model.settings().period_s) as u64;
        self.wait_for(TIMEOUT, |telemetry| telemetry.state.cycle >= rested)?;
        match self.request(&Request::Reset) {
            // If only the drives became idle, there is no fault.
            Ok(_) | Err(Failure::Refused { .. }) => {}
            Err(failure) => return Err(failure),
        }
        self.activate(Some(from))
    }

    fn learned(&mut self) -> Result<Option<Description>, Failure> {
        let file = self.learned.join("arm.toml");
        if !file.exists() {
            return Ok(None);
        }
        let kept = Description::load(file)?;
        // A system that was already running may have learned with another model.
        if kept.urdf() != self.model.urdf() || kept.friction() != self.model.friction() {
            return Ok(None);
        }
        let found = kept.config::<N>()?;
        let source = kept.settings().learned.as_ref();
        let source = source.and_then(|learned| learned.source.as_deref());
        Ok(Some(self.model.with_learned(
            &found.learned,
            source.unwrap_or("learned while moving"),
        )?))
    }

    fn take_weight(
        &mut self,
        weight_kg: f64,
        attach: &mut dyn FnMut() -> bool,
    ) -> Result<(), Failure> {
        if !self.starts {
            return Err(Failure::WeightNeedsOwnSystem);
        }
        self.end()?;
        self.loaded = false;
        if self.plant == PlantKind::Can {
            return match attach() {
                true => Ok(()),
                false => Err(ProcedureError::NoWeight.into()),
            };
        }
        let spec = format!("payload:mass-kg={weight_kg}");
        self.args.inject.push(spec.parse()?);
        self.plan = Plan::new(&self.args, &self.description, &self.domain, None)?;
        Ok(())
    }

    fn meanwhile<T: Send>(&mut self, work: impl FnOnce() -> T + Send) -> Result<T, Failure> {
        std::thread::scope(|scope| {
            let worker = scope.spawn(work);
            let mut lost = Ok(());
            while !worker.is_finished() {
                match lost {
                    Ok(()) => lost = self.poll().map(|_| ()),
                    Err(_) => pause(POLL_INTERVAL),
                }
            }
            let done = match worker.join() {
                Ok(done) => done,
                Err(panic) => std::panic::resume_unwind(panic),
            };
            lost.map(|()| done)
        })
    }
}
