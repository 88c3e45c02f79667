//! The controller of one arm, as a process.

fn main() -> std::process::ExitCode {
    supple_realtime::run_on_supported_processor(supple_rt::main)
}
