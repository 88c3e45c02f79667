//! Telemetry into a log, for as long as it can be written: a full disk ends the log, not the arm.

use crate::console::remark;
use crate::exit::Failure;
use std::fs;
use std::path::Path;
use std::time::{SystemTime, UNIX_EPOCH};
use supple_core::Config;
use supple_ipc::message::{Drives, MAX_DOF, Telemetry};
use supple_log::{CycleTiming, Extras, Record, RunInfo, TorqueTerms, Writer};
use supple_model::Description;

/// The log of a run, if there is one, and why it ended before the run, if it did.
pub struct Journal<const N: usize> {
    recorder: Option<Recorder<N>>,
    ended: Option<Failure>,
}

impl<const N: usize> Journal<N> {
    /// Of a run with a log or without.
    pub fn new(recorder: Option<Recorder<N>>) -> Self {
        Journal {
            recorder,
            ended: None,
        }
    }

    /// A cycle.
    pub fn add(&mut self, telemetry: &Telemetry) {
        self.write(|recorder| recorder.add(telemetry));
    }

    /// Something that happened to the arm, by the clock of its states.
    pub fn event(&mut self, stamp_ns: u64, text: &str) {
        self.write(|recorder| recorder.event(stamp_ns, text));
    }

    /// The log is whole, or it is said why it is not.
    pub fn finish(&mut self) {
        let finished = self.recorder.take().map_or(Ok(()), Recorder::finish);
        self.end_with(finished);
    }

    /// Why it ended before the run.
    pub fn ended(&mut self) -> Option<Failure> {
        self.ended.take()
    }

    fn write(&mut self, write: impl FnOnce(&mut Recorder<N>) -> Result<(), Failure>) {
        if let Some(recorder) = &mut self.recorder {
            let written = write(recorder);
            self.end_with(written);
        }
    }

    fn end_with(&mut self, written: Result<(), Failure>) {
        if let Err(failure) = written {
            remark(&format!(
                "warning: the log ends here, the arm goes on: {failure}"
            ));
            self.recorder = None;
            self.ended = Some(failure);
        }
    }
}

/// A log that grows by a record a cycle.
pub struct Recorder<const N: usize> {
    writer: Writer<N>,
    /// From the stamps of the states to the time of the log \[ns\].
    offset_ns: u64,
    virtual_time: bool,
    /// Latest time written \[ns\]: a log does not go back.
    latest_ns: u64,
}

impl<const N: usize> Recorder<N> {
    /// Begins a log. In virtual time it is the same for the same run: no clock, no timing.
    ///
    /// # Errors
    /// [`Failure::File`], [`Failure::Log`].
    pub fn create(
        file: &Path,
        description: &Description,
        config: &Config<N>,
        virtual_time: bool,
    ) -> Result<Self, Failure> {
        if let Some(folder) = file.parent() {
            fs::create_dir_all(folder).map_err(|error| Failure::file("create", folder, error))?;
        }
        let (start_ns, offset_ns) = match virtual_time {
            true => (0, 0),
            false => {
                let now_ns = since_epoch_ns();
                (
                    now_ns,
                    now_ns.saturating_sub(supple_realtime::monotonic_ns()),
                )
            }
        };
        let run = RunInfo {
            experiment: "supple up".to_owned(),
            start_ns,
            ..RunInfo::default()
        };
        Ok(Recorder {
            writer: Writer::create(file, description, config, &run)?,
            offset_ns,
            virtual_time,
            latest_ns: start_ns,
        })
    }

    /// A cycle.
    ///
    /// # Errors
    /// [`Failure::Log`].
    pub fn add(&mut self, telemetry: &Telemetry) -> Result<(), Failure> {
        let time_ns = telemetry.state.stamp_ns + self.offset_ns;
        self.latest_ns = self.latest_ns.max(time_ns);
        let timing = &telemetry.timing;
        let extras = Extras {
            timing: (!self.virtual_time).then_some(CycleTiming {
                period_ns: timing.period_ns,
                latency_ns: timing.latency_ns,
                step_ns: timing.step_ns,
            }),
            ..Extras::default()
        };
        let record = record::<N>(telemetry);
        Ok(self.writer.write_record(self.latest_ns, &record, &extras)?)
    }

