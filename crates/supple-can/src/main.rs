//! The program `supple-can`.

fn main() -> std::process::ExitCode {
    supple_can::main()
}
