//! `tumble eval`: keyframe files in, rotations and whole poses at every frame out.

mod arguments;
pub(crate) mod job;
pub(crate) mod shards;

use crate::batch::preview::PlannedWork;
pub(crate) use crate::commands::eval::arguments::Arguments;
use crate::commands::eval::job::evaluate_all;
use crate::messages::exit::Failure;

pub(crate) fn run(arguments: &Arguments) -> Result<(), Failure> {
    if let Some(part) = arguments.shard {
        return shards::run(arguments, part);
    }
    // Everything that can be refused is refused before any work.
    arguments.refuse_quantity_as_output()?;
    let inputs = arguments
        .inputs
        .gather(arguments.sampling.reads_standard_input())?;
    let samples = arguments.checked_samples()?;
    let format = arguments.dialect.format(&arguments.results)?;
    arguments.choose_keys();
    let (reader, options) = (arguments.inputs.clone(), arguments.options(&samples));
    let work = PlannedWork {
        reader: &reader,
        options: &options,
    };
    let plan = arguments.results.plan_in(inputs, format, &work)?;
    // All targets have one format.
    if let Some(target) = plan.targets.first() {
        arguments.check_before(target.format())?;
    }
    let mut device = arguments.device.open()?;
    let mut pipeline = arguments.results.start(reader, plan, options);
    evaluate_all(arguments, &samples, &mut device, &mut pipeline);
    pipeline.finish()
}
