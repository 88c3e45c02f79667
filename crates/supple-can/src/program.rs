//! The program: the backend of the arm's drives, and the summary of a run.

use crate::options::Options;
use crate::registry::BACKENDS;
use std::process::ExitCode;
use supple_drive::Counters;
use supple_model::Description;
use supple_process::{Failure, ProcessOptions, Program, RateOption};
use supple_realtime::Stop;

/// Runs the program: parses the arguments and returns the exit code.
pub fn main() -> ExitCode {
    supple_process::main::<Options>()
}

impl Program for Options {
    const NAME: &'static str = "supple-can";

    fn process(&self) -> &ProcessOptions {
        &self.process
    }

    fn rate(&self) -> RateOption {
        self.rate
    }

    fn run(&self, description: &Description, stop: &Stop) -> Result<Option<String>, Failure> {
        let mut backends = BACKENDS.iter();
        let backend = backends.find(|backend| (backend.supports)(description));
        let backend = backend.ok_or_else(|| {
            let arm = description.name();
            let text = "[bus] kind names no type of drives that this program supports";
            Failure::new(3, format_args!("arm `{arm}`: {text}"))
        })?;
        Ok((backend.run)(description, self, stop)?.map(|counters| summary(&counters)))
    }
}

fn summary(counters: &Counters) -> String {
    format!(
        "{} cycles, {} answers missed, {} answers unusable, {} periods skipped, {} frames lost, {} replies lost, \
         {} receive overruns",
        counters.cycles,
        counters.missed,
        counters.unusable,
        counters.skipped,
        counters.tx_lost,
        counters.replies_lost,
        counters.overruns
    )
}
