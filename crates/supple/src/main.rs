//! Entry point of the program `supple`.

fn main() -> std::process::ExitCode {
    supple_realtime::run_on_supported_processor(supple::run)
}
