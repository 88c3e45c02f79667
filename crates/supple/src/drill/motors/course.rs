//! Reads the reports of the processes of bus and arm: losses, stages and motor states, with times of the arm's clock.

use std::path::Path;
use supple_cli::exit::Failure;

/// Maximum size of the reports of a run \[bytes\].
const MAX_BYTES: u64 = 1 << 24;

/// A stage of the plant loop, as `supple-can` reports it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stage {
    /// The arm is held.
    Holding,
    /// The arm is being laid down.
    LayingDown,
    /// The motors are being disabled.
    Disabling,
    /// The motors are disabled.
    Disabled,
}

/// The reports of a run.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ReportedCourse {
    /// Stages in order: time \[s\], stage, reason.
    pub stages: Vec<(f64, Stage, String)>,
    /// Times at which a misbehaviour began \[s\].
    pub misbehaves_s: Vec<f64>,
    /// Motors, counted from 0, whose watchdog ended the torque: time \[s\], motor, time since their last command \[ms\].
    pub watchdogs: Vec<(f64, usize, f64)>,
    /// Times at which all motors were enabled \[s\].
    pub enabled_s: Vec<f64>,
    /// Times at which all motors were disabled \[s\].
    pub disabled_s: Vec<f64>,
    /// Errors of the processes.
    pub errors: Vec<String>,
}

impl ReportedCourse {
    /// Reads a file of reports.
    ///
    /// # Errors
    /// [`Failure::File`].
    pub fn read(file: &Path) -> Result<ReportedCourse, Failure> {
        let text = supple_files::read_text(file, MAX_BYTES)
            .map_err(|error| Failure::file("read", file, error))?;
        Ok(ReportedCourse::parse(&text))
    }

    fn parse(text: &str) -> ReportedCourse {
        let mut course = ReportedCourse::default();
        for line in text.lines() {
            if line.contains(": error: ") {
                course.errors.push(line.to_owned());
            }
            if let Some((time_s, what)) = timed(line, "supple-can: ") {
                course.bus(time_s, what);
            } else if let Some((time_s, what)) = timed(line, "supple-emu: ") {
                course.arm(time_s, what);
            }
        }
        course
    }

    fn bus(&mut self, time_s: f64, what: &str) {
        let stages = [
            ("holding the arm: ", Stage::Holding),
            ("laying the arm down: ", Stage::LayingDown),
            ("disabling the motors: ", Stage::Disabling),
            ("disabled", Stage::Disabled),
        ];
        for (prefix, stage) in stages {
            if let Some(reason) = what.strip_prefix(prefix) {
                self.stages.push((time_s, stage, reason.to_owned()));
            }
        }
    }

    fn arm(&mut self, time_s: f64, what: &str) {
        if what.starts_with("misbehaves: ") {
            self.misbehaves_s.push(time_s);
        } else if what == "all motors enabled" {
            self.enabled_s.push(time_s);
        } else if what == "all motors disabled" {
            self.disabled_s.push(time_s);
        } else if let Some((motor, since)) = what
            .strip_prefix("motor ")
            .and_then(|rest| rest.split_once(": no torque, "))
        {
            let since_ms = since.split_once(" ms ").map(|(ms, _)| ms.parse());
            if let (Ok(motor @ 1..), Some(Ok(since_ms))) = (motor.parse::<usize>(), since_ms) {
                self.watchdogs.push((time_s, motor - 1, since_ms));
            }
        }
    }

    /// Returns the first loss from this time on: time \[s\] and reason.
    pub fn loss(&self, from_s: f64) -> Option<(f64, &str)> {
        let found = self.stages.iter().find(|(time_s, stage, _)| {
            *time_s >= from_s && matches!(stage, Stage::Holding | Stage::Disabling)
        });
        found.map(|(time_s, _, reason)| (*time_s, reason.as_str()))
    }

    /// Returns the time of a stage from this time on \[s\].
    pub fn stage_s(&self, stage: Stage, from_s: f64) -> Option<f64> {
        let found = self
            .stages
            .iter()
            .find(|(time_s, found, _)| *time_s >= from_s && *found == stage);
        found.map(|(time_s, ..)| *time_s)
    }

    /// Returns the stages from this time on.
    pub fn stages(&self, from_s: f64) -> Vec<Stage> {
        let later = self.stages.iter().filter(|(time_s, ..)| *time_s >= from_s);
        later.map(|(_, stage, _)| *stage).collect()
    }
}

/// Parses time \[s\] and text of a line `PROGRAM: TIME s: TEXT`.
fn timed<'a>(line: &'a str, program: &str) -> Option<(f64, &'a str)> {
    let (time_s, what) = line.strip_prefix(program)?.split_once(" s: ")?;
    Some((time_s.parse().ok()?, what))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stages_states_and_errors_are_read() {
        let course = ReportedCourse::parse(
            "supple-can: bus unix:/run/x\n\
             supple-emu: 0.0310 s: all motors enabled\n\
             supple-can: active\n\
             supple-emu: 1.0000 s: misbehaves: motor 7 has an error: current too high\n\
             supple-emu: 1.0000 s: motor 7: current too high\n\
             supple-can: 1.0018 s: holding the arm: motor 7 reports over-current\n\
             supple-can: 1.5020 s: laying the arm down: motor 7 reports over-current\n\
             supple-can: 9.0000 s: disabling the motors: motor 7 reports over-current\n\
             supple-can: 9.0010 s: disabled\n\
             supple-emu: 9.1000 s: motor 2: no torque, 20.2 ms after its last command\n\
             supple-emu: error: no more\n",
        );
        assert_eq!(course.misbehaves_s, [1.0]);
        assert_eq!(course.enabled_s, [0.031]);
        assert_eq!(
            course.loss(1.0),
            Some((1.0018, "motor 7 reports over-current"))
        );
        assert_eq!(course.loss(9.01), None);
        assert_eq!(course.stage_s(Stage::LayingDown, 0.0), Some(1.502));
        assert_eq!(
            course.stages(0.0),
            [
                Stage::Holding,
                Stage::LayingDown,
                Stage::Disabling,
                Stage::Disabled
            ]
        );
        assert_eq!(course.watchdogs, [(9.1, 1, 20.2)]);
        assert_eq!(course.errors.len(), 1);
    }
}
