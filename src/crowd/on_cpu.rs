//! A crowd on the CPU: instances on all threads, rotations of neighbouring joints in vector lanes.

use bytemuck::Zeroable as _;
use rayon::prelude::*;

use crate::crowd::clip_tables::{ClipTables, arcs};
use crate::crowd::compact;
use crate::crowd::lay_over::lay_over;
use crate::crowd::library::CrowdLibrary;
use crate::crowd::stages;
use crate::machine::Machine;
use crate::output::crowd::{CrowdOutput, CrowdValues, FrameStep};
use crate::shader::{
    CHANNELS, CrowdEntry, CrowdPosition, FORM_ARC, ON_KEY, ROTATION, SCALE, TRANSLATION,
};
use crate::simd::dispatch::{InLanes, in_lanes_of};
use crate::simd::lanes::Lanes;
use crate::threads::OutOfThreadsError;
use crate::twin::crowd_compact::is_compact;
use crate::twin::crowd_layers::Layers;
use crate::twin::crowd_matrices::transform;
use crate::twin::crowd_times::base_positions;

const TASK: usize = 32;

/// The input of an evaluation, the same for all instances.
#[derive(Clone, Copy)]
pub(crate) struct CrowdScene<'a> {
    pub(crate) library: &'a CrowdLibrary,
    pub(crate) values: CrowdValues,
    pub(crate) clock: u64,
    /// All entries, still without positions in the clips, which the evaluation computes.
    pub(crate) context: Layers<'a>,
}

/// Evaluates all instances into vectors of four numbers.
pub(crate) fn evaluate(
    scene: CrowdScene<'_>,
    machine: &dyn Machine,
    output: &mut [[f32; 4]],
) -> Result<(), OutOfThreadsError> {
    let (context, width) = (scene.context, machine.width());
    let task = |(positions, rotations): &mut (Vec<_>, Vec<_>),
                (output, entries): (&mut [[f32; 4]], &[CrowdEntry])| {
        positions.resize(
            entries.len() * context.bases as usize,
            CrowdPosition::zeroed(),
        );
        rotations.resize(2 * scene.library.joint_count(), [0.0; 4]);
        let context = Layers { entries, ..context };
        let scene = CrowdScene { context, ..scene };
        in_lanes_of(
            width,
            &mut InstancesTask {
                scene,
                positions,
                rotations,
                output,
            },
        );
    };
    let entries = context.entries;
    let (of_output, of_entries) = (scene.vectors() * TASK, context.layers as usize * TASK);
    if entries.len() <= of_entries {
        task(&mut Default::default(), (output, entries));
        return Ok(());
    }
    machine.threads().run(|| {
        let tasks = output.par_chunks_mut(of_output);
        let tasks = tasks.zip(entries.par_chunks(of_entries));
        tasks.for_each_init(Default::default, task);
    })
}

/// Some instances, and scratch memory.
struct InstancesTask<'a, 'b> {
    scene: CrowdScene<'a>,
    positions: &'b mut Vec<CrowdPosition>,
    /// The rotations of an instance, and the rotations of one of its layers.
    rotations: &'b mut Vec<[f32; 4]>,
    output: &'b mut [[f32; 4]],
}

impl InLanes for InstancesTask<'_, '_> {
    #[inline(always)]
    fn run<L: Lanes>(&mut self) {
        let (scene, context) = (self.scene, self.scene.context);
        let tables = &scene.library.tables;
        let (layers, bases) = (context.layers as usize, context.bases as usize);
        let rows = self.positions.chunks_exact_mut(bases);
        let entries = context.entries.iter().zip(rows).enumerate();
        for (entry_index, (entry, entry_positions)) in entries {
            if entry_index.is_multiple_of(layers) || entry.clip_and_weight >> 16 != 0 {
                let (clips, bases, spans) = (&tables.clips, &tables.bases, &tables.spans);
                base_positions(entry, scene.clock, clips, bases, spans, entry_positions);
            }
        }
        let context = Layers {
            positions: &self.positions[..],
            ..context
        };
        let (found, layered) = self.rotations.split_at_mut(scene.library.joint_count());
        for (instance, output) in self.output.chunks_exact_mut(scene.vectors()).enumerate() {
            let is_all = scene.values == CrowdValues::Rotations;
            // A single call for both cases, because the function is inlined and has many instructions.
            let into = if is_all { &mut *output } else { &mut *found };
            rotations::<L>(&context, tables, instance, layered, into);
            if !is_all {
                matrices(scene, &context, instance as u32, found, output);
            }
        }
    }
}

