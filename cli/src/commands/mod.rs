//! The commands: a file or a folder for each, with its arguments and its code.

#[allow(clippy::disallowed_methods)] // workloads to time
pub(crate) mod bench;
pub(crate) mod check;
pub(crate) mod compare;
pub(crate) mod completions;
pub(crate) mod convert;
pub(crate) mod devices;
pub(crate) mod eval;
pub(crate) mod explain;
pub(crate) mod features;
pub(crate) mod follow;
pub(crate) mod generate;
pub(crate) mod info;
pub(crate) mod lab;
pub(crate) mod man;
pub(crate) mod merge;
pub(crate) mod methods;
pub(crate) mod picture;
#[allow(clippy::disallowed_methods)] // pictures
pub(crate) mod plot;
pub(crate) mod probe;
pub(crate) mod prove;
pub(crate) mod reduce;
#[allow(clippy::disallowed_methods)] // pictures
pub(crate) mod render;
pub(crate) mod retarget;
pub(crate) mod route;
pub(crate) mod smooth;
#[allow(clippy::disallowed_methods)] // pictures
pub(crate) mod travel;
pub(crate) mod verify;
pub(crate) mod view;

use clap::Subcommand;

use crate::messages::exit::Failure;

#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    Eval(Box<eval::Arguments>),
    Convert(convert::Arguments),
    Retarget(Box<retarget::Arguments>),
    Features(Box<features::Arguments>),
    Route(Box<route::Arguments>),
    Follow(Box<follow::Arguments>),
    Compare(Box<compare::Arguments>),
    Verify(verify::Arguments),
    Prove(prove::Arguments),
    Lab(lab::Arguments),
    Devices(devices::Arguments),
    Info(info::Arguments),
    Generate(generate::Arguments),
    Methods(methods::Arguments),
    Plot(Box<plot::Arguments>),
    View(Box<view::Arguments>),
    Render(Box<render::Arguments>),
    Smooth(Box<smooth::Arguments>),
    Reduce(Box<reduce::Arguments>),
    Bench(bench::Arguments),
    Check(check::Arguments),
    Merge(merge::Arguments),
    Explain(explain::Arguments),
    Completions(completions::Arguments),
    Man(man::Arguments),
    #[command(hide = true)]
    ProbeDrivers(probe::Arguments),
}

impl Command {
    pub(crate) fn run(self) -> Result<(), Failure> {
        match self {
            Self::Eval(arguments) => eval::run(&arguments),
            Self::Convert(arguments) => convert::run(&arguments),
            Self::Retarget(arguments) => retarget::run(&arguments),
            Self::Features(arguments) => features::run(&arguments),
            Self::Route(arguments) => route::run(&arguments),
            Self::Follow(arguments) => follow::run(&arguments),
            Self::Compare(arguments) => compare::run(&arguments),
            Self::Verify(arguments) => verify::run(&arguments),
            Self::Prove(arguments) => prove::run(&arguments),
            Self::Lab(arguments) => lab::run(&arguments),
            Self::Devices(arguments) => devices::run(&arguments),
            Self::Info(arguments) => info::run(&arguments),
            Self::Generate(arguments) => generate::run(&arguments),
            Self::Methods(arguments) => methods::run(&arguments),
            Self::Plot(arguments) => plot::run(&arguments),
            Self::View(arguments) => view::run(&arguments),
            Self::Render(arguments) => render::run(&arguments),
            Self::Smooth(arguments) => smooth::run(&arguments),
            Self::Reduce(arguments) => reduce::run(&arguments),
            Self::Bench(arguments) => bench::run(&arguments),
            Self::Check(arguments) => check::run(&arguments),
            Self::Merge(arguments) => merge::run(&arguments),
            Self::Explain(arguments) => explain::run(&arguments),
            Self::Completions(arguments) => completions::run(&arguments),
            Self::Man(arguments) => man::run(&arguments),
            Self::ProbeDrivers(arguments) => probe::run(&arguments),
        }
    }
}
