//! The live page.

fn main() -> std::process::ExitCode {
    supple_view::run()
}
