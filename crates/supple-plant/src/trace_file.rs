//! CSV trace of motor torques and tip forces of a simulated arm, one line per millisecond.
//!
//! Independent of the controller: it continues after the controller has exited. If the disk is full, the trace
//! stops and the arm continues; [`TraceFile::finish`] returns the error.

use crate::plant::Plant;
use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};

const INTERVAL_NS: u64 = 1_000_000;

/// The file cannot be written.
#[derive(Debug, thiserror::Error)]
#[error("{}: {source}; choose a file that can be written with --trace", file.display())]
pub struct TraceError {
    /// Path of the file.
    pub file: PathBuf,
    /// Error of the operating system.
    pub source: std::io::Error,
}

/// Data of a line that do not come from the plant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample<const N: usize> {
    /// Time \[ns\].
    pub time_ns: u64,
    /// Number of motors in torque mode.
    pub active: usize,
    /// Torque at each motor, braking included \[N m\].
    pub torque_nm: [f64; N],
    /// Mode of the controller, a number of [`supple_core::codes::MODES`]; `None` if unknown.
    pub mode: Option<u8>,
    /// Kind of the controller's fault, see [`supple_core::codes::FaultCode`], 0 for no fault; `None` if unknown.
    pub fault: Option<u8>,
    /// Number of injections that have begun.
    pub injections: usize,
}

/// Writer of the trace file.
#[derive(Debug)]
pub struct TraceFile {
    path: PathBuf,
    file: BufWriter<File>,
    /// Error that ended the trace.
    failed: Option<std::io::Error>,
    next_ns: u64,
    active: usize,
}

impl TraceFile {
    /// Creates the file with its header line, for an arm of `joints` motors. A device, FIFO, socket or folder of
    /// that name is rejected.
    ///
    /// # Errors
    /// [`TraceError`].
    pub fn create(path: &Path, joints: usize) -> Result<TraceFile, TraceError> {
        let file = supple_files::create_output(path).map_err(|source| TraceError {
            file: path.to_owned(),
            source,
        })?;
        let mut trace = TraceFile {
            path: path.to_owned(),
            file: BufWriter::new(file),
            failed: None,
            next_ns: 0,
            active: 0,
        };
        let motors: String = (1..=joints).map(|i| format!(",motor{i}_nm")).collect();
        let speeds: String = (1..=joints)
            .map(|i| format!(",joint{i}_rad_per_s"))
            .collect();
        trace.line(&format!(
            "time_ns,motors_in_torque_mode{motors}{speeds},force_x_n,force_y_n,force_z_n,tip_x_m,tip_y_m,tip_z_m,\
             tip_speed_m_per_s,joint_speed_rad_per_s,kinetic_energy_j,mode,fault,injections"
        ));
        Ok(trace)
    }

    /// Writes a line every millisecond and whenever motors start or stop braking. The force is the maximum since the
    /// previous line, since an impact may be shorter than the interval. After a write error nothing more is
    /// written.
    pub fn write_sample<const N: usize>(&mut self, sample: &Sample<N>, plant: &mut Plant<N>) {
        let Sample {
            time_ns, active, ..
        } = *sample;
        if time_ns < self.next_ns && active == self.active {
            return;
        }
        self.active = active;
        self.next_ns = time_ns + INTERVAL_NS;
        let torques = sample.torque_nm.iter().map(|t| format!(",{t:.6}"));
        let force = plant.take_max_force_n();
        let truth = plant.truth();
        let tip = truth.tip_position_m;
        let speeds = truth
            .velocity_rad_per_s
            .iter()
            .map(|speed| format!(",{speed:.6}"));
        let code_text = |code: Option<u8>| code.map_or_else(String::new, |code| code.to_string());
        let line = format!(
            "{time_ns},{active}{}{},{:.4},{:.4},{:.4},{:.6},{:.6},{:.6},{:.6},{:.6},{:.6},{},{},{}",
            torques.collect::<String>(),
            speeds.collect::<String>(),
            force.x,
            force.y,
            force.z,
            tip.x,
            tip.y,
            tip.z,
            truth.tip_velocity_m_per_s.norm(),
            truth.velocity_rad_per_s.amax(),
            plant.kinetic_energy_j(),
            code_text(sample.mode),
            code_text(sample.fault),
            sample.injections
        );
        self.line(&line);
    }

    /// Closes the file at the end of the run.
    ///
    /// # Errors
    /// [`TraceError`] if a line could not be written.
    pub fn finish(mut self) -> Result<(), TraceError> {
        let flushed = self.file.flush();
        let failed = self.failed.map_or(flushed, Err);
        failed.map_err(|source| TraceError {
            file: self.path,
            source,
        })
    }

    fn line(&mut self, text: &str) {
        if self.failed.is_none() {
            self.failed = writeln!(self.file, "{text}").err();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::PlantConfig;
    use supple_core::Vector;
    use supple_model::Description;

    /// A system may end within the millisecond in which its motors start braking.
    #[test]
    fn a_start_of_braking_is_written_between_two_regular_lines() {
        let wam = Description::asset("wam4").expect("built in");
        let config = PlantConfig::<4>::from_description(&wam).expect("valid");
        let home_rad = wam.home::<4>().expect("four joints");
        let mut plant = Plant::new(config, home_rad, Vector::zeros()).expect("valid");
        let file = tempfile::NamedTempFile::new().expect("a file");
        let mut trace = TraceFile::create(file.path(), 4).expect("created");
        for (time_ns, active) in [(0, 4), (600_000, 4), (700_000, 0), (800_000, 0)] {
            let sample = Sample {
                time_ns,
                active,
                torque_nm: [0.0; 4],
                mode: (active > 0).then_some(3),
                fault: None,
                injections: 1,
            };
            trace.write_sample(&sample, &mut plant);
        }
        trace.finish().expect("written");
        let text = std::fs::read_to_string(file.path()).expect("readable");
        let lines: Vec<&str> = text.lines().skip(1).collect();
        assert_eq!(lines.len(), 2, "{text}");
        assert!(
            lines[0].starts_with("0,4,") && lines[1].starts_with("700000,0,"),
            "{text}"
        );
        assert!(
            lines[0].ends_with(",0.000000,3,,1") && lines[1].ends_with(",0.000000,,,1"),
            "{text}"
        );
        let columns = |line: &str| line.split(',').count();
        let head = text.lines().next().expect("a head");
        assert!(lines.iter().all(|line| columns(line) == columns(head)));
    }
}
