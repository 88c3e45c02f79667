//! Checks that the processor has the instructions for which the programs were built (`.cargo/config.toml`).

use std::process::ExitCode;

/// Exit code of a program on a processor that cannot run it: the machine does not meet the requirements.
const EXIT_CODE: u8 = 8;

/// Instruction sets of x86-64-v3: whether this build uses each, and its flag in `/proc/cpuinfo`.
const FLAGS: [(bool, &str); 7] = [
    (cfg!(target_feature = "lzcnt"), "abm"),
    (cfg!(target_feature = "avx"), "avx"),
    (cfg!(target_feature = "avx2"), "avx2"),
    (cfg!(target_feature = "bmi1"), "bmi1"),
    (cfg!(target_feature = "bmi2"), "bmi2"),
    (cfg!(target_feature = "f16c"), "f16c"),
    (cfg!(target_feature = "movbe"), "movbe"),
];

/// Error: the processor lacks instructions that the program uses.
#[derive(Debug, PartialEq, thiserror::Error)]
#[error(
    "this program was built for processors with {missing}, which this one lacks: build it with \
     RUSTFLAGS=\"-C target-cpu=x86-64\" (same results to the last bit, slower control step)"
)]
pub struct ProcessorError {
    /// Names of the missing instruction sets as in `/proc/cpuinfo`.
    missing: String,
}

/// Checks that the processor can run this program. Call it first in a program, before an illegal instruction can end it.
///
/// # Errors
/// [`ProcessorError`] with the missing instruction sets. If the flags of the processor cannot be read, the check passes.
pub fn check_processor() -> Result<(), ProcessorError> {
    match std::fs::read_to_string("/proc/cpuinfo") {
        Ok(text) => check(&FLAGS, &text),
        Err(_) => Ok(()),
    }
}

/// Runs a program; on a processor that cannot run it, prints the error and returns exit code 8.
pub fn run_on_supported_processor(program: fn() -> ExitCode) -> ExitCode {
    match check_processor() {
        Ok(()) => program(),
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::from(EXIT_CODE)
        }
    }
}

fn check(flags: &[(bool, &str)], cpuinfo: &str) -> Result<(), ProcessorError> {
    let Some(line) = cpuinfo.lines().find(|line| line.starts_with("flags")) else {
        return Ok(());
    };
    let has = |flag: &str| line.split_whitespace().any(|found| found == flag);
    let missing: Vec<&str> = flags
        .iter()
        .filter(|(needed, flag)| *needed && !has(flag))
        .map(|(_, flag)| *flag)
        .collect();
    match missing.is_empty() {
        true => Ok(()),
        false => Err(ProcessorError {
            missing: missing.join(", "),
        }),
    }
}

#[cfg(test)]
mod tests {
    use super::{FLAGS, check, check_processor};

    const OLD: &str = "processor\t: 0\nflags\t\t: fpu sse2 avx bmi1\nbugs\t\t:\n";

    #[test]
    fn missing_instructions_are_named() {
        let needed = FLAGS.map(|(_, flag)| (true, flag));
        let error = check(&needed, OLD).expect_err("lacks five");
        assert!(
            error.to_string().contains("abm, avx2, bmi2, f16c, movbe"),
            "{error}"
        );
    }

    #[test]
    fn instructions_that_the_build_does_not_use_may_be_missing() {
        let needed = FLAGS.map(|(_, flag)| (flag == "avx", flag));
        assert_eq!(check(&needed, OLD), Ok(()));
        assert_eq!(
            check(&FLAGS.map(|(_, flag)| (true, flag)), "processor: 0\n"),
            Ok(())
        );
    }

    #[test]
    fn the_processor_of_this_machine_passes_the_check() {
        assert_eq!(check_processor(), Ok(()));
    }
}