/// The matrices of an instance, whose rotations are `found`.
#[inline(always)]
fn matrices(
    scene: CrowdScene<'_>,
    context: &Layers<'_>,
    instance: u32,
    found: &[[f32; 4]],
    output: &mut [[f32; 4]],
) {
    let (matrices, _) = output.as_chunks_mut::<3>();
    for step in FrameStep::of(scene.values.into()) {
        match step {
            // The caller has computed these steps already.
            FrameStep::Positions | FrameStep::Rotations => {}
            FrameStep::Locals => {
                for ((joint, &rotation), matrix) in (0..).zip(found).zip(&mut *matrices) {
                    let moved = context.layered(instance, joint, TRANSLATION);
                    let scale = context.layered(instance, joint, SCALE);
                    *matrix = transform(rotation, moved, scale);
                }
            }
            FrameStep::Walk => stages::walk(&scene.library.links, matrices),
            FrameStep::Skin => stages::skin(&scene.library.bind, matrices),
            // The caller rounds the result.
            FrameStep::Half => {}
        }
    }
}

impl CrowdScene<'_> {
    fn vectors(&self) -> usize {
        self.library.joint_count() * CrowdOutput::from(self.values).vector_count()
    }
}

/// The rotations of an instance: those of its first layer, with the other layers blended over them. `layered` is
/// scratch memory for the rotations of one layer.
#[inline(always)]
fn rotations<L: Lanes>(
    context: &Layers<'_>,
    tables: &ClipTables,
    instance: usize,
    layered: &mut [[f32; 4]],
    output: &mut [[f32; 4]],
) {
    let first = instance * context.layers as usize;
    let mut layers = first + 1..first + context.layers as usize;
    // Layers below one that hides them have no effect.
    let hides = |layer: &usize| context.entries[*layer].hides_lower_layers();
    let lowest = layers.clone().rfind(hides).unwrap_or(first);
    layers.start = lowest + 1;
    of_layer::<L>(context, tables, lowest, output);
    for layer in layers {
        if context.entries[layer].clip_and_weight >> 16 != 0 {
            of_layer::<L>(context, tables, layer, layered);
            lay_over::<L>(context, layer, layered, output);
        }
    }
}

/// The rotations of one layer.
#[inline(always)]
fn of_layer<L: Lanes>(
    context: &Layers<'_>,
    tables: &ClipTables,
    layer: usize,
    output: &mut [[f32; 4]],
) {
    let entry = &context.entries[layer];
    let clip = entry.clip_and_weight & 0xffff;
    for run in &tables.runs[clip as usize] {
        let values = &mut output[run.start as usize..run.end as usize];
        let first_channel = ((clip * context.joints + run.start) * CHANNELS) as usize;
        let channel = &context.channels[first_channel];
        let base = (channel.form_and_base & 0x00ff_ffff) as usize;
        let stands = context.positions[layer * context.bases as usize + base];
        if channel.form_and_base >> 24 == FORM_ARC && stands.span & ON_KEY == 0 {
            let middle = (channel.first + stands.span * channel.count * 2) as usize;
            let tangent = middle + channel.count as usize;
            let cells = |first: usize| &context.cells[first..first + values.len()];
            arcs::<L>(cells(middle), cells(tangent), stands.parameter, values);
            continue;
        }
        if is_compact(channel.form_and_base >> 24) {
            compact::rotations::<L>(context.cells, channel, stands, values);
            continue;
        }
        for (joint, value) in run.clone().zip(values) {
            *value = context.layer_value(layer as u32, entry, joint, ROTATION);
        }
    }
}
