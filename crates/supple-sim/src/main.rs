//! A simulated arm, as a process.

fn main() -> std::process::ExitCode {
    supple_sim::main()
}
