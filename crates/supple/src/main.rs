//! The command line.

fn main() -> std::process::ExitCode {
    supple::run()
}
