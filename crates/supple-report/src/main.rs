//! Entry point of `supple-report`: the commands that need no running controller.

fn main() -> std::process::ExitCode {
    supple_report::run()
}
