//! The program `supple-rt`.

fn main() -> std::process::ExitCode {
    supple_realtime::run_on_supported_processor(supple_rt::main)
}
