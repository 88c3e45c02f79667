//! The controller of one arm, as a process.

fn main() -> std::process::ExitCode {
    supple_rt::main()
}
