//! The program: everything is in `raywright_cli`.
fn main() -> std::process::ExitCode {
    raywright_cli::main()
}
