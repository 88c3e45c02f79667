//! What acts at the motors and on the tip, once a millisecond, as CSV.

use crate::emulator::Emulator;
use crate::error::EmulatorError;
use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};
use supple_bus::virtual_time::Peer;
use supple_puck::status::MotorMode;

const EVERY_NS: u64 = 1_000_000;

/// The file.
#[derive(Debug)]
pub struct TraceFile {
    path: PathBuf,
    file: BufWriter<File>,
    next_ns: u64,
}

impl TraceFile {
    /// A new file with its head line, for an arm of `joints` motors.
    ///
    /// # Errors
    /// [`EmulatorError::Trace`].
    pub fn create(path: &Path, joints: usize) -> Result<TraceFile, EmulatorError> {
        let file = File::create(path).map_err(|source| EmulatorError::Trace {
            file: path.display().to_string(),
            source,
        })?;
        let mut trace = TraceFile {
            path: path.to_owned(),
            file: BufWriter::new(file),
            next_ns: 0,
        };
        let motors: String = (1..=joints).map(|i| format!(",motor{i}_nm")).collect();
        trace.line(&format!(
            "time_ns,motors_in_torque_mode{motors},force_x_n,force_y_n,force_z_n,tip_z_m"
        ))?;
        Ok(trace)
    }

    /// Writes a line if it is time for one.
    ///
    /// # Errors
    /// [`EmulatorError::Trace`].
    pub fn note<const N: usize>(&mut self, emulator: &Emulator<N>) -> Result<(), EmulatorError> {
        let now_ns = emulator.now_ns();
        if now_ns < self.next_ns {
            return Ok(());
        }
        self.next_ns = now_ns + EVERY_NS;
        let pucks = emulator.pucks().iter();
        let torque_mode = pucks.filter(|p| p.mode() == MotorMode::Torque).count();
        let torques = emulator.motor_torque_nm();
        let torques: String = torques.iter().map(|t| format!(",{t:.6}")).collect();
        let truth = emulator.truth();
        let force = truth.contact_force_n;
        self.line(&format!(
            "{now_ns},{torque_mode}{torques},{:.4},{:.4},{:.4},{:.6}",
            force.x, force.y, force.z, truth.tip_position_m.z
        ))
    }

    fn line(&mut self, text: &str) -> Result<(), EmulatorError> {
        writeln!(self.file, "{text}").map_err(|source| EmulatorError::Trace {
            file: self.path.display().to_string(),
            source,
        })
    }
}
