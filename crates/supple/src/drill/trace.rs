//! What acted at the motors, from the trace of a simulated arm.

use crate::exit::Failure;
use std::path::Path;

/// Longest trace that is read \[bytes\].
const MOST_BYTES: u64 = 1 << 30;

/// One line.
#[derive(Clone, Debug, PartialEq)]
struct Line {
    time_ns: u64,
    active: bool,
    torque_nm: Vec<f64>,
    force_n: f64,
    tip_z_m: f64,
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
        let text = supple_files::read_text(file, MOST_BYTES)
            .map_err(|error| Failure::file("read", file, error))?;
        let lines = text.lines().filter_map(Line::parse);
        let within = |line: &Line| (begin_ns..begin_ns + for_ns).contains(&line.time_ns);
        Ok(After {
            lines: lines.filter(within).collect(),
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
        let first = self.lines.first().map_or(0.0, |line| line.tip_z_m);
        let lowest = self.lines.iter().map(|line| line.tip_z_m);
        first - lowest.fold(first, f64::min)
    }
}

impl Line {
    /// `time_ns,motors_in_torque_mode,motor..._nm,force_x_n,force_y_n,force_z_n,tip_z_m`
    fn parse(text: &str) -> Option<Line> {
        let (time, rest) = text.split_once(',')?;
        let values = rest.split(',').map(|v| v.parse().ok());
        let values: Vec<f64> = values.collect::<Option<_>>()?;
        let [active, torque_nm @ .., x, y, z, tip_z_m] = values.as_slice() else {
            return None;
        };
        Some(Line {
            time_ns: time.parse().ok()?,
            active: *active > 0.0,
            torque_nm: torque_nm.to_vec(),
            force_n: (x * x + y * y + z * z).sqrt(),
            tip_z_m: *tip_z_m,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_trace_says_when_the_motors_braked_and_what_was_hit() {
        let file = tempfile::NamedTempFile::new().expect("a file");
        let text = "time_ns,motors_in_torque_mode,motor1_nm,force_x_n,force_y_n,force_z_n,tip_z_m\n\
                    999000000,1,9.0,90,0,0,0.9\n\
                    1001000000,1,2.0,0,0,0,0.50\n\
                    1002000000,1,-2.5,0,0,0,0.49\n\
                    1003000000,0,7.0,0,3,4,0.30\n\
                    1004000000,0,0.0,0,0,1,0.40\n\
                    9004000000,0,0.0,0,0,80,0.10\n\
                    10040000";
        std::fs::write(file.path(), text).expect("written");
        let after = After::read(file.path(), 1_000_000_000, 2_000_000_000).expect("read");
        assert_eq!(after.braked_after_ms(), Some(3.0));
        assert_eq!(after.peak_force_n(), 5.0);
        assert!((after.torque_rise_nm() - 0.5).abs() < 1e-12);
        assert!((after.sank_m() - 0.2).abs() < 1e-12);
    }
}
