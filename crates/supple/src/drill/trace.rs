//! What acted at the motors, from the trace of a simulated arm.

use crate::exit::Failure;
use std::path::Path;

/// Longest trace that is read \[bytes\].
const MOST_BYTES: u64 = 1 << 30;

/// One line.
#[derive(Clone, Debug, PartialEq)]
pub struct Line {
    /// When \[ns\].
    pub time_ns: u64,
    /// Some motor takes torques.
    pub active: bool,
    /// What acts at each motor \[N m\].
    pub torque_nm: Vec<f64>,
    /// Greatest contact force on the tip since the line before \[N\].
    pub force_n: f64,
    /// Where the tip is, base axes \[m\].
    pub tip_m: [f64; 3],
    /// Its speed \[m/s\].
    pub tip_speed_m_per_s: f64,
    /// Speed of the fastest joint \[rad/s\].
    pub joint_speed_rad_per_s: f64,
    /// Kinetic energy \[J\].
    pub kinetic_energy_j: f64,
    /// How many injections have begun.
    pub injections: u64,
}

/// The lines after a loss.
#[derive(Clone, Debug, PartialEq)]
pub struct After {
    lines: Vec<Line>,
    begin_ns: u64,
}

impl After {
    /// The lines of a file from `begin_ns` on, for so long \[ns\]. What a killed process left half written
    /// is passed over.
    ///
    /// # Errors
    /// [`Failure::File`].
    pub fn read(file: &Path, begin_ns: u64, for_ns: u64) -> Result<After, Failure> {
        let within = |line: &Line| (begin_ns..begin_ns + for_ns).contains(&line.time_ns);
        Ok(After {
            lines: read(file)?.into_iter().filter(within).collect(),
            begin_ns,
        })
    }

    /// When the motors came to brake \[ms\].
    pub fn braked_after_ms(&self) -> Option<f64> {
        let braked = self.lines.iter().find(|line| !line.active)?;
        Some((braked.time_ns - self.begin_ns) as f64 * 1e-6)
    }

    /// By how much a motor's torque rose in magnitude above what it was at the loss, while it was still
    /// active \[N m\].
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

    /// Greatest force on the tip \[N\].
    pub fn peak_force_n(&self) -> f64 {
        self.lines
            .iter()
            .map(|line| line.force_n)
            .fold(0.0, f64::max)
    }

    /// How far the tip sank \[m\].
    pub fn sank_m(&self) -> f64 {
        let first = self.lines.first().map_or(0.0, |line| line.tip_m[2]);
        let lowest = self.lines.iter().map(|line| line.tip_m[2]);
        first - lowest.fold(first, f64::min)
    }
}

/// Every whole line of a file. What a killed process left half written is passed over.
///
/// # Errors
/// [`Failure::File`].
pub fn read(file: &Path) -> Result<Vec<Line>, Failure> {
    let text = supple_files::read_text(file, MOST_BYTES)
        .map_err(|error| Failure::file("read", file, error))?;
    let mut lines = text.lines();
    let head: Vec<&str> = lines.next().unwrap_or("").split(',').collect();
    Ok(lines.filter_map(|line| Line::parse(&head, line)).collect())
}

impl Line {
    /// Columns by the names of the head.
    fn parse(head: &[&str], text: &str) -> Option<Line> {
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
        let [x, y, z] = three(["force_x_n", "force_y_n", "force_z_n"])?;
        Some(Line {
            time_ns: text("time_ns")?.parse().ok()?,
            active: number("motors_in_torque_mode")? > 0.0,
            torque_nm: motors.map(|name| number(name)).collect::<Option<_>>()?,
            force_n: (x * x + y * y + z * z).sqrt(),
            tip_m: three(["tip_x_m", "tip_y_m", "tip_z_m"])?,
            tip_speed_m_per_s: number("tip_speed_m_per_s")?,
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
    fn a_trace_says_when_the_motors_braked_and_what_was_hit() {
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
        let after = After::read(file.path(), 1_000_000_000, 2_000_000_000).expect("read");
        assert_eq!(after.braked_after_ms(), Some(3.0));
        assert_eq!(after.peak_force_n(), 5.0);
        assert!((after.torque_rise_nm() - 0.5).abs() < 1e-12);
        assert!((after.sank_m() - 0.2).abs() < 1e-12);
    }
}
