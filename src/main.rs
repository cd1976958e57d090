//! The program `tumble`: keyframe tracks in, interpolated rotations out.
//!
//! Arguments are parsed into validated values, one command runs, and what went
//! wrong becomes a message on standard error and an exit code.

mod cli;

use std::process::ExitCode;

use clap::Parser;

fn main() -> ExitCode {
    cli::explain_panics();
    let arguments = cli::Arguments::parse();
    let outcome = std::panic::catch_unwind(|| {
        cli::stop_on_signals();
        arguments.command.run()
    });
    let code = match outcome {
        Ok(Ok(())) => cli::exit::DONE,
        Ok(Err(failure)) => failure.report(),
        Err(_) => cli::exit::BUG, // the hook has told about it
    };
    ExitCode::from(code)
}
