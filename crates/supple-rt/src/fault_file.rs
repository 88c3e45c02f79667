//! The last cycles before a fault, as a table on the disk.

use std::fmt::Write as _;
use std::fs::{self, DirBuilder, OpenOptions};
use std::io::{Error, Write as _};
use std::os::unix::fs::{DirBuilderExt, OpenOptionsExt};
use std::path::PathBuf;
use supple_ipc::message::{MAX_DOF, Telemetry};

/// Cycles that are kept.
pub const KEPT_CYCLES: usize = 1000;

/// The last [`KEPT_CYCLES`] cycles; a fault that latches sends them to the disk.
#[derive(Debug)]
pub struct LastCycles {
    kept: Vec<Telemetry>,
    /// Where the next one goes, once all places are taken.
    next: usize,
    fault: u8,
    folder: PathBuf,
}

impl LastCycles {
    /// None yet.
    pub fn new(folder: PathBuf) -> LastCycles {
        LastCycles {
            kept: Vec::with_capacity(KEPT_CYCLES),
            next: 0,
            fault: 0,
            folder,
        }
    }

    /// A cycle. Where a fault has just latched, the table is written and its place said on standard error.
    pub fn add(&mut self, telemetry: &Telemetry) {
        if self.kept.len() < KEPT_CYCLES {
            self.kept.push(*telemetry);
        } else {
            self.kept[self.next] = *telemetry;
            self.next = (self.next + 1) % KEPT_CYCLES;
        }
        let latched = telemetry.fault != 0 && self.fault == 0;
        self.fault = telemetry.fault;
        if latched {
            let fault = telemetry.fault_text;
            match self.write(telemetry.step) {
                Ok(file) => eprintln!(
                    "supple-rt: fault: {fault}; the last {} cycles are in {}",
                    self.kept.len(),
                    file.display()
                ),
                Err(error) => eprintln!(
                    "supple-rt: fault: {fault}; the last cycles cannot be written to {}: {error}; \
                     choose another folder with --fault-dir",
                    self.folder.display()
                ),
            }
        }
    }

    fn write(&self, step: u64) -> Result<PathBuf, Error> {
        DirBuilder::new()
            .recursive(true)
            .mode(0o700)
            .create(&self.folder)?;
        let process = std::process::id();
        let file = self.folder.join(format!("fault-{process}-{step}.csv"));
        let part = file.with_extension("csv.part");
        let mut options = OpenOptions::new();
        options.write(true).create(true).truncate(true).mode(0o600);
        let mut table = options.open(&part)?;
        table.write_all(self.table().as_bytes())?;
        table.sync_all()?;
        fs::rename(&part, &file)?;
        Ok(file)
    }

    /// The table, oldest cycle first.
    fn table(&self) -> String {
        let (newer, older) = self.kept.split_at(self.next);
        let cycles = older.iter().chain(newer);
        let dof = self.kept.first().map_or(0, |t| usize::from(t.state.dof));
        let mut table = String::new();
        header(&mut table, dof.min(MAX_DOF));
        for telemetry in cycles {
            row(&mut table, telemetry, dof.min(MAX_DOF));
        }
        table
    }
}

/// A column a joint.
type PerJoint = (&'static str, fn(&Telemetry) -> &[f64; MAX_DOF]);
/// A column an axis.
type PerAxis = (&'static str, fn(&Telemetry) -> &[f64; 3]);

const PER_JOINT: [PerJoint; 19] = [
    ("measured_position_rad", |t| &t.state.position_rad),
    ("position_rad", |t| &t.position_rad),
    ("velocity_rad_per_s", |t| &t.velocity_rad_per_s),
    ("torque_nm", |t| &t.torque_nm),
    ("fallback_torque_nm", |t| &t.fallback_torque_nm),
    ("external_torque_nm", |t| &t.external_torque_nm),
    ("gravity_nm", |t| &t.terms.gravity),
    ("coriolis_nm", |t| &t.terms.coriolis),
    ("friction_nm", |t| &t.terms.friction),
    ("jacobian_rate_nm", |t| &t.terms.jacobian_rate),
    ("inertial_nm", |t| &t.terms.inertial),
    ("stiffness_nm", |t| &t.terms.stiffness),
    ("damping_nm", |t| &t.terms.damping),
    ("force_nm", |t| &t.terms.force),
    ("nullspace_nm", |t| &t.terms.nullspace),
    ("joint_pd_nm", |t| &t.terms.joint_pd),
    ("soft_stop_nm", |t| &t.terms.soft_stop),
    ("handover_nm", |t| &t.terms.handover),
    ("ripple_nm", |t| &t.terms.ripple),
];

const PER_AXIS: [PerAxis; 7] = [
    ("tip_force_n", |t| &t.state.tip_force_n),
    ("tip_position_m", |t| &t.tip_position_m),
    ("tip_velocity_m_per_s", |t| &t.tip_velocity_m_per_s),
    ("reference_position_m", |t| &t.reference_position_m),
    ("stiffness_n_per_m", |t| &t.stiffness_n_per_m),
    ("damping_n_s_per_m", |t| &t.damping_n_s_per_m),
    ("external_force_n", |t| &t.external_force_n),
];

fn header(table: &mut String, dof: usize) {
    table.push_str(
        "step,cycle,stamp_ns,mode,drives,fault,fault_text,position_present,has_tip_force,has_reference,\
         in_contact,torque_limited,rate_limited,missed,late,tx_lost,wake_ns,round_trip_ns,period_ns,\
         latency_ns,step_ns",
    );
    for (name, _) in PER_JOINT {
        for joint in 0..dof {
            let _ = write!(table, ",{name}_{joint}");
        }
    }
    for (name, _) in PER_AXIS {
        for axis in ["x", "y", "z"] {
            let _ = write!(table, ",{name}_{axis}");
        }
    }
    table.push('\n');
}

fn row(table: &mut String, t: &Telemetry, dof: usize) {
    let mode = t.mode().map_or("unknown", |mode| mode.name());
    let (plant, timing) = (&t.state.plant, &t.timing);
    // No comma but between columns: a table that any reader takes apart.
    let fault_text = t.fault_text.as_str().replace(',', ";");
    let _ = write!(
        table,
        "{},{},{},{mode},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{}",
        t.step,
        t.state.cycle,
        t.state.stamp_ns,
        t.state.drives().name(),
        t.fault,
        fault_text,
        t.state.position_present,
        t.state.has_tip_force,
        t.has_reference,
        t.in_contact,
        t.torque_limited,
        t.rate_limited,
        plant.missed,
        plant.late,
        plant.tx_lost,
        plant.wake_ns,
        plant.round_trip_ns,
        timing.period_ns,
        timing.latency_ns,
        timing.step_ns,
    );
    for (_, values) in PER_JOINT {
        for value in &values(t)[..dof] {
            let _ = write!(table, ",{value}");
        }
    }
    for (_, values) in PER_AXIS {
        for value in values(t) {
            let _ = write!(table, ",{value}");
        }
    }
    table.push('\n');
}
