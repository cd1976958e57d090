//! The program `tumble`; what it does is in the library beside it.

use std::process::ExitCode;

fn main() -> ExitCode {
    tumble_cli::main()
}
