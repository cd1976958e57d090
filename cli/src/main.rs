//! The program `tumble`; the code is in the library beside it.

use std::process::ExitCode;

fn main() -> ExitCode {
    tumble_cli::main()
}