    /// Something that happened to the arm, by the clock of its states.
    ///
    /// # Errors
    /// [`Failure::Log`].
    pub fn event(&mut self, stamp_ns: u64, text: &str) -> Result<(), Failure> {
        Ok(self.writer.event(stamp_ns + self.offset_ns, text)?)
    }

    /// The log is whole.
    ///
    /// # Errors
    /// [`Failure::Log`].
    pub fn finish(self) -> Result<(), Failure> {
        self.writer.finish()?;
        Ok(())
    }
}

#[expect(
    clippy::disallowed_methods,
    reason = "a log of the wall clock says when it was; in virtual time this is not called"
)]
fn since_epoch_ns() -> u64 {
    let since = SystemTime::now().duration_since(UNIX_EPOCH);
    since.map_or(0, |since| {
        u64::try_from(since.as_nanos()).unwrap_or(u64::MAX)
    })
}

/// What the log holds of a cycle.
fn record<const N: usize>(t: &Telemetry) -> Record<N> {
    let joints = |wide: &[f64; MAX_DOF]| -> [f64; N] { core::array::from_fn(|i| wide[i]) };
    let request = t.request();
    let terms = &t.terms;
    Record {
        step: t.step,
        input_cycle: t.state.cycle,
        has_measured_position: core::array::from_fn(|i| t.state.position_present >> i & 1 == 1),
        measured_position_rad: joints(&t.state.position_rad),
        has_tip_force: t.state.has_tip_force != 0,
        tip_force_n: t.state.tip_force_n,
        request: request.kind,
        trajectory: request.trajectory,
        request_values: request.values().to_vec(),
        cycle: t.state.cycle,
        mode: t.mode,
        mode_time_s: t.mode_time_s,
        torque_nm: joints(&t.torque_nm),
        fallback_torque_nm: joints(&t.fallback_torque_nm),
        torques: TorqueTerms {
            gravity: joints(&terms.gravity),
            coriolis: joints(&terms.coriolis),
            friction: joints(&terms.friction),
            jacobian_rate: joints(&terms.jacobian_rate),
            inertial: joints(&terms.inertial),
            stiffness: joints(&terms.stiffness),
            damping: joints(&terms.damping),
            force: joints(&terms.force),
            nullspace: joints(&terms.nullspace),
            joint_pd: joints(&terms.joint_pd),
            soft_stop: joints(&terms.soft_stop),
            handover: joints(&terms.handover),
            ripple: joints(&terms.ripple),
        },
        torque_limited: t.torque_limited != 0,
        rate_limited: t.rate_limited != 0,
        position_rad: joints(&t.position_rad),
        velocity_rad_per_s: joints(&t.velocity_rad_per_s),
        tip_position_m: t.tip_position_m,
        tip_velocity_m_per_s: t.tip_velocity_m_per_s,
        has_reference: t.has_reference != 0,
        reference_position_m: t.reference_position_m,
        reference_velocity_m_per_s: t.reference_velocity_m_per_s,
        reference_acceleration_m_per_s2: t.reference_acceleration_m_per_s2,
        stiffness_n_per_m: t.stiffness_n_per_m,
        damping_n_s_per_m: t.damping_n_s_per_m,
        external_torque_nm: joints(&t.external_torque_nm),
        external_force_n: t.external_force_n,
        force_against_n: t.force_against_n,
        contact_threshold_n: t.contact_threshold_n,
        in_contact: t.in_contact != 0,
        friction_share: t.friction_share,
        least_singular_value_m: t.least_singular_value_m,
        fault: t.fault,
        fault_joint: t.fault_joint,
        fault_value: t.fault_value,
        fault_limit: t.fault_limit,
        fault_text: t.fault_text.to_string(),
        refusal: t.refusal,
        refusal_text: t.refusal_text.to_string(),
        drives_active: t.state.drives() == Drives::Active,
    }
}
