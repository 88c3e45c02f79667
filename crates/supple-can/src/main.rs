//! The arm's bus and clock, as a process.

fn main() -> std::process::ExitCode {
    supple_can::main()
}
