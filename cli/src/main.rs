//! The program `tumble`; its code is in the library of this package.

use std::process::ExitCode;

fn main() -> ExitCode {
    tumble_cli::main()
}
