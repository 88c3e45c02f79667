//! The program `supple-sim`.

fn main() -> std::process::ExitCode {
    supple_realtime::run_on_supported_processor(supple_sim::main)
}
