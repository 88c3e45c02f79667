//! The program `supple-emu`.

fn main() -> std::process::ExitCode {
    supple_emu::main()
}
