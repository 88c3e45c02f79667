//! Reads the trace of a simulated arm: torques at the motors, forces and motion of the tip.

use std::path::Path;
use supple_cli::exit::Failure;

/// Maximum size of a trace file \[bytes\].
const MAX_BYTES: u64 = 1 << 30;

/// One row of a trace.
#[derive(Clone, Debug, PartialEq)]
pub struct TraceRow {
    /// Time \[ns\].
    pub time_ns: u64,
    /// Whether a motor is in torque mode.
    pub active: bool,
    /// Torque of each motor \[N m\].
    pub torque_nm: Vec<f64>,
    /// Maximum contact force on the tip since the previous row \[N\].
    pub force_n: f64,
    /// Tip position, base axes \[m\].
    pub tip_m: [f64; 3],
    /// Tip speed \[m/s\].
    pub tip_speed_m_per_s: f64,
    /// Speed of each joint \[rad/s\].
    pub joint_rad_per_s: Vec<f64>,
    /// Speed of the fastest joint \[rad/s\].
    pub joint_speed_rad_per_s: f64,
    /// Kinetic energy \[J\].
    pub kinetic_energy_j: f64,
    /// Number of injections that have begun.
    pub injections: u64,
}

/// Trace rows after a process loss.
#[derive(Clone, Debug, PartialEq)]
pub struct TraceAfterLoss {
    lines: Vec<TraceRow>,
    begin_ns: u64,
}

impl TraceAfterLoss {
    /// Reads the rows of a file from `begin_ns` for the duration `for_ns` \[ns\]. An incomplete last line (killed
    /// writer) is skipped.
    ///
    /// # Errors
    /// [`Failure::File`].
    pub fn read(file: &Path, begin_ns: u64, for_ns: u64) -> Result<TraceAfterLoss, Failure> {
        let within = |line: &TraceRow| (begin_ns..begin_ns + for_ns).contains(&line.time_ns);
        Ok(TraceAfterLoss {
            lines: read(file)?.into_iter().filter(within).collect(),
            begin_ns,
        })
    }

    /// Time from the loss until the motors brake \[ms\].
    pub fn braked_after_ms(&self) -> Option<f64> {
        let braked = self.lines.iter().find(|line| !line.active)?;
        Some((braked.time_ns - self.begin_ns) as f64 * 1e-6)
    }

    /// Maximum rise of the magnitude of a motor torque above its value at the loss, while active \[N m\].
    pub fn torque_rise_nm(&self) -> f64 {
        let Some(first) = self.lines.first() else {
            return 0.0;
        };
        let active = self.lines.iter().take_while(|line| line.active);
        let rises = active.flat_map(|line| {
            let pairs = line.torque_nm.iter().zip(&first.torque_nm);
            pairs.map(|(now, then)| now.abs() - then.abs())
        });
        rises.fold(0.0, f64::max)
    }

    /// Maximum force on the tip \[N\].
    pub fn peak_force_n(&self) -> f64 {
        self.lines
            .iter()
            .map(|line| line.force_n)
            .fold(0.0, f64::max)
    }

    /// Distance by which the tip descended \[m\].
    pub fn sank_m(&self) -> f64 {
        let first = self.lines.first().map_or(0.0, |line| line.tip_m[2]);
        let lowest = self.lines.iter().map(|line| line.tip_m[2]);
        first - lowest.fold(first, f64::min)
    }
}

/// Reads the complete rows of a file. An incomplete last line (killed writer) is skipped.
///
/// # Errors
/// [`Failure::File`].
pub fn read(file: &Path) -> Result<Vec<TraceRow>, Failure> {
    let text = supple_files::read_text(file, MAX_BYTES)
        .map_err(|error| Failure::file("read", file, error))?;
    let mut lines = text.lines();
    let head: Vec<&str> = lines.next().unwrap_or("").split(',').collect();
    Ok(lines
        .filter_map(|line| TraceRow::parse(&head, line))
        .collect())
}

impl TraceRow {
    /// Parses a row; `head` contains the column names.
    fn parse(head: &[&str], text: &str) -> Option<TraceRow> {
        let values: Vec<&str> = text.split(',').collect();
        if values.len() != head.len() {
            return None;
        }
        let text = |name: &str| {
            let at = head.iter().position(|column| *column == name)?;
            Some(values[at])
        };
        let number = |name: &str| text(name)?.parse::<f64>().ok();
        let three = |names: [&str; 3]| {
            let [x, y, z] = names.map(number);
            Some([x?, y?, z?])
        };
        let motors = head
            .iter()
            .filter(|name| name.starts_with("motor") && name.ends_with("_nm"));
        let speeds = head
            .iter()
            .filter(|name| name.starts_with("joint") && !name.starts_with("joint_"));
        let [x, y, z] = three(["force_x_n", "force_y_n", "force_z_n"])?;
        Some(TraceRow {
            time_ns: text("time_ns")?.parse().ok()?,
            active: number("motors_in_torque_mode")? > 0.0,
            torque_nm: motors.map(|name| number(name)).collect::<Option<_>>()?,
            force_n: (x * x + y * y + z * z).sqrt(),
            tip_m: three(["tip_x_m", "tip_y_m", "tip_z_m"])?,
            tip_speed_m_per_s: number("tip_speed_m_per_s")?,
            joint_rad_per_s: speeds.map(|name| number(name)).collect::<Option<_>>()?,
            joint_speed_rad_per_s: number("joint_speed_rad_per_s")?,
            kinetic_energy_j: number("kinetic_energy_j")?,
            injections: text("injections")?.parse().ok()?,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn braking_time_force_torque_rise_and_descent_are_read_from_a_trace() {
        let file = tempfile::NamedTempFile::new().expect("a file");
        let text = "time_ns,motors_in_torque_mode,motor1_nm,force_x_n,force_y_n,force_z_n,\
                    tip_x_m,tip_y_m,tip_z_m,tip_speed_m_per_s,joint_speed_rad_per_s,\
                    kinetic_energy_j,mode,fault,injections\n\
                    999000000,1,9.0,90,0,0,0,0,0.9,0,0,0,3,0,0\n\
                    1001000000,1,2.0,0,0,0,0,0,0.50,0,0,0,3,0,0\n\
                    1002000000,1,-2.5,0,0,0,0,0,0.49,0.1,0.3,2.5,5,1,1\n\
                    1003000000,0,7.0,0,3,4,0,0,0.30,0,0,0,,,1\n\
                    1004000000,0,0.0,0,0,1,0,0,0.40,0,0,0,,,1\n\
                    9004000000,0,0.0,0,0,80,0,0,0.10,0,0,0,,,1\n\
                    10040000";
        std::fs::write(file.path(), text).expect("written");
        let after = TraceAfterLoss::read(file.path(), 1_000_000_000, 2_000_000_000).expect("read");
        assert_eq!(after.braked_after_ms(), Some(3.0));
        assert_eq!(after.peak_force_n(), 5.0);
        assert!((after.torque_rise_nm() - 0.5).abs() < 1e-12);
        assert!((after.sank_m() - 0.2).abs() < 1e-12);
    }
}
