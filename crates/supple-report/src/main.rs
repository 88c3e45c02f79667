//! Entry point of `supple-report`: the commands that need no running controller.

fn main() -> std::process::ExitCode {
    supple_realtime::run_on_supported_processor(supple_report::run)
}
