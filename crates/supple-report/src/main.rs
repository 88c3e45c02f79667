//! The commands that need no running system.

fn main() -> std::process::ExitCode {
    supple_report::run()
}
