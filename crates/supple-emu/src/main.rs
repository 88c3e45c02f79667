//! The emulated arm, as a process.

fn main() -> std::process::ExitCode {
    supple_emu::main()
}
