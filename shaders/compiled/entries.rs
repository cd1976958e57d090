//! The kernels, one invocation at a time. Written by `cargo run -p tumble-shaders` from the shaders: change those.

use crate::shader::*;
use crate::twin::machine::{
    Entry, Float, Machine, ballot, barrier, both, choose, quotient, shuffled, stored,
};

/// The variables of the kernels, by their names.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Global {
    Added,
    All,
    Base,
    Bind,
    Blended,
    Blocks,
    Cells,
    Changes,
    Channels,
    Clips,
    Constants,
    Dispatch,
    Distances,
    Entries,
    FirstEntry,
    FoundParameters,
    FoundSpans,
    Frames,
    FromLayer,
    Gathered,
    Halves,
    Intervals,
    IsThere,
    Items,
    Keys,
    Layer,
    Layers,
    Links,
    Local,
    Matrices,
    Mixed,
    Picks,
    Positions,
    Probes,
    Rates,
    Reference,
    Replies,
    Rotations,
    Rows,
    Samples,
    Segments,
    Smoothed,
    Spans,
    States,
    Steps,
    Tile,
    TimeBases,
    ToLayer,
    Tracks,
    Values,
    Visible,
    Weights,
    World,
}

impl Global {
    /// All of them, in their order.
    pub(crate) const ALL: [Self; GLOBALS] = [
        Self::Added,
        Self::All,
        Self::Base,
        Self::Bind,
        Self::Blended,
        Self::Blocks,
        Self::Cells,
        Self::Changes,
        Self::Channels,
        Self::Clips,
        Self::Constants,
        Self::Dispatch,
        Self::Distances,
        Self::Entries,
        Self::FirstEntry,
        Self::FoundParameters,
        Self::FoundSpans,
        Self::Frames,
        Self::FromLayer,
        Self::Gathered,
        Self::Halves,
        Self::Intervals,
        Self::IsThere,
        Self::Items,
        Self::Keys,
        Self::Layer,
        Self::Layers,
        Self::Links,
        Self::Local,
        Self::Matrices,
        Self::Mixed,
        Self::Picks,
        Self::Positions,
        Self::Probes,
        Self::Rates,
        Self::Reference,
        Self::Replies,
        Self::Rotations,
        Self::Rows,
        Self::Samples,
        Self::Segments,
        Self::Smoothed,
        Self::Spans,
        Self::States,
        Self::Steps,
        Self::Tile,
        Self::TimeBases,
        Self::ToLayer,
        Self::Tracks,
        Self::Values,
        Self::Visible,
        Self::Weights,
        Self::World,
    ];
}

pub(crate) const GLOBALS: usize = 53;

/// Variables of which each invocation has its own.
pub(crate) const PRIVATE: [Global; 1] = [Global::FirstEntry];

/// The variables that kernels bind, in the order of the bindings.
const BOUND: [&[Global]; 31] = [
    &[Global::Probes, Global::Replies],
    &[
        Global::Segments,
        Global::Constants,
        Global::Items,
        Global::Rotations,
    ],
    &[
        Global::Segments,
        Global::Constants,
        Global::Items,
        Global::Distances,
        Global::Rotations,
    ],
    &[
        Global::Segments,
        Global::Constants,
        Global::Samples,
        Global::Rotations,
    ],
    &[
        Global::Segments,
        Global::Constants,
        Global::Items,
        Global::Blocks,
        Global::Rotations,
    ],
    &[
        Global::Segments,
        Global::Constants,
        Global::Items,
        Global::Blocks,
        Global::Distances,
        Global::Rotations,
    ],
    &[Global::Keys, Global::Samples, Global::Rotations],
    &[
        Global::Keys,
        Global::Samples,
        Global::Weights,
        Global::Rotations,
    ],
    &[
        Global::Base,
        Global::Layer,
        Global::Reference,
        Global::Added,
    ],
    &[Global::Layers, Global::Weights, Global::Blended],
    &[
        Global::FromLayer,
        Global::ToLayer,
        Global::Weights,
        Global::Mixed,
    ],
    &[
        Global::Values,
        Global::Steps,
        Global::Weights,
        Global::Smoothed,
    ],
    &[Global::Values, Global::Steps],
    &[Global::Local, Global::Links, Global::World],
    &[
        Global::Entries,
        Global::Channels,
        Global::Cells,
        Global::Positions,
        Global::Rotations,
    ],
    &[Global::All, Global::Visible, Global::Gathered],
    &[Global::Changes, Global::All],
    &[
        Global::Entries,
        Global::Clips,
        Global::TimeBases,
        Global::Spans,
        Global::Positions,
    ],
    &[Global::Links, Global::Matrices],
    &[Global::Bind, Global::Matrices],
    &[Global::Values, Global::Halves],
    &[
        Global::Entries,
        Global::Clips,
        Global::TimeBases,
        Global::Spans,
        Global::Channels,
        Global::Cells,
        Global::Values,
        Global::Halves,
    ],
    &[
        Global::Entries,
        Global::Clips,
        Global::TimeBases,
        Global::Spans,
        Global::Channels,
        Global::Cells,
        Global::Links,
        Global::Bind,
        Global::Values,
        Global::Halves,
    ],
    &[
        Global::Entries,
        Global::Clips,
        Global::TimeBases,
        Global::Spans,
        Global::Channels,
        Global::Cells,
        Global::Rotations,
    ],
    &[
        Global::Samples,
        Global::Clips,
        Global::TimeBases,
        Global::Spans,
        Global::Channels,
        Global::Cells,
        Global::States,
    ],
    &[Global::Links, Global::States],
    &[Global::Rates, Global::States],
    &[Global::States, Global::Values],
    &[Global::Frames, Global::Tracks, Global::States],
    &[Global::Picks, Global::States, Global::Values],
    &[Global::Keys, Global::Intervals, Global::Rotations],
];

const fn entry(
    bound: usize,
    pushed: Option<Global>,
    workgroup: u32,
    texels: Option<usize>,
) -> Entry {
    Entry {
        bound: BOUND[bound],
        pushed,
        workgroup,
        texels,
    }
}

/// The entry points: those of the kernels in their order, and then those that read texel buffers.
pub(crate) static ENTRIES: [Entry; 227] = [
    entry(0, None, 64, None),
    entry(1, Some(Global::Dispatch), 64, Some(164)),
    entry(1, Some(Global::Dispatch), 64, Some(165)),
    entry(1, Some(Global::Dispatch), 64, Some(166)),
    entry(1, Some(Global::Dispatch), 64, Some(167)),
    entry(1, Some(Global::Dispatch), 64, Some(168)),
    entry(1, Some(Global::Dispatch), 64, Some(169)),
    entry(1, Some(Global::Dispatch), 64, Some(170)),
    entry(1, Some(Global::Dispatch), 64, Some(171)),
    entry(1, Some(Global::Dispatch), 64, Some(172)),
    entry(2, Some(Global::Dispatch), 64, Some(173)),
    entry(2, Some(Global::Dispatch), 64, Some(174)),
    entry(2, Some(Global::Dispatch), 64, Some(175)),
    entry(2, Some(Global::Dispatch), 64, Some(176)),
    entry(2, Some(Global::Dispatch), 64, Some(177)),
    entry(2, Some(Global::Dispatch), 64, Some(178)),
    entry(2, Some(Global::Dispatch), 64, Some(179)),
    entry(2, Some(Global::Dispatch), 64, Some(180)),
    entry(2, Some(Global::Dispatch), 64, Some(181)),
    entry(3, Some(Global::Dispatch), 64, Some(182)),
    entry(3, Some(Global::Dispatch), 64, Some(183)),
    entry(3, Some(Global::Dispatch), 64, Some(184)),
    entry(3, Some(Global::Dispatch), 64, Some(185)),
    entry(3, Some(Global::Dispatch), 64, Some(186)),
    entry(3, Some(Global::Dispatch), 64, Some(187)),
    entry(3, Some(Global::Dispatch), 64, Some(188)),
    entry(3, Some(Global::Dispatch), 64, Some(189)),
    entry(3, Some(Global::Dispatch), 64, Some(190)),
    entry(4, Some(Global::Dispatch), 64, None),
    entry(4, Some(Global::Dispatch), 64, None),
    entry(4, Some(Global::Dispatch), 64, None),
    entry(4, Some(Global::Dispatch), 64, None),
    entry(4, Some(Global::Dispatch), 64, None),
    entry(4, Some(Global::Dispatch), 64, None),
    entry(4, Some(Global::Dispatch), 64, None),
    entry(4, Some(Global::Dispatch), 64, None),
    entry(4, Some(Global::Dispatch), 64, None),
    entry(5, Some(Global::Dispatch), 64, None),
    entry(5, Some(Global::Dispatch), 64, None),
    entry(5, Some(Global::Dispatch), 64, None),
    entry(5, Some(Global::Dispatch), 64, None),
    entry(5, Some(Global::Dispatch), 64, None),
    entry(5, Some(Global::Dispatch), 64, None),
    entry(5, Some(Global::Dispatch), 64, None),
    entry(5, Some(Global::Dispatch), 64, None),
    entry(5, Some(Global::Dispatch), 64, None),
    entry(1, Some(Global::Dispatch), 128, None),
    entry(1, Some(Global::Dispatch), 128, None),
    entry(1, Some(Global::Dispatch), 128, None),
    entry(1, Some(Global::Dispatch), 128, None),
    entry(1, Some(Global::Dispatch), 128, None),
    entry(1, Some(Global::Dispatch), 128, None),
    entry(1, Some(Global::Dispatch), 128, None),
    entry(1, Some(Global::Dispatch), 128, None),
    entry(1, Some(Global::Dispatch), 128, None),
    entry(2, Some(Global::Dispatch), 128, None),
    entry(2, Some(Global::Dispatch), 128, None),
    entry(2, Some(Global::Dispatch), 128, None),
    entry(2, Some(Global::Dispatch), 128, None),
    entry(2, Some(Global::Dispatch), 128, None),
    entry(2, Some(Global::Dispatch), 128, None),
    entry(2, Some(Global::Dispatch), 128, None),
    entry(2, Some(Global::Dispatch), 128, None),
    entry(2, Some(Global::Dispatch), 128, None),
    entry(1, Some(Global::Dispatch), 64, Some(191)),
    entry(1, Some(Global::Dispatch), 64, Some(192)),
    entry(1, Some(Global::Dispatch), 64, Some(193)),
    entry(1, Some(Global::Dispatch), 64, Some(194)),
    entry(1, Some(Global::Dispatch), 64, Some(195)),
    entry(1, Some(Global::Dispatch), 64, Some(196)),
    entry(1, Some(Global::Dispatch), 64, Some(197)),
    entry(1, Some(Global::Dispatch), 64, Some(198)),
    entry(1, Some(Global::Dispatch), 64, Some(199)),
    entry(2, Some(Global::Dispatch), 64, Some(200)),
    entry(2, Some(Global::Dispatch), 64, Some(201)),
    entry(2, Some(Global::Dispatch), 64, Some(202)),
    entry(2, Some(Global::Dispatch), 64, Some(203)),
    entry(2, Some(Global::Dispatch), 64, Some(204)),
    entry(2, Some(Global::Dispatch), 64, Some(205)),
    entry(2, Some(Global::Dispatch), 64, Some(206)),
    entry(2, Some(Global::Dispatch), 64, Some(207)),
    entry(2, Some(Global::Dispatch), 64, Some(208)),
    entry(3, Some(Global::Dispatch), 64, Some(209)),
    entry(3, Some(Global::Dispatch), 64, Some(210)),
    entry(3, Some(Global::Dispatch), 64, Some(211)),
    entry(3, Some(Global::Dispatch), 64, Some(212)),
    entry(3, Some(Global::Dispatch), 64, Some(213)),
    entry(3, Some(Global::Dispatch), 64, Some(214)),
    entry(3, Some(Global::Dispatch), 64, Some(215)),
    entry(3, Some(Global::Dispatch), 64, Some(216)),
    entry(3, Some(Global::Dispatch), 64, Some(217)),
    entry(4, Some(Global::Dispatch), 64, None),
    entry(4, Some(Global::Dispatch), 64, None),
    entry(4, Some(Global::Dispatch), 64, None),
    entry(4, Some(Global::Dispatch), 64, None),
    entry(4, Some(Global::Dispatch), 64, None),
    entry(4, Some(Global::Dispatch), 64, None),
    entry(4, Some(Global::Dispatch), 64, None),
    entry(4, Some(Global::Dispatch), 64, None),
    entry(4, Some(Global::Dispatch), 64, None),
    entry(5, Some(Global::Dispatch), 64, None),
    entry(5, Some(Global::Dispatch), 64, None),
    entry(5, Some(Global::Dispatch), 64, None),
    entry(5, Some(Global::Dispatch), 64, None),
    entry(5, Some(Global::Dispatch), 64, None),
    entry(5, Some(Global::Dispatch), 64, None),
    entry(5, Some(Global::Dispatch), 64, None),
    entry(5, Some(Global::Dispatch), 64, None),
    entry(5, Some(Global::Dispatch), 64, None),
    entry(1, Some(Global::Dispatch), 128, None),
    entry(1, Some(Global::Dispatch), 128, None),
    entry(1, Some(Global::Dispatch), 128, None),
    entry(1, Some(Global::Dispatch), 128, None),
    entry(1, Some(Global::Dispatch), 128, None),
    entry(1, Some(Global::Dispatch), 128, None),
    entry(1, Some(Global::Dispatch), 128, None),
    entry(1, Some(Global::Dispatch), 128, None),
    entry(1, Some(Global::Dispatch), 128, None),
    entry(2, Some(Global::Dispatch), 128, None),
    entry(2, Some(Global::Dispatch), 128, None),
    entry(2, Some(Global::Dispatch), 128, None),
    entry(2, Some(Global::Dispatch), 128, None),
    entry(2, Some(Global::Dispatch), 128, None),
    entry(2, Some(Global::Dispatch), 128, None),
    entry(2, Some(Global::Dispatch), 128, None),
    entry(2, Some(Global::Dispatch), 128, None),
    entry(2, Some(Global::Dispatch), 128, None),
    entry(6, Some(Global::Rows), 64, Some(218)),
    entry(6, Some(Global::Rows), 64, Some(219)),
    entry(7, Some(Global::Rows), 64, Some(220)),
    entry(8, Some(Global::Dispatch), 64, None),
    entry(9, Some(Global::Dispatch), 64, None),
    entry(10, Some(Global::Dispatch), 64, None),
    entry(11, Some(Global::Dispatch), 64, None),
    entry(12, Some(Global::Dispatch), 64, None),
    entry(13, Some(Global::Dispatch), 64, None),
    entry(14, Some(Global::Dispatch), 64, Some(221)),
    entry(14, Some(Global::Dispatch), 64, Some(222)),
    entry(14, Some(Global::Dispatch), 64, Some(223)),
    entry(14, Some(Global::Dispatch), 64, Some(224)),
    entry(14, Some(Global::Dispatch), 64, Some(225)),
    entry(14, Some(Global::Dispatch), 64, Some(226)),
    entry(15, Some(Global::Dispatch), 64, None),
    entry(16, Some(Global::Dispatch), 64, None),
    entry(17, Some(Global::Dispatch), 64, None),
    entry(18, Some(Global::Dispatch), 64, None),
    entry(18, Some(Global::Dispatch), 64, None),
    entry(19, Some(Global::Dispatch), 64, None),
    entry(20, Some(Global::Dispatch), 64, None),
    entry(21, Some(Global::Dispatch), 64, None),
    entry(21, Some(Global::Dispatch), 64, None),
    entry(22, Some(Global::Dispatch), 64, None),
    entry(22, Some(Global::Dispatch), 64, None),
    entry(21, Some(Global::Dispatch), 64, None),
    entry(23, Some(Global::Dispatch), 64, None),
    entry(23, Some(Global::Dispatch), 64, None),
    entry(24, Some(Global::Dispatch), 64, None),
    entry(25, Some(Global::Dispatch), 64, None),
    entry(26, Some(Global::Dispatch), 64, None),
    entry(27, Some(Global::Dispatch), 64, None),
    entry(27, Some(Global::Dispatch), 64, None),
    entry(28, Some(Global::Dispatch), 64, None),
    entry(29, Some(Global::Dispatch), 64, None),
    entry(30, Some(Global::Dispatch), 64, None),
    entry(1, Some(Global::Dispatch), 64, None),
    entry(1, Some(Global::Dispatch), 64, None),
    entry(1, Some(Global::Dispatch), 64, None),
    entry(1, Some(Global::Dispatch), 64, None),
    entry(1, Some(Global::Dispatch), 64, None),
    entry(1, Some(Global::Dispatch), 64, None),
    entry(1, Some(Global::Dispatch), 64, None),
    entry(1, Some(Global::Dispatch), 64, None),
    entry(1, Some(Global::Dispatch), 64, None),
    entry(2, Some(Global::Dispatch), 64, None),
    entry(2, Some(Global::Dispatch), 64, None),
    entry(2, Some(Global::Dispatch), 64, None),
    entry(2, Some(Global::Dispatch), 64, None),
    entry(2, Some(Global::Dispatch), 64, None),
    entry(2, Some(Global::Dispatch), 64, None),
    entry(2, Some(Global::Dispatch), 64, None),
    entry(2, Some(Global::Dispatch), 64, None),
    entry(2, Some(Global::Dispatch), 64, None),
    entry(3, Some(Global::Dispatch), 64, None),
    entry(3, Some(Global::Dispatch), 64, None),
    entry(3, Some(Global::Dispatch), 64, None),
    entry(3, Some(Global::Dispatch), 64, None),
    entry(3, Some(Global::Dispatch), 64, None),
    entry(3, Some(Global::Dispatch), 64, None),
    entry(3, Some(Global::Dispatch), 64, None),
    entry(3, Some(Global::Dispatch), 64, None),
    entry(3, Some(Global::Dispatch), 64, None),
    entry(1, Some(Global::Dispatch), 64, None),
    entry(1, Some(Global::Dispatch), 64, None),
    entry(1, Some(Global::Dispatch), 64, None),
    entry(1, Some(Global::Dispatch), 64, None),
    entry(1, Some(Global::Dispatch), 64, None),
    entry(1, Some(Global::Dispatch), 64, None),
    entry(1, Some(Global::Dispatch), 64, None),
    entry(1, Some(Global::Dispatch), 64, None),
    entry(1, Some(Global::Dispatch), 64, None),
    entry(2, Some(Global::Dispatch), 64, None),
    entry(2, Some(Global::Dispatch), 64, None),
    entry(2, Some(Global::Dispatch), 64, None),
    entry(2, Some(Global::Dispatch), 64, None),
    entry(2, Some(Global::Dispatch), 64, None),
    entry(2, Some(Global::Dispatch), 64, None),
    entry(2, Some(Global::Dispatch), 64, None),
    entry(2, Some(Global::Dispatch), 64, None),
    entry(2, Some(Global::Dispatch), 64, None),
    entry(3, Some(Global::Dispatch), 64, None),
    entry(3, Some(Global::Dispatch), 64, None),
    entry(3, Some(Global::Dispatch), 64, None),
    entry(3, Some(Global::Dispatch), 64, None),
    entry(3, Some(Global::Dispatch), 64, None),
    entry(3, Some(Global::Dispatch), 64, None),
    entry(3, Some(Global::Dispatch), 64, None),
    entry(3, Some(Global::Dispatch), 64, None),
    entry(3, Some(Global::Dispatch), 64, None),
    entry(6, Some(Global::Rows), 64, None),
    entry(6, Some(Global::Rows), 64, None),
    entry(7, Some(Global::Rows), 64, None),
    entry(14, Some(Global::Dispatch), 64, None),
    entry(14, Some(Global::Dispatch), 64, None),
    entry(14, Some(Global::Dispatch), 64, None),
    entry(14, Some(Global::Dispatch), 64, None),
    entry(14, Some(Global::Dispatch), 64, None),
    entry(14, Some(Global::Dispatch), 64, None),
];

#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct ArcSegment<F> {
    pub(crate) middle: [F; 4],
    pub(crate) tangent: [F; 4],
}

stored!(ArcSegment, (<F>), 8, middle 0, tangent 4);

#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct ArcsHoisted<F> {
    pub(crate) parameter: F,
}

stored!(ArcsHoisted, (<F>), 1, parameter 0);

#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Block {
    pub(crate) first: u32,
    pub(crate) starts: u32,
}

stored!(Block, (), 2, first 0, starts 1);

#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Cell {
    pub(crate) output: u32,
    pub(crate) row: u32,
    pub(crate) position: u32,
    pub(crate) block: u32,
    pub(crate) is_inside: bool,
}

#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Corner {
    pub(crate) first: u32,
    pub(crate) column: u32,
    pub(crate) block: u32,
}

stored!(Corner, (), 3, first 0, column 1, block 2);

#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct CrowdBase {
    pub(crate) first: u32,
    pub(crate) count: u32,
    pub(crate) step: u32,
}

stored!(CrowdBase, (), 3, first 0, count 1, step 2);

#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct CrowdChange {
    pub(crate) index: u32,
    pub(crate) clip_and_weight: u32,
    pub(crate) speed_and_modes: u32,
    pub(crate) start: u32,
    pub(crate) anchor: u32,
}

stored!(CrowdChange, (), 5, index 0, clip_and_weight 1, speed_and_modes 2, start 3, anchor 4);

#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct CrowdChannel {
    pub(crate) first: u32,
    pub(crate) count: u32,
    pub(crate) form_and_base: u32,
    pub(crate) keys: u32,
}

stored!(CrowdChannel, (), 4, first 0, count 1, form_and_base 2, keys 3);

#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct CrowdClip {
    pub(crate) period: u32,
    pub(crate) first_base: u32,
    pub(crate) bases: u32,
}

stored!(CrowdClip, (), 3, period 0, first_base 1, bases 2);

#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct CrowdEntry {
    pub(crate) clip_and_weight: u32,
    pub(crate) speed_and_modes: u32,
    pub(crate) start: u32,
    pub(crate) anchor: u32,
}

stored!(CrowdEntry, (), 4, clip_and_weight 0, speed_and_modes 1, start 2, anchor 3);

#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct CrowdLink {
    pub(crate) joint: u32,
    pub(crate) parent: u32,
}

stored!(CrowdLink, (), 2, joint 0, parent 1);

#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct CrowdMove {
    pub(crate) ticks: [u32; 2],
    pub(crate) part: u32,
}

stored!(CrowdMove, (), 4, ticks 0, part 2);

#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct CrowdPosition<F> {
    pub(crate) span: u32,
    pub(crate) parameter: F,
}

stored!(CrowdPosition, (<F>), 2, span 0, parameter 1);

#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct CrowdSpan<F> {
    pub(crate) start: u32,
    pub(crate) whole: i32,
    pub(crate) scale: F,
    pub(crate) offset: F,
}

stored!(CrowdSpan, (<F>), 4, start 0, whole 1, scale 2, offset 3);

#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct CubicsHoisted<F> {
    pub(crate) first: TangentWeights<F>,
    pub(crate) last: TangentWeights<F>,
    pub(crate) parameter: F,
}

stored!(CubicsHoisted, (<F>), 9, first 0, last 4, parameter 8);

#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Dispatch {
    pub(crate) first_item: u32,
    pub(crate) item_count: u32,
    pub(crate) stride: u32,
    pub(crate) detail: u32,
    pub(crate) first_output: u32,
    pub(crate) idle: u32,
}

stored!(Dispatch, (), 6, first_item 0, item_count 1, stride 2, detail 3, first_output 4, idle 5);

#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct FromIdentity<F> {
    pub(crate) vector: [F; 3],
    pub(crate) cosm1: F,
}

stored!(FromIdentity, (<F>), 4, vector 0, cosm1 3);

#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Item<F> {
    pub(crate) source: u32,
    pub(crate) output: u32,
    pub(crate) count: u32,
    pub(crate) first: i32,
    pub(crate) scale: F,
    pub(crate) offset: F,
}

stored!(Item, (<F>), 6, source 0, output 1, count 2, first 3, scale 4, offset 5);

#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct KeySample<F> {
    pub(crate) key: u32,
    pub(crate) parameter: F,
}

stored!(KeySample, (<F>), 2, key 0, parameter 1);

#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Link<F> {
    pub(crate) offset: [F; 3],
    pub(crate) track: u32,
    pub(crate) parent: u32,
}

stored!(Link, (<F>), 8, offset 0, track 3, parent 4);

#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct ListedSample<F> {
    pub(crate) source: u32,
    pub(crate) parameter: F,
}

stored!(ListedSample, (<F>), 2, source 0, parameter 1);

#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct MatrixRows<F> {
    pub(crate) first: [F; 3],
    pub(crate) second: [F; 3],
    pub(crate) third: [F; 3],
}

stored!(MatrixRows, (<F>), 12, first 0, second 4, third 8);

#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct MotionSample {
    pub(crate) clip: u32,
    pub(crate) tick: u32,
}

stored!(MotionSample, (), 2, clip 0, tick 1);

#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct MotionSpan<F> {
    pub(crate) index: u32,
    pub(crate) parameter: F,
    pub(crate) rate: F,
}

stored!(MotionSpan, (<F>), 3, index 0, parameter 1, rate 2);

#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct PolynomialSegment<F> {
    pub(crate) coefficients: [[F; 4]; 11],
}

stored!(PolynomialSegment, (<F>), 44, coefficients 0);

#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Probe<F> {
    pub(crate) a: F,
    pub(crate) b: F,
    pub(crate) c: F,
    pub(crate) n: i32,
}

stored!(Probe, (<F>), 4, a 0, b 1, c 2, n 3);

#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Reply<F> {
    pub(crate) contraction: F,
    pub(crate) reassociation: F,
    pub(crate) rounding: F,
    pub(crate) association: F,
    pub(crate) conversion: F,
    pub(crate) cancellation: F,
    pub(crate) sine: F,
    pub(crate) cosine: F,
    pub(crate) root: F,
    pub(crate) arc_tangent: F,
}

stored!(Reply, (<F>), 10, contraction 0, reassociation 1, rounding 2, association 3, conversion 4, cancellation 5, sine 6, cosine 7, root 8, arc_tangent 9);

#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct SmallAngleCubic<F> {
    pub(crate) powers: [[F; 4]; 7],
    pub(crate) is_valid: bool,
}

#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Spread {
    pub(crate) detail: u32,
    pub(crate) first_item: u32,
    pub(crate) item_count: u32,
    pub(crate) first_output: u32,
    pub(crate) lanes_log2: u32,
    pub(crate) sample_mask: u32,
    pub(crate) track_mask: u32,
    pub(crate) step: u32,
    pub(crate) step_log2: u32,
    pub(crate) stride: u32,
    pub(crate) line_mask: u32,
    pub(crate) repetitions: u32,
    pub(crate) layer_repetitions: u32,
    pub(crate) segments: u32,
    pub(crate) constants: u32,
    pub(crate) outputs: u32,
}

stored!(Spread, (), 16, detail 0, first_item 1, item_count 2, first_output 3, lanes_log2 4, sample_mask 5, track_mask 6, step 7, step_log2 8, stride 9, line_mask 10, repetitions 11, layer_repetitions 12, segments 13, constants 14, outputs 15);

#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct SpreadRun<F> {
    pub(crate) source: u32,
    pub(crate) output: u32,
    pub(crate) count: u32,
    pub(crate) first: i32,
    pub(crate) scale: F,
    pub(crate) offset: F,
    pub(crate) key: u32,
    pub(crate) iterations: u32,
}

stored!(SpreadRun, (<F>), 8, source 0, output 1, count 2, first 3, scale 4, offset 5, key 6, iterations 7);

#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Subgroup<F> {
    pub(crate) row: u32,
    pub(crate) span: u32,
    pub(crate) parameter: F,
}

stored!(Subgroup, (<F>), 3, row 0, span 1, parameter 2);

#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct TangentWeights<F> {
    pub(crate) before: F,
    pub(crate) after: F,
    pub(crate) outgoing: F,
    pub(crate) kind: F,
}

stored!(TangentWeights, (<F>), 4, before 0, after 1, outgoing 2, kind 3);

#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct TreeFrame<F> {
    pub(crate) offset: [F; 3],
    pub(crate) above: u32,
    pub(crate) rest: [F; 4],
    pub(crate) axis: [F; 3],
    pub(crate) kind: u32,
    pub(crate) source: u32,
    pub(crate) root: u32,
    pub(crate) multiplier: F,
    pub(crate) shift: F,
}

stored!(TreeFrame, (<F>), 16, offset 0, above 3, rest 4, axis 8, kind 11, source 12, root 13, multiplier 14, shift 15);

#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct TwoKeysHoisted<F> {
    pub(crate) parameter: F,
}

stored!(TwoKeysHoisted, (<F>), 1, parameter 0);

#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct ValueAndSlope<F> {
    pub(crate) value: [F; 4],
    pub(crate) slope: [F; 4],
}

stored!(ValueAndSlope, (<F>), 8, value 0, slope 4);

/// The angle of the point (along, up), neither of which is negative, from 0 to pi/2; 0 for (0, 0).
pub(crate) fn acute_arc_tangent<M: Machine>(machine: &M, up: M::F, along: M::F) -> M::F {
    let _block = machine.block(line!(), 34);
    let steep = up > along;
    let large = if steep { up } else { along };
    let small = if steep { along } else { up };
    let divisor = if large == M::F::of(0.0) {
        M::F::of(1.0)
    } else {
        large
    };
    let inverse = reciprocal(machine, divisor);
    let near = small * inverse;
    let t = near + (small - near * divisor) * inverse;
    let z = t * t;
    let high =
        (((M::F::of(ARC_8) * z + M::F::of(ARC_7)) * z + M::F::of(ARC_6)) * z + M::F::of(ARC_5)) * z
            + M::F::of(ARC_4);
    let tail = (((high * z + M::F::of(ARC_3)) * z + M::F::of(ARC_2)) * z + M::F::of(ARC_1)) * z
        + M::F::of(ARC_0);
    let flat = tail * (z * t) + t;
    if steep {
        (M::F::of(HALF_PI) - flat) + M::F::of(HALF_PI_LOW)
    } else {
        flat
    }
}

pub(crate) fn arc_between<M: Machine>(
    machine: &M,
    start: [M::F; 4],
    end: [M::F; 4],
) -> ArcSegment<M::F> {
    let _block = machine.block(line!(), 44);
    let half = both(
        both(start, end, |x, y| x + y),
        [M::F::of(0.5); 4],
        |x, y| x * y,
    );
    let difference = both(end, start, |x, y| x - y);
    let result = norm_squared(machine, difference);
    let x = result * M::F::of(0.25);
    let xx = x * x;
    let secant_7 = M::F::of(SECANT_8) * x + M::F::of(SECANT_7);
    let secant_5 = M::F::of(SECANT_6) * x + M::F::of(SECANT_5);
    let secant_3 = M::F::of(SECANT_4) * x + M::F::of(SECANT_3);
    let secant_1 = M::F::of(SECANT_2) * x + M::F::of(SECANT_1);
    let secant_high = (M::F::of(SECANT_9) * xx + secant_7) * xx + secant_5;
    let secant = ((secant_high * xx + secant_3) * xx + secant_1) * x;
    let sine_7 = M::F::of(ARC_SINE_8) * x + M::F::of(ARC_SINE_7);
    let sine_5 = M::F::of(ARC_SINE_6) * x + M::F::of(ARC_SINE_5);
    let sine_3 = M::F::of(ARC_SINE_4) * x + M::F::of(ARC_SINE_3);
    let sine_1 = M::F::of(ARC_SINE_2) * x + M::F::of(ARC_SINE_1);
    let arc_sine = (((sine_7 * xx + sine_5) * xx + sine_3) * xx + sine_1) * x;
    let result_2 = canonical(
        machine,
        both(both(half, [secant; 4], |x, y| x * y), half, |x, y| x + y),
    );
    let result_3 = canonical(
        machine,
        both(
            both(difference, [arc_sine; 4], |x, y| x * y),
            difference,
            |x, y| x + y,
        ),
    );
    ArcSegment {
        middle: result_2,
        tangent: result_3,
    }
}

pub(crate) fn arc_of_keys<M: Machine>(
    machine: &M,
    channel: CrowdChannel,
    at: CrowdPosition<M::F>,
) -> [M::F; 4] {
    let _block = machine.block(line!(), 14);
    let key = channel
        .first
        .wrapping_add((at.span & TICKS).wrapping_mul(channel.count));
    let start = cell_at(machine, key);
    if at.span & ON_KEY != 0u32 {
        let _block = machine.block(line!(), 1);
        let result = authored_key(machine, start);
        return result;
    }
    let end = cell_at(machine, key.wrapping_add(channel.count));
    let result_2 = continued_key(machine, start);
    let result_3 = continued_key(machine, end);
    let result_4 = arc_between(machine, result_2, result_3);
    let result_5 = evaluate_arc_segment(machine, result_4, at.parameter);
    let result_6 = canonical(machine, result_5);
    result_6
}

/// The angle of the point (x, y), from -pi to pi; 0 for (0, 0).
pub(crate) fn arc_tangent<M: Machine>(machine: &M, y: M::F, x: M::F) -> M::F {
    let _block = machine.block(line!(), 10);
    let result = magnitude(machine, y);
    let result_2 = magnitude(machine, x);
    let acute = acute_arc_tangent(machine, result, result_2);
    let obtuse = if x < M::F::of(0.0) {
        (M::F::of(PI) - acute) + M::F::of(PI_LOW)
    } else {
        acute
    };
    if y < M::F::of(0.0) { -obtuse } else { obtuse }
}

/// An arc where its time base stands. The first cell is 0: a constant or a key is an arc without a tangent, whose
/// middle stays as it is.
pub(crate) fn arc_value<M: Machine>(
    machine: &M,
    channel: CrowdChannel,
    at: CrowdPosition<M::F>,
) -> [M::F; 4] {
    let _block = machine.block(line!(), 16);
    let is_key = at.span & ON_KEY != 0u32;
    let along = (at.span & TICKS).wrapping_mul(channel.count);
    let middle = channel.first.wrapping_add(along.wrapping_mul(2u32));
    let key_or_first = cell_at(
        machine,
        if is_key {
            channel.keys.wrapping_add(along)
        } else {
            middle
        },
    );
    let tangent = cell_at(
        machine,
        if is_key | (channel.count == 0u32) {
            0u32
        } else {
            middle.wrapping_add(channel.count)
        },
    );
    let result = evaluate_arc_segment(
        machine,
        ArcSegment {
            middle: key_or_first,
            tangent,
        },
        at.parameter,
    );
    let result_2 = canonical(machine, result);
    result_2
}

/// A key with its stored sign.
pub(crate) fn as_stored<M: Machine>(machine: &M, stored: [u32; 4]) -> [M::F; 4] {
    let _block = machine.block(line!(), 3);
    [
        stored[0] & 0xbfffffffu32,
        [stored[1], stored[2], stored[3]][0],
        [stored[1], stored[2], stored[3]][1],
        [stored[1], stored[2], stored[3]][2],
    ]
    .map(|x| M::F::of_bits(x))
}

pub(crate) fn authored_key<M: Machine>(machine: &M, stored: [M::F; 4]) -> [M::F; 4] {
    let _block = machine.block(line!(), 5);
    let result = norm_squared(machine, stored);
    let result_2 = canonical(
        machine,
        if result > M::F::of(LONGEST_KEY) {
            both(stored, [M::F::of(-0.25); 4], |x, y| x * y)
        } else {
            stored
        },
    );
    result_2
}

pub(crate) fn axis_angle<M: Machine>(machine: &M, rotation: [M::F; 4]) -> [M::F; 4] {
    let _block = machine.block(line!(), 18);
    let x = flushed(machine, rotation[0]);
    let y = flushed(machine, rotation[1]);
    let z = flushed(machine, rotation[2]);
    let square = (x * x + y * y) + z * z;
    let scale = reciprocal_root(machine, square);
    let result = root(machine, square);
    let result_2 = flushed(machine, rotation[3]);
    let result_3 = arc_tangent(machine, result, result_2);
    let angle = result_3 * M::F::of(114.59156);
    let axis_and_angle = [x * scale, y * scale, z * scale, angle];
    if square == M::F::of(0.0) {
        [M::F::of(1.0), M::F::of(0.0), M::F::of(0.0), angle]
    } else {
        axis_and_angle
    }
}

pub(crate) fn base_at<M: Machine>(machine: &M, index: u32) -> CrowdBase {
    let _block = machine.block(line!(), 1);
    let loaded = machine.load::<CrowdBase>(Global::TimeBases, 3 * (index as usize));
    loaded
}

/// How many vectors of the line in which a vector is stored come before it. So many invocations are idle, so that
/// those after them store whole lines.
pub(crate) fn before_in_line<M: Machine>(machine: &M, vector: u32) -> u32 {
    let _block = machine.block(line!(), 4);
    let loaded = machine.load::<u32>(Global::Dispatch, 14);
    vector & (LINE_VECTORS << loaded).wrapping_sub(1u32)
}

pub(crate) fn block_at<M: Machine>(machine: &M, index: u32) -> Block {
    let _block = machine.block(line!(), 1);
    let loaded = machine.load::<Block>(Global::Blocks, 2 * (index as usize));
    loaded
}

/// Components below 2^-64 in magnitude become +0.
pub(crate) fn canonical<M: Machine>(machine: &M, q: [M::F; 4]) -> [M::F; 4] {
    let _block = machine.block(line!(), 4);
    let magnitude = both(q.map(|x| x.bits()), [0x7fffffffu32; 4], |x, y| x & y);
    choose(
        both(magnitude, [0x1f800000u32; 4], |x, y| x < y),
        [M::F::of(0.0); 4],
        q,
    )
}

pub(crate) fn canonical3<M: Machine>(machine: &M, v: [M::F; 3]) -> [M::F; 4] {
    let _block = machine.block(line!(), 1);
    let result = canonical(machine, [v[0], v[1], v[2], M::F::of(0.0)]);
    result
}

/// The Hamilton product of m and \[v, w].
pub(crate) fn canonical_product<M: Machine>(
    machine: &M,
    m: [M::F; 4],
    v: [M::F; 3],
    w: M::F,
) -> [M::F; 4] {
    let _block = machine.block(line!(), 29);
    let result = canonical(
        machine,
        [
            ((m[3] * v[0] + m[0] * w) + m[1] * v[2]) - m[2] * v[1],
            ((m[3] * v[1] - m[0] * v[2]) + m[1] * w) + m[2] * v[0],
            ((m[3] * v[2] + m[0] * v[1]) - m[1] * v[0]) + m[2] * w,
            ((m[3] * w - m[0] * v[0]) - m[1] * v[1]) - m[2] * v[2],
        ],
    );
    result
}

pub(crate) fn cell_at<M: Machine>(machine: &M, index: u32) -> [M::F; 4] {
    const OF_KERNELS: [u8; 227] = [
        0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,
        0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,
        0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,
        0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,
        0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,
        0, 0, 0, 0, 1, 1, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,
        0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,
        0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1, 1, 1, 1, 1, 1,
    ];
    match OF_KERNELS[machine.code()] {
        0 => cell_at_of_readers(machine, index),
        _ => cell_at_of_readers_2(machine, index),
    }
}

pub(crate) fn cell_at_of_readers<M: Machine>(machine: &M, index: u32) -> [M::F; 4] {
    let _block = machine.block(line!(), 1);
    let loaded = machine.load::<[M::F; 4]>(Global::Cells, 4 * (index as usize));
    loaded
}

pub(crate) fn cell_at_of_readers_2<M: Machine>(machine: &M, index: u32) -> [M::F; 4] {
    let _block = machine.block(line!(), 2);
    let loaded = machine.load::<[u32; 4]>(Global::Cells, 4 * (index as usize));
    loaded.map(|x| M::F::of_bits(x))
}

/// The sample that an invocation takes in its `iteration`. Eight neighbours always store at eight
/// neighbouring cells, the first of which is a multiple of eight. An invocation's own samples are
/// those of consecutive frames.
pub(crate) fn cell_of<M: Machine>(machine: &M, corner: Corner, iteration: u32) -> Cell {
    let _block = machine.block(line!(), 14);
    let sample = corner.first.wrapping_add(iteration);
    let loaded = machine.load::<u32>(Global::Dispatch, 1);
    let loaded_2 = machine.load::<u32>(Global::Dispatch, 4);
    let row = sample.wrapping_mul(loaded).wrapping_add(loaded_2);
    let output = (row & 0xfffffff8u32).wrapping_add(corner.column);
    let track = output.wrapping_sub(row);
    let loaded_3 = machine.load::<u32>(Global::Dispatch, 2);
    let loaded_4 = machine.load::<u32>(Global::Dispatch, 3);
    let is_inside = (sample < loaded_3) & (track < loaded_4);
    Cell {
        output,
        row: track,
        position: sample,
        block: corner.block.wrapping_add(track),
        is_inside,
    }
}

pub(crate) fn channel_at<M: Machine>(machine: &M, index: u32) -> CrowdChannel {
    const OF_KERNELS: [u8; 227] = [
        0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,
        0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,
        0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,
        0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,
        0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,
        0, 0, 0, 0, 1, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,
        0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,
        0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1, 1, 1, 1, 1, 1,
    ];
    match OF_KERNELS[machine.code()] {
        0 => channel_at_of_readers(machine, index),
        _ => channel_at_of_readers_2(machine, index),
    }
}

pub(crate) fn channel_at_of_readers<M: Machine>(machine: &M, index: u32) -> CrowdChannel {
    let _block = machine.block(line!(), 1);
    let loaded = machine.load::<CrowdChannel>(Global::Channels, 4 * (index as usize));
    loaded
}

pub(crate) fn channel_at_of_readers_2<M: Machine>(machine: &M, index: u32) -> CrowdChannel {
    let _block = machine.block(line!(), 1);
    let all = machine.load::<[u32; 4]>(Global::Channels, 4 * (index as usize));
    CrowdChannel {
        first: all[0],
        count: all[1],
        form_and_base: all[2],
        keys: all[3],
    }
}

pub(crate) fn clip_at<M: Machine>(machine: &M, index: u32) -> CrowdClip {
    let _block = machine.block(line!(), 1);
    let loaded = machine.load::<CrowdClip>(Global::Clips, 3 * (index as usize));
    loaded
}

/// The Hamilton product a b.
pub(crate) fn composed<M: Machine>(
    machine: &M,
    a: FromIdentity<M::F>,
    b: FromIdentity<M::F>,
) -> FromIdentity<M::F> {
    let _block = machine.block(line!(), 12);
    let result = cross3(machine, a.vector, b.vector);
    let result_2 = dot3(machine, a.vector, b.vector);
    FromIdentity {
        vector: both(
            both(
                both(a.vector, b.vector, |x, y| x + y),
                both(
                    both(a.vector, [b.cosm1; 3], |x, y| x * y),
                    both(b.vector, [a.cosm1; 3], |x, y| x * y),
                    |x, y| x + y,
                ),
                |x, y| x + y,
            ),
            result,
            |x, y| x + y,
        ),
        cosm1: ((a.cosm1 + b.cosm1) + a.cosm1 * b.cosm1) - result_2,
    }
}

pub(crate) fn constant_at<M: Machine>(machine: &M, index: u32) -> [M::F; 4] {
    const OF_KERNELS: [u8; 227] = [
        0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,
        0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1,
        1, 1, 1, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,
        0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1,
        1, 1, 1, 1, 1, 1, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,
        0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1,
        1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1,
        1, 1, 1, 1, 1, 1, 1, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0,
    ];
    match OF_KERNELS[machine.code()] {
        0 => constant_at_of_readers(machine, index),
        _ => constant_at_of_readers_2(machine, index),
    }
}

pub(crate) fn constant_at_of_readers<M: Machine>(machine: &M, index: u32) -> [M::F; 4] {
    let _block = machine.block(line!(), 1);
    let loaded = machine.load::<[M::F; 4]>(Global::Constants, 4 * (index as usize));
    loaded
}

pub(crate) fn constant_at_of_readers_2<M: Machine>(machine: &M, index: u32) -> [M::F; 4] {
    let _block = machine.block(line!(), 2);
    let loaded = machine.load::<[u32; 4]>(Global::Constants, 4 * (index as usize));
    loaded.map(|x| M::F::of_bits(x))
}

/// A number that is the same for all samples of a segment.
pub(crate) fn constant_of_arc_segment<M: Machine>(machine: &M, segment: ArcSegment<M::F>) -> M::F {
    let _block = machine.block(line!(), 1);
    let result = norm_squared(machine, segment.tangent);
    result
}

/// The form of polynomials, as kernels over spread runs call it: no number is the same for all samples.
/// Twin: src/twin/evaluate_polynomial.rs.
pub(crate) fn constant_of_polynomial_segment<M: Machine>(
    machine: &M,
    segment: PolynomialSegment<M::F>,
) -> M::F {
    M::F::of(0.0)
}

/// A constant of a run, in a repetition.
pub(crate) fn constant_of_run<M: Machine>(machine: &M, index: u32, repetition: u32) -> [M::F; 4] {
    let _block = machine.block(line!(), 4);
    let loaded = machine.load::<u32>(Global::Dispatch, 14);
    let result = constant_at(machine, index.wrapping_add(repetition.wrapping_mul(loaded)));
    result
}

/// The coefficients of 1, s, s², … s¹⁰.
pub(crate) fn constant_velocity<M: Machine>(machine: &M, arc: ArcSegment<M::F>) -> [[M::F; 4]; 11] {
    let _block = machine.block(line!(), 29);
    let square = norm_squared(machine, arc.tangent);
    let even_2 = both(arc.middle, [square; 4], |x, y| x * y);
    let odd_3 = both(arc.tangent, [square; 4], |x, y| x * y);
    let even_4 = both(even_2, [square; 4], |x, y| x * y);
    let odd_5 = both(odd_3, [square; 4], |x, y| x * y);
    let even_6 = both(even_4, [square; 4], |x, y| x * y);
    let odd_7 = both(odd_5, [square; 4], |x, y| x * y);
    let even_8 = both(even_6, [square; 4], |x, y| x * y);
    let odd_9 = both(odd_7, [square; 4], |x, y| x * y);
    let result = canonical(machine, arc.tangent);
    let result_2 = canonical(machine, both(even_2, [M::F::of(SERIES_2); 4], |x, y| x * y));
    let result_3 = canonical(machine, both(odd_3, [M::F::of(SERIES_3); 4], |x, y| x * y));
    let result_4 = canonical(machine, both(even_4, [M::F::of(SERIES_4); 4], |x, y| x * y));
    let result_5 = canonical(machine, both(odd_5, [M::F::of(SERIES_5); 4], |x, y| x * y));
    let result_6 = canonical(machine, both(even_6, [M::F::of(SERIES_6); 4], |x, y| x * y));
    let result_7 = canonical(machine, both(odd_7, [M::F::of(SERIES_7); 4], |x, y| x * y));
    let result_8 = canonical(machine, both(even_8, [M::F::of(SERIES_8); 4], |x, y| x * y));
    let result_9 = canonical(machine, both(odd_9, [M::F::of(SERIES_9); 4], |x, y| x * y));
    let result_10 = canonical(
        machine,
        both(
            both(even_8, [square; 4], |x, y| x * y),
            [M::F::of(SERIES_10); 4],
            |x, y| x * y,
        ),
    );
    [
        arc.middle, result, result_2, result_3, result_4, result_5, result_6, result_7, result_8,
        result_9, result_10,
    ]
}

/// A key with the sign that continues the keys before it.
pub(crate) fn continued<M: Machine>(machine: &M, stored: [u32; 4]) -> [M::F; 4] {
    let _block = machine.block(line!(), 5);
    let negation = stored[0] & SIGN_NEGATED;
    let sign = negation << 1u32;
    both(
        stored,
        [negation | sign, [sign; 3][0], [sign; 3][1], [sign; 3][2]],
        |x, y| x ^ y,
    )
    .map(|x| M::F::of_bits(x))
}

pub(crate) fn continued_key<M: Machine>(machine: &M, stored: [M::F; 4]) -> [M::F; 4] {
    let _block = machine.block(line!(), 4);
    let result = norm_squared(machine, stored);
    if result > M::F::of(LONGEST_KEY) {
        both(stored, [M::F::of(0.25); 4], |x, y| x * y)
    } else {
        stored
    }
}

pub(crate) fn continued_key_at<M: Machine>(machine: &M, key: u32) -> [M::F; 4] {
    let _block = machine.block(line!(), 2);
    let result = key_at(machine, key);
    let result_2 = continued(machine, result);
    result_2
}

pub(crate) fn corner_of<M: Machine>(
    machine: &M,
    group: [u32; 3],
    groups: [u32; 3],
    lane: u32,
) -> Corner {
    let _block = machine.block(line!(), 14);
    let tile = group[1].wrapping_mul(groups[0]).wrapping_add(group[0]);
    let line = quotient(lane, LINE);
    let within = lane & 7u32;
    let first = group[2]
        .wrapping_mul(8u32)
        .wrapping_add(line)
        .wrapping_mul(SAMPLES_EACH);
    let loaded = machine.load::<u32>(Global::Dispatch, 5);
    let loaded_2 = machine.load::<u32>(Global::Dispatch, 3);
    let block = loaded.wrapping_add(quotient(first, BLOCK_SAMPLES).wrapping_mul(loaded_2));
    Corner {
        first,
        column: tile.wrapping_mul(LINE).wrapping_add(within),
        block,
    }
}

/// Products of vectors, in a fixed order of operations.
/// Twin: src/math/quaternion.rs.
pub(crate) fn cross3<M: Machine>(machine: &M, a: [M::F; 3], b: [M::F; 3]) -> [M::F; 3] {
    let _block = machine.block(line!(), 9);
    [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]
}

pub(crate) fn crowd_work<M: Machine>(machine: &M, index: u32) {
    const OF_KERNELS: [u8; 227] = [
        0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,
        0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,
        0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,
        0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,
        0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1, 1, 0, 1, 2, 3, 4, 5, 0, 6, 7, 0,
        0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,
        0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,
        0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1, 1, 0, 1,
    ];
    match OF_KERNELS[machine.code()] {
        0 => crowd_work_of_rotations(machine, index),
        1 => crowd_work_of_locals(machine, index),
        2 => crowd_work_of_gather(machine, index),
        3 => crowd_work_of_scatter(machine, index),
        4 => crowd_work_of_times(machine, index),
        5 => crowd_work_of_walk(machine, index),
        6 => crowd_work_of_skin(machine, index),
        _ => crowd_work_of_half(machine, index),
    }
}

/// `index` is a joint of an instance.
pub(crate) fn crowd_work_of_rotations<M: Machine>(machine: &M, index: u32) {
    let _block = machine.block(line!(), 7);
    let loaded = machine.load::<u32>(Global::Dispatch, 2);
    let instance = quotient(index, loaded);
    let loaded_2 = machine.load::<u32>(Global::Dispatch, 2);
    let result = layered(
        machine,
        instance,
        index.wrapping_sub(instance.wrapping_mul(loaded_2)),
        ROTATION,
    );
    store(machine, index, result);
}

/// `index` is a joint of an instance.
pub(crate) fn crowd_work_of_locals<M: Machine>(machine: &M, index: u32) {
    let _block = machine.block(line!(), 18);
    let loaded = machine.load::<u32>(Global::Dispatch, 2);
    let instance = quotient(index, loaded);
    let loaded_2 = machine.load::<u32>(Global::Dispatch, 2);
    let joint = index.wrapping_sub(instance.wrapping_mul(loaded_2));
    let result = layered(machine, instance, joint, ROTATION);
    let rows = matrix_rows(machine, result, 0u32);
    let moved = layered(machine, instance, joint, TRANSLATION);
    let scale = layered(machine, instance, joint, SCALE);
    let first = index.wrapping_mul(3u32);
    let result_2 = transform_row(machine, rows.first, scale, moved[0]);
    store(machine, first, result_2);
    let result_3 = transform_row(machine, rows.second, scale, moved[1]);
    store(machine, first.wrapping_add(1u32), result_3);
    let result_4 = transform_row(machine, rows.third, scale, moved[2]);
    store(machine, first.wrapping_add(2u32), result_4);
}

/// `index` is a layer of an instance of the window.
pub(crate) fn crowd_work_of_gather<M: Machine>(machine: &M, index: u32) {
    let _block = machine.block(line!(), 13);
    let loaded = machine.load::<u32>(Global::Dispatch, 3);
    let instance = quotient(index, loaded);
    let loaded_2 = machine.load::<u32>(Global::Dispatch, 3);
    let layer = index.wrapping_sub(instance.wrapping_mul(loaded_2));
    let loaded_3 = machine.load::<u32>(Global::Dispatch, 1);
    let loaded_4 = machine.load::<u32>(Global::Visible, loaded_3.wrapping_add(instance) as usize);
    let loaded_5 = machine.load::<u32>(Global::Dispatch, 3);
    let loaded_6 = machine.load::<[u32; 4]>(
        Global::All,
        4 * (loaded_4.wrapping_mul(loaded_5).wrapping_add(layer) as usize),
    );
    machine.store::<[u32; 4]>(Global::Gathered, 4 * (index as usize), loaded_6);
}

/// `index` is a change.
pub(crate) fn crowd_work_of_scatter<M: Machine>(machine: &M, index: u32) {
    let _block = machine.block(line!(), 2);
    let change = machine.load::<CrowdChange>(Global::Changes, 5 * (index as usize));
    machine.store::<[u32; 4]>(
        Global::All,
        4 * (change.index as usize),
        [
            change.clip_and_weight,
            change.speed_and_modes,
            change.start,
            change.anchor,
        ],
    );
}

/// `index_in_window` is a time base of an entry, of those of the window.
pub(crate) fn crowd_work_of_times<M: Machine>(machine: &M, index_in_window: u32) {
    let _block = machine.block(line!(), 14);
    let loaded = machine.load::<u32>(Global::Dispatch, 4);
    let layer = quotient(index_in_window, loaded);
    let loaded_2 = machine.load::<u32>(Global::Dispatch, 4);
    let base_index = index_in_window.wrapping_sub(layer.wrapping_mul(loaded_2));
    let loaded_3 = machine.load::<u32>(Global::Dispatch, 1);
    let loaded_4 = machine.load::<u32>(Global::Dispatch, 3);
    let entry = machine.load::<CrowdEntry>(
        Global::Entries,
        4 * (loaded_3.wrapping_mul(loaded_4).wrapping_add(layer) as usize),
    );
    let clip = machine.load::<CrowdClip>(
        Global::Clips,
        3 * ((entry.clip_and_weight & 0xffffu32) as usize),
    );
    if base_index < clip.bases {
        let _block = machine.block(line!(), 17);
        let tick = tick_of(machine, entry, clip.period);
        let base = machine.load::<CrowdBase>(
            Global::TimeBases,
            3 * (clip.first_base.wrapping_add(base_index) as usize),
        );
        let index = span_at(machine, base, tick);
        let span = machine
            .load::<CrowdSpan<M::F>>(Global::Spans, 4 * (base.first.wrapping_add(index) as usize));
        let distance = distance_from_middle(machine, (tick as i32).wrapping_sub(span.whole), 0u32);
        let is_key = span.start == tick | ON_KEY;
        machine.store::<u32>(
            Global::Positions,
            2 * (index_in_window as usize),
            index | (if is_key { ON_KEY } else { 0u32 }),
        );
        machine.store::<M::F>(
            Global::Positions,
            2 * (index_in_window as usize) + 1,
            distance * span.scale + span.offset,
        );
        return;
    } else {
        return;
    }
}

/// `index` is a joint of the level, of an instance; `dispatch.layers` is the number of joints of the
/// skeleton.
pub(crate) fn crowd_work_of_walk<M: Machine>(machine: &M, index: u32) {
    let _block = machine.block(line!(), 34);
    let loaded = machine.load::<u32>(Global::Dispatch, 2);
    let instance = quotient(index, loaded);
    let loaded_2 = machine.load::<u32>(Global::Dispatch, 5);
    let loaded_3 = machine.load::<u32>(Global::Dispatch, 2);
    let link = machine.load::<CrowdLink>(
        Global::Links,
        2 * (loaded_2.wrapping_add(index.wrapping_sub(instance.wrapping_mul(loaded_3))) as usize),
    );
    let loaded_4 = machine.load::<u32>(Global::Dispatch, 3);
    let above = instance
        .wrapping_mul(loaded_4)
        .wrapping_add(link.parent)
        .wrapping_mul(3u32);
    let loaded_5 = machine.load::<u32>(Global::Dispatch, 3);
    let row = instance
        .wrapping_mul(loaded_5)
        .wrapping_add(link.joint)
        .wrapping_mul(3u32);
    let first = machine.load::<[M::F; 4]>(Global::Matrices, 4 * (row as usize));
    let second = machine.load::<[M::F; 4]>(Global::Matrices, 4 * (row.wrapping_add(1u32) as usize));
    let third = machine.load::<[M::F; 4]>(Global::Matrices, 4 * (row.wrapping_add(2u32) as usize));
    let loaded_6 = machine.load::<[M::F; 4]>(Global::Matrices, 4 * (above as usize));
    let result = row_product(machine, loaded_6, first, second, third);
    machine.store::<[M::F; 4]>(Global::Matrices, 4 * (row as usize), result);
    let loaded_7 =
        machine.load::<[M::F; 4]>(Global::Matrices, 4 * (above.wrapping_add(1u32) as usize));
    let result_2 = row_product(machine, loaded_7, first, second, third);
    machine.store::<[M::F; 4]>(
        Global::Matrices,
        4 * (row.wrapping_add(1u32) as usize),
        result_2,
    );
    let loaded_8 =
        machine.load::<[M::F; 4]>(Global::Matrices, 4 * (above.wrapping_add(2u32) as usize));
    let result_3 = row_product(machine, loaded_8, first, second, third);
    machine.store::<[M::F; 4]>(
        Global::Matrices,
        4 * (row.wrapping_add(2u32) as usize),
        result_3,
    );
}

/// `index` is a row of a matrix of a joint of an instance; `dispatch.joints` counts the skeleton's.
pub(crate) fn crowd_work_of_skin<M: Machine>(machine: &M, index: u32) {
    let _block = machine.block(line!(), 15);
    let matrix = quotient(index, 3u32);
    let loaded = machine.load::<u32>(Global::Dispatch, 2);
    let instance = quotient(matrix, loaded);
    let loaded_2 = machine.load::<u32>(Global::Dispatch, 2);
    let first = matrix
        .wrapping_sub(instance.wrapping_mul(loaded_2))
        .wrapping_mul(3u32);
    let loaded_3 = machine.load::<[M::F; 4]>(Global::Matrices, 4 * (index as usize));
    let loaded_4 = machine.load::<[M::F; 4]>(Global::Bind, 4 * (first as usize));
    let loaded_5 = machine.load::<[M::F; 4]>(Global::Bind, 4 * (first.wrapping_add(1u32) as usize));
    let loaded_6 = machine.load::<[M::F; 4]>(Global::Bind, 4 * (first.wrapping_add(2u32) as usize));
    let result = row_product(machine, loaded_3, loaded_4, loaded_5, loaded_6);
    machine.store::<[M::F; 4]>(Global::Matrices, 4 * (index as usize), result);
}

/// Rounds values to half precision.
/// Twin: src/twin/crowd_matrices.rs.
pub(crate) fn crowd_work_of_half<M: Machine>(machine: &M, index: u32) {
    let _block = machine.block(line!(), 7);
    let loaded = machine.load::<[M::F; 4]>(Global::Values, 4 * (index as usize));
    let half = to_any_half(machine, loaded);
    machine.store::<[u32; 2]>(
        Global::Halves,
        2 * (index as usize),
        [half[0] | (half[1] << 16u32), half[2] | (half[3] << 16u32)],
    );
}

/// A cubic about the middle of its span.
pub(crate) fn cubic<M: Machine>(
    machine: &M,
    c0: [M::F; 4],
    c1: [M::F; 4],
    c2: [M::F; 4],
    c3: [M::F; 4],
    s: M::F,
) -> [M::F; 4] {
    let _block = machine.block(line!(), 7);
    let z = s * s;
    both(
        c0,
        both(
            both(
                both(both(c3, [s; 4], |x, y| x * y), c2, |x, y| x + y),
                [z; 4],
                |x, y| x * y,
            ),
            both(c1, [s; 4], |x, y| x * y),
            |x, y| x + y,
        ),
        |x, y| x + y,
    )
}

/// The group of a channel has a row for each key: a cell with the weights of its tangent, cells with the sources of the
/// intervals after the keys, one word for each channel, and the keys. `channel.keys` is the cell of the first weights.
pub(crate) fn cubic_of_keys<M: Machine>(
    machine: &M,
    channel: CrowdChannel,
    at: CrowdPosition<M::F>,
) -> [M::F; 4] {
    let _block = machine.block(line!(), 58);
    let before_keys = 1u32.wrapping_add(channel.count.wrapping_add(3u32) >> 2u32);
    let stride = channel.count.wrapping_add(before_keys);
    let along = (at.span & TICKS).wrapping_mul(stride);
    let key = channel.first.wrapping_add(along);
    let start = cell_at(machine, key);
    if at.span & ON_KEY != 0u32 {
        let _block = machine.block(line!(), 1);
        let result = authored_key(machine, start);
        return result;
    }
    let row = channel.keys.wrapping_add(along);
    let member = channel
        .first
        .wrapping_sub(channel.keys)
        .wrapping_sub(before_keys);
    let result_2 = cell_at(machine, row.wrapping_add(1u32).wrapping_add(member >> 2u32));
    let source = source_of(machine, result_2.map(|x| x.bits()), member & 3u32);
    if source != 0u32 {
        let _block = machine.block(line!(), 1);
        let result_3 = segment_of_3(machine, channel.keys, source, at.parameter);
        return result_3;
    }
    let result_4 = cell_at(machine, row);
    let first = weights_in(machine, result_4);
    let result_5 = cell_at(machine, row.wrapping_add(stride));
    let last = weights_in(machine, result_5);
    let before = if first.kind == M::F::of(KEY_INNER) {
        key.wrapping_sub(stride)
    } else {
        key
    };
    let next = key.wrapping_add(stride);
    let after = if last.kind == M::F::of(KEY_INNER) {
        next.wrapping_add(stride)
    } else {
        next
    };
    let result_6 = cell_at(machine, before);
    let result_7 = continued_key(machine, result_6);
    let result_8 = continued_key(machine, start);
    let result_9 = cell_at(machine, next);
    let result_10 = continued_key(machine, result_9);
    let result_11 = cell_at(machine, after);
    let result_12 = continued_key(machine, result_11);
    let curve = small_angle_cubic(
        machine, result_7, result_8, result_10, result_12, first, last,
    );
    let c = curve.powers;
    let s = at.parameter;
    let z = s * s;
    let third = both(both(c[3], [s; 4], |x, y| x * y), c[2], |x, y| x + y);
    let high = both(
        both(c[6], [z; 4], |x, y| x * y),
        both(both(c[5], [s; 4], |x, y| x * y), c[4], |x, y| x + y),
        |x, y| x + y,
    );
    let gain = both(
        both(high, [z * z; 4], |x, y| x * y),
        both(
            both(third, [z; 4], |x, y| x * y),
            both(c[1], [s; 4], |x, y| x * y),
            |x, y| x + y,
        ),
        |x, y| x + y,
    );
    let result_13 = canonical(machine, both(c[0], gain, |x, y| x + y));
    result_13
}

pub(crate) fn cubic_value<M: Machine>(
    machine: &M,
    channel: CrowdChannel,
    at: CrowdPosition<M::F>,
) -> [M::F; 4] {
    const OF_KERNELS: [u8; 227] = [
        0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,
        0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,
        0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,
        0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,
        0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,
        1, 0, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,
        0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,
        0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,
    ];
    match OF_KERNELS[machine.code()] {
        0 => cubic_value_of_plain_cubic(machine, channel, at),
        _ => cubic_value_of_cubic_or_constant(machine, channel, at),
    }
}

/// A cubic where its time base stands, as `crowd/plain_arc` has arcs: a constant or a key is one without other
/// coefficients.
pub(crate) fn cubic_value_of_plain_cubic<M: Machine>(
    machine: &M,
    channel: CrowdChannel,
    at: CrowdPosition<M::F>,
) -> [M::F; 4] {
    let _block = machine.block(line!(), 22);
    let is_key = at.span & ON_KEY != 0u32;
    let is_constant = channel.count == 0u32;
    let along = (at.span & TICKS).wrapping_mul(channel.count);
    let first = channel.first.wrapping_add(along.wrapping_mul(4u32));
    let second = first.wrapping_add(channel.count);
    let third = second.wrapping_add(channel.count);
    let key_or_first = cell_at(
        machine,
        if is_key {
            channel.keys.wrapping_add(along)
        } else {
            first
        },
    );
    let result = cell_at(machine, if is_constant { 0u32 } else { second });
    let result_2 = cell_at(machine, if is_constant { 0u32 } else { third });
    let result_3 = cell_at(
        machine,
        if is_constant {
            0u32
        } else {
            third.wrapping_add(channel.count)
        },
    );
    let value = cubic(
        machine,
        key_or_first,
        result,
        result_2,
        result_3,
        at.parameter,
    );
    let result_4 = canonical(machine, value);
    if is_key { key_or_first } else { result_4 }
}

/// A cubic where its time base stands, or a constant.
pub(crate) fn cubic_value_of_cubic_or_constant<M: Machine>(
    machine: &M,
    channel: CrowdChannel,
    at: CrowdPosition<M::F>,
) -> [M::F; 4] {
    let _block = machine.block(line!(), 20);
    if channel.count == 0u32 {
        let _block = machine.block(line!(), 1);
        let result = cell_at(machine, channel.first);
        return result;
    }
    let is_key = at.span & ON_KEY != 0u32;
    let along = (at.span & TICKS).wrapping_mul(channel.count);
    let first = channel.first.wrapping_add(along.wrapping_mul(4u32));
    let second = first.wrapping_add(channel.count);
    let third = second.wrapping_add(channel.count);
    let key_or_first = cell_at(
        machine,
        if is_key {
            channel.keys.wrapping_add(along)
        } else {
            first
        },
    );
    let result_2 = cell_at(machine, second);
    let result_3 = cell_at(machine, third);
    let result_4 = cell_at(machine, third.wrapping_add(channel.count));
    let value = cubic(
        machine,
        key_or_first,
        result_2,
        result_3,
        result_4,
        at.parameter,
    );
    let result_5 = canonical(machine, value);
    if is_key { key_or_first } else { result_5 }
}

pub(crate) fn distance_at<M: Machine>(machine: &M, index: u32) -> M::F {
    const OF_KERNELS: [u8; 227] = [
        0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,
        0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,
        0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,
        0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,
        0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,
        0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1, 1, 1, 1, 1, 1, 1,
        1, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1, 1, 1, 1, 1, 1, 1, 1, 1, 0,
        0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,
    ];
    match OF_KERNELS[machine.code()] {
        0 => distance_at_of_readers(machine, index),
        _ => distance_at_of_readers_2(machine, index),
    }
}

pub(crate) fn distance_at_of_readers<M: Machine>(machine: &M, index: u32) -> M::F {
    let _block = machine.block(line!(), 1);
    let loaded = machine.load::<M::F>(Global::Distances, index as usize);
    loaded
}

pub(crate) fn distance_at_of_readers_2<M: Machine>(machine: &M, index: u32) -> M::F {
    let _block = machine.block(line!(), 11);
    let four = machine.load::<[u32; 4]>(Global::Distances, 4 * (quotient(index, 4u32) as usize));
    let two = if index & 2u32 == 2u32 {
        [four[2], four[3]]
    } else {
        [four[0], four[1]]
    };
    M::F::of_bits(if index & 1u32 == 1u32 { two[1] } else { two[0] })
}

pub(crate) fn distance_from_middle<M: Machine>(machine: &M, first: i32, j: u32) -> M::F {
    const OF_KERNELS: [u8; 227] = [
        0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1, 1, 1, 1, 1, 1, 1, 1, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,
        0, 0, 0, 0, 0, 0, 0, 1, 1, 1, 1, 1, 1, 1, 1, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1, 1, 1, 1, 1,
        1, 1, 1, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1, 1, 1, 1, 1, 1, 1, 1, 1, 0, 0, 0, 0, 0, 0, 0, 0,
        0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1, 1, 1, 1, 1, 1, 1, 1, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1, 1,
        1, 1, 1, 1, 1, 1, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,
        0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1, 1, 1, 1, 1, 1, 1,
        1, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1, 1, 1, 1, 1, 1, 1, 1, 1, 0,
        0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,
    ];
    match OF_KERNELS[machine.code()] {
        0 => distance_from_middle_of_frame_distance(machine, first, j),
        _ => distance_from_middle_of_time_distance(machine, first, j),
    }
}

/// A whole number of frames from the whole frame nearest to the middle. It is converted in two
/// halves, each exact in f32, so that the one rounding is that of the addition.
pub(crate) fn distance_from_middle_of_frame_distance<M: Machine>(
    machine: &M,
    first: i32,
    j: u32,
) -> M::F {
    let _block = machine.block(line!(), 7);
    let frames = first.wrapping_add(j as i32);
    let low = frames & 4095i32;
    M::F::of(frames.wrapping_sub(low) as f32) + M::F::of(low as f32)
}

/// Seconds from the middle, which the host subtracted in f64.
pub(crate) fn distance_from_middle_of_time_distance<M: Machine>(
    machine: &M,
    first: i32,
    j: u32,
) -> M::F {
    let _block = machine.block(line!(), 3);
    let result = distance_at(machine, (first as u32).wrapping_add(j));
    result
}

pub(crate) fn dot3<M: Machine>(machine: &M, a: [M::F; 3], b: [M::F; 3]) -> M::F {
    let _block = machine.block(line!(), 5);
    (a[0] * b[0] + a[1] * b[1]) + a[2] * b[2]
}

pub(crate) fn dot4<M: Machine>(machine: &M, a: [M::F; 4], b: [M::F; 4]) -> M::F {
    let _block = machine.block(line!(), 7);
    ((a[0] * b[0] + a[1] * b[1]) + a[2] * b[2]) + a[3] * b[3]
}

pub(crate) fn entry_at<M: Machine>(machine: &M, index: u32) -> CrowdEntry {
    const OF_KERNELS: [u8; 227] = [
        0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,
        0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,
        0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,
        0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,
        0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1,
        1, 1, 1, 1, 2, 2, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,
        0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,
        0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 2, 2, 2, 2, 2, 2,
    ];
    match OF_KERNELS[machine.code()] {
        0 => entry_at_of_readers(machine, index),
        1 => entry_at_of_whole(machine, index),
        _ => entry_at_of_readers_2(machine, index),
    }
}

pub(crate) fn entry_at_of_readers<M: Machine>(machine: &M, index: u32) -> CrowdEntry {
    let _block = machine.block(line!(), 1);
    let loaded = machine.load::<CrowdEntry>(Global::Entries, 4 * (index as usize));
    loaded
}

pub(crate) fn entry_at_of_whole<M: Machine>(machine: &M, index: u32) -> CrowdEntry {
    let _block = machine.block(line!(), 3);
    let loaded = machine.load::<u32>(Global::FirstEntry, 0);
    let loaded_2 =
        machine.load::<CrowdEntry>(Global::Entries, 4 * (loaded.wrapping_add(index) as usize));
    loaded_2
}

pub(crate) fn entry_at_of_readers_2<M: Machine>(machine: &M, index: u32) -> CrowdEntry {
    let _block = machine.block(line!(), 1);
    let all = machine.load::<[u32; 4]>(Global::Entries, 4 * (index as usize));
    CrowdEntry {
        clip_and_weight: all[0],
        speed_and_modes: all[1],
        start: all[2],
        anchor: all[3],
    }
}

pub(crate) fn euler<M: Machine>(machine: &M, rotation: [M::F; 4], detail: u32) -> [M::F; 3] {
    let mut condition: bool = Default::default();
    let mut condition_2: bool = Default::default();
    let _block = machine.block(line!(), 70);
    let symmetric = detail & SYMMETRIC != 0u32;
    let intrinsic = detail & INTRINSIC != 0u32;
    let sign = if detail & NEGATIVE != 0u32 {
        M::F::of(-1.0)
    } else {
        M::F::of(1.0)
    };
    let w = rotation[3];
    let i = rotation[(detail & 3u32) as usize];
    let j = rotation[((detail >> 2u32) & 3u32) as usize];
    let k = rotation[((detail >> 4u32) & 3u32) as usize] * sign;
    let a = flushed(machine, if symmetric { w } else { w - j });
    let b = flushed(machine, if symmetric { i } else { i + k });
    let c = flushed(machine, if symmetric { j } else { j + w });
    let d = flushed(machine, if symmetric { k } else { k - i });
    let sine = root(machine, c * c + d * d);
    let cosine = root(machine, a * a + b * b);
    let half_sum = arc_tangent(machine, b, a);
    let half_difference = arc_tangent(machine, d, c);
    let closed = sine < M::F::of(GIMBAL);
    let open = cosine < M::F::of(GIMBAL);
    if !closed {
        let _block = machine.block(line!(), 1);
        condition = open;
    } else {
        let _block = machine.block(line!(), 1);
        condition = true;
    }
    let locked = condition;
    let sum = half_sum + half_difference;
    let difference = half_sum - half_difference;
    let opposite = if intrinsic {
        half_difference
    } else {
        -half_difference
    };
    let together = M::F::of(2.0) * (if closed { half_sum } else { opposite });
    let third_sign = if symmetric { M::F::of(1.0) } else { sign };
    let outer = if locked {
        together
    } else {
        if intrinsic {
            sum * third_sign
        } else {
            difference
        }
    };
    let inner = if locked {
        M::F::of(0.0)
    } else {
        if intrinsic {
            difference
        } else {
            sum * third_sign
        }
    };
    if locked {
        let _block = machine.block(line!(), 1);
        condition_2 = intrinsic;
    } else {
        let _block = machine.block(line!(), 1);
        condition_2 = false;
    }
    let loaded = condition_2;
    let first = if loaded { outer * third_sign } else { outer };
    let result = acute_arc_tangent(machine, sine, cosine);
    let whole = M::F::of(2.0) * result;
    let second = if symmetric {
        whole
    } else {
        (whole - M::F::of(HALF_PI)) - M::F::of(HALF_PI_LOW)
    };
    let result_2 = wrapped(machine, first);
    let result_3 = wrapped(machine, inner);
    [
        result_2 * M::F::of(DEGREES),
        second * M::F::of(DEGREES),
        result_3 * M::F::of(DEGREES),
    ]
}

/// `parameter` runs from -1/2 to 1/2 over the segment.
pub(crate) fn evaluate_arc_segment<M: Machine>(
    machine: &M,
    segment: ArcSegment<M::F>,
    parameter: M::F,
) -> [M::F; 4] {
    let _block = machine.block(line!(), 2);
    let result = constant_of_arc_segment(machine, segment);
    let result_2 = evaluate_with_arc_segment(machine, segment, result, parameter);
    result_2
}

/// The value at a sample of a run that needs no care and has no key there. `at` is the run's `first` for this sample, and
/// `constant` its segment's.
pub(crate) fn evaluate_near_arc_segment<M: Machine>(
    machine: &M,
    item: SpreadRun<M::F>,
    segment: ArcSegment<M::F>,
    constant: M::F,
    at: i32,
) -> [M::F; 4] {
    let _block = machine.block(line!(), 4);
    let result = near_distance(machine, at);
    let parameter = result * item.scale + item.offset;
    let result_2 = evaluate_with_arc_segment(machine, segment, constant, parameter);
    result_2
}

/// The value at a sample of a run that needs no care and has no key there. `at` is the run's `first` for this sample, and
/// `constant` its segment's.
pub(crate) fn evaluate_near_polynomial_segment<M: Machine>(
    machine: &M,
    item: SpreadRun<M::F>,
    segment: PolynomialSegment<M::F>,
    constant: M::F,
    at: i32,
) -> [M::F; 4] {
    let _block = machine.block(line!(), 4);
    let result = near_distance(machine, at);
    let parameter = result * item.scale + item.offset;
    let result_2 = evaluate_with_polynomial_segment(machine, segment, constant, parameter);
    result_2
}

/// `s` runs from -1/2 to 1/2 over the segment.
pub(crate) fn evaluate_polynomial_segment<M: Machine>(
    machine: &M,
    segment: PolynomialSegment<M::F>,
    s: M::F,
) -> [M::F; 4] {
    let _block = machine.block(line!(), 1);
    let result = polynomial(machine, segment.coefficients, s);
    result
}

pub(crate) fn evaluate_with_arc_segment<M: Machine>(
    machine: &M,
    segment: ArcSegment<M::F>,
    square: M::F,
    parameter: M::F,
) -> [M::F; 4] {
    let _block = machine.block(line!(), 7);
    let z = (parameter * parameter) * square;
    let sines = sine_cosm1_quarter(machine, parameter, z);
    both(
        segment.middle,
        both(
            both(segment.middle, [sines[1]; 4], |x, y| x * y),
            both(segment.tangent, [sines[0]; 4], |x, y| x * y),
            |x, y| x + y,
        ),
        |x, y| x + y,
    )
}

pub(crate) fn evaluate_with_polynomial_segment<M: Machine>(
    machine: &M,
    segment: PolynomialSegment<M::F>,
    constant: M::F,
    parameter: M::F,
) -> [M::F; 4] {
    let _block = machine.block(line!(), 1);
    let result = evaluate_polynomial_segment(machine, segment, parameter);
    result
}

/// √x, rounded to nearest, for x from 2^-30 to 1, and for 0.
pub(crate) fn exact_root<M: Machine>(machine: &M, x: M::F) -> M::F {
    let _block = machine.block(line!(), 19);
    if x == M::F::of(0.0) {
        return M::F::of(0.0);
    }
    let near = root(machine, x);
    let next = M::F::of_bits(near.bits().wrapping_add(1u32));
    let before = M::F::of_bits(near.bits().wrapping_sub(1u32));
    let result = rest_of_square(machine, x, near, (next - near) * M::F::of(0.5));
    let is_more = result > M::F::of(0.0);
    let result_2 = rest_of_square(machine, x, near, (before - near) * M::F::of(0.5));
    let is_less = result_2 < M::F::of(0.0);
    if is_more {
        next
    } else {
        if is_less { before } else { near }
    }
}

/// Finds the position in a time base of a layer of the workgroup's instances, as `crowd/times` does.
pub(crate) fn find_position<M: Machine>(machine: &M, index: u32) {
    let _block = machine.block(line!(), 14);
    let loaded = machine.load::<u32>(Global::Dispatch, 4);
    let layer = quotient(index, loaded);
    let loaded_2 = machine.load::<u32>(Global::Dispatch, 4);
    let base_index = index.wrapping_sub(layer.wrapping_mul(loaded_2));
    let loaded_3 = machine.load::<u32>(Global::Dispatch, 1);
    let loaded_4 = machine.load::<u32>(Global::Dispatch, 3);
    let entry = entry_at(machine, loaded_3.wrapping_mul(loaded_4).wrapping_add(layer));
    let clip = machine.load::<CrowdClip>(
        Global::Clips,
        3 * ((entry.clip_and_weight & 0xffffu32) as usize),
    );
    if base_index < clip.bases {
        let _block = machine.block(line!(), 17);
        let tick = tick_of(machine, entry, clip.period);
        let base = machine.load::<CrowdBase>(
            Global::TimeBases,
            3 * (clip.first_base.wrapping_add(base_index) as usize),
        );
        let found = span_at(machine, base, tick);
        let span = machine
            .load::<CrowdSpan<M::F>>(Global::Spans, 4 * (base.first.wrapping_add(found) as usize));
        let distance = distance_from_middle(machine, (tick as i32).wrapping_sub(span.whole), 0u32);
        let is_key = span.start == tick | ON_KEY;
        machine.store::<u32>(
            Global::FoundSpans,
            index as usize,
            found | (if is_key { ON_KEY } else { 0u32 }),
        );
        machine.store::<M::F>(
            Global::FoundParameters,
            index as usize,
            distance * span.scale + span.offset,
        );
        return;
    } else {
        return;
    }
}

/// Finds an invocation's part of the positions of so many instances.
pub(crate) fn find_positions<M: Machine>(machine: &M, instances: u32, lane: u32) {
    let mut index: u32 = Default::default();
    let _block = machine.block(line!(), 5);
    let loaded = machine.load::<u32>(Global::Dispatch, 3);
    let loaded_2 = machine.load::<u32>(Global::Dispatch, 4);
    let count = instances.wrapping_mul(loaded).wrapping_mul(loaded_2);
    index = lane;
    loop {
        let _block = machine.block(line!(), 8);
        let loaded_3 = index;
        if !(loaded_3 < count) {
            break;
        }
        let loaded_4 = index;
        find_position(machine, loaded_4);
        let loaded_5 = index;
        index = loaded_5.wrapping_add(CROWD_WORKGROUP);
    }
}

/// Stores a vector of the result.
pub(crate) fn finish_1<M: Machine>(machine: &M, vector: u32, value: [M::F; 4]) {
    let _block = machine.block(line!(), 3);
    let loaded = machine.load::<u32>(Global::Dispatch, 14);
    if loaded != 0u32 {
        let _block = machine.block(line!(), 6);
        let half = to_any_half(machine, value);
        machine.store::<[u32; 2]>(
            Global::Halves,
            2 * (vector as usize),
            [half[0] | (half[1] << 16u32), half[2] | (half[3] << 16u32)],
        );
        return;
    } else {
        let _block = machine.block(line!(), 1);
        machine.store::<[M::F; 4]>(Global::Values, 4 * (vector as usize), value);
        return;
    }
}

pub(crate) async fn finish_2<M: Machine>(
    machine: &M,
    lane: u32,
    index: u32,
    rotation: [M::F; 4],
    is_stored: bool,
) {
    const OF_KERNELS: [u8; 227] = [
        0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1,
        0, 0, 2, 3, 4, 0, 1, 0, 1, 0, 0, 2, 3, 4, 0, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,
        0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,
        0, 0, 1, 0, 0, 2, 3, 4, 0, 1, 0, 1, 0, 0, 2, 3, 4, 0, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,
        0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,
        0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,
        0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,
        0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,
    ];
    match OF_KERNELS[machine.code()] {
        0 => finish_2_of_alone(machine, lane, index, rotation, is_stored).await,
        1 => finish_2_of_together(machine, lane, index, rotation, is_stored).await,
        2 => finish_2_of_together_2(machine, lane, index, rotation, is_stored).await,
        3 => finish_2_of_together_3(machine, lane, index, rotation, is_stored).await,
        _ => finish_2_of_together_4(machine, lane, index, rotation, is_stored).await,
    }
}

/// Values of one part: eight neighbours store a line of them as they are.
pub(crate) async fn finish_2_of_alone<M: Machine>(
    machine: &M,
    lane: u32,
    index: u32,
    rotation: [M::F; 4],
    is_stored: bool,
) {
    let _block = machine.block(line!(), 1);
    if is_stored {
        let _block = machine.block(line!(), 1);
        store(machine, index, rotation);
        return;
    } else {
        return;
    }
}

pub(crate) async fn finish_2_of_together<M: Machine>(
    machine: &M,
    lane: u32,
    index: u32,
    rotation: [M::F; 4],
    is_stored: bool,
) {
    let mut part: u32 = Default::default();
    let _block = machine.block(line!(), 7);
    machine.store::<u32>(
        Global::IsThere,
        lane as usize,
        if is_stored { 1u32 } else { 0u32 },
    );
    if is_stored {
        let _block = machine.block(line!(), 2);
        let result = parts_1(machine, rotation);
        machine.store::<[M::F; 3]>(Global::Tile, 3 * (lane as usize), result);
    }
    barrier().await;
    let within = lane & 7u32;
    let first = index.wrapping_sub(within).wrapping_mul(3u32);
    part = within;
    loop {
        let _block = machine.block(line!(), 13);
        let loaded = part;
        if !(loaded < 24u32) {
            break;
        }
        let loaded_2 = part;
        let value = quotient(loaded_2, 3u32);
        let other = lane.wrapping_sub(within).wrapping_add(value);
        let loaded_3 = machine.load::<u32>(Global::IsThere, other as usize);
        if loaded_3 != 0u32 {
            let _block = machine.block(line!(), 7);
            let loaded_4 = part;
            let loaded_5 = part;
            let loaded_6 = machine.load::<M::F>(
                Global::Tile,
                3 * (other as usize) + loaded_5.wrapping_sub(value.wrapping_mul(3u32)) as usize,
            );
            machine.store::<M::F>(
                Global::Rotations,
                first.wrapping_add(loaded_4) as usize,
                loaded_6,
            );
        }
        let loaded_7 = part;
        part = loaded_7.wrapping_add(LINE);
    }
    barrier().await;
}

pub(crate) async fn finish_2_of_together_2<M: Machine>(
    machine: &M,
    lane: u32,
    index: u32,
    rotation: [M::F; 4],
    is_stored: bool,
) {
    let mut part: u32 = Default::default();
    let _block = machine.block(line!(), 7);
    machine.store::<u32>(
        Global::IsThere,
        lane as usize,
        if is_stored { 1u32 } else { 0u32 },
    );
    if is_stored {
        let _block = machine.block(line!(), 2);
        let result = parts_3(machine, rotation);
        machine.store::<[M::F; 9]>(Global::Tile, 9 * (lane as usize), result);
    }
    barrier().await;
    let within = lane & 7u32;
    let first = index.wrapping_sub(within).wrapping_mul(9u32);
    part = within;
    loop {
        let _block = machine.block(line!(), 13);
        let loaded = part;
        if !(loaded < 72u32) {
            break;
        }
        let loaded_2 = part;
        let value = quotient(loaded_2, 9u32);
        let other = lane.wrapping_sub(within).wrapping_add(value);
        let loaded_3 = machine.load::<u32>(Global::IsThere, other as usize);
        if loaded_3 != 0u32 {
            let _block = machine.block(line!(), 7);
            let loaded_4 = part;
            let loaded_5 = part;
            let loaded_6 = machine.load::<M::F>(
                Global::Tile,
                9 * (other as usize) + loaded_5.wrapping_sub(value.wrapping_mul(9u32)) as usize,
            );
            machine.store::<M::F>(
                Global::Rotations,
                first.wrapping_add(loaded_4) as usize,
                loaded_6,
            );
        }
        let loaded_7 = part;
        part = loaded_7.wrapping_add(LINE);
    }
    barrier().await;
}

pub(crate) async fn finish_2_of_together_3<M: Machine>(
    machine: &M,
    lane: u32,
    index: u32,
    rotation: [M::F; 4],
    is_stored: bool,
) {
    let mut part: u32 = Default::default();
    let _block = machine.block(line!(), 7);
    machine.store::<u32>(
        Global::IsThere,
        lane as usize,
        if is_stored { 1u32 } else { 0u32 },
    );
    if is_stored {
        let _block = machine.block(line!(), 2);
        let result = parts_4(machine, rotation);
        machine.store::<[[M::F; 4]; 3]>(Global::Tile, 12 * (lane as usize), result);
    }
    barrier().await;
    let within = lane & 7u32;
    let first = index.wrapping_sub(within).wrapping_mul(3u32);
    part = within;
    loop {
        let _block = machine.block(line!(), 13);
        let loaded = part;
        if !(loaded < 24u32) {
            break;
        }
        let loaded_2 = part;
        let value = quotient(loaded_2, 3u32);
        let other = lane.wrapping_sub(within).wrapping_add(value);
        let loaded_3 = machine.load::<u32>(Global::IsThere, other as usize);
        if loaded_3 != 0u32 {
            let _block = machine.block(line!(), 7);
            let loaded_4 = part;
            let loaded_5 = part;
            let loaded_6 = machine.load::<[M::F; 4]>(
                Global::Tile,
                12 * (other as usize)
                    + 4 * (loaded_5.wrapping_sub(value.wrapping_mul(3u32)) as usize),
            );
            machine.store::<[M::F; 4]>(
                Global::Rotations,
                4 * (first.wrapping_add(loaded_4) as usize),
                loaded_6,
            );
        }
        let loaded_7 = part;
        part = loaded_7.wrapping_add(LINE);
    }
    barrier().await;
}

pub(crate) async fn finish_2_of_together_4<M: Machine>(
    machine: &M,
    lane: u32,
    index: u32,
    rotation: [M::F; 4],
    is_stored: bool,
) {
    let mut part: u32 = Default::default();
    let _block = machine.block(line!(), 7);
    machine.store::<u32>(
        Global::IsThere,
        lane as usize,
        if is_stored { 1u32 } else { 0u32 },
    );
    if is_stored {
        let _block = machine.block(line!(), 2);
        let result = parts_2(machine, rotation);
        machine.store::<[M::F; 6]>(Global::Tile, 6 * (lane as usize), result);
    }
    barrier().await;
    let within = lane & 7u32;
    let first = index.wrapping_sub(within).wrapping_mul(6u32);
    part = within;
    loop {
        let _block = machine.block(line!(), 13);
        let loaded = part;
        if !(loaded < 48u32) {
            break;
        }
        let loaded_2 = part;
        let value = quotient(loaded_2, 6u32);
        let other = lane.wrapping_sub(within).wrapping_add(value);
        let loaded_3 = machine.load::<u32>(Global::IsThere, other as usize);
        if loaded_3 != 0u32 {
            let _block = machine.block(line!(), 7);
            let loaded_4 = part;
            let loaded_5 = part;
            let loaded_6 = machine.load::<M::F>(
                Global::Tile,
                6 * (other as usize) + loaded_5.wrapping_sub(value.wrapping_mul(6u32)) as usize,
            );
            machine.store::<M::F>(
                Global::Rotations,
                first.wrapping_add(loaded_4) as usize,
                loaded_6,
            );
        }
        let loaded_7 = part;
        part = loaded_7.wrapping_add(LINE);
    }
    barrier().await;
}

/// 0 where the magnitude is below 2^-50.
pub(crate) fn flushed<M: Machine>(machine: &M, x: M::F) -> M::F {
    let _block = machine.block(line!(), 4);
    if x.bits() & 0x7fffffffu32 < FLUSHED_BITS {
        M::F::of(0.0)
    } else {
        x
    }
}

pub(crate) fn flushed4<M: Machine>(machine: &M, q: [M::F; 4]) -> [M::F; 4] {
    let _block = machine.block(line!(), 4);
    let result = flushed(machine, q[0]);
    let result_2 = flushed(machine, q[1]);
    let result_3 = flushed(machine, q[2]);
    let result_4 = flushed(machine, q[3]);
    [result, result_2, result_3, result_4]
}

/// Converts a joint's state from its parent's frame to the world.
pub(crate) fn hang_on<M: Machine>(machine: &M, parent: u32, child: u32) {
    let _block = machine.block(line!(), 26);
    let above = machine.load::<[M::F; 4]>(
        Global::States,
        4 * (parent.wrapping_add(WORLD_ROTATION) as usize),
    );
    let loaded =
        machine.load::<[M::F; 4]>(Global::States, 4 * (child.wrapping_add(POSITION) as usize));
    let arm = rotated(machine, above, [loaded[0], loaded[1], loaded[2]]);
    let loaded_2 =
        machine.load::<[M::F; 4]>(Global::States, 4 * (parent.wrapping_add(POSITION) as usize));
    let result = canonical3(
        machine,
        both([loaded_2[0], loaded_2[1], loaded_2[2]], arm, |x, y| x + y),
    );
    machine.store::<[M::F; 4]>(
        Global::States,
        4 * (child.wrapping_add(POSITION) as usize),
        result,
    );
    let loaded_3 = machine.load::<[M::F; 4]>(
        Global::States,
        4 * (child.wrapping_add(WORLD_ROTATION) as usize),
    );
    let rotation = product(machine, above, loaded_3);
    let result_2 = dot4(machine, rotation, rotation);
    let scale = M::F::of(1.5) - M::F::of(0.5) * result_2;
    let result_3 = canonical(machine, both(rotation, [scale; 4], |x, y| x * y));
    machine.store::<[M::F; 4]>(
        Global::States,
        4 * (child.wrapping_add(WORLD_ROTATION) as usize),
        result_3,
    );
    let loaded_4 = machine.load::<u32>(Global::Dispatch, 4);
    if loaded_4 != 0u32 {
        let _block = machine.block(line!(), 24);
        let loaded_5 = machine.load::<[M::F; 4]>(
            Global::States,
            4 * (parent.wrapping_add(ANGULAR_VELOCITY) as usize),
        );
        let angular_above = [loaded_5[0], loaded_5[1], loaded_5[2]];
        let loaded_6 =
            machine.load::<[M::F; 4]>(Global::States, 4 * (parent.wrapping_add(VELOCITY) as usize));
        let result_4 = cross3(machine, angular_above, arm);
        let carried = both([loaded_6[0], loaded_6[1], loaded_6[2]], result_4, |x, y| {
            x + y
        });
        let loaded_7 =
            machine.load::<[M::F; 4]>(Global::States, 4 * (child.wrapping_add(VELOCITY) as usize));
        let velocity = rotated(machine, above, [loaded_7[0], loaded_7[1], loaded_7[2]]);
        let result_5 = canonical3(machine, both(carried, velocity, |x, y| x + y));
        machine.store::<[M::F; 4]>(
            Global::States,
            4 * (child.wrapping_add(VELOCITY) as usize),
            result_5,
        );
        let loaded_8 = machine.load::<[M::F; 4]>(
            Global::States,
            4 * (child.wrapping_add(ANGULAR_VELOCITY) as usize),
        );
        let angular = rotated(machine, above, [loaded_8[0], loaded_8[1], loaded_8[2]]);
        let result_6 = canonical3(machine, both(angular_above, angular, |x, y| x + y));
        machine.store::<[M::F; 4]>(
            Global::States,
            4 * (child.wrapping_add(ANGULAR_VELOCITY) as usize),
            result_6,
        );
        return;
    } else {
        return;
    }
}

/// Whether a position is one of an item's samples.
pub(crate) fn has<M: Machine>(machine: &M, item: Item<M::F>, position: u32) -> bool {
    let _block = machine.block(line!(), 3);
    position.wrapping_sub(item.output) < item.count & 0x3fffffffu32
}

/// The tick at which a layer stands that does not go on behind an end of its clip. It has moved by `ticks` and, if
/// `part` is 1, a part of one more.
pub(crate) fn held_tick<M: Machine>(
    machine: &M,
    start: u32,
    ticks: [u32; 2],
    part: u32,
    backwards: bool,
    period: u32,
) -> u32 {
    let _block = machine.block(line!(), 17);
    let end = period.wrapping_add(START_BIAS);
    let later = start.wrapping_add(ticks[0]);
    let earlier = start.wrapping_sub(ticks[0]).wrapping_sub(part);
    let is_outside = (ticks[1] != 0u32)
        | (if backwards {
            start <= ticks[0]
        } else {
            later < start
        });
    let moved = if backwards { earlier } else { later };
    let tick = if is_outside {
        if backwards { 0u32 } else { end }
    } else {
        moved
    };
    (if tick < START_BIAS {
        START_BIAS
    } else {
        if tick > end { end } else { tick }
    })
    .wrapping_sub(START_BIAS)
}

pub(crate) fn hoisted_arcs_hoisted<M: Machine>(
    machine: &M,
    first: u32,
    next: u32,
    parameter: M::F,
) -> ArcsHoisted<M::F> {
    ArcsHoisted { parameter }
}

pub(crate) fn hoisted_cubics_hoisted<M: Machine>(
    machine: &M,
    first: u32,
    next: u32,
    parameter: M::F,
) -> CubicsHoisted<M::F> {
    let _block = machine.block(line!(), 2);
    let result = weights_at(machine, first);
    let result_2 = weights_at(machine, next);
    CubicsHoisted {
        first: result,
        last: result_2,
        parameter,
    }
}

pub(crate) fn hoisted_two_keys_hoisted<M: Machine>(
    machine: &M,
    first: u32,
    next: u32,
    parameter: M::F,
) -> TwoKeysHoisted<M::F> {
    TwoKeysHoisted { parameter }
}

/// The instance of a joint, of those of all instances of the workgroup.
pub(crate) fn instance_of<M: Machine>(machine: &M, index: u32) -> u32 {
    let _block = machine.block(line!(), 3);
    let loaded = machine.load::<u32>(Global::Dispatch, 11);
    index.wrapping_mul(loaded) >> 20u32
}

/// Begins with the instances of a workgroup, from the `first` of the dispatch on; returns how many they are.
pub(crate) fn instances_from<M: Machine>(machine: &M, first: u32) -> u32 {
    let _block = machine.block(line!(), 9);
    let loaded = machine.load::<u32>(Global::Dispatch, 3);
    machine.store::<u32>(Global::FirstEntry, 0, first.wrapping_mul(loaded));
    let loaded_2 = machine.load::<u32>(Global::Dispatch, 0);
    let rest = loaded_2.wrapping_sub(first);
    let loaded_3 = machine.load::<u32>(Global::Dispatch, 10);
    let loaded_4 = machine.load::<u32>(Global::Dispatch, 10);
    if rest < loaded_4 { rest } else { loaded_3 }
}

pub(crate) fn interval_at<M: Machine>(machine: &M, index: u32) -> u32 {
    let _block = machine.block(line!(), 1);
    let loaded = machine.load::<u32>(Global::Intervals, index as usize);
    loaded
}

/// r⁻¹ v r.
pub(crate) fn inverse_rotated<M: Machine>(
    machine: &M,
    v: [M::F; 3],
    r: FromIdentity<M::F>,
) -> [M::F; 3] {
    let _block = machine.block(line!(), 7);
    let once = cross3(machine, r.vector, v);
    let twice = both(once, once, |x, y| x + y);
    let result = cross3(machine, r.vector, twice);
    both(
        both(
            v,
            both(both(twice, [r.cosm1; 3], |x, y| x * y), twice, |x, y| x + y),
            |x, y| x - y,
        ),
        result,
        |x, y| x + y,
    )
}

pub(crate) fn invocation_index<M: Machine>(
    machine: &M,
    invocation: [u32; 3],
    groups: [u32; 3],
) -> u32 {
    let _block = machine.block(line!(), 3);
    invocation[1]
        .wrapping_mul(groups[0].wrapping_mul(WORKGROUP))
        .wrapping_add(invocation[0])
}

/// Whether a condition holds in any lane.
pub(crate) async fn is_any<M: Machine>(machine: &M, condition: bool) -> bool {
    let _block = machine.block(line!(), 3);
    let votes = ballot(machine, condition).await;
    votes[0] | votes[1] != 0u32
}

pub(crate) fn item_at_item<M: Machine>(machine: &M, index: u32) -> Item<M::F> {
    const OF_KERNELS: [u8; 227] = [
        0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,
        0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,
        0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,
        0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,
        0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,
        0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1,
        1, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 0,
        0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,
    ];
    match OF_KERNELS[machine.code()] {
        0 => item_at_item_of_readers(machine, index),
        _ => item_at_item_of_readers_2(machine, index),
    }
}

pub(crate) fn item_at_item_of_readers<M: Machine>(machine: &M, index: u32) -> Item<M::F> {
    let _block = machine.block(line!(), 1);
    let loaded = machine.load::<Item<M::F>>(Global::Items, 6 * (index as usize));
    loaded
}

pub(crate) fn item_at_item_of_readers_2<M: Machine>(machine: &M, index: u32) -> Item<M::F> {
    let _block = machine.block(line!(), 16);
    let texel = quotient(3u32.wrapping_mul(index), 2u32);
    let first = machine.load::<[u32; 4]>(Global::Items, 4 * (texel as usize));
    let second = machine.load::<[u32; 4]>(Global::Items, 4 * (texel.wrapping_add(1u32) as usize));
    let is_odd = index & 1u32 == 1u32;
    let head = if is_odd {
        [
            [first[2], first[3]][0],
            [first[2], first[3]][1],
            [second[0], second[1]][0],
            [second[0], second[1]][1],
        ]
    } else {
        first
    };
    let tail = if is_odd {
        [second[2], second[3]]
    } else {
        [second[0], second[1]]
    };
    Item {
        source: head[0],
        output: head[1],
        count: head[2],
        first: head[3] as i32,
        scale: M::F::of_bits(tail[0]),
        offset: M::F::of_bits(tail[1]),
    }
}

pub(crate) fn item_at_spread_run<M: Machine>(machine: &M, index: u32) -> SpreadRun<M::F> {
    let _block = machine.block(line!(), 8);
    let head = machine.load::<[u32; 4]>(Global::Items, 4 * (2u32.wrapping_mul(index) as usize));
    let tail = machine.load::<[u32; 4]>(
        Global::Items,
        4 * (2u32.wrapping_mul(index).wrapping_add(1u32) as usize),
    );
    SpreadRun {
        source: head[0],
        output: head[1],
        count: head[2],
        first: head[3] as i32,
        scale: M::F::of_bits(tail[0]),
        offset: M::F::of_bits(tail[1]),
        key: tail[2],
        iterations: tail[3],
    }
}

/// The item that a sample belongs to, if it belongs to any.
pub(crate) fn item_of<M: Machine>(machine: &M, cell: Cell) -> u32 {
    let _block = machine.block(line!(), 6);
    let block = block_at(machine, cell.block);
    block
        .first
        .wrapping_add((block.starts << (!cell.position & 31u32)).count_ones())
}

/// The key at the end of a span. The last span is constant: its key is at both ends.
pub(crate) fn key_after<M: Machine>(
    machine: &M,
    channel: CrowdChannel,
    base: CrowdBase,
    span: u32,
) -> [M::F; 4] {
    let _block = machine.block(line!(), 5);
    let result = key_of(
        machine,
        channel,
        if span.wrapping_add(1u32) == base.count {
            span
        } else {
            span.wrapping_add(1u32)
        },
    );
    result
}

pub(crate) fn key_at<M: Machine>(machine: &M, index: u32) -> [u32; 4] {
    let _block = machine.block(line!(), 1);
    let loaded = machine.load::<[u32; 4]>(Global::Keys, 4 * (index as usize));
    loaded
}

/// The key at the start of a span, of a channel that consists of keys.
pub(crate) fn key_of<M: Machine>(machine: &M, channel: CrowdChannel, span: u32) -> [M::F; 4] {
    let _block = machine.block(line!(), 6);
    let index = channel.first.wrapping_add(span.wrapping_mul(channel.count));
    if channel.form_and_base >> 24u32 == FORM_PACKED {
        let _block = machine.block(line!(), 8);
        let words = machine.load::<[u32; 4]>(Global::Cells, 4 * ((index >> 1u32) as usize));
        let result = unpacked(
            machine,
            if index & 1u32 == 1u32 {
                [words[2], words[3]]
            } else {
                [words[0], words[1]]
            },
        );
        return result;
    }
    let result_2 = cell_at(machine, index);
    result_2
}

/// A rotation, a translation or a scale under the next layer. For scales `reference` holds reciprocals.
pub(crate) fn laid_over<M: Machine>(
    machine: &M,
    kind: u32,
    is_additive: bool,
    below: [M::F; 4],
    layer: [M::F; 4],
    reference: [M::F; 4],
    weight: M::F,
) -> [M::F; 4] {
    let _block = machine.block(line!(), 12);
    if kind == ROTATION {
        let _block = machine.block(line!(), 3);
        if is_additive {
            let _block = machine.block(line!(), 1);
            let result = rotation_added(machine, below, layer, reference, weight);
            return result;
        }
        let result_2 = over(machine, below, layer, weight);
        let result_3 = canonical(machine, result_2);
        return result_3;
    }
    if !is_additive {
        let _block = machine.block(line!(), 6);
        let result_4 = canonical(
            machine,
            if weight == M::F::of(1.0) {
                layer
            } else {
                both(
                    below,
                    both(both(layer, below, |x, y| x - y), [weight; 4], |x, y| x * y),
                    |x, y| x + y,
                )
            },
        );
        return result_4;
    }
    if kind == TRANSLATION {
        let _block = machine.block(line!(), 4);
        let result_5 = canonical(
            machine,
            both(
                below,
                both(both(layer, reference, |x, y| x - y), [weight; 4], |x, y| {
                    x * y
                }),
                |x, y| x + y,
            ),
        );
        return result_5;
    }
    let result_6 = canonical(
        machine,
        both(
            below,
            both(
                below,
                both(
                    both(
                        both(layer, reference, |x, y| x * y),
                        [M::F::of(1.0); 4],
                        |x, y| x - y,
                    ),
                    [weight; 4],
                    |x, y| x * y,
                ),
                |x, y| x * y,
            ),
            |x, y| x + y,
        ),
    );
    result_6
}

pub(crate) fn layer_value<M: Machine>(
    machine: &M,
    layer: u32,
    entry: CrowdEntry,
    joint: u32,
    kind: u32,
) -> [M::F; 4] {
    const OF_KERNELS: [u8; 227] = [
        0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,
        0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,
        0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,
        0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,
        0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1, 1, 0, 0, 0, 0, 0, 0, 0, 0,
        0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,
        0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,
        0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1, 1,
    ];
    match OF_KERNELS[machine.code()] {
        0 => layer_value_of_layer_value(machine, layer, entry, joint, kind),
        _ => layer_value_of_compact(machine, layer, entry, joint, kind),
    }
}

/// The `kind`th channel of a joint in one layer; `layer` counts within the window.
pub(crate) fn layer_value_of_layer_value<M: Machine>(
    machine: &M,
    layer: u32,
    entry: CrowdEntry,
    joint: u32,
    kind: u32,
) -> [M::F; 4] {
    let _block = machine.block(line!(), 13);
    let clip = entry.clip_and_weight & 0xffffu32;
    let loaded = machine.load::<u32>(Global::Dispatch, 2);
    let channel = channel_at(
        machine,
        clip.wrapping_mul(loaded)
            .wrapping_add(joint)
            .wrapping_mul(CHANNELS)
            .wrapping_add(kind),
    );
    let loaded_2 = machine.load::<u32>(Global::Dispatch, 4);
    let at = position_at(
        machine,
        layer
            .wrapping_mul(loaded_2)
            .wrapping_add(channel.form_and_base & 0xffffffu32),
    );
    let result = sampled(machine, channel, at);
    result
}

/// The `kind`th channel of a joint in one layer; `layer` counts within the window.
pub(crate) fn layer_value_of_compact<M: Machine>(
    machine: &M,
    layer: u32,
    entry: CrowdEntry,
    joint: u32,
    kind: u32,
) -> [M::F; 4] {
    let _block = machine.block(line!(), 20);
    let clip = entry.clip_and_weight & 0xffffu32;
    let loaded = machine.load::<u32>(Global::Dispatch, 2);
    let channel = channel_at(
        machine,
        clip.wrapping_mul(loaded)
            .wrapping_add(joint)
            .wrapping_mul(CHANNELS)
            .wrapping_add(kind),
    );
    let loaded_2 = machine.load::<u32>(Global::Dispatch, 4);
    let at = position_at(
        machine,
        layer
            .wrapping_mul(loaded_2)
            .wrapping_add(channel.form_and_base & 0xffffffu32),
    );
    let form = channel.form_and_base >> 24u32;
    if form == FORM_CUBIC_KEYS {
        let _block = machine.block(line!(), 1);
        let result = cubic_of_keys(machine, channel, at);
        return result;
    }
    if form == FORM_ARC_KEYS {
        let _block = machine.block(line!(), 1);
        let result_2 = arc_of_keys(machine, channel, at);
        return result_2;
    }
    if form == FORM_LINE {
        let _block = machine.block(line!(), 1);
        let result_3 = line_of_keys(machine, channel, at);
        return result_3;
    }
    let result_4 = sampled(machine, channel, at);
    result_4
}

pub(crate) fn layered<M: Machine>(machine: &M, instance: u32, joint: u32, kind: u32) -> [M::F; 4] {
    const OF_KERNELS: [u8; 227] = [
        0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,
        0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,
        0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,
        0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,
        0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1, 0, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,
        1, 0, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,
        0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,
        0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1, 0, 1, 0, 0,
    ];
    match OF_KERNELS[machine.code()] {
        0 => layered_of_layers(machine, instance, joint, kind),
        _ => layered_of_plain(machine, instance, joint, kind),
    }
}

/// The `kind`th channel of a joint, with all layers; `instance` counts within the window.
pub(crate) fn layered_of_layers<M: Machine>(
    machine: &M,
    instance: u32,
    joint: u32,
    kind: u32,
) -> [M::F; 4] {
    let mut value: [M::F; 4] = Default::default();
    let mut layer: u32 = 1u32;
    let _block = machine.block(line!(), 10);
    let loaded = machine.load::<u32>(Global::Dispatch, 3);
    let first = instance.wrapping_mul(loaded);
    let loaded_2 = machine.load::<u32>(Global::Dispatch, 1);
    let loaded_3 = machine.load::<u32>(Global::Dispatch, 3);
    let all = loaded_2.wrapping_add(instance).wrapping_mul(loaded_3);
    let result = entry_at(machine, all);
    let result_2 = layer_value(machine, first, result, joint, kind);
    value = result_2;
    loop {
        let _block = machine.block(line!(), 13);
        let loaded_4 = layer;
        let loaded_5 = machine.load::<u32>(Global::Dispatch, 3);
        if !(loaded_4 < loaded_5) {
            break;
        }
        let loaded_6 = layer;
        let entry = entry_at(machine, all.wrapping_add(loaded_6));
        let weight = entry.clip_and_weight >> 16u32;
        if weight != 0u32 {
            let _block = machine.block(line!(), 29);
            let modes = entry.speed_and_modes;
            let loaded_7 = machine.load::<u32>(Global::Dispatch, 8);
            let loaded_8 = machine.load::<u32>(Global::Dispatch, 2);
            let mask = loaded_7
                .wrapping_add(((modes >> 24u32) & 31u32).wrapping_mul(loaded_8))
                .wrapping_add(joint);
            let result_3 = cell_at(machine, mask);
            let joint_weight =
                (M::F::of((weight as i32) as f32) * M::F::of(WEIGHT_UNIT)) * result_3[0];
            let clip = entry.clip_and_weight & 0xffffu32;
            let loaded_9 = machine.load::<u32>(Global::Dispatch, 9);
            let loaded_10 = machine.load::<u32>(Global::Dispatch, 2);
            let reference = loaded_9
                .wrapping_add(
                    clip.wrapping_mul(loaded_10)
                        .wrapping_add(joint)
                        .wrapping_mul(CHANNELS),
                )
                .wrapping_add(kind);
            let loaded_11 = layer;
            let next = layer_value(machine, first.wrapping_add(loaded_11), entry, joint, kind);
            let loaded_12 = value;
            let result_4 = cell_at(machine, reference);
            let result_5 = laid_over(
                machine,
                kind,
                modes >> 31u32 != 0u32,
                loaded_12,
                next,
                result_4,
                joint_weight,
            );
            value = result_5;
        }
        let loaded_13 = layer;
        layer = loaded_13.wrapping_add(1u32);
    }
    let loaded_14 = value;
    loaded_14
}

/// The `kind`th channel of a joint; `instance` counts within the window.
pub(crate) fn layered_of_plain<M: Machine>(
    machine: &M,
    instance: u32,
    joint: u32,
    kind: u32,
) -> [M::F; 4] {
    let _block = machine.block(line!(), 18);
    let loaded = machine.load::<u32>(Global::Dispatch, 1);
    let result = entry_at(machine, loaded.wrapping_add(instance));
    let clip = result.clip_and_weight & 0xffffu32;
    let loaded_2 = machine.load::<u32>(Global::Dispatch, 2);
    let channel = channel_at(
        machine,
        clip.wrapping_mul(loaded_2)
            .wrapping_add(joint)
            .wrapping_mul(CHANNELS)
            .wrapping_add(kind),
    );
    let loaded_3 = machine.load::<u32>(Global::Dispatch, 4);
    let at = position_at(
        machine,
        instance
            .wrapping_mul(loaded_3)
            .wrapping_add(channel.form_and_base & 0xffffffu32),
    );
    if kind == ROTATION {
        let _block = machine.block(line!(), 1);
        let result_2 = arc_value(machine, channel, at);
        return result_2;
    }
    let result_3 = cubic_value(machine, channel, at);
    result_3
}

/// The middle of a line, and its rise. Halves are added, so that no sum is too large.
pub(crate) fn line_between<M: Machine>(
    machine: &M,
    start: [M::F; 4],
    end: [M::F; 4],
) -> ValueAndSlope<M::F> {
    let _block = machine.block(line!(), 6);
    let result = canonical(
        machine,
        both(
            both(start, [M::F::of(0.5); 4], |x, y| x * y),
            both(end, [M::F::of(0.5); 4], |x, y| x * y),
            |x, y| x + y,
        ),
    );
    let result_2 = canonical(machine, both(end, start, |x, y| x - y));
    ValueAndSlope {
        value: result,
        slope: result_2,
    }
}

/// Halves are added, so that no sum is too large.
pub(crate) fn line_of_keys<M: Machine>(
    machine: &M,
    channel: CrowdChannel,
    at: CrowdPosition<M::F>,
) -> [M::F; 4] {
    let _block = machine.block(line!(), 18);
    let key = channel
        .first
        .wrapping_add((at.span & TICKS).wrapping_mul(channel.count));
    let start = cell_at(machine, key);
    if at.span & ON_KEY != 0u32 {
        return start;
    }
    let end = cell_at(machine, key.wrapping_add(channel.count));
    let middle = canonical(
        machine,
        both(
            both(start, [M::F::of(0.5); 4], |x, y| x * y),
            both(end, [M::F::of(0.5); 4], |x, y| x * y),
            |x, y| x + y,
        ),
    );
    let result = canonical(machine, both(end, start, |x, y| x - y));
    let result_2 = canonical(
        machine,
        both(
            both(result, [at.parameter; 4], |x, y| x * y),
            middle,
            |x, y| x + y,
        ),
    );
    result_2
}

/// Where a run of a repetition finds its segment (x) and its key (z), and stores its first sample (y).
pub(crate) fn location_of<M: Machine>(
    machine: &M,
    item: SpreadRun<M::F>,
    repetition: u32,
) -> [u32; 3] {
    let _block = machine.block(line!(), 4);
    let all = machine.load::<Spread>(Global::Dispatch, 0);
    let steps = [all.segments, all.outputs, all.constants];
    let listed = [
        item.source,
        item.output.wrapping_add(all.first_output),
        item.key,
    ];
    both(
        listed,
        both([repetition; 3], steps, |x, y| x.wrapping_mul(y)),
        |x, y| x.wrapping_add(y),
    )
}

pub(crate) fn magnitude<M: Machine>(machine: &M, x: M::F) -> M::F {
    let _block = machine.block(line!(), 3);
    M::F::of_bits(x.bits() & 0x7fffffffu32)
}

pub(crate) async fn main<M: Machine>(machine: &M) {
    const OF_KERNELS: [u8; 227] = [
        0, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 2, 2, 2, 2, 2, 2, 2, 2, 2, 3, 3,
        3, 3, 3, 3, 3, 3, 3, 3, 3, 3, 3, 3, 3, 3, 3, 3, 4, 5, 4, 4, 6, 7, 8, 4, 5, 4, 5, 4, 4, 6,
        7, 8, 4, 5, 9, 9, 9, 9, 9, 9, 9, 9, 9, 9, 9, 9, 9, 9, 9, 9, 9, 9, 10, 10, 10, 10, 10, 10,
        10, 10, 10, 11, 11, 11, 11, 11, 11, 11, 11, 11, 11, 11, 11, 11, 11, 11, 11, 11, 11, 12, 13,
        12, 12, 14, 15, 16, 12, 13, 12, 13, 12, 12, 14, 15, 16, 12, 13, 17, 18, 19, 20, 20, 20, 20,
        20, 20, 21, 21, 21, 21, 21, 21, 21, 21, 21, 21, 22, 21, 21, 23, 23, 24, 24, 23, 25, 25, 26,
        26, 26, 26, 26, 26, 26, 27, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 2, 2, 2,
        2, 2, 2, 2, 2, 2, 9, 9, 9, 9, 9, 9, 9, 9, 9, 9, 9, 9, 9, 9, 9, 9, 9, 9, 10, 10, 10, 10, 10,
        10, 10, 10, 10, 17, 18, 19, 21, 21, 21, 21, 21, 21,
    ];
    match OF_KERNELS[machine.code()] {
        0 => main_of_self_test(machine).await,
        1 => main_of_runs(machine).await,
        2 => main_of_samples(machine).await,
        3 => main_of_coalesced(machine).await,
        4 => main_of_alone(machine).await,
        5 => main_of_together(machine).await,
        6 => main_of_together_2(machine).await,
        7 => main_of_together_3(machine).await,
        8 => main_of_together_4(machine).await,
        9 => main_of_runs_2(machine).await,
        10 => main_of_samples_2(machine).await,
        11 => main_of_coalesced_2(machine).await,
        12 => main_of_alone_2(machine).await,
        13 => main_of_together_5(machine).await,
        14 => main_of_together_6(machine).await,
        15 => main_of_together_7(machine).await,
        16 => main_of_together_8(machine).await,
        17 => main_of_from_keys(machine).await,
        18 => main_of_from_keys_2(machine).await,
        19 => main_of_from_keys_3(machine).await,
        20 => main_of_poses(machine).await,
        21 => main_of_crowd(machine).await,
        22 => main_of_walk_all(machine).await,
        23 => main_of_whole_rotations(machine).await,
        24 => main_of_whole_matrices(machine).await,
        25 => main_of_subgroup_rotations(machine).await,
        26 => main_of_motion(machine).await,
        _ => main_of_prepare_arcs(machine).await,
    }
}

pub(crate) async fn main_of_self_test<M: Machine>(machine: &M) {
    let invocation = machine.ids().global_invocation_id;
    let mut reply: Reply<M::F> = Default::default();
    let _block = machine.block(line!(), 38);
    let index = invocation[0];
    if index >= machine.length(Global::Probes, 4) {
        return;
    }
    let probe = machine.load::<Probe<M::F>>(Global::Probes, 4 * (index as usize));
    let a = probe.a;
    let b = probe.b;
    let c = probe.c;
    let low = probe.n & 4095i32;
    let sines = sine_cosine(machine, c);
    reply.contraction = a * b + c;
    reply.reassociation = (a + b) - a;
    reply.rounding = a + c;
    reply.association = (a * b) * c;
    reply.conversion = M::F::of(probe.n.wrapping_sub(low) as f32) + M::F::of(low as f32);
    reply.cancellation = (a * c + b) - a * c;
    reply.sine = sines[0];
    reply.cosine = sines[1];
    let result = root(machine, a * a + c * c);
    reply.root = result;
    let result_2 = arc_tangent(machine, a, c);
    reply.arc_tangent = result_2;
    let loaded = reply;
    machine.store::<Reply<M::F>>(Global::Replies, 10 * (index as usize), loaded);
}

pub(crate) async fn main_of_runs<M: Machine>(machine: &M) {
    let invocation = machine.ids().global_invocation_id;
    let groups = machine.ids().num_workgroups;
    let mut output: u32 = Default::default();
    let mut j: u32 = 0u32;
    let mut j_2: u32 = 0u32;
    let _block = machine.block(line!(), 15);
    let index = invocation_index(machine, invocation, groups);
    let loaded = machine.load::<u32>(Global::Dispatch, 1);
    if index >= loaded {
        return;
    }
    let loaded_2 = machine.load::<u32>(Global::Dispatch, 0);
    let item = item_at_item(machine, loaded_2.wrapping_add(index));
    let stride = machine.load::<u32>(Global::Dispatch, 2);
    let loaded_3 = machine.load::<u32>(Global::Dispatch, 4);
    output = item.output.wrapping_add(loaded_3);
    if item.count & IS_CONSTANT != 0u32 {
        let _block = machine.block(line!(), 2);
        let constant = constant_at(machine, item.source);
        let count = item.count & 0x7fffffffu32;
        loop {
            let _block = machine.block(line!(), 11);
            let loaded_4 = j;
            if !(loaded_4 < count) {
                break;
            }
            let loaded_5 = output;
            store(machine, loaded_5, constant);
            let loaded_6 = output;
            output = loaded_6.wrapping_add(stride);
            let loaded_7 = j;
            j = loaded_7.wrapping_add(1u32);
        }
        return;
    }
    let segment = segment_at_arc_segment(machine, item.source);
    loop {
        let _block = machine.block(line!(), 17);
        let loaded_8 = j_2;
        if !(loaded_8 < item.count) {
            break;
        }
        let loaded_9 = j_2;
        let result = distance_from_middle(machine, item.first, loaded_9);
        let parameter = result * item.scale + item.offset;
        let loaded_10 = output;
        let result_2 = evaluate_arc_segment(machine, segment, parameter);
        let result_3 = canonical(machine, result_2);
        store(machine, loaded_10, result_3);
        let loaded_11 = output;
        output = loaded_11.wrapping_add(stride);
        let loaded_12 = j_2;
        j_2 = loaded_12.wrapping_add(1u32);
    }
}

pub(crate) async fn main_of_samples<M: Machine>(machine: &M) {
    let invocation = machine.ids().global_invocation_id;
    let groups = machine.ids().num_workgroups;
    let _block = machine.block(line!(), 22);
    let index = invocation_index(machine, invocation, groups);
    let loaded = machine.load::<u32>(Global::Dispatch, 5);
    let loaded_2 = machine.load::<u32>(Global::Dispatch, 1);
    if index.wrapping_sub(loaded) >= loaded_2 {
        return;
    }
    let loaded_3 = machine.load::<u32>(Global::Dispatch, 0);
    let sample = sample_at_listed_sample(machine, loaded_3.wrapping_add(index));
    let is_constant = sample.source & IS_CONSTANT != 0u32;
    let source = sample.source & 0x7fffffffu32;
    let constant = constant_at(machine, if is_constant { source } else { 0u32 });
    let segment = segment_at_arc_segment(machine, if is_constant { 0u32 } else { source });
    let result = evaluate_arc_segment(machine, segment, sample.parameter);
    let value = canonical(machine, result);
    let loaded_4 = machine.load::<u32>(Global::Dispatch, 4);
    store(
        machine,
        loaded_4.wrapping_add(index),
        if is_constant { constant } else { value },
    );
}

pub(crate) async fn main_of_coalesced<M: Machine>(machine: &M) {
    let group = machine.ids().workgroup_id;
    let groups = machine.ids().num_workgroups;
    let lane = machine.ids().local_invocation_index;
    let mut item: Item<M::F> = Default::default();
    let mut segment: ArcSegment<M::F> = Default::default();
    let mut row: u32 = 0u32;
    let mut iteration: u32 = 0u32;
    let mut rotation: [M::F; 4] = Default::default();
    let _block = machine.block(line!(), 1);
    let corner = corner_of(machine, group, groups, lane);
    loop {
        let _block = machine.block(line!(), 23);
        let loaded = iteration;
        if !(loaded < SAMPLES_EACH) {
            break;
        }
        let loaded_2 = iteration;
        let cell = cell_of(machine, corner, loaded_2);
        let loaded_3 = row;
        let loaded_4 = item;
        let result = has(machine, loaded_4, cell.position);
        if cell.is_inside & !((cell.row == loaded_3) & result) {
            let _block = machine.block(line!(), 7);
            let result_2 = item_of(machine, cell);
            let result_3 = item_at_item(machine, result_2);
            item = result_3;
            let loaded_5 = item;
            let result_4 = segment_of_arc_segment(machine, loaded_5);
            segment = result_4;
            row = cell.row;
        }
        let loaded_6 = item;
        let result_5 = has(machine, loaded_6, cell.position);
        let is_stored = cell.is_inside & result_5;
        rotation = <[M::F; 4]>::default();
        if is_stored {
            let _block = machine.block(line!(), 4);
            let loaded_7 = item.count;
            if loaded_7 & IS_CONSTANT != 0u32 {
                let _block = machine.block(line!(), 3);
                let loaded_8 = item.source;
                let result_6 = constant_at(machine, loaded_8);
                rotation = result_6;
            } else {
                let _block = machine.block(line!(), 15);
                let loaded_9 = item.first;
                let loaded_10 = item.output;
                let distance =
                    distance_from_middle(machine, loaded_9, cell.position.wrapping_sub(loaded_10));
                let loaded_11 = segment;
                let loaded_12 = item.scale;
                let loaded_13 = item.offset;
                let result_7 =
                    evaluate_arc_segment(machine, loaded_11, distance * loaded_12 + loaded_13);
                rotation = result_7;
                let loaded_14 = item.count;
                if loaded_14 & MAY_BE_TINY != 0u32 {
                    let _block = machine.block(line!(), 3);
                    let loaded_15 = rotation;
                    let result_8 = canonical(machine, loaded_15);
                    rotation = result_8;
                }
            }
        }
        let loaded_16 = rotation;
        finish_2(machine, lane, cell.output, loaded_16, is_stored).await;
        let loaded_17 = iteration;
        iteration = loaded_17.wrapping_add(1u32);
    }
}

pub(crate) async fn main_of_alone<M: Machine>(machine: &M) {
    let group = machine.ids().workgroup_id;
    let invocation = machine.ids().local_invocation_index;
    let mut at: i32 = Default::default();
    let _block = machine.block(line!(), 47);
    let all = machine.load::<Spread>(Global::Dispatch, 0);
    let index = group[0]
        .wrapping_mul(SPREAD_WORKGROUP)
        .wrapping_add(invocation)
        >> all.lanes_log2;
    let repetition = group[2]
        .wrapping_mul(all.layer_repetitions)
        .wrapping_add(invocation & all.track_mask);
    if (index >= all.item_count) | (repetition >= all.repetitions) {
        return;
    }
    let item = item_at_spread_run(machine, all.first_item.wrapping_add(index));
    let location = location_of(machine, item, repetition);
    let first = location[1];
    let idle = first & all.line_mask;
    let first_j = (invocation & all.sample_mask).wrapping_sub(idle);
    if item.count >= NEEDS_CARE {
        let _block = machine.block(line!(), 1);
        store_with_care(machine, item, location, first_j, repetition);
        return;
    }
    let count = item.count;
    let segment = segment_at_arc_segment(machine, location[0]);
    let constant = constant_of_arc_segment(machine, segment);
    let first_at = item.first.wrapping_add(first_j as i32);
    if first_j < count {
        let _block = machine.block(line!(), 4);
        if (first_j == 0u32) & (item.key != NO_KEY) {
            let _block = machine.block(line!(), 2);
            let result = constant_at(machine, location[2]);
            store(machine, first, result);
        } else {
            let _block = machine.block(line!(), 3);
            let result_2 = evaluate_near_arc_segment(machine, item, segment, constant, first_at);
            store(machine, first.wrapping_add(first_j), result_2);
        }
    }
    let base = first.wrapping_sub((item.first as u32).wrapping_mul(all.stride));
    let step = all.step as i32;
    let end = item.first.wrapping_add(count as i32);
    at = first_at.wrapping_add(step);
    let full = count.wrapping_add(idle) >> all.step_log2;
    let loaded = at;
    let pairs_end =
        loaded.wrapping_add(((full.wrapping_sub(1u32) & 0xfffffffeu32) << all.step_log2) as i32);
    let loaded_2 = at;
    if loaded_2 < pairs_end {
        let _block = machine.block(line!(), 1);
        loop {
            let _block = machine.block(line!(), 23);
            let loaded_3 = at;
            let loaded_4 = at;
            let result_3 = evaluate_near_arc_segment(machine, item, segment, constant, loaded_4);
            store(
                machine,
                base.wrapping_add((loaded_3 as u32).wrapping_mul(all.stride)),
                result_3,
            );
            let loaded_5 = at;
            at = loaded_5.wrapping_add(step);
            let loaded_6 = at;
            let loaded_7 = at;
            let result_4 = evaluate_near_arc_segment(machine, item, segment, constant, loaded_7);
            store(
                machine,
                base.wrapping_add((loaded_6 as u32).wrapping_mul(all.stride)),
                result_4,
            );
            let loaded_8 = at;
            at = loaded_8.wrapping_add(step);
            let loaded_9 = at;
            if loaded_9 >= pairs_end {
                break;
            }
        }
        at = pairs_end;
    }
    let loaded_10 = at;
    if loaded_10 < end {
        loop {
            let _block = machine.block(line!(), 13);
            let loaded_11 = at;
            let loaded_12 = at;
            let result_5 = evaluate_near_arc_segment(machine, item, segment, constant, loaded_12);
            store(
                machine,
                base.wrapping_add((loaded_11 as u32).wrapping_mul(all.stride)),
                result_5,
            );
            let loaded_13 = at;
            at = loaded_13.wrapping_add(step);
            let loaded_14 = at;
            if loaded_14 >= end {
                break;
            }
        }
        return;
    } else {
        return;
    }
}

pub(crate) async fn main_of_together<M: Machine>(machine: &M) {
    let group = machine.ids().workgroup_id;
    let invocation = machine.ids().local_invocation_index;
    let mut item: SpreadRun<M::F> = Default::default();
    let mut first_j: u32 = Default::default();
    let mut iteration: u32 = 0u32;
    let mut rotation: [M::F; 4] = Default::default();
    let mut all_parts: [M::F; 3] = Default::default();
    let mut part: u32 = Default::default();
    let mut part_2: u32 = Default::default();
    let mut end_lane: u32 = Default::default();
    let mut part_3: u32 = Default::default();
    let _block = machine.block(line!(), 58);
    let all = machine.load::<Spread>(Global::Dispatch, 0);
    let lanes = 1u32 << all.lanes_log2;
    let first_index = group[0].wrapping_mul(SPREAD_WORKGROUP >> all.lanes_log2);
    if first_index >= all.item_count {
        return;
    }
    let result = item_at_spread_run(machine, all.first_item.wrapping_add(first_index));
    let iterations = result.iterations;
    let index = first_index.wrapping_add(invocation >> all.lanes_log2);
    if index < all.item_count {
        let _block = machine.block(line!(), 3);
        let result_2 = item_at_spread_run(machine, all.first_item.wrapping_add(index));
        item = result_2;
    }
    let first_repetition = group[2].wrapping_mul(all.layer_repetitions);
    let repetition = first_repetition.wrapping_add(invocation & all.track_mask);
    let is_there = repetition < all.repetitions;
    let loaded = item;
    let location = location_of(machine, loaded, repetition);
    let loaded_2 = item.count;
    let has_segment = is_there & (loaded_2 & IS_CONSTANT == 0u32);
    let segment = segment_at_arc_segment(machine, if has_segment { location[0] } else { 0u32 });
    let constant = constant_of_arc_segment(machine, segment);
    let loaded_3 = item;
    let count = sample_count(machine, loaded_3);
    let lane_count = if is_there { count } else { 0u32 };
    let tracks = all.repetitions.wrapping_sub(first_repetition);
    let used_lanes = if (all.track_mask != 0u32) & (tracks < lanes) {
        tracks
    } else {
        lanes
    };
    let lane = invocation & lanes.wrapping_sub(1u32);
    let run_values = invocation.wrapping_sub(lane).wrapping_mul(3u32);
    let lane_part = (lane & 0xfffffff8u32)
        .wrapping_mul(3u32)
        .wrapping_add(lane & 7u32);
    let first = location[1].wrapping_sub((invocation & all.track_mask).wrapping_mul(all.outputs));
    let first_part = first.wrapping_mul(3u32).wrapping_add(lane_part);
    let stride = all.stride.wrapping_mul(3u32);
    let fills_lines = (lanes >= LINE) & (used_lanes == lanes) & (count > all.sample_mask);
    let filling = if fills_lines {
        count.wrapping_sub(all.sample_mask)
    } else {
        0u32
    };
    let sample_lane = invocation & all.sample_mask;
    first_j = 0u32.wrapping_sub(first & all.line_mask);
    loop {
        let _block = machine.block(line!(), 21);
        let loaded_4 = iteration;
        let values = (loaded_4 & 1u32)
            .wrapping_mul(SPREAD_WORKGROUP)
            .wrapping_mul(3u32)
            .wrapping_add(run_values);
        let loaded_5 = first_j;
        let j = loaded_5.wrapping_add(sample_lane);
        if j < lane_count {
            let _block = machine.block(line!(), 13);
            rotation = <[M::F; 4]>::default();
            let loaded_6 = item.count;
            let loaded_7 = item.key;
            if (loaded_6 < NEEDS_CARE) & ((j != 0u32) | (loaded_7 == NO_KEY)) {
                let _block = machine.block(line!(), 6);
                let loaded_8 = item;
                let loaded_9 = item.first;
                let result_3 = evaluate_near_arc_segment(
                    machine,
                    loaded_8,
                    segment,
                    constant,
                    loaded_9.wrapping_add(j as i32),
                );
                rotation = result_3;
            } else {
                let _block = machine.block(line!(), 3);
                let loaded_10 = item;
                let result_4 = sample_of_arc_segment(machine, loaded_10, segment, j, repetition);
                rotation = result_4;
            }
            let loaded_11 = rotation;
            let result_5 = parts_1(machine, loaded_11);
            all_parts = result_5;
            part = 0u32;
            loop {
                let _block = machine.block(line!(), 13);
                let loaded_12 = part;
                if !(loaded_12 < 3u32) {
                    break;
                }
                let loaded_13 = part;
                let loaded_14 = part;
                let loaded_15 = all_parts[loaded_14 as usize];
                machine.store::<M::F>(
                    Global::Tile,
                    values
                        .wrapping_add(lane.wrapping_mul(3u32))
                        .wrapping_add(loaded_13) as usize,
                    loaded_15,
                );
                let loaded_16 = part;
                part = loaded_16.wrapping_add(1u32);
            }
        }
        barrier().await;
        let loaded_17 = first_j;
        if loaded_17 < filling {
            let _block = machine.block(line!(), 5);
            let found = values.wrapping_add(lane_part);
            let loaded_18 = first_j;
            let stored = first_part.wrapping_add(loaded_18.wrapping_mul(stride));
            part_2 = 0u32;
            loop {
                let _block = machine.block(line!(), 14);
                let loaded_19 = part_2;
                if !(loaded_19 < 3u32) {
                    break;
                }
                let loaded_20 = part_2;
                let loaded_21 = part_2;
                let loaded_22 = machine.load::<M::F>(
                    Global::Tile,
                    found.wrapping_add(loaded_21.wrapping_mul(LINE)) as usize,
                );
                machine.store::<M::F>(
                    Global::Rotations,
                    stored.wrapping_add(loaded_20.wrapping_mul(LINE)) as usize,
                    loaded_22,
                );
                let loaded_23 = part_2;
                part_2 = loaded_23.wrapping_add(1u32);
            }
        } else {
            let _block = machine.block(line!(), 18);
            let loaded_24 = first_j;
            let loaded_25 = first_j;
            let first_lane = if (loaded_25 as i32) < 0i32 {
                0u32.wrapping_sub(loaded_24)
            } else {
                0u32
            };
            let loaded_26 = first_j;
            let last_j = loaded_26.wrapping_add(all.sample_mask);
            end_lane = used_lanes;
            if last_j >= count {
                let _block = machine.block(line!(), 11);
                let missing = if all.track_mask != 0u32 {
                    lanes
                } else {
                    last_j.wrapping_add(1u32).wrapping_sub(count)
                };
                let loaded_27 = end_lane;
                let loaded_28 = end_lane;
                let loaded_29 = end_lane;
                end_lane = loaded_27.wrapping_sub(if missing > loaded_29 {
                    loaded_28
                } else {
                    missing
                });
            }
            let loaded_30 = first_j;
            let stored_2 = first
                .wrapping_mul(3u32)
                .wrapping_add(loaded_30.wrapping_mul(stride));
            part_3 = first_lane.wrapping_mul(3u32).wrapping_add(lane);
            loop {
                let _block = machine.block(line!(), 14);
                let loaded_31 = part_3;
                let loaded_32 = end_lane;
                if !(loaded_31 < loaded_32.wrapping_mul(3u32)) {
                    break;
                }
                let loaded_33 = part_3;
                let loaded_34 = part_3;
                let loaded_35 =
                    machine.load::<M::F>(Global::Tile, values.wrapping_add(loaded_34) as usize);
                machine.store::<M::F>(
                    Global::Rotations,
                    stored_2.wrapping_add(loaded_33) as usize,
                    loaded_35,
                );
                let loaded_36 = part_3;
                part_3 = loaded_36.wrapping_add(lanes);
            }
        }
        let loaded_37 = first_j;
        first_j = loaded_37.wrapping_add(all.step);
        let loaded_38 = iteration;
        iteration = loaded_38.wrapping_add(1u32);
        let loaded_39 = iteration;
        if loaded_39 >= iterations {
            break;
        }
    }
}

pub(crate) async fn main_of_together_2<M: Machine>(machine: &M) {
    let group = machine.ids().workgroup_id;
    let invocation = machine.ids().local_invocation_index;
    let mut item: SpreadRun<M::F> = Default::default();
    let mut first_j: u32 = Default::default();
    let mut iteration: u32 = 0u32;
    let mut rotation: [M::F; 4] = Default::default();
    let mut all_parts: [M::F; 9] = Default::default();
    let mut part: u32 = Default::default();
    let mut part_2: u32 = Default::default();
    let mut end_lane: u32 = Default::default();
    let mut part_3: u32 = Default::default();
    let _block = machine.block(line!(), 58);
    let all = machine.load::<Spread>(Global::Dispatch, 0);
    let lanes = 1u32 << all.lanes_log2;
    let first_index = group[0].wrapping_mul(SPREAD_WORKGROUP >> all.lanes_log2);
    if first_index >= all.item_count {
        return;
    }
    let result = item_at_spread_run(machine, all.first_item.wrapping_add(first_index));
    let iterations = result.iterations;
    let index = first_index.wrapping_add(invocation >> all.lanes_log2);
    if index < all.item_count {
        let _block = machine.block(line!(), 3);
        let result_2 = item_at_spread_run(machine, all.first_item.wrapping_add(index));
        item = result_2;
    }
    let first_repetition = group[2].wrapping_mul(all.layer_repetitions);
    let repetition = first_repetition.wrapping_add(invocation & all.track_mask);
    let is_there = repetition < all.repetitions;
    let loaded = item;
    let location = location_of(machine, loaded, repetition);
    let loaded_2 = item.count;
    let has_segment = is_there & (loaded_2 & IS_CONSTANT == 0u32);
    let segment = segment_at_arc_segment(machine, if has_segment { location[0] } else { 0u32 });
    let constant = constant_of_arc_segment(machine, segment);
    let loaded_3 = item;
    let count = sample_count(machine, loaded_3);
    let lane_count = if is_there { count } else { 0u32 };
    let tracks = all.repetitions.wrapping_sub(first_repetition);
    let used_lanes = if (all.track_mask != 0u32) & (tracks < lanes) {
        tracks
    } else {
        lanes
    };
    let lane = invocation & lanes.wrapping_sub(1u32);
    let run_values = invocation.wrapping_sub(lane).wrapping_mul(9u32);
    let lane_part = (lane & 0xfffffff8u32)
        .wrapping_mul(9u32)
        .wrapping_add(lane & 7u32);
    let first = location[1].wrapping_sub((invocation & all.track_mask).wrapping_mul(all.outputs));
    let first_part = first.wrapping_mul(9u32).wrapping_add(lane_part);
    let stride = all.stride.wrapping_mul(9u32);
    let fills_lines = (lanes >= LINE) & (used_lanes == lanes) & (count > all.sample_mask);
    let filling = if fills_lines {
        count.wrapping_sub(all.sample_mask)
    } else {
        0u32
    };
    let sample_lane = invocation & all.sample_mask;
    first_j = 0u32.wrapping_sub(first & all.line_mask);
    loop {
        let _block = machine.block(line!(), 21);
        let loaded_4 = iteration;
        let values = (loaded_4 & 1u32)
            .wrapping_mul(SPREAD_WORKGROUP)
            .wrapping_mul(9u32)
            .wrapping_add(run_values);
        let loaded_5 = first_j;
        let j = loaded_5.wrapping_add(sample_lane);
        if j < lane_count {
            let _block = machine.block(line!(), 13);
            rotation = <[M::F; 4]>::default();
            let loaded_6 = item.count;
            let loaded_7 = item.key;
            if (loaded_6 < NEEDS_CARE) & ((j != 0u32) | (loaded_7 == NO_KEY)) {
                let _block = machine.block(line!(), 6);
                let loaded_8 = item;
                let loaded_9 = item.first;
                let result_3 = evaluate_near_arc_segment(
                    machine,
                    loaded_8,
                    segment,
                    constant,
                    loaded_9.wrapping_add(j as i32),
                );
                rotation = result_3;
            } else {
                let _block = machine.block(line!(), 3);
                let loaded_10 = item;
                let result_4 = sample_of_arc_segment(machine, loaded_10, segment, j, repetition);
                rotation = result_4;
            }
            let loaded_11 = rotation;
            let result_5 = parts_3(machine, loaded_11);
            all_parts = result_5;
            part = 0u32;
            loop {
                let _block = machine.block(line!(), 13);
                let loaded_12 = part;
                if !(loaded_12 < 9u32) {
                    break;
                }
                let loaded_13 = part;
                let loaded_14 = part;
                let loaded_15 = all_parts[loaded_14 as usize];
                machine.store::<M::F>(
                    Global::Tile,
                    values
                        .wrapping_add(lane.wrapping_mul(9u32))
                        .wrapping_add(loaded_13) as usize,
                    loaded_15,
                );
                let loaded_16 = part;
                part = loaded_16.wrapping_add(1u32);
            }
        }
        barrier().await;
        let loaded_17 = first_j;
        if loaded_17 < filling {
            let _block = machine.block(line!(), 5);
            let found = values.wrapping_add(lane_part);
            let loaded_18 = first_j;
            let stored = first_part.wrapping_add(loaded_18.wrapping_mul(stride));
            part_2 = 0u32;
            loop {
                let _block = machine.block(line!(), 14);
                let loaded_19 = part_2;
                if !(loaded_19 < 9u32) {
                    break;
                }
                let loaded_20 = part_2;
                let loaded_21 = part_2;
                let loaded_22 = machine.load::<M::F>(
                    Global::Tile,
                    found.wrapping_add(loaded_21.wrapping_mul(LINE)) as usize,
                );
                machine.store::<M::F>(
                    Global::Rotations,
                    stored.wrapping_add(loaded_20.wrapping_mul(LINE)) as usize,
                    loaded_22,
                );
                let loaded_23 = part_2;
                part_2 = loaded_23.wrapping_add(1u32);
            }
        } else {
            let _block = machine.block(line!(), 18);
            let loaded_24 = first_j;
            let loaded_25 = first_j;
            let first_lane = if (loaded_25 as i32) < 0i32 {
                0u32.wrapping_sub(loaded_24)
            } else {
                0u32
            };
            let loaded_26 = first_j;
            let last_j = loaded_26.wrapping_add(all.sample_mask);
            end_lane = used_lanes;
            if last_j >= count {
                let _block = machine.block(line!(), 11);
                let missing = if all.track_mask != 0u32 {
                    lanes
                } else {
                    last_j.wrapping_add(1u32).wrapping_sub(count)
                };
                let loaded_27 = end_lane;
                let loaded_28 = end_lane;
                let loaded_29 = end_lane;
                end_lane = loaded_27.wrapping_sub(if missing > loaded_29 {
                    loaded_28
                } else {
                    missing
                });
            }
            let loaded_30 = first_j;
            let stored_2 = first
                .wrapping_mul(9u32)
                .wrapping_add(loaded_30.wrapping_mul(stride));
            part_3 = first_lane.wrapping_mul(9u32).wrapping_add(lane);
            loop {
                let _block = machine.block(line!(), 14);
                let loaded_31 = part_3;
                let loaded_32 = end_lane;
                if !(loaded_31 < loaded_32.wrapping_mul(9u32)) {
                    break;
                }
                let loaded_33 = part_3;
                let loaded_34 = part_3;
                let loaded_35 =
                    machine.load::<M::F>(Global::Tile, values.wrapping_add(loaded_34) as usize);
                machine.store::<M::F>(
                    Global::Rotations,
                    stored_2.wrapping_add(loaded_33) as usize,
                    loaded_35,
                );
                let loaded_36 = part_3;
                part_3 = loaded_36.wrapping_add(lanes);
            }
        }
        let loaded_37 = first_j;
        first_j = loaded_37.wrapping_add(all.step);
        let loaded_38 = iteration;
        iteration = loaded_38.wrapping_add(1u32);
        let loaded_39 = iteration;
        if loaded_39 >= iterations {
            break;
        }
    }
}

pub(crate) async fn main_of_together_3<M: Machine>(machine: &M) {
    let group = machine.ids().workgroup_id;
    let invocation = machine.ids().local_invocation_index;
    let mut item: SpreadRun<M::F> = Default::default();
    let mut first_j: u32 = Default::default();
    let mut iteration: u32 = 0u32;
    let mut rotation: [M::F; 4] = Default::default();
    let mut all_parts: [[M::F; 4]; 3] = Default::default();
    let mut part: u32 = Default::default();
    let mut part_2: u32 = Default::default();
    let mut end_lane: u32 = Default::default();
    let mut part_3: u32 = Default::default();
    let _block = machine.block(line!(), 58);
    let all = machine.load::<Spread>(Global::Dispatch, 0);
    let lanes = 1u32 << all.lanes_log2;
    let first_index = group[0].wrapping_mul(SPREAD_WORKGROUP >> all.lanes_log2);
    if first_index >= all.item_count {
        return;
    }
    let result = item_at_spread_run(machine, all.first_item.wrapping_add(first_index));
    let iterations = result.iterations;
    let index = first_index.wrapping_add(invocation >> all.lanes_log2);
    if index < all.item_count {
        let _block = machine.block(line!(), 3);
        let result_2 = item_at_spread_run(machine, all.first_item.wrapping_add(index));
        item = result_2;
    }
    let first_repetition = group[2].wrapping_mul(all.layer_repetitions);
    let repetition = first_repetition.wrapping_add(invocation & all.track_mask);
    let is_there = repetition < all.repetitions;
    let loaded = item;
    let location = location_of(machine, loaded, repetition);
    let loaded_2 = item.count;
    let has_segment = is_there & (loaded_2 & IS_CONSTANT == 0u32);
    let segment = segment_at_arc_segment(machine, if has_segment { location[0] } else { 0u32 });
    let constant = constant_of_arc_segment(machine, segment);
    let loaded_3 = item;
    let count = sample_count(machine, loaded_3);
    let lane_count = if is_there { count } else { 0u32 };
    let tracks = all.repetitions.wrapping_sub(first_repetition);
    let used_lanes = if (all.track_mask != 0u32) & (tracks < lanes) {
        tracks
    } else {
        lanes
    };
    let lane = invocation & lanes.wrapping_sub(1u32);
    let run_values = invocation.wrapping_sub(lane).wrapping_mul(3u32);
    let lane_part = (lane & 0xfffffff8u32)
        .wrapping_mul(3u32)
        .wrapping_add(lane & 7u32);
    let first = location[1].wrapping_sub((invocation & all.track_mask).wrapping_mul(all.outputs));
    let first_part = first.wrapping_mul(3u32).wrapping_add(lane_part);
    let stride = all.stride.wrapping_mul(3u32);
    let fills_lines = (lanes >= LINE) & (used_lanes == lanes) & (count > all.sample_mask);
    let filling = if fills_lines {
        count.wrapping_sub(all.sample_mask)
    } else {
        0u32
    };
    let sample_lane = invocation & all.sample_mask;
    first_j = 0u32.wrapping_sub(first & all.line_mask);
    loop {
        let _block = machine.block(line!(), 21);
        let loaded_4 = iteration;
        let values = (loaded_4 & 1u32)
            .wrapping_mul(SPREAD_WORKGROUP)
            .wrapping_mul(3u32)
            .wrapping_add(run_values);
        let loaded_5 = first_j;
        let j = loaded_5.wrapping_add(sample_lane);
        if j < lane_count {
            let _block = machine.block(line!(), 13);
            rotation = <[M::F; 4]>::default();
            let loaded_6 = item.count;
            let loaded_7 = item.key;
            if (loaded_6 < NEEDS_CARE) & ((j != 0u32) | (loaded_7 == NO_KEY)) {
                let _block = machine.block(line!(), 6);
                let loaded_8 = item;
                let loaded_9 = item.first;
                let result_3 = evaluate_near_arc_segment(
                    machine,
                    loaded_8,
                    segment,
                    constant,
                    loaded_9.wrapping_add(j as i32),
                );
                rotation = result_3;
            } else {
                let _block = machine.block(line!(), 3);
                let loaded_10 = item;
                let result_4 = sample_of_arc_segment(machine, loaded_10, segment, j, repetition);
                rotation = result_4;
            }
            let loaded_11 = rotation;
            let result_5 = parts_4(machine, loaded_11);
            all_parts = result_5;
            part = 0u32;
            loop {
                let _block = machine.block(line!(), 13);
                let loaded_12 = part;
                if !(loaded_12 < 3u32) {
                    break;
                }
                let loaded_13 = part;
                let loaded_14 = part;
                let loaded_15 = all_parts[loaded_14 as usize];
                machine.store::<[M::F; 4]>(
                    Global::Tile,
                    4 * (values
                        .wrapping_add(lane.wrapping_mul(3u32))
                        .wrapping_add(loaded_13) as usize),
                    loaded_15,
                );
                let loaded_16 = part;
                part = loaded_16.wrapping_add(1u32);
            }
        }
        barrier().await;
        let loaded_17 = first_j;
        if loaded_17 < filling {
            let _block = machine.block(line!(), 5);
            let found = values.wrapping_add(lane_part);
            let loaded_18 = first_j;
            let stored = first_part.wrapping_add(loaded_18.wrapping_mul(stride));
            part_2 = 0u32;
            loop {
                let _block = machine.block(line!(), 14);
                let loaded_19 = part_2;
                if !(loaded_19 < 3u32) {
                    break;
                }
                let loaded_20 = part_2;
                let loaded_21 = part_2;
                let loaded_22 = machine.load::<[M::F; 4]>(
                    Global::Tile,
                    4 * (found.wrapping_add(loaded_21.wrapping_mul(LINE)) as usize),
                );
                machine.store::<[M::F; 4]>(
                    Global::Rotations,
                    4 * (stored.wrapping_add(loaded_20.wrapping_mul(LINE)) as usize),
                    loaded_22,
                );
                let loaded_23 = part_2;
                part_2 = loaded_23.wrapping_add(1u32);
            }
        } else {
            let _block = machine.block(line!(), 18);
            let loaded_24 = first_j;
            let loaded_25 = first_j;
            let first_lane = if (loaded_25 as i32) < 0i32 {
                0u32.wrapping_sub(loaded_24)
            } else {
                0u32
            };
            let loaded_26 = first_j;
            let last_j = loaded_26.wrapping_add(all.sample_mask);
            end_lane = used_lanes;
            if last_j >= count {
                let _block = machine.block(line!(), 11);
                let missing = if all.track_mask != 0u32 {
                    lanes
                } else {
                    last_j.wrapping_add(1u32).wrapping_sub(count)
                };
                let loaded_27 = end_lane;
                let loaded_28 = end_lane;
                let loaded_29 = end_lane;
                end_lane = loaded_27.wrapping_sub(if missing > loaded_29 {
                    loaded_28
                } else {
                    missing
                });
            }
            let loaded_30 = first_j;
            let stored_2 = first
                .wrapping_mul(3u32)
                .wrapping_add(loaded_30.wrapping_mul(stride));
            part_3 = first_lane.wrapping_mul(3u32).wrapping_add(lane);
            loop {
                let _block = machine.block(line!(), 14);
                let loaded_31 = part_3;
                let loaded_32 = end_lane;
                if !(loaded_31 < loaded_32.wrapping_mul(3u32)) {
                    break;
                }
                let loaded_33 = part_3;
                let loaded_34 = part_3;
                let loaded_35 = machine
                    .load::<[M::F; 4]>(Global::Tile, 4 * (values.wrapping_add(loaded_34) as usize));
                machine.store::<[M::F; 4]>(
                    Global::Rotations,
                    4 * (stored_2.wrapping_add(loaded_33) as usize),
                    loaded_35,
                );
                let loaded_36 = part_3;
                part_3 = loaded_36.wrapping_add(lanes);
            }
        }
        let loaded_37 = first_j;
        first_j = loaded_37.wrapping_add(all.step);
        let loaded_38 = iteration;
        iteration = loaded_38.wrapping_add(1u32);
        let loaded_39 = iteration;
        if loaded_39 >= iterations {
            break;
        }
    }
}

pub(crate) async fn main_of_together_4<M: Machine>(machine: &M) {
    let group = machine.ids().workgroup_id;
    let invocation = machine.ids().local_invocation_index;
    let mut item: SpreadRun<M::F> = Default::default();
    let mut first_j: u32 = Default::default();
    let mut iteration: u32 = 0u32;
    let mut rotation: [M::F; 4] = Default::default();
    let mut all_parts: [M::F; 6] = Default::default();
    let mut part: u32 = Default::default();
    let mut part_2: u32 = Default::default();
    let mut end_lane: u32 = Default::default();
    let mut part_3: u32 = Default::default();
    let _block = machine.block(line!(), 58);
    let all = machine.load::<Spread>(Global::Dispatch, 0);
    let lanes = 1u32 << all.lanes_log2;
    let first_index = group[0].wrapping_mul(SPREAD_WORKGROUP >> all.lanes_log2);
    if first_index >= all.item_count {
        return;
    }
    let result = item_at_spread_run(machine, all.first_item.wrapping_add(first_index));
    let iterations = result.iterations;
    let index = first_index.wrapping_add(invocation >> all.lanes_log2);
    if index < all.item_count {
        let _block = machine.block(line!(), 3);
        let result_2 = item_at_spread_run(machine, all.first_item.wrapping_add(index));
        item = result_2;
    }
    let first_repetition = group[2].wrapping_mul(all.layer_repetitions);
    let repetition = first_repetition.wrapping_add(invocation & all.track_mask);
    let is_there = repetition < all.repetitions;
    let loaded = item;
    let location = location_of(machine, loaded, repetition);
    let loaded_2 = item.count;
    let has_segment = is_there & (loaded_2 & IS_CONSTANT == 0u32);
    let segment = segment_at_arc_segment(machine, if has_segment { location[0] } else { 0u32 });
    let constant = constant_of_arc_segment(machine, segment);
    let loaded_3 = item;
    let count = sample_count(machine, loaded_3);
    let lane_count = if is_there { count } else { 0u32 };
    let tracks = all.repetitions.wrapping_sub(first_repetition);
    let used_lanes = if (all.track_mask != 0u32) & (tracks < lanes) {
        tracks
    } else {
        lanes
    };
    let lane = invocation & lanes.wrapping_sub(1u32);
    let run_values = invocation.wrapping_sub(lane).wrapping_mul(6u32);
    let lane_part = (lane & 0xfffffff8u32)
        .wrapping_mul(6u32)
        .wrapping_add(lane & 7u32);
    let first = location[1].wrapping_sub((invocation & all.track_mask).wrapping_mul(all.outputs));
    let first_part = first.wrapping_mul(6u32).wrapping_add(lane_part);
    let stride = all.stride.wrapping_mul(6u32);
    let fills_lines = (lanes >= LINE) & (used_lanes == lanes) & (count > all.sample_mask);
    let filling = if fills_lines {
        count.wrapping_sub(all.sample_mask)
    } else {
        0u32
    };
    let sample_lane = invocation & all.sample_mask;
    first_j = 0u32.wrapping_sub(first & all.line_mask);
    loop {
        let _block = machine.block(line!(), 21);
        let loaded_4 = iteration;
        let values = (loaded_4 & 1u32)
            .wrapping_mul(SPREAD_WORKGROUP)
            .wrapping_mul(6u32)
            .wrapping_add(run_values);
        let loaded_5 = first_j;
        let j = loaded_5.wrapping_add(sample_lane);
        if j < lane_count {
            let _block = machine.block(line!(), 13);
            rotation = <[M::F; 4]>::default();
            let loaded_6 = item.count;
            let loaded_7 = item.key;
            if (loaded_6 < NEEDS_CARE) & ((j != 0u32) | (loaded_7 == NO_KEY)) {
                let _block = machine.block(line!(), 6);
                let loaded_8 = item;
                let loaded_9 = item.first;
                let result_3 = evaluate_near_arc_segment(
                    machine,
                    loaded_8,
                    segment,
                    constant,
                    loaded_9.wrapping_add(j as i32),
                );
                rotation = result_3;
            } else {
                let _block = machine.block(line!(), 3);
                let loaded_10 = item;
                let result_4 = sample_of_arc_segment(machine, loaded_10, segment, j, repetition);
                rotation = result_4;
            }
            let loaded_11 = rotation;
            let result_5 = parts_2(machine, loaded_11);
            all_parts = result_5;
            part = 0u32;
            loop {
                let _block = machine.block(line!(), 13);
                let loaded_12 = part;
                if !(loaded_12 < 6u32) {
                    break;
                }
                let loaded_13 = part;
                let loaded_14 = part;
                let loaded_15 = all_parts[loaded_14 as usize];
                machine.store::<M::F>(
                    Global::Tile,
                    values
                        .wrapping_add(lane.wrapping_mul(6u32))
                        .wrapping_add(loaded_13) as usize,
                    loaded_15,
                );
                let loaded_16 = part;
                part = loaded_16.wrapping_add(1u32);
            }
        }
        barrier().await;
        let loaded_17 = first_j;
        if loaded_17 < filling {
            let _block = machine.block(line!(), 5);
            let found = values.wrapping_add(lane_part);
            let loaded_18 = first_j;
            let stored = first_part.wrapping_add(loaded_18.wrapping_mul(stride));
            part_2 = 0u32;
            loop {
                let _block = machine.block(line!(), 14);
                let loaded_19 = part_2;
                if !(loaded_19 < 6u32) {
                    break;
                }
                let loaded_20 = part_2;
                let loaded_21 = part_2;
                let loaded_22 = machine.load::<M::F>(
                    Global::Tile,
                    found.wrapping_add(loaded_21.wrapping_mul(LINE)) as usize,
                );
                machine.store::<M::F>(
                    Global::Rotations,
                    stored.wrapping_add(loaded_20.wrapping_mul(LINE)) as usize,
                    loaded_22,
                );
                let loaded_23 = part_2;
                part_2 = loaded_23.wrapping_add(1u32);
            }
        } else {
            let _block = machine.block(line!(), 18);
            let loaded_24 = first_j;
            let loaded_25 = first_j;
            let first_lane = if (loaded_25 as i32) < 0i32 {
                0u32.wrapping_sub(loaded_24)
            } else {
                0u32
            };
            let loaded_26 = first_j;
            let last_j = loaded_26.wrapping_add(all.sample_mask);
            end_lane = used_lanes;
            if last_j >= count {
                let _block = machine.block(line!(), 11);
                let missing = if all.track_mask != 0u32 {
                    lanes
                } else {
                    last_j.wrapping_add(1u32).wrapping_sub(count)
                };
                let loaded_27 = end_lane;
                let loaded_28 = end_lane;
                let loaded_29 = end_lane;
                end_lane = loaded_27.wrapping_sub(if missing > loaded_29 {
                    loaded_28
                } else {
                    missing
                });
            }
            let loaded_30 = first_j;
            let stored_2 = first
                .wrapping_mul(6u32)
                .wrapping_add(loaded_30.wrapping_mul(stride));
            part_3 = first_lane.wrapping_mul(6u32).wrapping_add(lane);
            loop {
                let _block = machine.block(line!(), 14);
                let loaded_31 = part_3;
                let loaded_32 = end_lane;
                if !(loaded_31 < loaded_32.wrapping_mul(6u32)) {
                    break;
                }
                let loaded_33 = part_3;
                let loaded_34 = part_3;
                let loaded_35 =
                    machine.load::<M::F>(Global::Tile, values.wrapping_add(loaded_34) as usize);
                machine.store::<M::F>(
                    Global::Rotations,
                    stored_2.wrapping_add(loaded_33) as usize,
                    loaded_35,
                );
                let loaded_36 = part_3;
                part_3 = loaded_36.wrapping_add(lanes);
            }
        }
        let loaded_37 = first_j;
        first_j = loaded_37.wrapping_add(all.step);
        let loaded_38 = iteration;
        iteration = loaded_38.wrapping_add(1u32);
        let loaded_39 = iteration;
        if loaded_39 >= iterations {
            break;
        }
    }
}

pub(crate) async fn main_of_runs_2<M: Machine>(machine: &M) {
    let invocation = machine.ids().global_invocation_id;
    let groups = machine.ids().num_workgroups;
    let mut output: u32 = Default::default();
    let mut j: u32 = 0u32;
    let mut j_2: u32 = 0u32;
    let _block = machine.block(line!(), 15);
    let index = invocation_index(machine, invocation, groups);
    let loaded = machine.load::<u32>(Global::Dispatch, 1);
    if index >= loaded {
        return;
    }
    let loaded_2 = machine.load::<u32>(Global::Dispatch, 0);
    let item = item_at_item(machine, loaded_2.wrapping_add(index));
    let stride = machine.load::<u32>(Global::Dispatch, 2);
    let loaded_3 = machine.load::<u32>(Global::Dispatch, 4);
    output = item.output.wrapping_add(loaded_3);
    if item.count & IS_CONSTANT != 0u32 {
        let _block = machine.block(line!(), 2);
        let constant = constant_at(machine, item.source);
        let count = item.count & 0x7fffffffu32;
        loop {
            let _block = machine.block(line!(), 11);
            let loaded_4 = j;
            if !(loaded_4 < count) {
                break;
            }
            let loaded_5 = output;
            store(machine, loaded_5, constant);
            let loaded_6 = output;
            output = loaded_6.wrapping_add(stride);
            let loaded_7 = j;
            j = loaded_7.wrapping_add(1u32);
        }
        return;
    }
    let segment = segment_at_polynomial_segment(machine, item.source);
    loop {
        let _block = machine.block(line!(), 17);
        let loaded_8 = j_2;
        if !(loaded_8 < item.count) {
            break;
        }
        let loaded_9 = j_2;
        let result = distance_from_middle(machine, item.first, loaded_9);
        let parameter = result * item.scale + item.offset;
        let loaded_10 = output;
        let result_2 = evaluate_polynomial_segment(machine, segment, parameter);
        let result_3 = canonical(machine, result_2);
        store(machine, loaded_10, result_3);
        let loaded_11 = output;
        output = loaded_11.wrapping_add(stride);
        let loaded_12 = j_2;
        j_2 = loaded_12.wrapping_add(1u32);
    }
}

pub(crate) async fn main_of_samples_2<M: Machine>(machine: &M) {
    let invocation = machine.ids().global_invocation_id;
    let groups = machine.ids().num_workgroups;
    let _block = machine.block(line!(), 22);
    let index = invocation_index(machine, invocation, groups);
    let loaded = machine.load::<u32>(Global::Dispatch, 5);
    let loaded_2 = machine.load::<u32>(Global::Dispatch, 1);
    if index.wrapping_sub(loaded) >= loaded_2 {
        return;
    }
    let loaded_3 = machine.load::<u32>(Global::Dispatch, 0);
    let sample = sample_at_listed_sample(machine, loaded_3.wrapping_add(index));
    let is_constant = sample.source & IS_CONSTANT != 0u32;
    let source = sample.source & 0x7fffffffu32;
    let constant = constant_at(machine, if is_constant { source } else { 0u32 });
    let segment = segment_at_polynomial_segment(machine, if is_constant { 0u32 } else { source });
    let result = evaluate_polynomial_segment(machine, segment, sample.parameter);
    let value = canonical(machine, result);
    let loaded_4 = machine.load::<u32>(Global::Dispatch, 4);
    store(
        machine,
        loaded_4.wrapping_add(index),
        if is_constant { constant } else { value },
    );
}

pub(crate) async fn main_of_coalesced_2<M: Machine>(machine: &M) {
    let group = machine.ids().workgroup_id;
    let groups = machine.ids().num_workgroups;
    let lane = machine.ids().local_invocation_index;
    let mut item: Item<M::F> = Default::default();
    let mut segment: PolynomialSegment<M::F> = Default::default();
    let mut row: u32 = 0u32;
    let mut iteration: u32 = 0u32;
    let mut rotation: [M::F; 4] = Default::default();
    let _block = machine.block(line!(), 1);
    let corner = corner_of(machine, group, groups, lane);
    loop {
        let _block = machine.block(line!(), 23);
        let loaded = iteration;
        if !(loaded < SAMPLES_EACH) {
            break;
        }
        let loaded_2 = iteration;
        let cell = cell_of(machine, corner, loaded_2);
        let loaded_3 = row;
        let loaded_4 = item;
        let result = has(machine, loaded_4, cell.position);
        if cell.is_inside & !((cell.row == loaded_3) & result) {
            let _block = machine.block(line!(), 7);
            let result_2 = item_of(machine, cell);
            let result_3 = item_at_item(machine, result_2);
            item = result_3;
            let loaded_5 = item;
            let result_4 = segment_of_polynomial_segment(machine, loaded_5);
            segment = result_4;
            row = cell.row;
        }
        let loaded_6 = item;
        let result_5 = has(machine, loaded_6, cell.position);
        let is_stored = cell.is_inside & result_5;
        rotation = <[M::F; 4]>::default();
        if is_stored {
            let _block = machine.block(line!(), 4);
            let loaded_7 = item.count;
            if loaded_7 & IS_CONSTANT != 0u32 {
                let _block = machine.block(line!(), 3);
                let loaded_8 = item.source;
                let result_6 = constant_at(machine, loaded_8);
                rotation = result_6;
            } else {
                let _block = machine.block(line!(), 15);
                let loaded_9 = item.first;
                let loaded_10 = item.output;
                let distance =
                    distance_from_middle(machine, loaded_9, cell.position.wrapping_sub(loaded_10));
                let loaded_11 = segment;
                let loaded_12 = item.scale;
                let loaded_13 = item.offset;
                let result_7 = evaluate_polynomial_segment(
                    machine,
                    loaded_11,
                    distance * loaded_12 + loaded_13,
                );
                rotation = result_7;
                let loaded_14 = item.count;
                if loaded_14 & MAY_BE_TINY != 0u32 {
                    let _block = machine.block(line!(), 3);
                    let loaded_15 = rotation;
                    let result_8 = canonical(machine, loaded_15);
                    rotation = result_8;
                }
            }
        }
        let loaded_16 = rotation;
        finish_2(machine, lane, cell.output, loaded_16, is_stored).await;
        let loaded_17 = iteration;
        iteration = loaded_17.wrapping_add(1u32);
    }
}

pub(crate) async fn main_of_alone_2<M: Machine>(machine: &M) {
    let group = machine.ids().workgroup_id;
    let invocation = machine.ids().local_invocation_index;
    let mut at: i32 = Default::default();
    let _block = machine.block(line!(), 47);
    let all = machine.load::<Spread>(Global::Dispatch, 0);
    let index = group[0]
        .wrapping_mul(SPREAD_WORKGROUP)
        .wrapping_add(invocation)
        >> all.lanes_log2;
    let repetition = group[2]
        .wrapping_mul(all.layer_repetitions)
        .wrapping_add(invocation & all.track_mask);
    if (index >= all.item_count) | (repetition >= all.repetitions) {
        return;
    }
    let item = item_at_spread_run(machine, all.first_item.wrapping_add(index));
    let location = location_of(machine, item, repetition);
    let first = location[1];
    let idle = first & all.line_mask;
    let first_j = (invocation & all.sample_mask).wrapping_sub(idle);
    if item.count >= NEEDS_CARE {
        let _block = machine.block(line!(), 1);
        store_with_care(machine, item, location, first_j, repetition);
        return;
    }
    let count = item.count;
    let segment = segment_at_polynomial_segment(machine, location[0]);
    let constant = constant_of_polynomial_segment(machine, segment);
    let first_at = item.first.wrapping_add(first_j as i32);
    if first_j < count {
        let _block = machine.block(line!(), 4);
        if (first_j == 0u32) & (item.key != NO_KEY) {
            let _block = machine.block(line!(), 2);
            let result = constant_at(machine, location[2]);
            store(machine, first, result);
        } else {
            let _block = machine.block(line!(), 3);
            let result_2 =
                evaluate_near_polynomial_segment(machine, item, segment, constant, first_at);
            store(machine, first.wrapping_add(first_j), result_2);
        }
    }
    let base = first.wrapping_sub((item.first as u32).wrapping_mul(all.stride));
    let step = all.step as i32;
    let end = item.first.wrapping_add(count as i32);
    at = first_at.wrapping_add(step);
    let full = count.wrapping_add(idle) >> all.step_log2;
    let loaded = at;
    let pairs_end =
        loaded.wrapping_add(((full.wrapping_sub(1u32) & 0xfffffffeu32) << all.step_log2) as i32);
    let loaded_2 = at;
    if loaded_2 < pairs_end {
        let _block = machine.block(line!(), 1);
        loop {
            let _block = machine.block(line!(), 23);
            let loaded_3 = at;
            let loaded_4 = at;
            let result_3 =
                evaluate_near_polynomial_segment(machine, item, segment, constant, loaded_4);
            store(
                machine,
                base.wrapping_add((loaded_3 as u32).wrapping_mul(all.stride)),
                result_3,
            );
            let loaded_5 = at;
            at = loaded_5.wrapping_add(step);
            let loaded_6 = at;
            let loaded_7 = at;
            let result_4 =
                evaluate_near_polynomial_segment(machine, item, segment, constant, loaded_7);
            store(
                machine,
                base.wrapping_add((loaded_6 as u32).wrapping_mul(all.stride)),
                result_4,
            );
            let loaded_8 = at;
            at = loaded_8.wrapping_add(step);
            let loaded_9 = at;
            if loaded_9 >= pairs_end {
                break;
            }
        }
        at = pairs_end;
    }
    let loaded_10 = at;
    if loaded_10 < end {
        loop {
            let _block = machine.block(line!(), 13);
            let loaded_11 = at;
            let loaded_12 = at;
            let result_5 =
                evaluate_near_polynomial_segment(machine, item, segment, constant, loaded_12);
            store(
                machine,
                base.wrapping_add((loaded_11 as u32).wrapping_mul(all.stride)),
                result_5,
            );
            let loaded_13 = at;
            at = loaded_13.wrapping_add(step);
            let loaded_14 = at;
            if loaded_14 >= end {
                break;
            }
        }
        return;
    } else {
        return;
    }
}

pub(crate) async fn main_of_together_5<M: Machine>(machine: &M) {
    let group = machine.ids().workgroup_id;
    let invocation = machine.ids().local_invocation_index;
    let mut item: SpreadRun<M::F> = Default::default();
    let mut first_j: u32 = Default::default();
    let mut iteration: u32 = 0u32;
    let mut rotation: [M::F; 4] = Default::default();
    let mut all_parts: [M::F; 3] = Default::default();
    let mut part: u32 = Default::default();
    let mut part_2: u32 = Default::default();
    let mut end_lane: u32 = Default::default();
    let mut part_3: u32 = Default::default();
    let _block = machine.block(line!(), 58);
    let all = machine.load::<Spread>(Global::Dispatch, 0);
    let lanes = 1u32 << all.lanes_log2;
    let first_index = group[0].wrapping_mul(SPREAD_WORKGROUP >> all.lanes_log2);
    if first_index >= all.item_count {
        return;
    }
    let result = item_at_spread_run(machine, all.first_item.wrapping_add(first_index));
    let iterations = result.iterations;
    let index = first_index.wrapping_add(invocation >> all.lanes_log2);
    if index < all.item_count {
        let _block = machine.block(line!(), 3);
        let result_2 = item_at_spread_run(machine, all.first_item.wrapping_add(index));
        item = result_2;
    }
    let first_repetition = group[2].wrapping_mul(all.layer_repetitions);
    let repetition = first_repetition.wrapping_add(invocation & all.track_mask);
    let is_there = repetition < all.repetitions;
    let loaded = item;
    let location = location_of(machine, loaded, repetition);
    let loaded_2 = item.count;
    let has_segment = is_there & (loaded_2 & IS_CONSTANT == 0u32);
    let segment =
        segment_at_polynomial_segment(machine, if has_segment { location[0] } else { 0u32 });
    let constant = constant_of_polynomial_segment(machine, segment);
    let loaded_3 = item;
    let count = sample_count(machine, loaded_3);
    let lane_count = if is_there { count } else { 0u32 };
    let tracks = all.repetitions.wrapping_sub(first_repetition);
    let used_lanes = if (all.track_mask != 0u32) & (tracks < lanes) {
        tracks
    } else {
        lanes
    };
    let lane = invocation & lanes.wrapping_sub(1u32);
    let run_values = invocation.wrapping_sub(lane).wrapping_mul(3u32);
    let lane_part = (lane & 0xfffffff8u32)
        .wrapping_mul(3u32)
        .wrapping_add(lane & 7u32);
    let first = location[1].wrapping_sub((invocation & all.track_mask).wrapping_mul(all.outputs));
    let first_part = first.wrapping_mul(3u32).wrapping_add(lane_part);
    let stride = all.stride.wrapping_mul(3u32);
    let fills_lines = (lanes >= LINE) & (used_lanes == lanes) & (count > all.sample_mask);
    let filling = if fills_lines {
        count.wrapping_sub(all.sample_mask)
    } else {
        0u32
    };
    let sample_lane = invocation & all.sample_mask;
    first_j = 0u32.wrapping_sub(first & all.line_mask);
    loop {
        let _block = machine.block(line!(), 21);
        let loaded_4 = iteration;
        let values = (loaded_4 & 1u32)
            .wrapping_mul(SPREAD_WORKGROUP)
            .wrapping_mul(3u32)
            .wrapping_add(run_values);
        let loaded_5 = first_j;
        let j = loaded_5.wrapping_add(sample_lane);
        if j < lane_count {
            let _block = machine.block(line!(), 13);
            rotation = <[M::F; 4]>::default();
            let loaded_6 = item.count;
            let loaded_7 = item.key;
            if (loaded_6 < NEEDS_CARE) & ((j != 0u32) | (loaded_7 == NO_KEY)) {
                let _block = machine.block(line!(), 6);
                let loaded_8 = item;
                let loaded_9 = item.first;
                let result_3 = evaluate_near_polynomial_segment(
                    machine,
                    loaded_8,
                    segment,
                    constant,
                    loaded_9.wrapping_add(j as i32),
                );
                rotation = result_3;
            } else {
                let _block = machine.block(line!(), 3);
                let loaded_10 = item;
                let result_4 =
                    sample_of_polynomial_segment(machine, loaded_10, segment, j, repetition);
                rotation = result_4;
            }
            let loaded_11 = rotation;
            let result_5 = parts_1(machine, loaded_11);
            all_parts = result_5;
            part = 0u32;
            loop {
                let _block = machine.block(line!(), 13);
                let loaded_12 = part;
                if !(loaded_12 < 3u32) {
                    break;
                }
                let loaded_13 = part;
                let loaded_14 = part;
                let loaded_15 = all_parts[loaded_14 as usize];
                machine.store::<M::F>(
                    Global::Tile,
                    values
                        .wrapping_add(lane.wrapping_mul(3u32))
                        .wrapping_add(loaded_13) as usize,
                    loaded_15,
                );
                let loaded_16 = part;
                part = loaded_16.wrapping_add(1u32);
            }
        }
        barrier().await;
        let loaded_17 = first_j;
        if loaded_17 < filling {
            let _block = machine.block(line!(), 5);
            let found = values.wrapping_add(lane_part);
            let loaded_18 = first_j;
            let stored = first_part.wrapping_add(loaded_18.wrapping_mul(stride));
            part_2 = 0u32;
            loop {
                let _block = machine.block(line!(), 14);
                let loaded_19 = part_2;
                if !(loaded_19 < 3u32) {
                    break;
                }
                let loaded_20 = part_2;
                let loaded_21 = part_2;
                let loaded_22 = machine.load::<M::F>(
                    Global::Tile,
                    found.wrapping_add(loaded_21.wrapping_mul(LINE)) as usize,
                );
                machine.store::<M::F>(
                    Global::Rotations,
                    stored.wrapping_add(loaded_20.wrapping_mul(LINE)) as usize,
                    loaded_22,
                );
                let loaded_23 = part_2;
                part_2 = loaded_23.wrapping_add(1u32);
            }
        } else {
            let _block = machine.block(line!(), 18);
            let loaded_24 = first_j;
            let loaded_25 = first_j;
            let first_lane = if (loaded_25 as i32) < 0i32 {
                0u32.wrapping_sub(loaded_24)
            } else {
                0u32
            };
            let loaded_26 = first_j;
            let last_j = loaded_26.wrapping_add(all.sample_mask);
            end_lane = used_lanes;
            if last_j >= count {
                let _block = machine.block(line!(), 11);
                let missing = if all.track_mask != 0u32 {
                    lanes
                } else {
                    last_j.wrapping_add(1u32).wrapping_sub(count)
                };
                let loaded_27 = end_lane;
                let loaded_28 = end_lane;
                let loaded_29 = end_lane;
                end_lane = loaded_27.wrapping_sub(if missing > loaded_29 {
                    loaded_28
                } else {
                    missing
                });
            }
            let loaded_30 = first_j;
            let stored_2 = first
                .wrapping_mul(3u32)
                .wrapping_add(loaded_30.wrapping_mul(stride));
            part_3 = first_lane.wrapping_mul(3u32).wrapping_add(lane);
            loop {
                let _block = machine.block(line!(), 14);
                let loaded_31 = part_3;
                let loaded_32 = end_lane;
                if !(loaded_31 < loaded_32.wrapping_mul(3u32)) {
                    break;
                }
                let loaded_33 = part_3;
                let loaded_34 = part_3;
                let loaded_35 =
                    machine.load::<M::F>(Global::Tile, values.wrapping_add(loaded_34) as usize);
                machine.store::<M::F>(
                    Global::Rotations,
                    stored_2.wrapping_add(loaded_33) as usize,
                    loaded_35,
                );
                let loaded_36 = part_3;
                part_3 = loaded_36.wrapping_add(lanes);
            }
        }
        let loaded_37 = first_j;
        first_j = loaded_37.wrapping_add(all.step);
        let loaded_38 = iteration;
        iteration = loaded_38.wrapping_add(1u32);
        let loaded_39 = iteration;
        if loaded_39 >= iterations {
            break;
        }
    }
}

pub(crate) async fn main_of_together_6<M: Machine>(machine: &M) {
    let group = machine.ids().workgroup_id;
    let invocation = machine.ids().local_invocation_index;
    let mut item: SpreadRun<M::F> = Default::default();
    let mut first_j: u32 = Default::default();
    let mut iteration: u32 = 0u32;
    let mut rotation: [M::F; 4] = Default::default();
    let mut all_parts: [M::F; 9] = Default::default();
    let mut part: u32 = Default::default();
    let mut part_2: u32 = Default::default();
    let mut end_lane: u32 = Default::default();
    let mut part_3: u32 = Default::default();
    let _block = machine.block(line!(), 58);
    let all = machine.load::<Spread>(Global::Dispatch, 0);
    let lanes = 1u32 << all.lanes_log2;
    let first_index = group[0].wrapping_mul(SPREAD_WORKGROUP >> all.lanes_log2);
    if first_index >= all.item_count {
        return;
    }
    let result = item_at_spread_run(machine, all.first_item.wrapping_add(first_index));
    let iterations = result.iterations;
    let index = first_index.wrapping_add(invocation >> all.lanes_log2);
    if index < all.item_count {
        let _block = machine.block(line!(), 3);
        let result_2 = item_at_spread_run(machine, all.first_item.wrapping_add(index));
        item = result_2;
    }
    let first_repetition = group[2].wrapping_mul(all.layer_repetitions);
    let repetition = first_repetition.wrapping_add(invocation & all.track_mask);
    let is_there = repetition < all.repetitions;
    let loaded = item;
    let location = location_of(machine, loaded, repetition);
    let loaded_2 = item.count;
    let has_segment = is_there & (loaded_2 & IS_CONSTANT == 0u32);
    let segment =
        segment_at_polynomial_segment(machine, if has_segment { location[0] } else { 0u32 });
    let constant = constant_of_polynomial_segment(machine, segment);
    let loaded_3 = item;
    let count = sample_count(machine, loaded_3);
    let lane_count = if is_there { count } else { 0u32 };
    let tracks = all.repetitions.wrapping_sub(first_repetition);
    let used_lanes = if (all.track_mask != 0u32) & (tracks < lanes) {
        tracks
    } else {
        lanes
    };
    let lane = invocation & lanes.wrapping_sub(1u32);
    let run_values = invocation.wrapping_sub(lane).wrapping_mul(9u32);
    let lane_part = (lane & 0xfffffff8u32)
        .wrapping_mul(9u32)
        .wrapping_add(lane & 7u32);
    let first = location[1].wrapping_sub((invocation & all.track_mask).wrapping_mul(all.outputs));
    let first_part = first.wrapping_mul(9u32).wrapping_add(lane_part);
    let stride = all.stride.wrapping_mul(9u32);
    let fills_lines = (lanes >= LINE) & (used_lanes == lanes) & (count > all.sample_mask);
    let filling = if fills_lines {
        count.wrapping_sub(all.sample_mask)
    } else {
        0u32
    };
    let sample_lane = invocation & all.sample_mask;
    first_j = 0u32.wrapping_sub(first & all.line_mask);
    loop {
        let _block = machine.block(line!(), 21);
        let loaded_4 = iteration;
        let values = (loaded_4 & 1u32)
            .wrapping_mul(SPREAD_WORKGROUP)
            .wrapping_mul(9u32)
            .wrapping_add(run_values);
        let loaded_5 = first_j;
        let j = loaded_5.wrapping_add(sample_lane);
        if j < lane_count {
            let _block = machine.block(line!(), 13);
            rotation = <[M::F; 4]>::default();
            let loaded_6 = item.count;
            let loaded_7 = item.key;
            if (loaded_6 < NEEDS_CARE) & ((j != 0u32) | (loaded_7 == NO_KEY)) {
                let _block = machine.block(line!(), 6);
                let loaded_8 = item;
                let loaded_9 = item.first;
                let result_3 = evaluate_near_polynomial_segment(
                    machine,
                    loaded_8,
                    segment,
                    constant,
                    loaded_9.wrapping_add(j as i32),
                );
                rotation = result_3;
            } else {
                let _block = machine.block(line!(), 3);
                let loaded_10 = item;
                let result_4 =
                    sample_of_polynomial_segment(machine, loaded_10, segment, j, repetition);
                rotation = result_4;
            }
            let loaded_11 = rotation;
            let result_5 = parts_3(machine, loaded_11);
            all_parts = result_5;
            part = 0u32;
            loop {
                let _block = machine.block(line!(), 13);
                let loaded_12 = part;
                if !(loaded_12 < 9u32) {
                    break;
                }
                let loaded_13 = part;
                let loaded_14 = part;
                let loaded_15 = all_parts[loaded_14 as usize];
                machine.store::<M::F>(
                    Global::Tile,
                    values
                        .wrapping_add(lane.wrapping_mul(9u32))
                        .wrapping_add(loaded_13) as usize,
                    loaded_15,
                );
                let loaded_16 = part;
                part = loaded_16.wrapping_add(1u32);
            }
        }
        barrier().await;
        let loaded_17 = first_j;
        if loaded_17 < filling {
            let _block = machine.block(line!(), 5);
            let found = values.wrapping_add(lane_part);
            let loaded_18 = first_j;
            let stored = first_part.wrapping_add(loaded_18.wrapping_mul(stride));
            part_2 = 0u32;
            loop {
                let _block = machine.block(line!(), 14);
                let loaded_19 = part_2;
                if !(loaded_19 < 9u32) {
                    break;
                }
                let loaded_20 = part_2;
                let loaded_21 = part_2;
                let loaded_22 = machine.load::<M::F>(
                    Global::Tile,
                    found.wrapping_add(loaded_21.wrapping_mul(LINE)) as usize,
                );
                machine.store::<M::F>(
                    Global::Rotations,
                    stored.wrapping_add(loaded_20.wrapping_mul(LINE)) as usize,
                    loaded_22,
                );
                let loaded_23 = part_2;
                part_2 = loaded_23.wrapping_add(1u32);
            }
        } else {
            let _block = machine.block(line!(), 18);
            let loaded_24 = first_j;
            let loaded_25 = first_j;
            let first_lane = if (loaded_25 as i32) < 0i32 {
                0u32.wrapping_sub(loaded_24)
            } else {
                0u32
            };
            let loaded_26 = first_j;
            let last_j = loaded_26.wrapping_add(all.sample_mask);
            end_lane = used_lanes;
            if last_j >= count {
                let _block = machine.block(line!(), 11);
                let missing = if all.track_mask != 0u32 {
                    lanes
                } else {
                    last_j.wrapping_add(1u32).wrapping_sub(count)
                };
                let loaded_27 = end_lane;
                let loaded_28 = end_lane;
                let loaded_29 = end_lane;
                end_lane = loaded_27.wrapping_sub(if missing > loaded_29 {
                    loaded_28
                } else {
                    missing
                });
            }
            let loaded_30 = first_j;
            let stored_2 = first
                .wrapping_mul(9u32)
                .wrapping_add(loaded_30.wrapping_mul(stride));
            part_3 = first_lane.wrapping_mul(9u32).wrapping_add(lane);
            loop {
                let _block = machine.block(line!(), 14);
                let loaded_31 = part_3;
                let loaded_32 = end_lane;
                if !(loaded_31 < loaded_32.wrapping_mul(9u32)) {
                    break;
                }
                let loaded_33 = part_3;
                let loaded_34 = part_3;
                let loaded_35 =
                    machine.load::<M::F>(Global::Tile, values.wrapping_add(loaded_34) as usize);
                machine.store::<M::F>(
                    Global::Rotations,
                    stored_2.wrapping_add(loaded_33) as usize,
                    loaded_35,
                );
                let loaded_36 = part_3;
                part_3 = loaded_36.wrapping_add(lanes);
            }
        }
        let loaded_37 = first_j;
        first_j = loaded_37.wrapping_add(all.step);
        let loaded_38 = iteration;
        iteration = loaded_38.wrapping_add(1u32);
        let loaded_39 = iteration;
        if loaded_39 >= iterations {
            break;
        }
    }
}

pub(crate) async fn main_of_together_7<M: Machine>(machine: &M) {
    let group = machine.ids().workgroup_id;
    let invocation = machine.ids().local_invocation_index;
    let mut item: SpreadRun<M::F> = Default::default();
    let mut first_j: u32 = Default::default();
    let mut iteration: u32 = 0u32;
    let mut rotation: [M::F; 4] = Default::default();
    let mut all_parts: [[M::F; 4]; 3] = Default::default();
    let mut part: u32 = Default::default();
    let mut part_2: u32 = Default::default();
    let mut end_lane: u32 = Default::default();
    let mut part_3: u32 = Default::default();
    let _block = machine.block(line!(), 58);
    let all = machine.load::<Spread>(Global::Dispatch, 0);
    let lanes = 1u32 << all.lanes_log2;
    let first_index = group[0].wrapping_mul(SPREAD_WORKGROUP >> all.lanes_log2);
    if first_index >= all.item_count {
        return;
    }
    let result = item_at_spread_run(machine, all.first_item.wrapping_add(first_index));
    let iterations = result.iterations;
    let index = first_index.wrapping_add(invocation >> all.lanes_log2);
    if index < all.item_count {
        let _block = machine.block(line!(), 3);
        let result_2 = item_at_spread_run(machine, all.first_item.wrapping_add(index));
        item = result_2;
    }
    let first_repetition = group[2].wrapping_mul(all.layer_repetitions);
    let repetition = first_repetition.wrapping_add(invocation & all.track_mask);
    let is_there = repetition < all.repetitions;
    let loaded = item;
    let location = location_of(machine, loaded, repetition);
    let loaded_2 = item.count;
    let has_segment = is_there & (loaded_2 & IS_CONSTANT == 0u32);
    let segment =
        segment_at_polynomial_segment(machine, if has_segment { location[0] } else { 0u32 });
    let constant = constant_of_polynomial_segment(machine, segment);
    let loaded_3 = item;
    let count = sample_count(machine, loaded_3);
    let lane_count = if is_there { count } else { 0u32 };
    let tracks = all.repetitions.wrapping_sub(first_repetition);
    let used_lanes = if (all.track_mask != 0u32) & (tracks < lanes) {
        tracks
    } else {
        lanes
    };
    let lane = invocation & lanes.wrapping_sub(1u32);
    let run_values = invocation.wrapping_sub(lane).wrapping_mul(3u32);
    let lane_part = (lane & 0xfffffff8u32)
        .wrapping_mul(3u32)
        .wrapping_add(lane & 7u32);
    let first = location[1].wrapping_sub((invocation & all.track_mask).wrapping_mul(all.outputs));
    let first_part = first.wrapping_mul(3u32).wrapping_add(lane_part);
    let stride = all.stride.wrapping_mul(3u32);
    let fills_lines = (lanes >= LINE) & (used_lanes == lanes) & (count > all.sample_mask);
    let filling = if fills_lines {
        count.wrapping_sub(all.sample_mask)
    } else {
        0u32
    };
    let sample_lane = invocation & all.sample_mask;
    first_j = 0u32.wrapping_sub(first & all.line_mask);
    loop {
        let _block = machine.block(line!(), 21);
        let loaded_4 = iteration;
        let values = (loaded_4 & 1u32)
            .wrapping_mul(SPREAD_WORKGROUP)
            .wrapping_mul(3u32)
            .wrapping_add(run_values);
        let loaded_5 = first_j;
        let j = loaded_5.wrapping_add(sample_lane);
        if j < lane_count {
            let _block = machine.block(line!(), 13);
            rotation = <[M::F; 4]>::default();
            let loaded_6 = item.count;
            let loaded_7 = item.key;
            if (loaded_6 < NEEDS_CARE) & ((j != 0u32) | (loaded_7 == NO_KEY)) {
                let _block = machine.block(line!(), 6);
                let loaded_8 = item;
                let loaded_9 = item.first;
                let result_3 = evaluate_near_polynomial_segment(
                    machine,
                    loaded_8,
                    segment,
                    constant,
                    loaded_9.wrapping_add(j as i32),
                );
                rotation = result_3;
            } else {
                let _block = machine.block(line!(), 3);
                let loaded_10 = item;
                let result_4 =
                    sample_of_polynomial_segment(machine, loaded_10, segment, j, repetition);
                rotation = result_4;
            }
            let loaded_11 = rotation;
            let result_5 = parts_4(machine, loaded_11);
            all_parts = result_5;
            part = 0u32;
            loop {
                let _block = machine.block(line!(), 13);
                let loaded_12 = part;
                if !(loaded_12 < 3u32) {
                    break;
                }
                let loaded_13 = part;
                let loaded_14 = part;
                let loaded_15 = all_parts[loaded_14 as usize];
                machine.store::<[M::F; 4]>(
                    Global::Tile,
                    4 * (values
                        .wrapping_add(lane.wrapping_mul(3u32))
                        .wrapping_add(loaded_13) as usize),
                    loaded_15,
                );
                let loaded_16 = part;
                part = loaded_16.wrapping_add(1u32);
            }
        }
        barrier().await;
        let loaded_17 = first_j;
        if loaded_17 < filling {
            let _block = machine.block(line!(), 5);
            let found = values.wrapping_add(lane_part);
            let loaded_18 = first_j;
            let stored = first_part.wrapping_add(loaded_18.wrapping_mul(stride));
            part_2 = 0u32;
            loop {
                let _block = machine.block(line!(), 14);
                let loaded_19 = part_2;
                if !(loaded_19 < 3u32) {
                    break;
                }
                let loaded_20 = part_2;
                let loaded_21 = part_2;
                let loaded_22 = machine.load::<[M::F; 4]>(
                    Global::Tile,
                    4 * (found.wrapping_add(loaded_21.wrapping_mul(LINE)) as usize),
                );
                machine.store::<[M::F; 4]>(
                    Global::Rotations,
                    4 * (stored.wrapping_add(loaded_20.wrapping_mul(LINE)) as usize),
                    loaded_22,
                );
                let loaded_23 = part_2;
                part_2 = loaded_23.wrapping_add(1u32);
            }
        } else {
            let _block = machine.block(line!(), 18);
            let loaded_24 = first_j;
            let loaded_25 = first_j;
            let first_lane = if (loaded_25 as i32) < 0i32 {
                0u32.wrapping_sub(loaded_24)
            } else {
                0u32
            };
            let loaded_26 = first_j;
            let last_j = loaded_26.wrapping_add(all.sample_mask);
            end_lane = used_lanes;
            if last_j >= count {
                let _block = machine.block(line!(), 11);
                let missing = if all.track_mask != 0u32 {
                    lanes
                } else {
                    last_j.wrapping_add(1u32).wrapping_sub(count)
                };
                let loaded_27 = end_lane;
                let loaded_28 = end_lane;
                let loaded_29 = end_lane;
                end_lane = loaded_27.wrapping_sub(if missing > loaded_29 {
                    loaded_28
                } else {
                    missing
                });
            }
            let loaded_30 = first_j;
            let stored_2 = first
                .wrapping_mul(3u32)
                .wrapping_add(loaded_30.wrapping_mul(stride));
            part_3 = first_lane.wrapping_mul(3u32).wrapping_add(lane);
            loop {
                let _block = machine.block(line!(), 14);
                let loaded_31 = part_3;
                let loaded_32 = end_lane;
                if !(loaded_31 < loaded_32.wrapping_mul(3u32)) {
                    break;
                }
                let loaded_33 = part_3;
                let loaded_34 = part_3;
                let loaded_35 = machine
                    .load::<[M::F; 4]>(Global::Tile, 4 * (values.wrapping_add(loaded_34) as usize));
                machine.store::<[M::F; 4]>(
                    Global::Rotations,
                    4 * (stored_2.wrapping_add(loaded_33) as usize),
                    loaded_35,
                );
                let loaded_36 = part_3;
                part_3 = loaded_36.wrapping_add(lanes);
            }
        }
        let loaded_37 = first_j;
        first_j = loaded_37.wrapping_add(all.step);
        let loaded_38 = iteration;
        iteration = loaded_38.wrapping_add(1u32);
        let loaded_39 = iteration;
        if loaded_39 >= iterations {
            break;
        }
    }
}

pub(crate) async fn main_of_together_8<M: Machine>(machine: &M) {
    let group = machine.ids().workgroup_id;
    let invocation = machine.ids().local_invocation_index;
    let mut item: SpreadRun<M::F> = Default::default();
    let mut first_j: u32 = Default::default();
    let mut iteration: u32 = 0u32;
    let mut rotation: [M::F; 4] = Default::default();
    let mut all_parts: [M::F; 6] = Default::default();
    let mut part: u32 = Default::default();
    let mut part_2: u32 = Default::default();
    let mut end_lane: u32 = Default::default();
    let mut part_3: u32 = Default::default();
    let _block = machine.block(line!(), 58);
    let all = machine.load::<Spread>(Global::Dispatch, 0);
    let lanes = 1u32 << all.lanes_log2;
    let first_index = group[0].wrapping_mul(SPREAD_WORKGROUP >> all.lanes_log2);
    if first_index >= all.item_count {
        return;
    }
    let result = item_at_spread_run(machine, all.first_item.wrapping_add(first_index));
    let iterations = result.iterations;
    let index = first_index.wrapping_add(invocation >> all.lanes_log2);
    if index < all.item_count {
        let _block = machine.block(line!(), 3);
        let result_2 = item_at_spread_run(machine, all.first_item.wrapping_add(index));
        item = result_2;
    }
    let first_repetition = group[2].wrapping_mul(all.layer_repetitions);
    let repetition = first_repetition.wrapping_add(invocation & all.track_mask);
    let is_there = repetition < all.repetitions;
    let loaded = item;
    let location = location_of(machine, loaded, repetition);
    let loaded_2 = item.count;
    let has_segment = is_there & (loaded_2 & IS_CONSTANT == 0u32);
    let segment =
        segment_at_polynomial_segment(machine, if has_segment { location[0] } else { 0u32 });
    let constant = constant_of_polynomial_segment(machine, segment);
    let loaded_3 = item;
    let count = sample_count(machine, loaded_3);
    let lane_count = if is_there { count } else { 0u32 };
    let tracks = all.repetitions.wrapping_sub(first_repetition);
    let used_lanes = if (all.track_mask != 0u32) & (tracks < lanes) {
        tracks
    } else {
        lanes
    };
    let lane = invocation & lanes.wrapping_sub(1u32);
    let run_values = invocation.wrapping_sub(lane).wrapping_mul(6u32);
    let lane_part = (lane & 0xfffffff8u32)
        .wrapping_mul(6u32)
        .wrapping_add(lane & 7u32);
    let first = location[1].wrapping_sub((invocation & all.track_mask).wrapping_mul(all.outputs));
    let first_part = first.wrapping_mul(6u32).wrapping_add(lane_part);
    let stride = all.stride.wrapping_mul(6u32);
    let fills_lines = (lanes >= LINE) & (used_lanes == lanes) & (count > all.sample_mask);
    let filling = if fills_lines {
        count.wrapping_sub(all.sample_mask)
    } else {
        0u32
    };
    let sample_lane = invocation & all.sample_mask;
    first_j = 0u32.wrapping_sub(first & all.line_mask);
    loop {
        let _block = machine.block(line!(), 21);
        let loaded_4 = iteration;
        let values = (loaded_4 & 1u32)
            .wrapping_mul(SPREAD_WORKGROUP)
            .wrapping_mul(6u32)
            .wrapping_add(run_values);
        let loaded_5 = first_j;
        let j = loaded_5.wrapping_add(sample_lane);
        if j < lane_count {
            let _block = machine.block(line!(), 13);
            rotation = <[M::F; 4]>::default();
            let loaded_6 = item.count;
            let loaded_7 = item.key;
            if (loaded_6 < NEEDS_CARE) & ((j != 0u32) | (loaded_7 == NO_KEY)) {
                let _block = machine.block(line!(), 6);
                let loaded_8 = item;
                let loaded_9 = item.first;
                let result_3 = evaluate_near_polynomial_segment(
                    machine,
                    loaded_8,
                    segment,
                    constant,
                    loaded_9.wrapping_add(j as i32),
                );
                rotation = result_3;
            } else {
                let _block = machine.block(line!(), 3);
                let loaded_10 = item;
                let result_4 =
                    sample_of_polynomial_segment(machine, loaded_10, segment, j, repetition);
                rotation = result_4;
            }
            let loaded_11 = rotation;
            let result_5 = parts_2(machine, loaded_11);
            all_parts = result_5;
            part = 0u32;
            loop {
                let _block = machine.block(line!(), 13);
                let loaded_12 = part;
                if !(loaded_12 < 6u32) {
                    break;
                }
                let loaded_13 = part;
                let loaded_14 = part;
                let loaded_15 = all_parts[loaded_14 as usize];
                machine.store::<M::F>(
                    Global::Tile,
                    values
                        .wrapping_add(lane.wrapping_mul(6u32))
                        .wrapping_add(loaded_13) as usize,
                    loaded_15,
                );
                let loaded_16 = part;
                part = loaded_16.wrapping_add(1u32);
            }
        }
        barrier().await;
        let loaded_17 = first_j;
        if loaded_17 < filling {
            let _block = machine.block(line!(), 5);
            let found = values.wrapping_add(lane_part);
            let loaded_18 = first_j;
            let stored = first_part.wrapping_add(loaded_18.wrapping_mul(stride));
            part_2 = 0u32;
            loop {
                let _block = machine.block(line!(), 14);
                let loaded_19 = part_2;
                if !(loaded_19 < 6u32) {
                    break;
                }
                let loaded_20 = part_2;
                let loaded_21 = part_2;
                let loaded_22 = machine.load::<M::F>(
                    Global::Tile,
                    found.wrapping_add(loaded_21.wrapping_mul(LINE)) as usize,
                );
                machine.store::<M::F>(
                    Global::Rotations,
                    stored.wrapping_add(loaded_20.wrapping_mul(LINE)) as usize,
                    loaded_22,
                );
                let loaded_23 = part_2;
                part_2 = loaded_23.wrapping_add(1u32);
            }
        } else {
            let _block = machine.block(line!(), 18);
            let loaded_24 = first_j;
            let loaded_25 = first_j;
            let first_lane = if (loaded_25 as i32) < 0i32 {
                0u32.wrapping_sub(loaded_24)
            } else {
                0u32
            };
            let loaded_26 = first_j;
            let last_j = loaded_26.wrapping_add(all.sample_mask);
            end_lane = used_lanes;
            if last_j >= count {
                let _block = machine.block(line!(), 11);
                let missing = if all.track_mask != 0u32 {
                    lanes
                } else {
                    last_j.wrapping_add(1u32).wrapping_sub(count)
                };
                let loaded_27 = end_lane;
                let loaded_28 = end_lane;
                let loaded_29 = end_lane;
                end_lane = loaded_27.wrapping_sub(if missing > loaded_29 {
                    loaded_28
                } else {
                    missing
                });
            }
            let loaded_30 = first_j;
            let stored_2 = first
                .wrapping_mul(6u32)
                .wrapping_add(loaded_30.wrapping_mul(stride));
            part_3 = first_lane.wrapping_mul(6u32).wrapping_add(lane);
            loop {
                let _block = machine.block(line!(), 14);
                let loaded_31 = part_3;
                let loaded_32 = end_lane;
                if !(loaded_31 < loaded_32.wrapping_mul(6u32)) {
                    break;
                }
                let loaded_33 = part_3;
                let loaded_34 = part_3;
                let loaded_35 =
                    machine.load::<M::F>(Global::Tile, values.wrapping_add(loaded_34) as usize);
                machine.store::<M::F>(
                    Global::Rotations,
                    stored_2.wrapping_add(loaded_33) as usize,
                    loaded_35,
                );
                let loaded_36 = part_3;
                part_3 = loaded_36.wrapping_add(lanes);
            }
        }
        let loaded_37 = first_j;
        first_j = loaded_37.wrapping_add(all.step);
        let loaded_38 = iteration;
        iteration = loaded_38.wrapping_add(1u32);
        let loaded_39 = iteration;
        if loaded_39 >= iterations {
            break;
        }
    }
}

pub(crate) async fn main_of_from_keys<M: Machine>(machine: &M) {
    let invocation = machine.ids().global_invocation_id;
    let mut key: u32 = Default::default();
    let mut output_index: u32 = Default::default();
    let mut j: u32 = 0u32;
    let _block = machine.block(line!(), 33);
    let loaded = machine.load::<u32>(Global::Rows, 3);
    let row = invocation[1].wrapping_mul(loaded);
    let loaded_2 = machine.load::<u32>(Global::Rows, 0);
    let loaded_3 = machine.load::<u32>(Global::Rows, 4);
    let sample_index = invocation[0].wrapping_sub(row.wrapping_mul(loaded_2) & loaded_3);
    let loaded_4 = machine.load::<u32>(Global::Rows, 0);
    if sample_index >= loaded_4 {
        return;
    }
    let sample = sample_at_key_sample(machine, sample_index);
    let is_key = sample.key & IS_KEY != 0u32;
    let first = sample.key & 0x7fffffffu32;
    let next = if is_key { 0u32 } else { 1u32 };
    let all_rows = hoisted_arcs_hoisted(machine, first, first.wrapping_add(next), sample.parameter);
    let loaded_5 = machine.load::<u32>(Global::Rows, 2);
    let loaded_6 = machine.load::<u32>(Global::Rows, 3);
    let is_last = loaded_5 < row.wrapping_add(loaded_6);
    let loaded_7 = machine.load::<u32>(Global::Rows, 3);
    let loaded_8 = machine.load::<u32>(Global::Rows, 2);
    let count = if is_last {
        loaded_8.wrapping_sub(row)
    } else {
        loaded_7
    };
    let keys = machine.load::<u32>(Global::Rows, 1);
    let samples = machine.load::<u32>(Global::Rows, 0);
    key = row.wrapping_mul(keys).wrapping_add(first);
    output_index = row.wrapping_mul(samples).wrapping_add(sample_index);
    loop {
        let _block = machine.block(line!(), 24);
        let loaded_9 = j;
        if !(loaded_9 < count) {
            break;
        }
        let loaded_10 = key;
        let stored = key_at(machine, loaded_10);
        let loaded_11 = key;
        let result = continued(machine, stored);
        let loaded_12 = key;
        let result_2 = rotation_between_arcs_hoisted(
            machine,
            loaded_11,
            result,
            loaded_12.wrapping_add(next),
            all_rows,
        );
        let interpolated = canonical(machine, result_2);
        let loaded_13 = output_index;
        let result_3 = as_stored(machine, stored);
        store(
            machine,
            loaded_13,
            if is_key { result_3 } else { interpolated },
        );
        let loaded_14 = key;
        key = loaded_14.wrapping_add(keys);
        let loaded_15 = output_index;
        output_index = loaded_15.wrapping_add(samples);
        let loaded_16 = j;
        j = loaded_16.wrapping_add(1u32);
    }
}

pub(crate) async fn main_of_from_keys_2<M: Machine>(machine: &M) {
    let invocation = machine.ids().global_invocation_id;
    let mut key: u32 = Default::default();
    let mut output_index: u32 = Default::default();
    let mut j: u32 = 0u32;
    let _block = machine.block(line!(), 33);
    let loaded = machine.load::<u32>(Global::Rows, 3);
    let row = invocation[1].wrapping_mul(loaded);
    let loaded_2 = machine.load::<u32>(Global::Rows, 0);
    let loaded_3 = machine.load::<u32>(Global::Rows, 4);
    let sample_index = invocation[0].wrapping_sub(row.wrapping_mul(loaded_2) & loaded_3);
    let loaded_4 = machine.load::<u32>(Global::Rows, 0);
    if sample_index >= loaded_4 {
        return;
    }
    let sample = sample_at_key_sample(machine, sample_index);
    let is_key = sample.key & IS_KEY != 0u32;
    let first = sample.key & 0x7fffffffu32;
    let next = if is_key { 0u32 } else { 1u32 };
    let all_rows =
        hoisted_two_keys_hoisted(machine, first, first.wrapping_add(next), sample.parameter);
    let loaded_5 = machine.load::<u32>(Global::Rows, 2);
    let loaded_6 = machine.load::<u32>(Global::Rows, 3);
    let is_last = loaded_5 < row.wrapping_add(loaded_6);
    let loaded_7 = machine.load::<u32>(Global::Rows, 3);
    let loaded_8 = machine.load::<u32>(Global::Rows, 2);
    let count = if is_last {
        loaded_8.wrapping_sub(row)
    } else {
        loaded_7
    };
    let keys = machine.load::<u32>(Global::Rows, 1);
    let samples = machine.load::<u32>(Global::Rows, 0);
    key = row.wrapping_mul(keys).wrapping_add(first);
    output_index = row.wrapping_mul(samples).wrapping_add(sample_index);
    loop {
        let _block = machine.block(line!(), 24);
        let loaded_9 = j;
        if !(loaded_9 < count) {
            break;
        }
        let loaded_10 = key;
        let stored = key_at(machine, loaded_10);
        let loaded_11 = key;
        let result = continued(machine, stored);
        let loaded_12 = key;
        let result_2 = rotation_between_two_keys_hoisted(
            machine,
            loaded_11,
            result,
            loaded_12.wrapping_add(next),
            all_rows,
        );
        let interpolated = canonical(machine, result_2);
        let loaded_13 = output_index;
        let result_3 = as_stored(machine, stored);
        store(
            machine,
            loaded_13,
            if is_key { result_3 } else { interpolated },
        );
        let loaded_14 = key;
        key = loaded_14.wrapping_add(keys);
        let loaded_15 = output_index;
        output_index = loaded_15.wrapping_add(samples);
        let loaded_16 = j;
        j = loaded_16.wrapping_add(1u32);
    }
}

pub(crate) async fn main_of_from_keys_3<M: Machine>(machine: &M) {
    let invocation = machine.ids().global_invocation_id;
    let mut key: u32 = Default::default();
    let mut output_index: u32 = Default::default();
    let mut j: u32 = 0u32;
    let _block = machine.block(line!(), 33);
    let loaded = machine.load::<u32>(Global::Rows, 3);
    let row = invocation[1].wrapping_mul(loaded);
    let loaded_2 = machine.load::<u32>(Global::Rows, 0);
    let loaded_3 = machine.load::<u32>(Global::Rows, 4);
    let sample_index = invocation[0].wrapping_sub(row.wrapping_mul(loaded_2) & loaded_3);
    let loaded_4 = machine.load::<u32>(Global::Rows, 0);
    if sample_index >= loaded_4 {
        return;
    }
    let sample = sample_at_key_sample(machine, sample_index);
    let is_key = sample.key & IS_KEY != 0u32;
    let first = sample.key & 0x7fffffffu32;
    let next = if is_key { 0u32 } else { 1u32 };
    let all_rows =
        hoisted_cubics_hoisted(machine, first, first.wrapping_add(next), sample.parameter);
    let loaded_5 = machine.load::<u32>(Global::Rows, 2);
    let loaded_6 = machine.load::<u32>(Global::Rows, 3);
    let is_last = loaded_5 < row.wrapping_add(loaded_6);
    let loaded_7 = machine.load::<u32>(Global::Rows, 3);
    let loaded_8 = machine.load::<u32>(Global::Rows, 2);
    let count = if is_last {
        loaded_8.wrapping_sub(row)
    } else {
        loaded_7
    };
    let keys = machine.load::<u32>(Global::Rows, 1);
    let samples = machine.load::<u32>(Global::Rows, 0);
    key = row.wrapping_mul(keys).wrapping_add(first);
    output_index = row.wrapping_mul(samples).wrapping_add(sample_index);
    loop {
        let _block = machine.block(line!(), 24);
        let loaded_9 = j;
        if !(loaded_9 < count) {
            break;
        }
        let loaded_10 = key;
        let stored = key_at(machine, loaded_10);
        let loaded_11 = key;
        let result = continued(machine, stored);
        let loaded_12 = key;
        let result_2 = rotation_between_cubics_hoisted(
            machine,
            loaded_11,
            result,
            loaded_12.wrapping_add(next),
            all_rows,
        );
        let interpolated = canonical(machine, result_2);
        let loaded_13 = output_index;
        let result_3 = as_stored(machine, stored);
        store(
            machine,
            loaded_13,
            if is_key { result_3 } else { interpolated },
        );
        let loaded_14 = key;
        key = loaded_14.wrapping_add(keys);
        let loaded_15 = output_index;
        output_index = loaded_15.wrapping_add(samples);
        let loaded_16 = j;
        j = loaded_16.wrapping_add(1u32);
    }
}

pub(crate) async fn main_of_poses<M: Machine>(machine: &M) {
    let invocation = machine.ids().global_invocation_id;
    let groups = machine.ids().num_workgroups;
    let _block = machine.block(line!(), 6);
    let index = invocation[1]
        .wrapping_mul(groups[0].wrapping_mul(POSE_WORKGROUP))
        .wrapping_add(invocation[0]);
    let loaded = machine.load::<u32>(Global::Dispatch, 0);
    if index < loaded {
        let _block = machine.block(line!(), 1);
        pose(machine, index);
        return;
    } else {
        return;
    }
}

pub(crate) async fn main_of_crowd<M: Machine>(machine: &M) {
    let invocation = machine.ids().global_invocation_id;
    let groups = machine.ids().num_workgroups;
    let _block = machine.block(line!(), 6);
    let index = invocation[1]
        .wrapping_mul(groups[0].wrapping_mul(CROWD_WORKGROUP))
        .wrapping_add(invocation[0]);
    let loaded = machine.load::<u32>(Global::Dispatch, 0);
    if index < loaded {
        let _block = machine.block(line!(), 1);
        crowd_work(machine, index);
        return;
    } else {
        return;
    }
}

pub(crate) async fn main_of_walk_all<M: Machine>(machine: &M) {
    let group = machine.ids().workgroup_id;
    let groups = machine.ids().num_workgroups;
    let lane = machine.ids().local_invocation_index;
    let mut row: u32 = Default::default();
    let mut level: u32 = 0u32;
    let mut link: u32 = Default::default();
    let mut row_2: u32 = Default::default();
    let _block = machine.block(line!(), 9);
    let instance = group[1].wrapping_mul(groups[0]).wrapping_add(group[0]);
    let loaded = machine.load::<u32>(Global::Dispatch, 0);
    if instance >= loaded {
        return;
    }
    let loaded_2 = machine.load::<u32>(Global::Dispatch, 2);
    let count = loaded_2.wrapping_mul(3u32);
    row = lane;
    loop {
        let _block = machine.block(line!(), 12);
        let loaded_3 = row;
        if !(loaded_3 < count) {
            break;
        }
        let loaded_4 = row;
        let loaded_5 = row;
        let loaded_6 = machine.load::<[M::F; 4]>(
            Global::Matrices,
            4 * (instance.wrapping_mul(count).wrapping_add(loaded_5) as usize),
        );
        machine.store::<[M::F; 4]>(Global::Rows, 4 * (loaded_4 as usize), loaded_6);
        let loaded_7 = row;
        row = loaded_7.wrapping_add(CROWD_WORKGROUP);
    }
    barrier().await;
    loop {
        let _block = machine.block(line!(), 13);
        let loaded_8 = level;
        let loaded_9 = machine.load::<u32>(Global::Dispatch, 3);
        if !(loaded_8 < loaded_9) {
            break;
        }
        let loaded_10 = machine.load::<u32>(Global::Dispatch, 5);
        let loaded_11 = level;
        let bounds = machine.load::<CrowdLink>(
            Global::Links,
            2 * (loaded_10.wrapping_add(loaded_11) as usize),
        );
        link = bounds.joint.wrapping_add(lane);
        loop {
            let _block = machine.block(line!(), 30);
            let loaded_12 = link;
            if !(loaded_12 < bounds.parent) {
                break;
            }
            let loaded_13 = link;
            let loaded_14 = machine.load::<u32>(Global::Links, 2 * (loaded_13 as usize) + 1);
            let parent = loaded_14.wrapping_mul(3u32);
            let loaded_15 = link;
            let loaded_16 = machine.load::<u32>(Global::Links, 2 * (loaded_15 as usize));
            let joint = loaded_16.wrapping_mul(3u32);
            let first = machine.load::<[M::F; 4]>(Global::Rows, 4 * (joint as usize));
            let second =
                machine.load::<[M::F; 4]>(Global::Rows, 4 * (joint.wrapping_add(1u32) as usize));
            let third =
                machine.load::<[M::F; 4]>(Global::Rows, 4 * (joint.wrapping_add(2u32) as usize));
            let loaded_17 = machine.load::<[M::F; 4]>(Global::Rows, 4 * (parent as usize));
            let result = row_product(machine, loaded_17, first, second, third);
            machine.store::<[M::F; 4]>(Global::Rows, 4 * (joint as usize), result);
            let loaded_18 =
                machine.load::<[M::F; 4]>(Global::Rows, 4 * (parent.wrapping_add(1u32) as usize));
            let result_2 = row_product(machine, loaded_18, first, second, third);
            machine.store::<[M::F; 4]>(
                Global::Rows,
                4 * (joint.wrapping_add(1u32) as usize),
                result_2,
            );
            let loaded_19 =
                machine.load::<[M::F; 4]>(Global::Rows, 4 * (parent.wrapping_add(2u32) as usize));
            let result_3 = row_product(machine, loaded_19, first, second, third);
            machine.store::<[M::F; 4]>(
                Global::Rows,
                4 * (joint.wrapping_add(2u32) as usize),
                result_3,
            );
            let loaded_20 = link;
            link = loaded_20.wrapping_add(CROWD_WORKGROUP);
        }
        barrier().await;
        let loaded_21 = level;
        level = loaded_21.wrapping_add(1u32);
    }
    row_2 = lane;
    loop {
        let _block = machine.block(line!(), 12);
        let loaded_22 = row_2;
        if !(loaded_22 < count) {
            break;
        }
        let loaded_23 = row_2;
        let loaded_24 = row_2;
        let loaded_25 = machine.load::<[M::F; 4]>(Global::Rows, 4 * (loaded_24 as usize));
        machine.store::<[M::F; 4]>(
            Global::Matrices,
            4 * (instance.wrapping_mul(count).wrapping_add(loaded_23) as usize),
            loaded_25,
        );
        let loaded_26 = row_2;
        row_2 = loaded_26.wrapping_add(CROWD_WORKGROUP);
    }
}

pub(crate) async fn main_of_whole_rotations<M: Machine>(machine: &M) {
    let group = machine.ids().workgroup_id;
    let groups = machine.ids().num_workgroups;
    let lane = machine.ids().local_invocation_index;
    let mut next: u32 = Default::default();
    let _block = machine.block(line!(), 15);
    let loaded = machine.load::<u32>(Global::Dispatch, 10);
    let first = group[1]
        .wrapping_mul(groups[0])
        .wrapping_add(group[0])
        .wrapping_mul(loaded);
    let loaded_2 = machine.load::<u32>(Global::Dispatch, 0);
    if first >= loaded_2 {
        return;
    }
    let instances = instances_from(machine, first);
    find_positions(machine, instances, lane);
    barrier().await;
    let joints = machine.load::<u32>(Global::Dispatch, 2);
    let first_vector = first.wrapping_mul(joints);
    let idle = before_in_line(machine, first_vector);
    let end = idle.wrapping_add(instances.wrapping_mul(joints));
    next = lane;
    loop {
        let _block = machine.block(line!(), 9);
        let loaded_3 = next;
        if !(loaded_3 < end) {
            break;
        }
        let loaded_4 = next;
        if loaded_4 >= idle {
            let _block = machine.block(line!(), 8);
            let loaded_5 = next;
            let index = loaded_5.wrapping_sub(idle);
            let instance = instance_of(machine, index);
            let result = layered(
                machine,
                instance,
                index.wrapping_sub(instance.wrapping_mul(joints)),
                ROTATION,
            );
            finish_1(machine, first_vector.wrapping_add(index), result);
        }
        let loaded_6 = next;
        next = loaded_6.wrapping_add(CROWD_WORKGROUP);
    }
}

pub(crate) async fn main_of_whole_matrices<M: Machine>(machine: &M) {
    let group = machine.ids().workgroup_id;
    let groups = machine.ids().num_workgroups;
    let lane = machine.ids().local_invocation_index;
    let mut matrix: u32 = Default::default();
    let mut level: u32 = 0u32;
    let mut index: u32 = Default::default();
    let mut next: u32 = Default::default();
    let mut next_2: u32 = Default::default();
    let _block = machine.block(line!(), 26);
    let loaded = machine.load::<u32>(Global::Dispatch, 10);
    let first = group[1]
        .wrapping_mul(groups[0])
        .wrapping_add(group[0])
        .wrapping_mul(loaded);
    let loaded_2 = machine.load::<u32>(Global::Dispatch, 0);
    if first >= loaded_2 {
        return;
    }
    let instances = instances_from(machine, first);
    find_positions(machine, instances, lane);
    barrier().await;
    let joints = machine.load::<u32>(Global::Dispatch, 2);
    let matrices = instances.wrapping_mul(joints);
    matrix = lane;
    loop {
        let _block = machine.block(line!(), 12);
        let loaded_3 = matrix;
        if !(loaded_3 < matrices) {
            break;
        }
        let loaded_4 = matrix;
        let instance = instance_of(machine, loaded_4);
        let loaded_5 = matrix;
        transform_joint(
            machine,
            instance,
            loaded_5.wrapping_sub(instance.wrapping_mul(joints)),
        );
        let loaded_6 = matrix;
        matrix = loaded_6.wrapping_add(CROWD_WORKGROUP);
    }
    barrier().await;
    loop {
        let _block = machine.block(line!(), 18);
        let loaded_7 = level;
        let loaded_8 = machine.load::<u32>(Global::Dispatch, 12);
        if !(loaded_7 < loaded_8) {
            break;
        }
        let loaded_9 = machine.load::<u32>(Global::Dispatch, 5);
        let loaded_10 = level;
        let bounds = machine.load::<CrowdLink>(
            Global::Links,
            2 * (loaded_9.wrapping_add(loaded_10) as usize),
        );
        let shift = power_from(machine, bounds.parent.wrapping_sub(bounds.joint));
        let all = instances << shift;
        index = lane;
        let loaded_11 = index;
        if loaded_11 < all {
            loop {
                let _block = machine.block(line!(), 14);
                let loaded_12 = index;
                let instance_2 = loaded_12 >> shift;
                let loaded_13 = index;
                let link = bounds
                    .joint
                    .wrapping_add(loaded_13.wrapping_sub(instance_2 << shift));
                if link < bounds.parent {
                    let _block = machine.block(line!(), 2);
                    let loaded_14 = machine.load::<CrowdLink>(Global::Links, 2 * (link as usize));
                    walk(machine, instance_2, loaded_14);
                }
                let loaded_15 = index;
                index = loaded_15.wrapping_add(CROWD_WORKGROUP);
                let loaded_16 = index;
                if loaded_16 >= all {
                    break;
                }
            }
        }
        barrier().await;
        let loaded_17 = level;
        level = loaded_17.wrapping_add(1u32);
    }
    let first_vector = 3u32.wrapping_mul(first).wrapping_mul(joints);
    let count = 3u32.wrapping_mul(matrices);
    let result = before_in_line(machine, first_vector);
    let row = lane.wrapping_sub(result);
    let loaded_18 = machine.load::<u32>(Global::Dispatch, 13);
    let loaded_19 = machine.load::<u32>(Global::Dispatch, 14);
    if loaded_18 | loaded_19 == 0u32 {
        let _block = machine.block(line!(), 4);
        if row < count {
            let _block = machine.block(line!(), 3);
            let loaded_20 = machine.load::<[M::F; 4]>(Global::Rows, 4 * (row as usize));
            machine.store::<[M::F; 4]>(
                Global::Values,
                4 * (first_vector.wrapping_add(row) as usize),
                loaded_20,
            );
        }
        next = row.wrapping_add(CROWD_WORKGROUP);
        loop {
            let _block = machine.block(line!(), 11);
            let loaded_21 = next;
            if !(loaded_21 < count) {
                break;
            }
            let loaded_22 = next;
            let loaded_23 = next;
            let loaded_24 = machine.load::<[M::F; 4]>(Global::Rows, 4 * (loaded_23 as usize));
            machine.store::<[M::F; 4]>(
                Global::Values,
                4 * (first_vector.wrapping_add(loaded_22) as usize),
                loaded_24,
            );
            let loaded_25 = next;
            next = loaded_25.wrapping_add(CROWD_WORKGROUP);
        }
        return;
    }
    if row < count {
        let _block = machine.block(line!(), 3);
        let result_2 = row_at(machine, row);
        finish_1(machine, first_vector.wrapping_add(row), result_2);
    }
    next_2 = row.wrapping_add(CROWD_WORKGROUP);
    loop {
        let _block = machine.block(line!(), 11);
        let loaded_26 = next_2;
        if !(loaded_26 < count) {
            break;
        }
        let loaded_27 = next_2;
        let loaded_28 = next_2;
        let result_3 = row_at(machine, loaded_28);
        finish_1(machine, first_vector.wrapping_add(loaded_27), result_3);
        let loaded_29 = next_2;
        next_2 = loaded_29.wrapping_add(CROWD_WORKGROUP);
    }
}

pub(crate) async fn main_of_subgroup_rotations<M: Machine>(machine: &M) {
    let group = machine.ids().workgroup_id;
    let groups = machine.ids().num_workgroups;
    let subgroup = machine.ids().subgroup_id;
    let subgroups = machine.ids().num_subgroups;
    let lane = machine.ids().subgroup_invocation_id;
    let mut found: u32 = 0u32;
    let mut count: u32 = Default::default();
    let mut index: u32 = Default::default();
    let _block = machine.block(line!(), 85);
    let loaded = machine.load::<u32>(Global::Dispatch, 5);
    let first = group[1]
        .wrapping_mul(groups[0])
        .wrapping_add(group[0])
        .wrapping_mul(subgroups)
        .wrapping_add(subgroup)
        << loaded;
    let loaded_2 = machine.load::<u32>(Global::Dispatch, 0);
    if first >= loaded_2 {
        return;
    }
    let running = ballot(machine, true).await;
    let lanes = running[0]
        .count_ones()
        .wrapping_add(running[1].count_ones());
    let loaded_3 = machine.load::<u32>(Global::Dispatch, 6);
    let share_log2 = lanes.wrapping_sub(1u32).count_ones().wrapping_sub(loaded_3);
    let loaded_4 = machine.load::<u32>(Global::Dispatch, 6);
    let share_end = lanes.wrapping_sub(1u32) >> loaded_4;
    let loaded_5 = machine.load::<u32>(Global::Dispatch, 6);
    let within_share = lane >> loaded_5;
    let loaded_6 = machine.load::<u32>(Global::Dispatch, 6);
    let position = lane & (1u32 << loaded_6).wrapping_sub(1u32);
    let loaded_7 = machine.load::<u32>(Global::Dispatch, 7);
    let of_position = loaded_7 << position;
    let loaded_8 = machine.load::<u32>(Global::Dispatch, 5);
    let instance = position & (1u32 << loaded_8).wrapping_sub(1u32);
    let loaded_9 = machine.load::<u32>(Global::Dispatch, 0);
    let rest = loaded_9.wrapping_sub(first);
    let loaded_10 = machine.load::<u32>(Global::Dispatch, 1);
    let entry = entry_at(
        machine,
        loaded_10
            .wrapping_add(first)
            .wrapping_add(if instance >= rest {
                rest.wrapping_sub(1u32)
            } else {
                instance
            }),
    );
    let clip_index = entry.clip_and_weight & 0xffffu32;
    let clip = clip_at(machine, clip_index);
    let tick = tick_of(machine, entry, clip.period);
    let loaded_11 = machine.load::<u32>(Global::Dispatch, 5);
    let base_index = position >> loaded_11;
    let base = base_at(
        machine,
        clip.first_base.wrapping_add(if base_index < clip.bases {
            base_index
        } else {
            0u32
        }),
    );
    count = base.count;
    loop {
        let _block = machine.block(line!(), 39);
        let loaded_12 = count;
        let distance = loaded_12.wrapping_add(share_end) >> share_log2;
        let probe = within_share.wrapping_mul(distance);
        let loaded_13 = count;
        let is_inside = probe < loaded_13;
        let loaded_14 = found;
        let result = span_of(
            machine,
            base.first
                .wrapping_add(loaded_14)
                .wrapping_add(if is_inside { probe } else { 0u32 }),
        );
        let start = result.start & TICKS;
        let begun = ballot(
            machine,
            (is_inside & (start <= tick)) | (within_share == 0u32),
        )
        .await;
        let begun_count = (begun[0] & of_position)
            .count_ones()
            .wrapping_add((begun[1] & of_position).count_ones());
        let passed = begun_count.wrapping_sub(1u32).wrapping_mul(distance);
        let loaded_15 = found;
        found = loaded_15.wrapping_add(passed);
        let loaded_16 = count;
        let loaded_17 = count;
        count = if loaded_17.wrapping_sub(passed) > distance {
            distance
        } else {
            loaded_16.wrapping_sub(passed)
        };
        let loaded_18 = count;
        let go_on = is_any(machine, loaded_18 > 1u32).await;
        if !go_on {
            break;
        }
    }
    let loaded_19 = found;
    let span = span_of(machine, base.first.wrapping_add(loaded_19));
    let is_key = span.start == tick | ON_KEY;
    let loaded_20 = machine.load::<u32>(Global::Dispatch, 2);
    let loaded_21 = found;
    let result_2 = distance_from_middle(machine, (tick as i32).wrapping_sub(span.whole), 0u32);
    let in_subgroup = Subgroup {
        row: clip_index.wrapping_sub(instance).wrapping_mul(loaded_20),
        span: loaded_21 | (if is_key { ON_KEY } else { 0u32 }),
        parameter: result_2 * span.scale + span.offset,
    };
    let loaded_22 = machine.load::<u32>(Global::Dispatch, 5);
    let instances = 1u32 << loaded_22;
    let loaded_23 = machine.load::<u32>(Global::Dispatch, 2);
    let end = (if rest < instances { rest } else { instances }).wrapping_mul(loaded_23);
    let loaded_24 = machine.load::<u32>(Global::Dispatch, 2);
    let output = first.wrapping_mul(loaded_24);
    let full_end = end & !lanes.wrapping_sub(1u32);
    index = lane;
    let loaded_25 = index;
    let result_3 = is_any(machine, loaded_25 < full_end).await;
    if result_3 {
        loop {
            let _block = machine.block(line!(), 13);
            let loaded_26 = index;
            let loaded_27 = index;
            let result_4 = rotation_at_subgroup(machine, in_subgroup, loaded_27).await;
            store(machine, output.wrapping_add(loaded_26), result_4);
            let loaded_28 = index;
            index = loaded_28.wrapping_add(lanes);
            let loaded_29 = index;
            let go_on_2 = is_any(machine, loaded_29 < full_end).await;
            if !go_on_2 {
                break;
            }
        }
    }
    if full_end < end {
        let _block = machine.block(line!(), 6);
        let loaded_30 = index;
        let is_inside_2 = loaded_30 < end;
        let loaded_31 = index;
        let value = rotation_at_subgroup(
            machine,
            in_subgroup,
            if is_inside_2 { loaded_31 } else { 0u32 },
        )
        .await;
        if is_inside_2 {
            let _block = machine.block(line!(), 3);
            let loaded_32 = index;
            store(machine, output.wrapping_add(loaded_32), value);
            return;
        } else {
            return;
        }
    } else {
        return;
    }
}

pub(crate) async fn main_of_motion<M: Machine>(machine: &M) {
    let invocation = machine.ids().global_invocation_id;
    let groups = machine.ids().num_workgroups;
    let _block = machine.block(line!(), 6);
    let index = invocation[1]
        .wrapping_mul(groups[0].wrapping_mul(MOTION_WORKGROUP))
        .wrapping_add(invocation[0]);
    let loaded = machine.load::<u32>(Global::Dispatch, 0);
    if index < loaded {
        let _block = machine.block(line!(), 1);
        motion_work(machine, index);
        return;
    } else {
        return;
    }
}

pub(crate) async fn main_of_prepare_arcs<M: Machine>(machine: &M) {
    let invocation = machine.ids().global_invocation_id;
    let groups = machine.ids().num_workgroups;
    let _block = machine.block(line!(), 24);
    let index = invocation[1]
        .wrapping_mul(groups[0].wrapping_mul(PREPARE_WORKGROUP))
        .wrapping_add(invocation[0]);
    let loaded = machine.load::<u32>(Global::Dispatch, 0);
    if index >= loaded {
        return;
    }
    let interval = interval_at(machine, index);
    let key = interval & KEY_OF_INTERVAL;
    let result = key_at(machine, key);
    let start = both(result, [(interval & START_NEGATED) << 1u32; 4], |x, y| {
        x ^ y
    });
    let result_2 = key_at(machine, key.wrapping_add(1u32));
    let end = both(result_2, [interval & END_NEGATED; 4], |x, y| x ^ y);
    let arc = arc_between(
        machine,
        start.map(|x| M::F::of_bits(x)),
        end.map(|x| M::F::of_bits(x)),
    );
    machine.store::<[M::F; 4]>(
        Global::Rotations,
        4 * (2u32.wrapping_mul(index) as usize),
        arc.middle,
    );
    machine.store::<[M::F; 4]>(
        Global::Rotations,
        4 * (2u32.wrapping_mul(index).wrapping_add(1u32) as usize),
        arc.tangent,
    );
}

pub(crate) fn matrix_rows<M: Machine>(
    machine: &M,
    rotation: [M::F; 4],
    detail: u32,
) -> MatrixRows<M::F> {
    let mut rows: MatrixRows<M::F> = Default::default();
    let _block = machine.block(line!(), 30);
    let v = [rotation[0], rotation[1], rotation[2]];
    let w = if detail == 1u32 {
        -rotation[3]
    } else {
        rotation[3]
    };
    let double = both(v, v, |x, y| x + y);
    let xx = v[0] * double[0];
    let yy = v[1] * double[1];
    let zz = v[2] * double[2];
    let xy = v[0] * double[1];
    let yz = v[1] * double[2];
    let zx = v[2] * double[0];
    let wx = w * double[0];
    let wy = w * double[1];
    let wz = w * double[2];
    rows.first = [M::F::of(1.0) - (yy + zz), xy - wz, zx + wy];
    rows.second = [xy + wz, M::F::of(1.0) - (xx + zz), yz - wx];
    rows.third = [zx - wy, yz + wx, M::F::of(1.0) - (xx + yy)];
    let loaded = rows;
    loaded
}

pub(crate) fn motion_work<M: Machine>(machine: &M, index: u32) {
    const OF_KERNELS: [u8; 227] = [
        0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,
        0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,
        0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,
        0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,
        0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,
        0, 0, 0, 0, 0, 0, 0, 1, 2, 3, 4, 5, 6, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,
        0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,
        0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,
    ];
    match OF_KERNELS[machine.code()] {
        0 => motion_work_of_joints(machine, index),
        1 => motion_work_of_walk(machine, index),
        2 => motion_work_of_differences(machine, index),
        3 => motion_work_of_store(machine, index),
        4 => motion_work_of_matrices(machine, index),
        5 => motion_work_of_tree(machine, index),
        _ => motion_work_of_pick(machine, index),
    }
}

pub(crate) fn motion_work_of_joints<M: Machine>(machine: &M, index: u32) {
    let _block = machine.block(line!(), 22);
    let loaded = machine.load::<u32>(Global::Dispatch, 2);
    let sample_index = quotient(index, loaded);
    let loaded_2 = machine.load::<u32>(Global::Dispatch, 2);
    let joint = index.wrapping_sub(sample_index.wrapping_mul(loaded_2));
    let loaded_3 = machine.load::<u32>(Global::Dispatch, 1);
    let sample = machine.load::<MotionSample>(
        Global::Samples,
        2 * (loaded_3.wrapping_add(sample_index) as usize),
    );
    let clip = machine.load::<CrowdClip>(Global::Clips, 3 * (sample.clip as usize));
    let tick = if sample.tick > clip.period {
        clip.period
    } else {
        sample.tick
    };
    let loaded_4 = machine.load::<u32>(Global::Dispatch, 2);
    let first = sample
        .clip
        .wrapping_mul(loaded_4)
        .wrapping_add(joint)
        .wrapping_mul(CHANNELS);
    let state = index.wrapping_mul(STATE_VECTORS);
    let loaded_5 = machine.load::<CrowdChannel>(
        Global::Channels,
        4 * (first.wrapping_add(ROTATION) as usize),
    );
    rotate(machine, loaded_5, clip, tick, state);
    let loaded_6 = machine.load::<CrowdChannel>(
        Global::Channels,
        4 * (first.wrapping_add(TRANSLATION) as usize),
    );
    move_joint(machine, loaded_6, clip, tick, state);
}

pub(crate) fn motion_work_of_walk<M: Machine>(machine: &M, index: u32) {
    let mut i: u32 = 0u32;
    let _block = machine.block(line!(), 2);
    let loaded = machine.load::<u32>(Global::Dispatch, 2);
    let first = index.wrapping_mul(loaded);
    loop {
        let _block = machine.block(line!(), 14);
        let loaded_2 = i;
        let loaded_3 = machine.load::<u32>(Global::Dispatch, 3);
        if !(loaded_2 < loaded_3) {
            break;
        }
        let loaded_4 = i;
        let link = machine.load::<CrowdLink>(Global::Links, 2 * (loaded_4 as usize));
        hang_on(
            machine,
            first.wrapping_add(link.parent).wrapping_mul(STATE_VECTORS),
            first.wrapping_add(link.joint).wrapping_mul(STATE_VECTORS),
        );
        let loaded_5 = i;
        i = loaded_5.wrapping_add(1u32);
    }
}

pub(crate) fn motion_work_of_differences<M: Machine>(machine: &M, index: u32) {
    let mut along: M::F = M::F::of(0.0);
    let _block = machine.block(line!(), 51);
    let loaded = machine.load::<u32>(Global::Dispatch, 1);
    let loaded_2 = machine.load::<u32>(Global::Dispatch, 2);
    let rate = machine.load::<M::F>(
        Global::Rates,
        loaded.wrapping_add(quotient(index, loaded_2)) as usize,
    );
    let loaded_3 = machine.load::<u32>(Global::Dispatch, 0);
    let before = loaded_3.wrapping_add(index).wrapping_mul(STATE_VECTORS);
    let loaded_4 = machine.load::<u32>(Global::Dispatch, 0);
    let after = 2u32
        .wrapping_mul(loaded_4)
        .wrapping_add(index)
        .wrapping_mul(STATE_VECTORS);
    let state = index.wrapping_mul(STATE_VECTORS);
    let loaded_5 =
        machine.load::<[M::F; 4]>(Global::States, 4 * (after.wrapping_add(POSITION) as usize));
    let loaded_6 =
        machine.load::<[M::F; 4]>(Global::States, 4 * (before.wrapping_add(POSITION) as usize));
    let moved = both(
        [loaded_5[0], loaded_5[1], loaded_5[2]],
        [loaded_6[0], loaded_6[1], loaded_6[2]],
        |x, y| x - y,
    );
    let result = canonical3(machine, both(moved, [rate; 3], |x, y| x * y));
    machine.store::<[M::F; 4]>(
        Global::States,
        4 * (state.wrapping_add(VELOCITY) as usize),
        result,
    );
    let start = machine.load::<[M::F; 4]>(
        Global::States,
        4 * (before.wrapping_add(WORLD_ROTATION) as usize),
    );
    let loaded_7 = machine.load::<[M::F; 4]>(
        Global::States,
        4 * (after.wrapping_add(WORLD_ROTATION) as usize),
    );
    let result_2 = product(
        machine,
        loaded_7,
        [
            [start[0], start[1], start[2]].map(|x| -x)[0],
            [start[0], start[1], start[2]].map(|x| -x)[1],
            [start[0], start[1], start[2]].map(|x| -x)[2],
            start[3],
        ],
    );
    let rotation = flushed4(machine, result_2);
    let sine = root(
        machine,
        (rotation[0] * rotation[0] + rotation[1] * rotation[1]) + rotation[2] * rotation[2],
    );
    if sine != M::F::of(0.0) {
        let _block = machine.block(line!(), 6);
        let result_3 = magnitude(machine, rotation[3]);
        let result_4 = arc_tangent(machine, sine, result_3);
        let result_5 = reciprocal(machine, sine);
        along = (M::F::of(2.0) * result_4) * result_5;
    }
    let loaded_8 = along;
    let loaded_9 = along;
    let scale = if rotation[3] < M::F::of(0.0) {
        -loaded_9
    } else {
        loaded_8
    };
    let result_6 = canonical3(
        machine,
        both(
            [rotation[0], rotation[1], rotation[2]],
            [scale * rate; 3],
            |x, y| x * y,
        ),
    );
    machine.store::<[M::F; 4]>(
        Global::States,
        4 * (state.wrapping_add(ANGULAR_VELOCITY) as usize),
        result_6,
    );
}

/// `index` is a number of the result.
pub(crate) fn motion_work_of_store<M: Machine>(machine: &M, index: u32) {
    let _block = machine.block(line!(), 12);
    let loaded = machine.load::<u32>(Global::Dispatch, 7);
    let joint = quotient(index, loaded);
    let loaded_2 = machine.load::<u32>(Global::Dispatch, 6);
    let vector = joint.wrapping_mul(STATE_VECTORS).wrapping_add(loaded_2);
    let loaded_3 = machine.load::<u32>(Global::Dispatch, 7);
    let loaded_4 = machine.load::<u32>(
        Global::States,
        vector
            .wrapping_mul(4u32)
            .wrapping_add(index.wrapping_sub(joint.wrapping_mul(loaded_3))) as usize,
    );
    machine.store::<u32>(Global::Values, index as usize, loaded_4);
}

/// `index` is a joint of an instance.
pub(crate) fn motion_work_of_matrices<M: Machine>(machine: &M, index: u32) {
    let _block = machine.block(line!(), 16);
    let loaded = machine.load::<u32>(Global::Dispatch, 6);
    let loaded_2 = machine.load::<[M::F; 4]>(
        Global::States,
        4 * (index.wrapping_mul(STATE_VECTORS).wrapping_add(loaded) as usize),
    );
    let loaded_3 = machine.load::<u32>(Global::Dispatch, 8);
    let rows = matrix_rows(machine, loaded_2, loaded_3);
    let loaded_4 = machine.load::<u32>(Global::Dispatch, 7);
    let first = index.wrapping_mul(loaded_4);
    let result = canonical3(machine, rows.first);
    store_three(machine, first, result);
    let result_2 = canonical3(machine, rows.second);
    store_three(machine, first.wrapping_add(3u32), result_2);
    let loaded_5 = machine.load::<u32>(Global::Dispatch, 7);
    if loaded_5 == 9u32 {
        let _block = machine.block(line!(), 3);
        let result_3 = canonical3(machine, rows.third);
        store_three(machine, first.wrapping_add(6u32), result_3);
        return;
    } else {
        return;
    }
}

/// `index` is the sample, `dispatch.joints` the number of tracks and `dispatch.links` that of frames.
pub(crate) fn motion_work_of_tree<M: Machine>(machine: &M, index: u32) {
    let mut i: u32 = 0u32;
    let _block = machine.block(line!(), 5);
    let loaded = machine.load::<u32>(Global::Dispatch, 2);
    let first_word = index.wrapping_mul(loaded).wrapping_mul(20u32);
    let loaded_2 = machine.load::<u32>(Global::Dispatch, 3);
    let first = index.wrapping_mul(loaded_2);
    loop {
        let _block = machine.block(line!(), 13);
        let loaded_3 = i;
        let loaded_4 = machine.load::<u32>(Global::Dispatch, 3);
        if !(loaded_3 < loaded_4) {
            break;
        }
        let loaded_5 = i;
        let loaded_6 = machine.load::<TreeFrame<M::F>>(Global::Frames, 16 * (loaded_5 as usize));
        let loaded_7 = i;
        walk_to(
            machine,
            loaded_6,
            first_word,
            first,
            first.wrapping_add(loaded_7).wrapping_mul(STATE_VECTORS),
        );
        let loaded_8 = i;
        i = loaded_8.wrapping_add(1u32);
    }
}

/// `index` is a number of the result. Of each sample there are `dispatch.numbers`; their picks begin at `dispatch.vector`,
/// and its states have `dispatch.joints` vectors.
pub(crate) fn motion_work_of_pick<M: Machine>(machine: &M, index: u32) {
    let _block = machine.block(line!(), 14);
    let loaded = machine.load::<u32>(Global::Dispatch, 7);
    let sample = quotient(index, loaded);
    let loaded_2 = machine.load::<u32>(Global::Dispatch, 6);
    let loaded_3 = machine.load::<u32>(Global::Dispatch, 7);
    let pick = machine.load::<u32>(
        Global::Picks,
        loaded_2.wrapping_add(index.wrapping_sub(sample.wrapping_mul(loaded_3))) as usize,
    );
    let loaded_4 = machine.load::<u32>(Global::Dispatch, 2);
    let loaded_5 = machine.load::<u32>(
        Global::States,
        sample
            .wrapping_mul(loaded_4)
            .wrapping_mul(4u32)
            .wrapping_add(pick) as usize,
    );
    machine.store::<u32>(Global::Values, index as usize, loaded_5);
}

/// Stores the position and the velocity in the parent's frame.
pub(crate) fn move_joint<M: Machine>(
    machine: &M,
    channel: CrowdChannel,
    clip: CrowdClip,
    tick: u32,
    state: u32,
) {
    let mut value: [M::F; 4] = Default::default();
    let mut velocity: [M::F; 4] = [M::F::of(0.0); 4];
    let _block = machine.block(line!(), 16);
    let base = machine.load::<CrowdBase>(
        Global::TimeBases,
        3 * (clip
            .first_base
            .wrapping_add(channel.form_and_base & 0xffffffu32) as usize),
    );
    let form = channel.form_and_base >> 24u32;
    let position = position_in(machine, base, tick);
    let span = position.span & TICKS;
    let along = moving_span(machine, base, tick, span);
    if form == FORM_LINE {
        let _block = machine.block(line!(), 5);
        let result = key_of(machine, channel, span);
        value = result;
        if position.span & ON_KEY == 0u32 {
            let _block = machine.block(line!(), 7);
            let loaded = value;
            let result_2 = key_after(machine, channel, base, span);
            let line = line_between(machine, loaded, result_2);
            let result_3 = canonical(
                machine,
                both(
                    both(line.slope, [position.parameter; 4], |x, y| x * y),
                    line.value,
                    |x, y| x + y,
                ),
            );
            value = result_3;
        }
    } else {
        let _block = machine.block(line!(), 2);
        let result_4 = sampled(machine, channel, position);
        value = result_4;
    }
    let loaded_2 = value;
    machine.store::<[M::F; 4]>(
        Global::States,
        4 * (state.wrapping_add(POSITION) as usize),
        [
            [loaded_2[0], loaded_2[1], loaded_2[2]][0],
            [loaded_2[0], loaded_2[1], loaded_2[2]][1],
            [loaded_2[0], loaded_2[1], loaded_2[2]][2],
            M::F::of(0.0),
        ],
    );
    let loaded_3 = machine.load::<u32>(Global::Dispatch, 4);
    if loaded_3 != 0u32 {
        let _block = machine.block(line!(), 5);
        if form == FORM_LINE {
            let _block = machine.block(line!(), 7);
            let result_5 = key_of(machine, channel, along.index);
            let result_6 = key_after(machine, channel, base, along.index);
            let line_2 = line_between(machine, result_5, result_6);
            let result_7 = canonical3(
                machine,
                both(
                    [line_2.slope[0], line_2.slope[1], line_2.slope[2]],
                    [along.rate; 3],
                    |x, y| x * y,
                ),
            );
            velocity = result_7;
        } else {
            let _block = machine.block(line!(), 2);
            if form != FORM_CONSTANT {
                let _block = machine.block(line!(), 5);
                let curve = value_and_slope(machine, channel, along, 4u32);
                let result_8 = canonical3(
                    machine,
                    both(
                        [curve.slope[0], curve.slope[1], curve.slope[2]],
                        [along.rate; 3],
                        |x, y| x * y,
                    ),
                );
                velocity = result_8;
            }
        }
        let loaded_4 = velocity;
        machine.store::<[M::F; 4]>(
            Global::States,
            4 * (state.wrapping_add(VELOCITY) as usize),
            loaded_4,
        );
        return;
    } else {
        return;
    }
}

/// The product of a speed, below 2^23 in units of 2^-16, and a time, below 2^40.
pub(crate) fn move_of<M: Machine>(machine: &M, speed: u32, time: [u32; 2]) -> CrowdMove {
    let _block = machine.block(line!(), 25);
    let speed_low = speed & 0xffffu32;
    let speed_high = speed >> 16u32;
    let time_low = time[0] & 0xffffu32;
    let time_high = time[0] >> 16u32;
    let parts = speed_low.wrapping_mul(time_low);
    let first = (parts >> 16u32).wrapping_add(speed_high.wrapping_mul(time_low));
    let second = speed_low.wrapping_mul(time_high);
    let high = speed_high
        .wrapping_mul(time_high)
        .wrapping_add(speed.wrapping_mul(time[1]));
    let near = first.wrapping_add(second);
    let low = near.wrapping_add(high << 16u32);
    let carried =
        (if near < first { 1u32 } else { 0u32 }).wrapping_add(if low < near { 1u32 } else { 0u32 });
    CrowdMove {
        ticks: [low, (high >> 16u32).wrapping_add(carried)],
        part: if parts & 0xffffu32 != 0u32 {
            1u32
        } else {
            0u32
        },
    }
}

/// At the last key it is the span that ends there.
pub(crate) fn moving_span<M: Machine>(
    machine: &M,
    base: CrowdBase,
    tick: u32,
    index: u32,
) -> MotionSpan<M::F> {
    let _block = machine.block(line!(), 15);
    let span = machine
        .load::<CrowdSpan<M::F>>(Global::Spans, 4 * (base.first.wrapping_add(index) as usize));
    let is_end = (span.scale == M::F::of(0.0)) & (span.start & TICKS == tick) & (index > 0u32);
    let moving = index.wrapping_sub(if is_end { 1u32 } else { 0u32 });
    let along = machine.load::<CrowdSpan<M::F>>(
        Global::Spans,
        4 * (base.first.wrapping_add(moving) as usize),
    );
    let result = parameter_in(machine, along, tick);
    let loaded = machine.load::<M::F>(Global::Dispatch, 5);
    MotionSpan {
        index: moving,
        parameter: result,
        rate: along.scale * loaded,
    }
}

pub(crate) fn near_distance<M: Machine>(machine: &M, at: i32) -> M::F {
    const OF_KERNELS: [u8; 227] = [
        0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,
        0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1, 1, 1, 1, 1,
        1, 1, 1, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,
        0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1, 1,
        1, 1, 1, 1, 1, 1, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,
        0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,
        0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,
        0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,
    ];
    match OF_KERNELS[machine.code()] {
        0 => near_distance_of_near_frame(machine, at),
        _ => near_distance_of_near_time(machine, at),
    }
}

/// A whole number of frames below 2^24, which is exact in f32.
pub(crate) fn near_distance_of_near_frame<M: Machine>(machine: &M, at: i32) -> M::F {
    let _block = machine.block(line!(), 1);
    M::F::of(at as f32)
}

/// How far a sample lies from its segment's middle, when samples are explicit times: all are listed.
pub(crate) fn near_distance_of_near_time<M: Machine>(machine: &M, at: i32) -> M::F {
    let _block = machine.block(line!(), 1);
    let result = distance_from_middle(machine, at, 0u32);
    result
}

pub(crate) fn norm_squared<M: Machine>(machine: &M, q: [M::F; 4]) -> M::F {
    let _block = machine.block(line!(), 7);
    ((q[0] * q[0] + q[1] * q[1]) + q[2] * q[2]) + q[3] * q[3]
}

/// q / |q| for |q| well away from 0.
pub(crate) fn normalised<M: Machine>(machine: &M, q: [M::F; 4]) -> [M::F; 4] {
    let _block = machine.block(line!(), 3);
    let result = dot4(machine, q, q);
    let result_2 = reciprocal_root(machine, result);
    both(q, [result_2; 4], |x, y| x * y)
}

/// Slerp whose ends are the bits of a and b themselves.
pub(crate) fn over<M: Machine>(machine: &M, a: [M::F; 4], b: [M::F; 4], t: M::F) -> [M::F; 4] {
    let _block = machine.block(line!(), 5);
    let result = slerp(machine, a, b, t);
    if t == M::F::of(0.0) {
        a
    } else {
        if t == M::F::of(1.0) { b } else { result }
    }
}

/// The lowest 20 bits as a signed number of units.
pub(crate) fn packed_component<M: Machine>(machine: &M, word: u32) -> M::F {
    let _block = machine.block(line!(), 5);
    M::F::of((((word << 12u32) as i32) >> 12u32) as f32) * M::F::of(PACKED_STEP)
}

pub(crate) fn parameter_in<M: Machine>(machine: &M, span: CrowdSpan<M::F>, tick: u32) -> M::F {
    let _block = machine.block(line!(), 5);
    let result = distance_from_middle(machine, (tick as i32).wrapping_sub(span.whole), 0u32);
    result * span.scale + span.offset
}

pub(crate) fn parts_1<M: Machine>(machine: &M, rotation: [M::F; 4]) -> [M::F; 3] {
    const OF_KERNELS: [u8; 227] = [
        0, 0, 0, 0, 0, 0, 0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0, 0, 1, 0, 2,
        0, 0, 0, 0, 0, 0, 1, 0, 2, 0, 0, 0, 0, 0, 0, 1, 0, 2, 0, 0, 0, 0, 0, 0, 1, 0, 2, 0, 0, 0,
        0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0, 0,
        1, 0, 2, 0, 0, 0, 0, 0, 0, 1, 0, 2, 0, 0, 0, 0, 0, 0, 1, 0, 2, 0, 0, 0, 0, 0, 0, 1, 0, 2,
        0, 0, 0, 0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,
        0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0,
        0, 1, 0, 0, 0, 0, 0, 0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0, 0, 1, 0,
        0, 0, 0, 0, 0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0,
    ];
    match OF_KERNELS[machine.code()] {
        0 => parts_1_of_euler(machine, rotation),
        1 => parts_1_of_vector(machine, rotation),
        _ => parts_1_of_euler_2(machine, rotation),
    }
}

pub(crate) fn parts_1_of_euler<M: Machine>(machine: &M, rotation: [M::F; 4]) -> [M::F; 3] {
    let _block = machine.block(line!(), 3);
    let loaded = machine.load::<u32>(Global::Dispatch, 3);
    let result = euler(machine, rotation, loaded);
    let angles = canonical(machine, [result[0], result[1], result[2], M::F::of(0.0)]);
    [angles[0], angles[1], angles[2]]
}

pub(crate) fn parts_1_of_vector<M: Machine>(machine: &M, rotation: [M::F; 4]) -> [M::F; 3] {
    [rotation[0], rotation[1], rotation[2]]
}

pub(crate) fn parts_1_of_euler_2<M: Machine>(machine: &M, rotation: [M::F; 4]) -> [M::F; 3] {
    let _block = machine.block(line!(), 3);
    let loaded = machine.load::<u32>(Global::Dispatch, 0);
    let result = euler(machine, rotation, loaded);
    let angles = canonical(machine, [result[0], result[1], result[2], M::F::of(0.0)]);
    [angles[0], angles[1], angles[2]]
}

pub(crate) fn parts_2<M: Machine>(machine: &M, rotation: [M::F; 4]) -> [M::F; 6] {
    const OF_KERNELS: [u8; 227] = [
        0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,
        0, 0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0,
        0, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,
        0, 0, 0, 0, 0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0, 0, 1, 0, 0, 0, 0,
        0, 0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,
        0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,
        0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,
        0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,
    ];
    match OF_KERNELS[machine.code()] {
        0 => parts_2_of_six_d(machine, rotation),
        _ => parts_2_of_six_d_2(machine, rotation),
    }
}

pub(crate) fn parts_2_of_six_d<M: Machine>(machine: &M, rotation: [M::F; 4]) -> [M::F; 6] {
    let _block = machine.block(line!(), 4);
    let loaded = machine.load::<u32>(Global::Dispatch, 3);
    let columns = matrix_rows(machine, rotation, loaded);
    let first = canonical(
        machine,
        [
            columns.first[0],
            columns.first[1],
            columns.first[2],
            M::F::of(0.0),
        ],
    );
    let second = canonical(
        machine,
        [
            columns.second[0],
            columns.second[1],
            columns.second[2],
            M::F::of(0.0),
        ],
    );
    [
        first[0], first[1], first[2], second[0], second[1], second[2],
    ]
}

pub(crate) fn parts_2_of_six_d_2<M: Machine>(machine: &M, rotation: [M::F; 4]) -> [M::F; 6] {
    let _block = machine.block(line!(), 4);
    let loaded = machine.load::<u32>(Global::Dispatch, 0);
    let columns = matrix_rows(machine, rotation, loaded);
    let first = canonical(
        machine,
        [
            columns.first[0],
            columns.first[1],
            columns.first[2],
            M::F::of(0.0),
        ],
    );
    let second = canonical(
        machine,
        [
            columns.second[0],
            columns.second[1],
            columns.second[2],
            M::F::of(0.0),
        ],
    );
    [
        first[0], first[1], first[2], second[0], second[1], second[2],
    ]
}

pub(crate) fn parts_3<M: Machine>(machine: &M, rotation: [M::F; 4]) -> [M::F; 9] {
    const OF_KERNELS: [u8; 227] = [
        0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,
        0, 0, 1, 0, 0, 0, 0, 0, 0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0, 0, 1,
        0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,
        0, 0, 0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0, 0, 1, 0, 0, 0, 0, 0, 0,
        0, 0, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,
        0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,
        0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,
        0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,
    ];
    match OF_KERNELS[machine.code()] {
        0 => parts_3_of_matrix3x3(machine, rotation),
        _ => parts_3_of_matrix3x3_2(machine, rotation),
    }
}

pub(crate) fn parts_3_of_matrix3x3<M: Machine>(machine: &M, rotation: [M::F; 4]) -> [M::F; 9] {
    let _block = machine.block(line!(), 5);
    let loaded = machine.load::<u32>(Global::Dispatch, 3);
    let rows = matrix_rows(machine, rotation, loaded);
    let first = canonical(
        machine,
        [rows.first[0], rows.first[1], rows.first[2], M::F::of(0.0)],
    );
    let second = canonical(
        machine,
        [
            rows.second[0],
            rows.second[1],
            rows.second[2],
            M::F::of(0.0),
        ],
    );
    let third = canonical(
        machine,
        [rows.third[0], rows.third[1], rows.third[2], M::F::of(0.0)],
    );
    [
        first[0], first[1], first[2], second[0], second[1], second[2], third[0], third[1], third[2],
    ]
}

pub(crate) fn parts_3_of_matrix3x3_2<M: Machine>(machine: &M, rotation: [M::F; 4]) -> [M::F; 9] {
    let _block = machine.block(line!(), 5);
    let loaded = machine.load::<u32>(Global::Dispatch, 0);
    let rows = matrix_rows(machine, rotation, loaded);
    let first = canonical(
        machine,
        [rows.first[0], rows.first[1], rows.first[2], M::F::of(0.0)],
    );
    let second = canonical(
        machine,
        [
            rows.second[0],
            rows.second[1],
            rows.second[2],
            M::F::of(0.0),
        ],
    );
    let third = canonical(
        machine,
        [rows.third[0], rows.third[1], rows.third[2], M::F::of(0.0)],
    );
    [
        first[0], first[1], first[2], second[0], second[1], second[2], third[0], third[1], third[2],
    ]
}

pub(crate) fn parts_4<M: Machine>(machine: &M, rotation: [M::F; 4]) -> [[M::F; 4]; 3] {
    const OF_KERNELS: [u8; 227] = [
        0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,
        0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0, 0,
        1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,
        0, 0, 0, 0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0, 0, 1, 0, 0, 0, 0, 0,
        0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,
        0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,
        0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,
        0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,
    ];
    match OF_KERNELS[machine.code()] {
        0 => parts_4_of_matrix3x4(machine, rotation),
        _ => parts_4_of_matrix3x4_2(machine, rotation),
    }
}

pub(crate) fn parts_4_of_matrix3x4<M: Machine>(machine: &M, rotation: [M::F; 4]) -> [[M::F; 4]; 3] {
    let _block = machine.block(line!(), 12);
    let detail = machine.load::<u32>(Global::Dispatch, 3);
    let rows = matrix_rows(machine, rotation, detail);
    let first = canonical(
        machine,
        [rows.first[0], rows.first[1], rows.first[2], M::F::of(0.0)],
    );
    let second = canonical(
        machine,
        [
            rows.second[0],
            rows.second[1],
            rows.second[2],
            M::F::of(0.0),
        ],
    );
    let third = canonical(
        machine,
        [rows.third[0], rows.third[1], rows.third[2], M::F::of(0.0)],
    );
    let by_columns = detail == 1u32;
    [
        if by_columns {
            [
                [first[0], first[1], first[2]][0],
                [first[0], first[1], first[2]][1],
                [first[0], first[1], first[2]][2],
                second[0],
            ]
        } else {
            first
        },
        if by_columns {
            [
                [second[1], second[2]][0],
                [second[1], second[2]][1],
                [third[0], third[1]][0],
                [third[0], third[1]][1],
            ]
        } else {
            second
        },
        if by_columns {
            [third[2], M::F::of(0.0), M::F::of(0.0), M::F::of(0.0)]
        } else {
            third
        },
    ]
}

pub(crate) fn parts_4_of_matrix3x4_2<M: Machine>(
    machine: &M,
    rotation: [M::F; 4],
) -> [[M::F; 4]; 3] {
    let _block = machine.block(line!(), 12);
    let detail = machine.load::<u32>(Global::Dispatch, 0);
    let rows = matrix_rows(machine, rotation, detail);
    let first = canonical(
        machine,
        [rows.first[0], rows.first[1], rows.first[2], M::F::of(0.0)],
    );
    let second = canonical(
        machine,
        [
            rows.second[0],
            rows.second[1],
            rows.second[2],
            M::F::of(0.0),
        ],
    );
    let third = canonical(
        machine,
        [rows.third[0], rows.third[1], rows.third[2], M::F::of(0.0)],
    );
    let by_columns = detail == 1u32;
    [
        if by_columns {
            [
                [first[0], first[1], first[2]][0],
                [first[0], first[1], first[2]][1],
                [first[0], first[1], first[2]][2],
                second[0],
            ]
        } else {
            first
        },
        if by_columns {
            [
                [second[1], second[2]][0],
                [second[1], second[2]][1],
                [third[0], third[1]][0],
                [third[0], third[1]][1],
            ]
        } else {
            second
        },
        if by_columns {
            [third[2], M::F::of(0.0), M::F::of(0.0), M::F::of(0.0)]
        } else {
            third
        },
    ]
}

/// The coefficients are those of 1, s, s², … s¹⁰. Neighbouring powers are added in pairs (Estrin's
/// scheme), which makes short chains of operations instead of one long one. The constant comes
/// last: what is added to it is small, and so are the roundings of what is added.
pub(crate) fn polynomial<M: Machine>(machine: &M, c: [[M::F; 4]; 11], s: M::F) -> [M::F; 4] {
    let _block = machine.block(line!(), 22);
    let z = s * s;
    let zz = z * z;
    let third = both(both(c[3], [s; 4], |x, y| x * y), c[2], |x, y| x + y);
    let fifth = both(both(c[5], [s; 4], |x, y| x * y), c[4], |x, y| x + y);
    let seventh = both(both(c[7], [s; 4], |x, y| x * y), c[6], |x, y| x + y);
    let ninth = both(both(c[9], [s; 4], |x, y| x * y), c[8], |x, y| x + y);
    let high = both(
        both(
            both(both(c[10], [z; 4], |x, y| x * y), ninth, |x, y| x + y),
            [zz; 4],
            |x, y| x * y,
        ),
        both(both(seventh, [z; 4], |x, y| x * y), fifth, |x, y| x + y),
        |x, y| x + y,
    );
    both(
        c[0],
        both(
            both(high, [zz; 4], |x, y| x * y),
            both(
                both(third, [z; 4], |x, y| x * y),
                both(c[1], [s; 4], |x, y| x * y),
                |x, y| x + y,
            ),
            |x, y| x + y,
        ),
        |x, y| x + y,
    )
}

pub(crate) fn pose<M: Machine>(machine: &M, sample: u32) {
    const OF_KERNELS: [u8; 227] = [
        0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,
        0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,
        0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,
        0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,
        0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1, 2, 3, 4, 5, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,
        0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,
        0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,
        0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,
    ];
    match OF_KERNELS[machine.code()] {
        0 => pose_of_add(machine, sample),
        1 => pose_of_blend(machine, sample),
        2 => pose_of_mix(machine, sample),
        3 => pose_of_smooth(machine, sample),
        4 => pose_of_steps(machine, sample),
        _ => pose_of_world(machine, sample),
    }
}

pub(crate) fn pose_of_add<M: Machine>(machine: &M, index: u32) {
    let _block = machine.block(line!(), 14);
    let reference_pose = machine.load::<[M::F; 4]>(Global::Reference, 4 * (index as usize));
    let inverse = [
        -reference_pose[0],
        -reference_pose[1],
        -reference_pose[2],
        reference_pose[3],
    ];
    let loaded = machine.load::<[M::F; 4]>(Global::Layer, 4 * (index as usize));
    let result = product(machine, inverse, loaded);
    let loaded_2 = machine.load::<u32>(Global::Dispatch, 0);
    let loaded_3 = machine.load::<M::F>(Global::Reference, 4 * (loaded_2 as usize));
    let weighted = slerp(
        machine,
        [M::F::of(0.0), M::F::of(0.0), M::F::of(0.0), M::F::of(1.0)],
        result,
        loaded_3,
    );
    let loaded_4 = machine.load::<[M::F; 4]>(Global::Base, 4 * (index as usize));
    let result_2 = product(machine, loaded_4, weighted);
    let result_3 = normalised(machine, result_2);
    let result_4 = canonical(machine, result_3);
    machine.store::<[M::F; 4]>(Global::Added, 4 * (index as usize), result_4);
}

/// `dispatch.detail` is the number of layers, which lie one after another.
pub(crate) fn pose_of_blend<M: Machine>(machine: &M, index: u32) {
    let mut sum: [M::F; 4] = Default::default();
    let mut layer: u32 = 1u32;
    let _block = machine.block(line!(), 13);
    let first = machine.load::<[M::F; 4]>(Global::Layers, 4 * (index as usize));
    let loaded = machine.load::<M::F>(Global::Weights, 0);
    sum = both(first, [loaded; 4], |x, y| x * y);
    loop {
        let _block = machine.block(line!(), 22);
        let loaded_2 = layer;
        let loaded_3 = machine.load::<u32>(Global::Dispatch, 1);
        if !(loaded_2 < loaded_3) {
            break;
        }
        let loaded_4 = layer;
        let loaded_5 = machine.load::<u32>(Global::Dispatch, 0);
        let next = machine.load::<[M::F; 4]>(
            Global::Layers,
            4 * (loaded_4.wrapping_mul(loaded_5).wrapping_add(index) as usize),
        );
        let result = dot4(machine, first, next);
        let near = if result < M::F::of(0.0) {
            next.map(|x| -x)
        } else {
            next
        };
        let loaded_6 = sum;
        let loaded_7 = layer;
        let loaded_8 = machine.load::<M::F>(Global::Weights, loaded_7 as usize);
        sum = both(loaded_6, both(near, [loaded_8; 4], |x, y| x * y), |x, y| {
            x + y
        });
        let loaded_9 = layer;
        layer = loaded_9.wrapping_add(1u32);
    }
    let loaded_10 = sum;
    let loaded_11 = sum;
    let result_2 = dot4(machine, loaded_10, loaded_11);
    let short = result_2 < M::F::of(LEAST_SQUARED_SUM);
    let loaded_12 = sum;
    let result_3 = normalised(machine, loaded_12);
    let result_4 = canonical(machine, if short { first } else { result_3 });
    machine.store::<[M::F; 4]>(Global::Blended, 4 * (index as usize), result_4);
}

pub(crate) fn pose_of_mix<M: Machine>(machine: &M, index: u32) {
    let _block = machine.block(line!(), 6);
    let loaded = machine.load::<[M::F; 4]>(Global::FromLayer, 4 * (index as usize));
    let loaded_2 = machine.load::<[M::F; 4]>(Global::ToLayer, 4 * (index as usize));
    let loaded_3 = machine.load::<M::F>(Global::Weights, 0);
    let result = over(machine, loaded, loaded_2, loaded_3);
    let result_2 = canonical(machine, result);
    machine.store::<[M::F; 4]>(Global::Mixed, 4 * (index as usize), result_2);
}

/// `dispatch.detail` is twice the number of weights, and one more for rotations.
pub(crate) fn pose_of_smooth<M: Machine>(machine: &M, index: u32) {
    let mut sum: [M::F; 4] = [M::F::of(0.0); 4];
    let mut m: u32 = 0u32;
    let _block = machine.block(line!(), 7);
    let loaded = machine.load::<u32>(Global::Dispatch, 1);
    let count = loaded >> 1u32;
    loop {
        let _block = machine.block(line!(), 22);
        let loaded_2 = m;
        if !(loaded_2 < count) {
            break;
        }
        let loaded_3 = m;
        let loaded_4 = machine.load::<[M::F; 4]>(
            Global::Steps,
            4 * (index.wrapping_add(count).wrapping_add(loaded_3) as usize),
        );
        let loaded_5 = m;
        let loaded_6 = machine.load::<[M::F; 4]>(
            Global::Steps,
            4 * (index
                .wrapping_add(count)
                .wrapping_sub(1u32)
                .wrapping_sub(loaded_5) as usize),
        );
        let rise = both(loaded_4, loaded_6, |x, y| x - y);
        let loaded_7 = sum;
        let loaded_8 = m;
        let loaded_9 = machine.load::<M::F>(Global::Weights, loaded_8 as usize);
        sum = both(loaded_7, both(rise, [loaded_9; 4], |x, y| x * y), |x, y| {
            x + y
        });
        let loaded_10 = m;
        m = loaded_10.wrapping_add(1u32);
    }
    let value = machine.load::<[M::F; 4]>(Global::Values, 4 * (index as usize));
    let loaded_11 = machine.load::<u32>(Global::Dispatch, 1);
    if loaded_11 & 1u32 == 1u32 {
        let _block = machine.block(line!(), 4);
        let loaded_12 = sum;
        let result = rotated_by(machine, value, loaded_12);
        let result_2 = canonical(machine, result);
        machine.store::<[M::F; 4]>(Global::Smoothed, 4 * (index as usize), result_2);
        return;
    } else {
        let _block = machine.block(line!(), 4);
        let loaded_13 = sum;
        let result_3 = canonical(machine, both(value, loaded_13, |x, y| x + y));
        machine.store::<[M::F; 4]>(Global::Smoothed, 4 * (index as usize), result_3);
        return;
    }
}

/// `dispatch.detail` is 1 for rotations, 0 for vectors.
pub(crate) fn pose_of_steps<M: Machine>(machine: &M, index: u32) {
    let _block = machine.block(line!(), 6);
    let value = machine.load::<[M::F; 4]>(Global::Values, 4 * (index as usize));
    let next = machine.load::<[M::F; 4]>(Global::Values, 4 * (index.wrapping_add(1u32) as usize));
    let loaded = machine.load::<u32>(Global::Dispatch, 1);
    if loaded == 1u32 {
        let _block = machine.block(line!(), 3);
        let result = rotation_step(machine, value, next);
        let result_2 = canonical(machine, result);
        machine.store::<[M::F; 4]>(Global::Steps, 4 * (index as usize), result_2);
        return;
    } else {
        let _block = machine.block(line!(), 3);
        let result_3 = canonical(machine, both(next, value, |x, y| x - y));
        machine.store::<[M::F; 4]>(Global::Steps, 4 * (index as usize), result_3);
        return;
    }
}

/// `sample` is the frame, `dispatch.detail` the number of tracks.
pub(crate) fn pose_of_world<M: Machine>(machine: &M, sample: u32) {
    let mut i: u32 = 0u32;
    let mut rotation: [M::F; 4] = Default::default();
    let mut position: [M::F; 3] = Default::default();
    let _block = machine.block(line!(), 2);
    let tracks = machine.load::<u32>(Global::Dispatch, 1);
    let first = sample.wrapping_mul(tracks);
    loop {
        let _block = machine.block(line!(), 23);
        let loaded = i;
        if !(loaded < tracks) {
            break;
        }
        let loaded_2 = i;
        let link = machine.load::<Link<M::F>>(Global::Links, 8 * (loaded_2 as usize));
        let in_parent =
            machine.load::<[M::F; 4]>(Global::Local, 4 * (first.wrapping_add(link.track) as usize));
        rotation = in_parent;
        position = link.offset;
        if link.parent != ROOT {
            let _block = machine.block(line!(), 12);
            let parent = 2u32.wrapping_mul(first.wrapping_add(link.parent));
            let above = machine.load::<[M::F; 4]>(Global::World, 4 * (parent as usize));
            let result = product(machine, above, in_parent);
            let result_2 = normalised(machine, result);
            rotation = result_2;
            let loaded_3 =
                machine.load::<[M::F; 4]>(Global::World, 4 * (parent.wrapping_add(1u32) as usize));
            let result_3 = rotated(machine, above, link.offset);
            position = both([loaded_3[0], loaded_3[1], loaded_3[2]], result_3, |x, y| {
                x + y
            });
        }
        let there = 2u32.wrapping_mul(first.wrapping_add(link.track));
        let loaded_4 = rotation;
        let result_4 = canonical(machine, loaded_4);
        machine.store::<[M::F; 4]>(Global::World, 4 * (there as usize), result_4);
        let loaded_5 = position;
        let result_5 = canonical(
            machine,
            [loaded_5[0], loaded_5[1], loaded_5[2], M::F::of(0.0)],
        );
        machine.store::<[M::F; 4]>(
            Global::World,
            4 * (there.wrapping_add(1u32) as usize),
            result_5,
        );
        let loaded_6 = i;
        i = loaded_6.wrapping_add(1u32);
    }
}

pub(crate) fn position_at<M: Machine>(machine: &M, index: u32) -> CrowdPosition<M::F> {
    const OF_KERNELS: [u8; 227] = [
        0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,
        0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,
        0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,
        0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,
        0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1,
        1, 1, 1, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,
        0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,
        0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 2, 2, 2, 2, 2, 2,
    ];
    match OF_KERNELS[machine.code()] {
        0 => position_at_of_readers(machine, index),
        1 => position_at_of_whole(machine, index),
        _ => position_at_of_readers_2(machine, index),
    }
}

pub(crate) fn position_at_of_readers<M: Machine>(machine: &M, index: u32) -> CrowdPosition<M::F> {
    let _block = machine.block(line!(), 1);
    let loaded = machine.load::<CrowdPosition<M::F>>(Global::Positions, 2 * (index as usize));
    loaded
}

pub(crate) fn position_at_of_whole<M: Machine>(machine: &M, index: u32) -> CrowdPosition<M::F> {
    let _block = machine.block(line!(), 2);
    let loaded = machine.load::<u32>(Global::FoundSpans, index as usize);
    let loaded_2 = machine.load::<M::F>(Global::FoundParameters, index as usize);
    CrowdPosition {
        span: loaded,
        parameter: loaded_2,
    }
}

pub(crate) fn position_at_of_readers_2<M: Machine>(machine: &M, index: u32) -> CrowdPosition<M::F> {
    let _block = machine.block(line!(), 8);
    let two = machine.load::<[u32; 4]>(Global::Positions, 4 * (quotient(index, 2u32) as usize));
    let pair = if index & 1u32 == 1u32 {
        [two[2], two[3]]
    } else {
        [two[0], two[1]]
    };
    CrowdPosition {
        span: pair[0],
        parameter: M::F::of_bits(pair[1]),
    }
}

/// The position of a tick in a time base.
pub(crate) fn position_in<M: Machine>(
    machine: &M,
    base: CrowdBase,
    tick: u32,
) -> CrowdPosition<M::F> {
    let _block = machine.block(line!(), 8);
    let index = span_at(machine, base, tick);
    let span = machine
        .load::<CrowdSpan<M::F>>(Global::Spans, 4 * (base.first.wrapping_add(index) as usize));
    let is_key = span.start == tick | ON_KEY;
    let result = parameter_in(machine, span, tick);
    CrowdPosition {
        span: index | (if is_key { ON_KEY } else { 0u32 }),
        parameter: result,
    }
}

/// The smallest power of two that is not less than a number of joints, as its logarithm.
pub(crate) fn power_from<M: Machine>(machine: &M, count: u32) -> u32 {
    let mut bits: u32 = Default::default();
    let _block = machine.block(line!(), 21);
    bits = if count == 0u32 {
        0u32
    } else {
        count.wrapping_sub(1u32)
    };
    let loaded = bits;
    let loaded_2 = bits;
    bits = loaded | (loaded_2 >> 1u32);
    let loaded_3 = bits;
    let loaded_4 = bits;
    bits = loaded_3 | (loaded_4 >> 2u32);
    let loaded_5 = bits;
    let loaded_6 = bits;
    bits = loaded_5 | (loaded_6 >> 4u32);
    let loaded_7 = bits;
    loaded_7.count_ones()
}

/// The Hamilton product a b.
pub(crate) fn product<M: Machine>(machine: &M, a: [M::F; 4], b: [M::F; 4]) -> [M::F; 4] {
    let _block = machine.block(line!(), 28);
    [
        ((a[3] * b[0] + a[0] * b[3]) + a[1] * b[2]) - a[2] * b[1],
        ((a[3] * b[1] - a[0] * b[2]) + a[1] * b[3]) + a[2] * b[0],
        ((a[3] * b[2] + a[0] * b[1]) - a[1] * b[0]) + a[2] * b[3],
        ((a[3] * b[3] - a[0] * b[0]) - a[1] * b[1]) - a[2] * b[2],
    ]
}

/// 1/x for x > 0.
pub(crate) fn reciprocal<M: Machine>(machine: &M, x: M::F) -> M::F {
    let _block = machine.block(line!(), 15);
    let seed = M::F::of_bits(RECIPROCAL_SEED.wrapping_sub(x.bits()));
    let first = seed * (M::F::of(2.0) - x * seed);
    let second = first * (M::F::of(2.0) - x * first);
    let third = second * (M::F::of(2.0) - x * second);
    third * (M::F::of(2.0) - x * third)
}

/// 1/√x for x > 0; large at 0.
pub(crate) fn reciprocal_root<M: Machine>(machine: &M, x: M::F) -> M::F {
    let _block = machine.block(line!(), 17);
    let seed = M::F::of_bits(ROOT_SEED.wrapping_sub(x.bits() >> 1u32));
    let half = M::F::of(0.5) * x;
    let first = seed * (M::F::of(1.5) - (half * seed) * seed);
    let second = first * (M::F::of(1.5) - (half * first) * first);
    second * (M::F::of(1.5) - (half * second) * second)
}

/// x modulo q, for q from 1 on.
pub(crate) fn remainder<M: Machine>(machine: &M, x: u32, q: u32) -> u32 {
    let _block = machine.block(line!(), 3);
    x.wrapping_sub(quotient(x, q).wrapping_mul(q))
}

/// x - (r + h)² for |h| of half a unit of the last place of r: its sign is exact.
pub(crate) fn rest_of_square<M: Machine>(machine: &M, x: M::F, r: M::F, h: M::F) -> M::F {
    let _block = machine.block(line!(), 16);
    let high = M::F::of_bits(r.bits() & 0xfffff000u32);
    let low = r - high;
    let rest = ((x - high * high) - (M::F::of(2.0) * high) * low) - (M::F::of(2.0) * r) * h;
    (rest - low * low) - h * h
}

pub(crate) fn root<M: Machine>(machine: &M, x: M::F) -> M::F {
    let _block = machine.block(line!(), 8);
    let result = reciprocal_root(machine, x);
    let near = x * result;
    let result_2 = reciprocal_root(machine, x);
    near + (x - near * near) * (M::F::of(0.5) * result_2)
}

/// Stores the rotation and the angular velocity about the parent's axes.
pub(crate) fn rotate<M: Machine>(
    machine: &M,
    channel: CrowdChannel,
    clip: CrowdClip,
    tick: u32,
    state: u32,
) {
    let mut rotation: [M::F; 4] = Default::default();
    let mut curve: ValueAndSlope<M::F> = Default::default();
    let mut arc: ArcSegment<M::F> = Default::default();
    let mut velocity: [M::F; 4] = [M::F::of(0.0); 4];
    let _block = machine.block(line!(), 22);
    let base = machine.load::<CrowdBase>(
        Global::TimeBases,
        3 * (clip
            .first_base
            .wrapping_add(channel.form_and_base & 0xffffffu32) as usize),
    );
    let form = channel.form_and_base >> 24u32;
    let position = position_in(machine, base, tick);
    let span = position.span & TICKS;
    let is_key = position.span & ON_KEY != 0u32;
    let along = moving_span(machine, base, tick, span);
    let loaded = machine.load::<u32>(Global::Dispatch, 4);
    let moves = loaded != 0u32;
    if (form == FORM_KEYS) | (form == FORM_PACKED) {
        let _block = machine.block(line!(), 9);
        if moves | !is_key {
            let _block = machine.block(line!(), 4);
            let result = key_of(machine, channel, along.index);
            let result_2 = key_after(machine, channel, base, along.index);
            let result_3 = arc_between(machine, result, result_2);
            arc = result_3;
        }
        if is_key | (along.index != span) {
            let _block = machine.block(line!(), 2);
            let result_4 = key_of(machine, channel, span);
            rotation = result_4;
        } else {
            let _block = machine.block(line!(), 4);
            let loaded_2 = arc;
            let result_5 = evaluate_arc_segment(machine, loaded_2, position.parameter);
            let result_6 = canonical(machine, result_5);
            rotation = result_6;
        }
        let loaded_3 = arc.middle;
        let loaded_4 = arc.tangent;
        curve = ValueAndSlope {
            value: loaded_3,
            slope: loaded_4,
        };
    } else {
        let _block = machine.block(line!(), 5);
        let result_7 = sampled(machine, channel, position);
        rotation = result_7;
        if moves & (form == FORM_ARC) {
            let _block = machine.block(line!(), 7);
            let first = channel
                .first
                .wrapping_add(along.index.wrapping_mul(channel.count).wrapping_mul(2u32));
            let result_8 = cell_at(machine, first);
            let result_9 = cell_at(machine, first.wrapping_add(channel.count));
            curve = ValueAndSlope {
                value: result_8,
                slope: result_9,
            };
        } else {
            let _block = machine.block(line!(), 3);
            if moves & (form != FORM_CONSTANT) {
                let _block = machine.block(line!(), 2);
                let result_10 = value_and_slope(machine, channel, along, 11u32);
                curve = result_10;
            }
        }
    }
    let loaded_5 = rotation;
    machine.store::<[M::F; 4]>(
        Global::States,
        4 * (state.wrapping_add(LOCAL_ROTATION) as usize),
        loaded_5,
    );
    let loaded_6 = rotation;
    machine.store::<[M::F; 4]>(
        Global::States,
        4 * (state.wrapping_add(WORLD_ROTATION) as usize),
        loaded_6,
    );
    if moves {
        let _block = machine.block(line!(), 5);
        if form != FORM_CONSTANT {
            let _block = machine.block(line!(), 11);
            let loaded_7 = curve.value;
            let loaded_8 = curve.value[3];
            let inverse = [
                [loaded_7[0], loaded_7[1], loaded_7[2]].map(|x| -x)[0],
                [loaded_7[0], loaded_7[1], loaded_7[2]].map(|x| -x)[1],
                [loaded_7[0], loaded_7[1], loaded_7[2]].map(|x| -x)[2],
                loaded_8,
            ];
            let loaded_9 = curve.slope;
            let result_11 = product(machine, loaded_9, inverse);
            let result_12 = canonical3(
                machine,
                both(
                    [result_11[0], result_11[1], result_11[2]],
                    [M::F::of(2.0) * along.rate; 3],
                    |x, y| x * y,
                ),
            );
            velocity = result_12;
        }
        let loaded_10 = velocity;
        machine.store::<[M::F; 4]>(
            Global::States,
            4 * (state.wrapping_add(ANGULAR_VELOCITY) as usize),
            loaded_10,
        );
        return;
    } else {
        return;
    }
}

/// q v q*, for a unit quaternion.
pub(crate) fn rotated<M: Machine>(machine: &M, q: [M::F; 4], v: [M::F; 3]) -> [M::F; 3] {
    let _block = machine.block(line!(), 22);
    let once = [
        q[1] * v[2] - q[2] * v[1],
        q[2] * v[0] - q[0] * v[2],
        q[0] * v[1] - q[1] * v[0],
    ];
    let twice = both(once, once, |x, y| x + y);
    let again = [
        q[1] * twice[2] - q[2] * twice[1],
        q[2] * twice[0] - q[0] * twice[2],
        q[0] * twice[1] - q[1] * twice[0],
    ];
    both(
        both(v, both(twice, [q[3]; 3], |x, y| x * y), |x, y| x + y),
        again,
        |x, y| x + y,
    )
}

/// A rotation, and then that of half a rotation vector; 0, which is no rotation, where that is too long.
/// One Newton step takes back what rounding does to the length; without a rotation every bit stays.
pub(crate) fn rotated_by<M: Machine>(machine: &M, q: [M::F; 4], v: [M::F; 4]) -> [M::F; 4] {
    let _block = machine.block(line!(), 21);
    let half = flushed4(machine, v);
    let square = (half[0] * half[0] + half[1] * half[1]) + half[2] * half[2];
    let long = square > M::F::of(LONGEST_ANGLE_SQUARE);
    let z = if long { M::F::of(0.0) } else { square };
    let sines = sine_cosm1(machine, M::F::of(1.0), z);
    let more = product(
        machine,
        q,
        [
            half[0] * sines[0],
            half[1] * sines[0],
            half[2] * sines[0],
            sines[1],
        ],
    );
    let sum = both(q, more, |x, y| x + y);
    let result = dot4(machine, sum, sum);
    let unit = both(sum, [M::F::of(1.5) - M::F::of(0.5) * result; 4], |x, y| {
        x * y
    });
    if long {
        [M::F::of(0.0); 4]
    } else {
        if square == M::F::of(0.0) { q } else { unit }
    }
}

/// The rotation by an angle, up to 8192 rad in magnitude, about a unit axis.
pub(crate) fn rotation_about<M: Machine>(machine: &M, axis: [M::F; 3], angle: M::F) -> [M::F; 4] {
    let _block = machine.block(line!(), 23);
    let half = angle * M::F::of(0.5);
    let shifted = half * M::F::of(QUARTERS_PER_RADIAN) + M::F::of(WHOLE_SHIFT);
    let quarters = shifted.bits();
    let whole = shifted - M::F::of(WHOLE_SHIFT);
    let rest = ((half - whole * M::F::of(QUARTER_1)) - whole * M::F::of(QUARTER_2))
        - whole * M::F::of(QUARTER_3);
    let sines = sine_cosine(machine, rest);
    let is_odd = quarters & 1u32 == 1u32;
    let sign = if quarters & 2u32 == 2u32 {
        M::F::of(-1.0)
    } else {
        M::F::of(1.0)
    };
    let sine = (if is_odd { sines[1] } else { sines[0] }) * sign;
    let cosine = (if is_odd { -sines[0] } else { sines[1] }) * sign;
    [
        both(axis, [sine; 3], |x, y| x * y)[0],
        both(axis, [sine; 3], |x, y| x * y)[1],
        both(axis, [sine; 3], |x, y| x * y)[2],
        cosine,
    ]
}

/// Turns a base on by what a layer differs from its reference: base (reference⁻¹ layer)^weight.
pub(crate) fn rotation_added<M: Machine>(
    machine: &M,
    base: [M::F; 4],
    layer: [M::F; 4],
    reference: [M::F; 4],
    weight: M::F,
) -> [M::F; 4] {
    let _block = machine.block(line!(), 8);
    let inverse = [-reference[0], -reference[1], -reference[2], reference[3]];
    let result = product(machine, inverse, layer);
    let weighted = slerp(
        machine,
        [M::F::of(0.0), M::F::of(0.0), M::F::of(0.0), M::F::of(1.0)],
        result,
        weight,
    );
    let result_2 = product(machine, base, weighted);
    let result_3 = normalised(machine, result_2);
    let result_4 = canonical(machine, result_3);
    result_4
}

pub(crate) fn rotation_at_2<M: Machine>(machine: &M, word: u32) -> [M::F; 4] {
    let _block = machine.block(line!(), 3);
    let result = vector_at(machine, word);
    let loaded = machine.load::<M::F>(Global::Tracks, word.wrapping_add(3u32) as usize);
    [result[0], result[1], result[2], loaded]
}

/// The rotation of a joint, of those of all instances of the subgroup.
pub(crate) async fn rotation_at_subgroup<M: Machine>(
    machine: &M,
    here: Subgroup<M::F>,
    index: u32,
) -> [M::F; 4] {
    let _block = machine.block(line!(), 14);
    let loaded = machine.load::<u32>(Global::Dispatch, 8);
    let instance = index.wrapping_mul(loaded) >> 20u32;
    let shuffled_value = shuffled(machine, here.row, instance).await;
    let channel = channel_at(
        machine,
        shuffled_value.wrapping_add(index).wrapping_mul(CHANNELS),
    );
    let loaded_2 = machine.load::<u32>(Global::Dispatch, 5);
    let source = ((channel.form_and_base & 0xffffffu32) << loaded_2).wrapping_add(instance);
    let shuffled_value_2 = shuffled(machine, here.span, source).await;
    let shuffled_value_3 = shuffled(machine, here.parameter, source).await;
    let at = CrowdPosition {
        span: shuffled_value_2,
        parameter: shuffled_value_3,
    };
    let result = arc_value(machine, channel, at);
    result
}

pub(crate) fn rotation_between_arcs_hoisted<M: Machine>(
    machine: &M,
    key: u32,
    start: [M::F; 4],
    next: u32,
    all_rows: ArcsHoisted<M::F>,
) -> [M::F; 4] {
    let _block = machine.block(line!(), 3);
    let result = continued_key_at(machine, next);
    let result_2 = arc_between(machine, start, result);
    let result_3 = evaluate_arc_segment(machine, result_2, all_rows.parameter);
    result_3
}

/// 0, which is no rotation, where the curve turns too far for the small-angle series: the CPU
/// prepares that interval and overwrites the sample.
pub(crate) fn rotation_between_cubics_hoisted<M: Machine>(
    machine: &M,
    key: u32,
    start: [M::F; 4],
    next: u32,
    all_rows: CubicsHoisted<M::F>,
) -> [M::F; 4] {
    let _block = machine.block(line!(), 25);
    let first = all_rows.first;
    let last = all_rows.last;
    let before = continued_key_at(
        machine,
        if first.kind == M::F::of(KEY_INNER) {
            key.wrapping_sub(1u32)
        } else {
            key
        },
    );
    let after = continued_key_at(
        machine,
        if last.kind == M::F::of(KEY_INNER) {
            next.wrapping_add(1u32)
        } else {
            next
        },
    );
    let result = continued_key_at(machine, next);
    let curve = small_angle_cubic(machine, before, start, result, after, first, last);
    let c = curve.powers;
    let s = all_rows.parameter;
    let z = s * s;
    let third = both(both(c[3], [s; 4], |x, y| x * y), c[2], |x, y| x + y);
    let high = both(
        both(c[6], [z; 4], |x, y| x * y),
        both(both(c[5], [s; 4], |x, y| x * y), c[4], |x, y| x + y),
        |x, y| x + y,
    );
    let gain = both(
        both(high, [z * z; 4], |x, y| x * y),
        both(
            both(third, [z; 4], |x, y| x * y),
            both(c[1], [s; 4], |x, y| x * y),
            |x, y| x + y,
        ),
        |x, y| x + y,
    );
    if curve.is_valid {
        both(c[0], gain, |x, y| x + y)
    } else {
        [M::F::of(0.0); 4]
    }
}

pub(crate) fn rotation_between_two_keys_hoisted<M: Machine>(
    machine: &M,
    key: u32,
    start: [M::F; 4],
    next: u32,
    all_rows: TwoKeysHoisted<M::F>,
) -> [M::F; 4] {
    let _block = machine.block(line!(), 4);
    let result = continued_key_at(machine, next);
    let result_2 = arc_between(machine, start, result);
    let coefficients = constant_velocity(machine, result_2);
    let result_3 = polynomial(machine, coefficients, all_rows.parameter);
    result_3
}

/// The half-rotation vector between two rotations. The vector part of q⁻¹ (q₊ - q) is that of q⁻¹ q₊,
/// and small steps lose nothing in it.
pub(crate) fn rotation_step<M: Machine>(
    machine: &M,
    from_value: [M::F; 4],
    to_value: [M::F; 4],
) -> [M::F; 4] {
    let _block = machine.block(line!(), 25);
    let result = dot4(machine, from_value, to_value);
    let near = if result < M::F::of(0.0) {
        to_value.map(|x| -x)
    } else {
        to_value
    };
    let inverse = [
        -from_value[0],
        -from_value[1],
        -from_value[2],
        from_value[3],
    ];
    let result_2 = product(machine, inverse, both(near, from_value, |x, y| x - y));
    let half_step = flushed4(machine, result_2);
    let square =
        (half_step[0] * half_step[0] + half_step[1] * half_step[1]) + half_step[2] * half_step[2];
    let sine = root(machine, square);
    let result_3 = dot4(machine, from_value, near);
    let half = arc_tangent(machine, sine, result_3);
    let result_4 = reciprocal_root(machine, square);
    let scale = if square == M::F::of(0.0) {
        M::F::of(0.0)
    } else {
        half * result_4
    };
    [
        half_step[0] * scale,
        half_step[1] * scale,
        half_step[2] * scale,
        M::F::of(0.0),
    ]
}

/// A row as it is stored.
pub(crate) fn row_at<M: Machine>(machine: &M, row: u32) -> [M::F; 4] {
    let _block = machine.block(line!(), 16);
    let loaded = machine.load::<u32>(Global::Dispatch, 13);
    if loaded == 0u32 {
        let _block = machine.block(line!(), 1);
        let loaded_2 = machine.load::<[M::F; 4]>(Global::Rows, 4 * (row as usize));
        return loaded_2;
    }
    let matrix = quotient(row, 3u32);
    let instance = instance_of(machine, matrix);
    let loaded_3 = machine.load::<u32>(Global::Dispatch, 2);
    let first = matrix
        .wrapping_sub(instance.wrapping_mul(loaded_3))
        .wrapping_mul(3u32);
    let loaded_4 = machine.load::<[M::F; 4]>(Global::Rows, 4 * (row as usize));
    let loaded_5 = machine.load::<[M::F; 4]>(Global::Bind, 4 * (first as usize));
    let loaded_6 = machine.load::<[M::F; 4]>(Global::Bind, 4 * (first.wrapping_add(1u32) as usize));
    let loaded_7 = machine.load::<[M::F; 4]>(Global::Bind, 4 * (first.wrapping_add(2u32) as usize));
    let result = row_product(machine, loaded_4, loaded_5, loaded_6, loaded_7);
    result
}

/// A row of the product: this row times the rows of the other matrix.
pub(crate) fn row_product<M: Machine>(
    machine: &M,
    row: [M::F; 4],
    first: [M::F; 4],
    second: [M::F; 4],
    third: [M::F; 4],
) -> [M::F; 4] {
    let _block = machine.block(line!(), 7);
    let sum = both(
        both(
            both(first, [row[0]; 4], |x, y| x * y),
            both(second, [row[1]; 4], |x, y| x * y),
            |x, y| x + y,
        ),
        both(third, [row[2]; 4], |x, y| x * y),
        |x, y| x + y,
    );
    let result = canonical(machine, [sum[0], sum[1], sum[2], sum[3] + row[3]]);
    result
}

pub(crate) fn sample_at_key_sample<M: Machine>(machine: &M, index: u32) -> KeySample<M::F> {
    const OF_KERNELS: [u8; 227] = [
        0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,
        0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,
        0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,
        0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,
        0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,
        0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,
        0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,
        0, 0, 0, 0, 0, 0, 0, 0, 1, 1, 1, 0, 0, 0, 0, 0, 0,
    ];
    match OF_KERNELS[machine.code()] {
        0 => sample_at_key_sample_of_readers(machine, index),
        _ => sample_at_key_sample_of_readers_2(machine, index),
    }
}

pub(crate) fn sample_at_key_sample_of_readers<M: Machine>(
    machine: &M,
    index: u32,
) -> KeySample<M::F> {
    let _block = machine.block(line!(), 1);
    let loaded = machine.load::<KeySample<M::F>>(Global::Samples, 2 * (index as usize));
    loaded
}

pub(crate) fn sample_at_key_sample_of_readers_2<M: Machine>(
    machine: &M,
    index: u32,
) -> KeySample<M::F> {
    let _block = machine.block(line!(), 8);
    let two = machine.load::<[u32; 4]>(Global::Samples, 4 * (quotient(index, 2u32) as usize));
    let pair = if index & 1u32 == 1u32 {
        [two[2], two[3]]
    } else {
        [two[0], two[1]]
    };
    KeySample {
        key: pair[0],
        parameter: M::F::of_bits(pair[1]),
    }
}

pub(crate) fn sample_at_listed_sample<M: Machine>(machine: &M, index: u32) -> ListedSample<M::F> {
    const OF_KERNELS: [u8; 227] = [
        0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,
        0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,
        0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,
        0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,
        0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,
        0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,
        0, 0, 1, 1, 1, 1, 1, 1, 1, 1, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1,
        1, 1, 1, 1, 1, 1, 1, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0,
    ];
    match OF_KERNELS[machine.code()] {
        0 => sample_at_listed_sample_of_readers(machine, index),
        _ => sample_at_listed_sample_of_readers_2(machine, index),
    }
}

pub(crate) fn sample_at_listed_sample_of_readers<M: Machine>(
    machine: &M,
    index: u32,
) -> ListedSample<M::F> {
    let _block = machine.block(line!(), 1);
    let loaded = machine.load::<ListedSample<M::F>>(Global::Samples, 2 * (index as usize));
    loaded
}

pub(crate) fn sample_at_listed_sample_of_readers_2<M: Machine>(
    machine: &M,
    index: u32,
) -> ListedSample<M::F> {
    let _block = machine.block(line!(), 8);
    let two = machine.load::<[u32; 4]>(Global::Samples, 4 * (quotient(index, 2u32) as usize));
    let pair = if index & 1u32 == 1u32 {
        [two[2], two[3]]
    } else {
        [two[0], two[1]]
    };
    ListedSample {
        source: pair[0],
        parameter: M::F::of_bits(pair[1]),
    }
}

pub(crate) fn sample_count<M: Machine>(machine: &M, item: SpreadRun<M::F>) -> u32 {
    let _block = machine.block(line!(), 1);
    item.count & 0x3fffffffu32
}

/// The value of any run at its `j`th sample.
pub(crate) fn sample_of_arc_segment<M: Machine>(
    machine: &M,
    item: SpreadRun<M::F>,
    segment: ArcSegment<M::F>,
    j: u32,
    repetition: u32,
) -> [M::F; 4] {
    let _block = machine.block(line!(), 14);
    if (item.count & IS_CONSTANT != 0u32) | ((j == 0u32) & (item.key != NO_KEY)) {
        let _block = machine.block(line!(), 4);
        let index = if item.count & IS_CONSTANT != 0u32 {
            item.source
        } else {
            item.key
        };
        let result = constant_of_run(machine, index, repetition);
        return result;
    }
    let distance = distance_from_middle(machine, item.first, j);
    let rotation = evaluate_arc_segment(machine, segment, distance * item.scale + item.offset);
    if item.count & NEEDS_CARE != 0u32 {
        let _block = machine.block(line!(), 1);
        let result_2 = canonical(machine, rotation);
        return result_2;
    }
    rotation
}

/// The value of any run at its `j`th sample.
pub(crate) fn sample_of_polynomial_segment<M: Machine>(
    machine: &M,
    item: SpreadRun<M::F>,
    segment: PolynomialSegment<M::F>,
    j: u32,
    repetition: u32,
) -> [M::F; 4] {
    let _block = machine.block(line!(), 14);
    if (item.count & IS_CONSTANT != 0u32) | ((j == 0u32) & (item.key != NO_KEY)) {
        let _block = machine.block(line!(), 4);
        let index = if item.count & IS_CONSTANT != 0u32 {
            item.source
        } else {
            item.key
        };
        let result = constant_of_run(machine, index, repetition);
        return result;
    }
    let distance = distance_from_middle(machine, item.first, j);
    let rotation =
        evaluate_polynomial_segment(machine, segment, distance * item.scale + item.offset);
    if item.count & NEEDS_CARE != 0u32 {
        let _block = machine.block(line!(), 1);
        let result_2 = canonical(machine, rotation);
        return result_2;
    }
    rotation
}

/// A channel where its time base stands.
pub(crate) fn sampled<M: Machine>(
    machine: &M,
    channel: CrowdChannel,
    at: CrowdPosition<M::F>,
) -> [M::F; 4] {
    let mut coefficients: [[M::F; 4]; 11] = Default::default();
    let mut next: u32 = Default::default();
    let mut power: u32 = 0u32;
    let _block = machine.block(line!(), 18);
    let form = channel.form_and_base >> 24u32;
    let span = at.span & TICKS;
    let count = channel.count;
    let s = at.parameter;
    if form == FORM_CONSTANT {
        let _block = machine.block(line!(), 1);
        let result = cell_at(machine, channel.first);
        return result;
    }
    if at.span & ON_KEY != 0u32 {
        let _block = machine.block(line!(), 3);
        let result_2 = cell_at(machine, channel.keys.wrapping_add(span.wrapping_mul(count)));
        return result_2;
    }
    if form == FORM_ARC {
        let _block = machine.block(line!(), 8);
        let first = channel
            .first
            .wrapping_add(span.wrapping_mul(count).wrapping_mul(2u32));
        let result_3 = cell_at(machine, first);
        let result_4 = cell_at(machine, first.wrapping_add(count));
        let result_5 = evaluate_arc_segment(
            machine,
            ArcSegment {
                middle: result_3,
                tangent: result_4,
            },
            s,
        );
        let result_6 = canonical(machine, result_5);
        return result_6;
    }
    if form == FORM_CUBIC {
        let _block = machine.block(line!(), 12);
        let first_2 = channel
            .first
            .wrapping_add(span.wrapping_mul(count).wrapping_mul(4u32));
        let second = first_2.wrapping_add(count);
        let third = second.wrapping_add(count);
        let c0 = cell_at(machine, first_2);
        let c1 = cell_at(machine, second);
        let result_7 = cell_at(machine, third);
        let result_8 = cell_at(machine, third.wrapping_add(count));
        let result_9 = cubic(machine, c0, c1, result_7, result_8, s);
        let result_10 = canonical(machine, result_9);
        return result_10;
    }
    next = channel
        .first
        .wrapping_add(span.wrapping_mul(count).wrapping_mul(11u32));
    loop {
        let _block = machine.block(line!(), 13);
        let loaded = power;
        if !(loaded < 11u32) {
            break;
        }
        let loaded_2 = power;
        let loaded_3 = next;
        let result_11 = cell_at(machine, loaded_3);
        coefficients[loaded_2 as usize] = result_11;
        let loaded_4 = next;
        next = loaded_4.wrapping_add(count);
        let loaded_5 = power;
        power = loaded_5.wrapping_add(1u32);
    }
    let loaded_6 = coefficients;
    let result_12 = polynomial(machine, loaded_6, s);
    let result_13 = canonical(machine, result_12);
    result_13
}

pub(crate) fn segment_at_arc_segment<M: Machine>(machine: &M, index: u32) -> ArcSegment<M::F> {
    const OF_KERNELS: [u8; 227] = [
        0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,
        0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1,
        1, 1, 1, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,
        0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,
        0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,
        0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1,
        1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,
        0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,
    ];
    match OF_KERNELS[machine.code()] {
        0 => segment_at_arc_segment_of_readers(machine, index),
        _ => segment_at_arc_segment_of_readers_2(machine, index),
    }
}

pub(crate) fn segment_at_arc_segment_of_readers<M: Machine>(
    machine: &M,
    index: u32,
) -> ArcSegment<M::F> {
    let _block = machine.block(line!(), 1);
    let loaded = machine.load::<ArcSegment<M::F>>(Global::Segments, 8 * (index as usize));
    loaded
}

pub(crate) fn segment_at_arc_segment_of_readers_2<M: Machine>(
    machine: &M,
    index: u32,
) -> ArcSegment<M::F> {
    let _block = machine.block(line!(), 6);
    let first = 2u32.wrapping_mul(index);
    let loaded = machine.load::<[u32; 4]>(Global::Segments, 4 * (first as usize));
    let loaded_2 =
        machine.load::<[u32; 4]>(Global::Segments, 4 * (first.wrapping_add(1u32) as usize));
    ArcSegment {
        middle: loaded.map(|x| M::F::of_bits(x)),
        tangent: loaded_2.map(|x| M::F::of_bits(x)),
    }
}

pub(crate) fn segment_at_polynomial_segment<M: Machine>(
    machine: &M,
    index: u32,
) -> PolynomialSegment<M::F> {
    const OF_KERNELS: [u8; 227] = [
        0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,
        0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,
        0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,
        0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1,
        1, 1, 1, 1, 1, 1, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,
        0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,
        0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1,
        1, 1, 1, 1, 1, 1, 1, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0,
    ];
    match OF_KERNELS[machine.code()] {
        0 => segment_at_polynomial_segment_of_readers(machine, index),
        _ => segment_at_polynomial_segment_of_readers_2(machine, index),
    }
}

pub(crate) fn segment_at_polynomial_segment_of_readers<M: Machine>(
    machine: &M,
    index: u32,
) -> PolynomialSegment<M::F> {
    let _block = machine.block(line!(), 1);
    let loaded = machine.load::<PolynomialSegment<M::F>>(Global::Segments, 44 * (index as usize));
    loaded
}

pub(crate) fn segment_at_polynomial_segment_of_readers_2<M: Machine>(
    machine: &M,
    index: u32,
) -> PolynomialSegment<M::F> {
    let _block = machine.block(line!(), 33);
    let first = 11u32.wrapping_mul(index);
    let loaded = machine.load::<[u32; 4]>(Global::Segments, 4 * (first as usize));
    let loaded_2 =
        machine.load::<[u32; 4]>(Global::Segments, 4 * (first.wrapping_add(1u32) as usize));
    let loaded_3 =
        machine.load::<[u32; 4]>(Global::Segments, 4 * (first.wrapping_add(2u32) as usize));
    let loaded_4 =
        machine.load::<[u32; 4]>(Global::Segments, 4 * (first.wrapping_add(3u32) as usize));
    let loaded_5 =
        machine.load::<[u32; 4]>(Global::Segments, 4 * (first.wrapping_add(4u32) as usize));
    let loaded_6 =
        machine.load::<[u32; 4]>(Global::Segments, 4 * (first.wrapping_add(5u32) as usize));
    let loaded_7 =
        machine.load::<[u32; 4]>(Global::Segments, 4 * (first.wrapping_add(6u32) as usize));
    let loaded_8 =
        machine.load::<[u32; 4]>(Global::Segments, 4 * (first.wrapping_add(7u32) as usize));
    let loaded_9 =
        machine.load::<[u32; 4]>(Global::Segments, 4 * (first.wrapping_add(8u32) as usize));
    let loaded_10 =
        machine.load::<[u32; 4]>(Global::Segments, 4 * (first.wrapping_add(9u32) as usize));
    let loaded_11 =
        machine.load::<[u32; 4]>(Global::Segments, 4 * (first.wrapping_add(10u32) as usize));
    PolynomialSegment {
        coefficients: [
            loaded.map(|x| M::F::of_bits(x)),
            loaded_2.map(|x| M::F::of_bits(x)),
            loaded_3.map(|x| M::F::of_bits(x)),
            loaded_4.map(|x| M::F::of_bits(x)),
            loaded_5.map(|x| M::F::of_bits(x)),
            loaded_6.map(|x| M::F::of_bits(x)),
            loaded_7.map(|x| M::F::of_bits(x)),
            loaded_8.map(|x| M::F::of_bits(x)),
            loaded_9.map(|x| M::F::of_bits(x)),
            loaded_10.map(|x| M::F::of_bits(x)),
            loaded_11.map(|x| M::F::of_bits(x)),
        ],
    }
}

/// A segment. The source says how many cells it is behind the first of its group; the lowest two bits are 0, 1 or 2 for
/// a polynomial of degree 6, 8 or 10.
pub(crate) fn segment_of_3<M: Machine>(machine: &M, group: u32, source: u32, s: M::F) -> [M::F; 4] {
    let mut coefficients: [[M::F; 4]; 11] = Default::default();
    let mut power: u32 = 0u32;
    let _block = machine.block(line!(), 8);
    let first = group.wrapping_add(source >> 2u32);
    let powers = 7u32.wrapping_add((source & 3u32).wrapping_mul(2u32));
    loop {
        let _block = machine.block(line!(), 14);
        let loaded = power;
        if !(loaded < 11u32) {
            break;
        }
        let loaded_2 = power;
        let loaded_3 = power;
        let loaded_4 = power;
        let result = cell_at(
            machine,
            if loaded_4 < powers {
                first.wrapping_add(loaded_3)
            } else {
                0u32
            },
        );
        coefficients[loaded_2 as usize] = result;
        let loaded_5 = power;
        power = loaded_5.wrapping_add(1u32);
    }
    let loaded_6 = coefficients;
    let result_2 = polynomial(machine, loaded_6, s);
    let result_3 = canonical(machine, result_2);
    result_3
}

/// Constants have no segment; the first one exists in any case.
pub(crate) fn segment_of_arc_segment<M: Machine>(
    machine: &M,
    item: Item<M::F>,
) -> ArcSegment<M::F> {
    let _block = machine.block(line!(), 4);
    let result = segment_at_arc_segment(
        machine,
        if item.count & IS_CONSTANT != 0u32 {
            0u32
        } else {
            item.source
        },
    );
    result
}

/// Constants have no segment; the first one exists in any case.
pub(crate) fn segment_of_polynomial_segment<M: Machine>(
    machine: &M,
    item: Item<M::F>,
) -> PolynomialSegment<M::F> {
    let _block = machine.block(line!(), 4);
    let result = segment_at_polynomial_segment(
        machine,
        if item.count & IS_CONSTANT != 0u32 {
            0u32
        } else {
            item.source
        },
    );
    result
}

/// Sine (x) and cosine (y).
pub(crate) fn sine_cosine<M: Machine>(machine: &M, angle: M::F) -> [M::F; 2] {
    let _block = machine.block(line!(), 3);
    let sines = sine_cosm1(machine, angle, angle * angle);
    [sines[0], sines[1] + M::F::of(1.0)]
}

/// x sin(a)/a and cos(a) - 1, for an angle |a| <= pi/2 that is given by its square z.
pub(crate) fn sine_cosm1<M: Machine>(machine: &M, x: M::F, z: M::F) -> [M::F; 2] {
    let _block = machine.block(line!(), 18);
    let sine_tail =
        ((M::F::of(SINE_9) * z + M::F::of(SINE_7)) * z + M::F::of(SINE_5)) * z + M::F::of(SINE_3);
    let sine = sine_tail * (z * x) + x;
    let cosine_tail = (((M::F::of(COSINE_10) * z + M::F::of(COSINE_8)) * z + M::F::of(COSINE_6))
        * z
        + M::F::of(COSINE_4))
        * z
        + M::F::of(COSINE_2);
    let cosm1 = cosine_tail * z;
    [sine, cosm1]
}

pub(crate) fn sine_cosm1_quarter<M: Machine>(machine: &M, x: M::F, z: M::F) -> [M::F; 2] {
    let _block = machine.block(line!(), 15);
    let zz = z * z;
    let sine_low = M::F::of(QUARTER_SINE_5) * z + M::F::of(QUARTER_SINE_3);
    let sine_tail = M::F::of(QUARTER_SINE_7) * zz + sine_low;
    let zx = z * x;
    let sine = sine_tail * zx + x;
    let cosine_low = M::F::of(QUARTER_COSINE_4) * z + M::F::of(QUARTER_COSINE_2);
    let cosine_high = M::F::of(QUARTER_COSINE_8) * z + M::F::of(QUARTER_COSINE_6);
    let cosine_tail = cosine_high * zz + cosine_low;
    let cosm1 = cosine_tail * z;
    [sine, cosm1]
}

/// Slerp about the middle of the arc, the shorter way, for t from 0 to 1.
pub(crate) fn slerp<M: Machine>(machine: &M, a: [M::F; 4], b: [M::F; 4], t: M::F) -> [M::F; 4] {
    let _block = machine.block(line!(), 25);
    let result = dot4(machine, a, b);
    let near = if result < M::F::of(0.0) {
        b.map(|x| -x)
    } else {
        b
    };
    let sum = both(a, near, |x, y| x + y);
    let difference = flushed4(machine, both(near, a, |x, y| x - y));
    let square = dot4(machine, difference, difference);
    let whole = dot4(machine, sum, sum);
    let result_2 = root(machine, square);
    let result_3 = root(machine, whole);
    let half = arc_tangent(machine, result_2, result_3);
    let sines = sine_cosine(machine, ((t + t) - M::F::of(1.0)) * half);
    let result_4 = reciprocal_root(machine, square);
    let partner = both(
        difference,
        [if square == M::F::of(0.0) {
            M::F::of(0.0)
        } else {
            result_4
        }; 4],
        |x, y| x * y,
    );
    let result_5 = reciprocal_root(machine, whole);
    both(
        both(
            both(sum, [result_5; 4], |x, y| x * y),
            [sines[1]; 4],
            |x, y| x * y,
        ),
        both(partner, [sines[0]; 4], |x, y| x * y),
        |x, y| x + y,
    )
}

/// The curve between `start` and `end`. Each of the four keys has the sign that is nearer to the
/// key before it.
pub(crate) fn small_angle_cubic<M: Machine>(
    machine: &M,
    before: [M::F; 4],
    start: [M::F; 4],
    end: [M::F; 4],
    after: [M::F; 4],
    first: TangentWeights<M::F>,
    last: TangentWeights<M::F>,
) -> SmallAngleCubic<M::F> {
    let _block = machine.block(line!(), 266);
    let chord_before = both(start, before, |x, y| x - y);
    let chord = both(end, start, |x, y| x - y);
    let chord_after = both(after, end, |x, y| x - y);
    let step = step_vector(machine, start, chord);
    let result = step_vector(machine, before, chord_before);
    let log_before = small_log(machine, result);
    let log = small_log(machine, step);
    let result_2 = step_vector(machine, end, chord_after);
    let log_after = small_log(machine, result_2);
    let first_left = both(log_before, [first.before; 3], |x, y| x * y);
    let first_right = both(log, [first.after; 3], |x, y| x * y);
    let last_left = both(log, [last.before; 3], |x, y| x * y);
    let last_right = both(log_after, [last.after; 3], |x, y| x * y);
    let result_3 = small_exp(machine, first_left);
    let result_4 = small_exp(machine, first_right);
    let result_5 = composed(machine, result_3, result_4);
    let first_tangent = small_log(machine, result_5.vector);
    let result_6 = small_exp(machine, last_left);
    let result_7 = small_exp(machine, last_right);
    let result_8 = composed(machine, result_6, result_7);
    let last_tangent = small_log(machine, result_8.vector);
    let outgoing = both(first_tangent, [first.outgoing; 3], |x, y| x * y);
    let incoming = both(
        last_tangent,
        [M::F::of(THIRD) - last.outgoing; 3],
        |x, y| x * y,
    );
    let parabola = both(log, [M::F::of(TWO_THIRDS); 3], |x, y| x * y);
    let w1 = if first.kind == M::F::of(KEY_AT_END) {
        both(parabola, incoming, |x, y| x - y)
    } else {
        outgoing
    };
    let v3 = if last.kind == M::F::of(KEY_AT_END) {
        both(parabola, outgoing, |x, y| x - y)
    } else {
        incoming
    };
    let result_9 = norm_squared(machine, chord);
    let whole = FromIdentity {
        vector: step,
        cosm1: result_9 * M::F::of(-0.5),
    };
    let result_10 = small_exp(machine, w1.map(|x| -x));
    let without_first = composed(machine, result_10, whole);
    let result_11 = small_exp(machine, v3.map(|x| -x));
    let result_12 = composed(machine, without_first, result_11);
    let w2 = small_log(machine, result_12.vector);
    let result_13 = dot3(machine, w1, w1);
    let result_14 = dot3(machine, w2, w2);
    let result_15 = dot3(machine, v3, v3);
    let squared_extent = (result_13 + result_14) + result_15;
    let result_16 = norm_squared(machine, chord_before);
    let result_17 = norm_squared(machine, chord);
    let result_18 = norm_squared(machine, chord_after);
    let result_19 = dot3(machine, first_left, first_left);
    let result_20 = dot3(machine, first_right, first_right);
    let result_21 = dot3(machine, last_left, last_left);
    let result_22 = dot3(machine, last_right, last_right);
    let is_valid = (squared_extent <= M::F::of(SMALL_SQUARED_EXTENT))
        & (result_16 <= M::F::of(LONGEST_STEP))
        & (result_17 <= M::F::of(LONGEST_STEP))
        & (result_18 <= M::F::of(LONGEST_STEP))
        & (result_19 <= M::F::of(LONGEST_TANGENT_PART))
        & (result_20 <= M::F::of(LONGEST_TANGENT_PART))
        & (result_21 <= M::F::of(LONGEST_TANGENT_PART))
        & (result_22 <= M::F::of(LONGEST_TANGENT_PART))
        & (first.kind != M::F::of(KEY_UNKNOWN))
        & (last.kind != M::F::of(KEY_UNKNOWN));
    let third_step = small_exp(machine, both(v3, [M::F::of(0.125); 3], |x, y| x * y));
    let result_23 = small_exp(machine, both(w2, [M::F::of(0.5); 3], |x, y| x * y));
    let second_step = composed(machine, result_23, third_step);
    let result_24 = small_exp(machine, both(w1, [M::F::of(0.875); 3], |x, y| x * y));
    let all_steps = composed(machine, result_24, second_step);
    let result_25 = canonical_product(machine, start, all_steps.vector, all_steps.cosm1);
    let m = both(result_25, start, |x, y| x + y);
    let v1 = inverse_rotated(machine, w1, second_step);
    let v2 = inverse_rotated(machine, w2, third_step);
    let outer = both(v1, v3, |x, y| x + y);
    let a = both(
        both(outer, [M::F::of(0.75); 3], |x, y| x * y),
        both(v2, [M::F::of(1.5); 3], |x, y| x * y),
        |x, y| x + y,
    );
    let b = both(both(v3, v1, |x, y| x - y), [M::F::of(1.5); 3], |x, y| x * y);
    let c = both(outer, both(v2, v2, |x, y| x + y), |x, y| x - y);
    let x12 = cross3(machine, v1, v2);
    let x23 = cross3(machine, v2, v3);
    let x13 = cross3(machine, v1, v3);
    let even = both(x12, x23, |x, y| x + y);
    let odd = both(x12, x23, |x, y| x - y);
    let n1 = dot3(machine, v1, v1);
    let n2 = dot3(machine, v2, v2);
    let n3 = dot3(machine, v3, v3);
    let d12 = dot3(machine, v1, v2);
    let d13 = dot3(machine, v1, v3);
    let d23 = dot3(machine, v2, v3);
    let outward = n1 + n3;
    let difference = n1 - n3;
    let volume = dot3(machine, v1, x23);
    let f1 = both(
        both(
            both(
                v1,
                [((n1 * M::F::of(B_111_1) + n2 * M::F::of(B_122_1)) + n3 * M::F::of(B_133_1))
                    - d23 * M::F::of(B_123_1); 3],
                |x, y| x * y,
            ),
            both(
                v3,
                [((n3 * M::F::of(B_111_1) + n2 * M::F::of(B_122_1)) + n1 * M::F::of(B_133_1))
                    - d12 * M::F::of(B_123_1); 3],
                |x, y| x * y,
            ),
            |x, y| x + y,
        ),
        both(
            v2,
            [(outward * M::F::of(B_211_1) + n2 * M::F::of(B_222_1)) + d13 * M::F::of(B_123_1); 3],
            |x, y| x * y,
        ),
        |x, y| x + y,
    );
    let f2 = both(
        both(
            both(
                v1,
                [(n1 * M::F::of(B_111_2) + n2 * M::F::of(B_122_2)) + n3 * M::F::of(B_133_2); 3],
                |x, y| x * y,
            ),
            both(
                v3,
                [(n3 * M::F::of(B_111_2) + n2 * M::F::of(B_122_2)) + n1 * M::F::of(B_133_2); 3],
                |x, y| x * y,
            ),
            |x, y| x - y,
        ),
        both(v2, [difference * M::F::of(B_211_2); 3], |x, y| x * y),
        |x, y| x + y,
    );
    let f3 = both(
        both(
            both(
                v1,
                [((n1 * M::F::of(B_111_3) + n2 * M::F::of(B_122_3)) + n3 * M::F::of(B_133_3))
                    - d23 * M::F::of(B_123_3); 3],
                |x, y| x * y,
            ),
            both(
                v3,
                [((n3 * M::F::of(B_111_3) + n2 * M::F::of(B_122_3)) + n1 * M::F::of(B_133_3))
                    - d12 * M::F::of(B_123_3); 3],
                |x, y| x * y,
            ),
            |x, y| x + y,
        ),
        both(
            v2,
            [(outward * M::F::of(B_211_3) + n2 * M::F::of(B_222_3)) + d13 * M::F::of(B_123_3); 3],
            |x, y| x * y,
        ),
        |x, y| x + y,
    );
    let f4 = both(
        both(
            both(
                v1,
                [(n1 * M::F::of(B_111_4) + n2 * M::F::of(B_122_4)) + n3 * M::F::of(B_133_4); 3],
                |x, y| x * y,
            ),
            both(
                v3,
                [(n3 * M::F::of(B_111_4) + n2 * M::F::of(B_122_4)) + n1 * M::F::of(B_133_4); 3],
                |x, y| x * y,
            ),
            |x, y| x - y,
        ),
        both(v2, [difference * M::F::of(B_211_4); 3], |x, y| x * y),
        |x, y| x + y,
    );
    let f5 = both(
        both(
            both(
                v1,
                [((n1 * M::F::of(B_111_5) + n2 * M::F::of(B_122_5)) + n3 * M::F::of(B_133_5))
                    - d23 * M::F::of(B_123_5); 3],
                |x, y| x * y,
            ),
            both(
                v3,
                [((n3 * M::F::of(B_111_5) + n2 * M::F::of(B_122_5)) + n1 * M::F::of(B_133_5))
                    - d12 * M::F::of(B_123_5); 3],
                |x, y| x * y,
            ),
            |x, y| x + y,
        ),
        both(
            v2,
            [(outward * M::F::of(B_211_5) + n2 * M::F::of(B_222_5)) + d13 * M::F::of(B_123_5); 3],
            |x, y| x * y,
        ),
        |x, y| x + y,
    );
    let f6 = both(
        both(
            both(
                v1,
                [(n1 * M::F::of(B_111_6) + n2 * M::F::of(B_122_6)) + n3 * M::F::of(B_133_6); 3],
                |x, y| x * y,
            ),
            both(
                v3,
                [(n3 * M::F::of(B_111_6) + n2 * M::F::of(B_122_6)) + n1 * M::F::of(B_133_6); 3],
                |x, y| x * y,
            ),
            |x, y| x - y,
        ),
        both(v2, [difference * M::F::of(B_211_6); 3], |x, y| x * y),
        |x, y| x + y,
    );
    let result_26 = canonical(machine, m);
    let result_27 = canonical_product(
        machine,
        m,
        both(a, f1, |x, y| x + y),
        -(volume * M::F::of(B_123_1)),
    );
    let result_28 = dot3(machine, a, a);
    let result_29 = canonical_product(
        machine,
        m,
        both(
            b,
            both(
                both(
                    both(even, [M::F::of(1.125); 3], |x, y| x * y),
                    both(x13, [M::F::of(0.5625); 3], |x, y| x * y),
                    |x, y| x + y,
                ),
                f2,
                |x, y| x + y,
            ),
            |x, y| x + y,
        ),
        result_28 * M::F::of(-0.5),
    );
    let result_30 = dot3(machine, a, b);
    let result_31 = canonical_product(
        machine,
        m,
        both(
            c,
            both(both(odd, [M::F::of(-2.25); 3], |x, y| x * y), f3, |x, y| {
                x + y
            }),
            |x, y| x + y,
        ),
        -result_30 - volume * M::F::of(B_123_3),
    );
    let result_32 = dot3(machine, b, b);
    let result_33 = dot3(machine, a, c);
    let result_34 = canonical_product(
        machine,
        m,
        both(both(x13, [M::F::of(-0.75); 3], |x, y| x * y), f4, |x, y| {
            x + y
        }),
        result_32 * M::F::of(-0.5) - result_33,
    );
    let result_35 = dot3(machine, b, c);
    let result_36 = canonical_product(
        machine,
        m,
        both(both(odd, [M::F::of(3.0); 3], |x, y| x * y), f5, |x, y| {
            x + y
        }),
        -result_35 - volume * M::F::of(B_123_5),
    );
    let result_37 = dot3(machine, c, c);
    let result_38 = canonical_product(
        machine,
        m,
        both(
            both(x13, both(even, even, |x, y| x + y), |x, y| x - y),
            f6,
            |x, y| x + y,
        ),
        result_37 * M::F::of(-0.5),
    );
    SmallAngleCubic {
        powers: [
            result_26, result_27, result_29, result_31, result_34, result_36, result_38,
        ],
        is_valid,
    }
}

/// The exponential of a small half-rotation vector.
pub(crate) fn small_exp<M: Machine>(machine: &M, v: [M::F; 3]) -> FromIdentity<M::F> {
    let _block = machine.block(line!(), 9);
    let x = dot3(machine, v, v);
    let sinc = (M::F::of(SINC_2) * x + M::F::of(SINC_1)) * x;
    FromIdentity {
        vector: both(both(v, [sinc; 3], |x, y| x * y), v, |x, y| x + y),
        cosm1: (M::F::of(COSM1_2) * x + M::F::of(COSM1_1)) * x,
    }
}

/// The logarithm of a small rotation by its vector part, whose length is the sine.
pub(crate) fn small_log<M: Machine>(machine: &M, v: [M::F; 3]) -> [M::F; 3] {
    let _block = machine.block(line!(), 10);
    let x = dot3(machine, v, v);
    let tail =
        ((M::F::of(LOG_4) * x + M::F::of(LOG_3)) * x + M::F::of(LOG_2)) * x + M::F::of(LOG_1);
    both(both(v, [tail * x; 3], |x, y| x * y), v, |x, y| x + y)
}

/// One of the four words of a cell.
pub(crate) fn source_of<M: Machine>(machine: &M, words: [u32; 4], member: u32) -> u32 {
    let _block = machine.block(line!(), 7);
    let is_odd = member & 1u32 != 0u32;
    let low = if is_odd { words[1] } else { words[0] };
    let high = if is_odd { words[3] } else { words[2] };
    (if member >= 2u32 { high } else { low }) & SOURCE_BITS
}

/// The last span of a time base that does not start after a tick.
pub(crate) fn span_at<M: Machine>(machine: &M, base: CrowdBase, tick: u32) -> u32 {
    let mut found: u32 = 0u32;
    let mut step: u32 = Default::default();
    let _block = machine.block(line!(), 2);
    step = base.step;
    loop {
        let _block = machine.block(line!(), 19);
        let loaded = step;
        if !(loaded != 0u32) {
            break;
        }
        let loaded_2 = found;
        let loaded_3 = step;
        let next = loaded_2.wrapping_add(loaded_3);
        let inside = next < base.count;
        let loaded_4 = machine.load::<u32>(
            Global::Spans,
            4 * (base.first.wrapping_add(if inside { next } else { 0u32 }) as usize),
        );
        let start = loaded_4 & TICKS;
        let loaded_5 = found;
        found = if inside & (tick >= start) {
            next
        } else {
            loaded_5
        };
        let loaded_6 = step;
        step = loaded_6 >> 1u32;
    }
    let loaded_7 = found;
    loaded_7
}

pub(crate) fn span_of<M: Machine>(machine: &M, index: u32) -> CrowdSpan<M::F> {
    let _block = machine.block(line!(), 4);
    let all = machine.load::<[u32; 4]>(Global::Spans, 4 * (index as usize));
    CrowdSpan {
        start: all[0],
        whole: all[1] as i32,
        scale: M::F::of_bits(all[2]),
        offset: M::F::of_bits(all[3]),
    }
}

/// The vector part of a⁻¹ (a + chord), the step from a to its next key.
pub(crate) fn step_vector<M: Machine>(machine: &M, a: [M::F; 4], chord: [M::F; 4]) -> [M::F; 3] {
    let _block = machine.block(line!(), 21);
    [
        (a[3] * chord[0] - chord[3] * a[0]) - (a[1] * chord[2] - a[2] * chord[1]),
        (a[3] * chord[1] - chord[3] * a[1]) - (a[2] * chord[0] - a[0] * chord[2]),
        (a[3] * chord[2] - chord[3] * a[2]) - (a[0] * chord[1] - a[1] * chord[0]),
    ]
}

pub(crate) fn store<M: Machine>(machine: &M, index: u32, rotation: [M::F; 4]) {
    const OF_KERNELS: [u8; 227] = [
        0, 0, 1, 2, 3, 4, 5, 6, 7, 1, 0, 1, 2, 3, 4, 5, 6, 7, 1, 0, 1, 2, 3, 4, 5, 6, 7, 1, 0, 1,
        2, 3, 4, 5, 6, 7, 1, 0, 1, 2, 3, 4, 5, 6, 7, 1, 0, 1, 2, 3, 4, 5, 6, 7, 1, 0, 1, 2, 3, 4,
        5, 6, 7, 1, 0, 1, 2, 3, 4, 5, 6, 7, 1, 0, 1, 2, 3, 4, 5, 6, 7, 1, 0, 1, 2, 3, 4, 5, 6, 7,
        1, 0, 1, 2, 3, 4, 5, 6, 7, 1, 0, 1, 2, 3, 4, 5, 6, 7, 1, 0, 1, 2, 3, 4, 5, 6, 7, 1, 0, 1,
        2, 3, 4, 5, 6, 7, 1, 3, 3, 3, 0, 0, 0, 0, 0, 0, 3, 3, 3, 3, 3, 3, 0, 0, 0, 0, 0, 0, 0, 0,
        0, 0, 0, 0, 3, 2, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1, 2, 8, 4, 5, 6, 7, 1, 0, 1, 2, 8, 4, 5, 6,
        7, 1, 0, 1, 2, 8, 4, 5, 6, 7, 1, 0, 1, 2, 8, 4, 5, 6, 7, 1, 0, 1, 2, 8, 4, 5, 6, 7, 1, 0,
        1, 2, 8, 4, 5, 6, 7, 1, 8, 8, 8, 8, 8, 8, 8, 8, 8,
    ];
    match OF_KERNELS[machine.code()] {
        0 => store_of_axis_angle(machine, index, rotation),
        1 => store_of_euler(machine, index, rotation),
        2 => store_of_f16(machine, index, rotation),
        3 => store_of_f32(machine, index, rotation),
        4 => store_of_matrix3x3(machine, index, rotation),
        5 => store_of_matrix3x4(machine, index, rotation),
        6 => store_of_six_d(machine, index, rotation),
        7 => store_of_snorm16(machine, index, rotation),
        _ => store_of_f32_2(machine, index, rotation),
    }
}

pub(crate) fn store_of_axis_angle<M: Machine>(machine: &M, index: u32, rotation: [M::F; 4]) {
    let _block = machine.block(line!(), 3);
    let result = axis_angle(machine, rotation);
    let result_2 = canonical(machine, result);
    machine.store::<[M::F; 4]>(Global::Rotations, 4 * (index as usize), result_2);
}

pub(crate) fn store_of_euler<M: Machine>(machine: &M, index: u32, rotation: [M::F; 4]) {
    let mut all: [M::F; 3] = Default::default();
    let mut part: u32 = 0u32;
    let _block = machine.block(line!(), 2);
    let result = parts_1(machine, rotation);
    all = result;
    loop {
        let _block = machine.block(line!(), 12);
        let loaded = part;
        if !(loaded < 3u32) {
            break;
        }
        let loaded_2 = part;
        let loaded_3 = part;
        let loaded_4 = all[loaded_3 as usize];
        machine.store::<M::F>(
            Global::Rotations,
            index.wrapping_mul(3u32).wrapping_add(loaded_2) as usize,
            loaded_4,
        );
        let loaded_5 = part;
        part = loaded_5.wrapping_add(1u32);
    }
}

pub(crate) fn store_of_f16<M: Machine>(machine: &M, index: u32, rotation: [M::F; 4]) {
    let _block = machine.block(line!(), 6);
    let half = to_half(machine, rotation);
    machine.store::<[u32; 2]>(
        Global::Rotations,
        2 * (index as usize),
        [half[0] | (half[1] << 16u32), half[2] | (half[3] << 16u32)],
    );
}

pub(crate) fn store_of_f32<M: Machine>(machine: &M, index: u32, rotation: [M::F; 4]) {
    let _block = machine.block(line!(), 1);
    machine.store::<[M::F; 4]>(Global::Rotations, 4 * (index as usize), rotation);
}

pub(crate) fn store_of_matrix3x3<M: Machine>(machine: &M, index: u32, rotation: [M::F; 4]) {
    let mut all: [M::F; 9] = Default::default();
    let mut part: u32 = 0u32;
    let _block = machine.block(line!(), 2);
    let result = parts_3(machine, rotation);
    all = result;
    loop {
        let _block = machine.block(line!(), 12);
        let loaded = part;
        if !(loaded < 9u32) {
            break;
        }
        let loaded_2 = part;
        let loaded_3 = part;
        let loaded_4 = all[loaded_3 as usize];
        machine.store::<M::F>(
            Global::Rotations,
            index.wrapping_mul(9u32).wrapping_add(loaded_2) as usize,
            loaded_4,
        );
        let loaded_5 = part;
        part = loaded_5.wrapping_add(1u32);
    }
}

pub(crate) fn store_of_matrix3x4<M: Machine>(machine: &M, index: u32, rotation: [M::F; 4]) {
    let mut all: [[M::F; 4]; 3] = Default::default();
    let mut part: u32 = 0u32;
    let _block = machine.block(line!(), 2);
    let result = parts_4(machine, rotation);
    all = result;
    loop {
        let _block = machine.block(line!(), 12);
        let loaded = part;
        if !(loaded < 3u32) {
            break;
        }
        let loaded_2 = part;
        let loaded_3 = part;
        let loaded_4 = all[loaded_3 as usize];
        machine.store::<[M::F; 4]>(
            Global::Rotations,
            4 * (index.wrapping_mul(3u32).wrapping_add(loaded_2) as usize),
            loaded_4,
        );
        let loaded_5 = part;
        part = loaded_5.wrapping_add(1u32);
    }
}

pub(crate) fn store_of_six_d<M: Machine>(machine: &M, index: u32, rotation: [M::F; 4]) {
    let mut all: [M::F; 6] = Default::default();
    let mut part: u32 = 0u32;
    let _block = machine.block(line!(), 2);
    let result = parts_2(machine, rotation);
    all = result;
    loop {
        let _block = machine.block(line!(), 12);
        let loaded = part;
        if !(loaded < 6u32) {
            break;
        }
        let loaded_2 = part;
        let loaded_3 = part;
        let loaded_4 = all[loaded_3 as usize];
        machine.store::<M::F>(
            Global::Rotations,
            index.wrapping_mul(6u32).wrapping_add(loaded_2) as usize,
            loaded_4,
        );
        let loaded_5 = part;
        part = loaded_5.wrapping_add(1u32);
    }
}

pub(crate) fn store_of_snorm16<M: Machine>(machine: &M, index: u32, rotation: [M::F; 4]) {
    let _block = machine.block(line!(), 6);
    let whole = to_snorm(machine, rotation);
    machine.store::<[u32; 2]>(
        Global::Rotations,
        2 * (index as usize),
        [
            whole[0] | (whole[1] << 16u32),
            whole[2] | (whole[3] << 16u32),
        ],
    );
}

pub(crate) fn store_of_f32_2<M: Machine>(machine: &M, index: u32, rotation: [M::F; 4]) {
    let _block = machine.block(line!(), 2);
    let result = wide(machine, rotation);
    machine.store::<[u64; 2]>(Global::Rotations, 4 * (index as usize), result);
}

pub(crate) fn store_three<M: Machine>(machine: &M, first: u32, numbers: [M::F; 4]) {
    let _block = machine.block(line!(), 5);
    machine.store::<M::F>(Global::Values, first as usize, numbers[0]);
    machine.store::<M::F>(
        Global::Values,
        first.wrapping_add(1u32) as usize,
        numbers[1],
    );
    machine.store::<M::F>(
        Global::Values,
        first.wrapping_add(2u32) as usize,
        numbers[2],
    );
}

pub(crate) fn store_with_care<M: Machine>(
    machine: &M,
    item: SpreadRun<M::F>,
    location: [u32; 3],
    first_j: u32,
    repetition: u32,
) {
    const OF_KERNELS: [u8; 227] = [
        0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,
        0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,
        0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,
        0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1, 0, 1, 1, 0, 0, 0, 1, 0, 1, 0,
        1, 1, 0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,
        0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,
        0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,
        0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,
    ];
    match OF_KERNELS[machine.code()] {
        0 => store_with_care_of_alone(machine, item, location, first_j, repetition),
        _ => store_with_care_of_alone_2(machine, item, location, first_j, repetition),
    }
}

/// A constant, or a run whose samples are not all simple, which is rare.
pub(crate) fn store_with_care_of_alone<M: Machine>(
    machine: &M,
    item: SpreadRun<M::F>,
    location: [u32; 3],
    first_j: u32,
    repetition: u32,
) {
    let mut j: u32 = Default::default();
    let _block = machine.block(line!(), 14);
    let count = sample_count(machine, item);
    let first = location[1];
    let stride = machine.load::<u32>(Global::Dispatch, 9);
    let step = machine.load::<u32>(Global::Dispatch, 7);
    j = first_j;
    if item.count & IS_CONSTANT != 0u32 {
        let _block = machine.block(line!(), 7);
        let constant = constant_of_run(machine, item.source, repetition);
        let loaded = j;
        if loaded < count {
            let _block = machine.block(line!(), 4);
            let loaded_2 = j;
            store(
                machine,
                first.wrapping_add(loaded_2.wrapping_mul(stride)),
                constant,
            );
        }
        let loaded_3 = j;
        j = loaded_3.wrapping_add(step);
        loop {
            let _block = machine.block(line!(), 10);
            let loaded_4 = j;
            if !(loaded_4 < count) {
                break;
            }
            let loaded_5 = j;
            store(
                machine,
                first.wrapping_add(loaded_5.wrapping_mul(stride)),
                constant,
            );
            let loaded_6 = j;
            j = loaded_6.wrapping_add(step);
        }
        return;
    }
    let segment = segment_at_arc_segment(machine, location[0]);
    let loaded_7 = j;
    if loaded_7 < count {
        let _block = machine.block(line!(), 6);
        let loaded_8 = j;
        let loaded_9 = j;
        let result = sample_of_arc_segment(machine, item, segment, loaded_9, repetition);
        store(
            machine,
            first.wrapping_add(loaded_8.wrapping_mul(stride)),
            result,
        );
    }
    let loaded_10 = j;
    j = loaded_10.wrapping_add(step);
    loop {
        let _block = machine.block(line!(), 12);
        let loaded_11 = j;
        if !(loaded_11 < count) {
            break;
        }
        let loaded_12 = j;
        let loaded_13 = j;
        let result_2 = sample_of_arc_segment(machine, item, segment, loaded_13, repetition);
        store(
            machine,
            first.wrapping_add(loaded_12.wrapping_mul(stride)),
            result_2,
        );
        let loaded_14 = j;
        j = loaded_14.wrapping_add(step);
    }
}

/// A constant, or a run whose samples are not all simple, which is rare.
pub(crate) fn store_with_care_of_alone_2<M: Machine>(
    machine: &M,
    item: SpreadRun<M::F>,
    location: [u32; 3],
    first_j: u32,
    repetition: u32,
) {
    let mut j: u32 = Default::default();
    let _block = machine.block(line!(), 14);
    let count = sample_count(machine, item);
    let first = location[1];
    let stride = machine.load::<u32>(Global::Dispatch, 9);
    let step = machine.load::<u32>(Global::Dispatch, 7);
    j = first_j;
    if item.count & IS_CONSTANT != 0u32 {
        let _block = machine.block(line!(), 7);
        let constant = constant_of_run(machine, item.source, repetition);
        let loaded = j;
        if loaded < count {
            let _block = machine.block(line!(), 4);
            let loaded_2 = j;
            store(
                machine,
                first.wrapping_add(loaded_2.wrapping_mul(stride)),
                constant,
            );
        }
        let loaded_3 = j;
        j = loaded_3.wrapping_add(step);
        loop {
            let _block = machine.block(line!(), 10);
            let loaded_4 = j;
            if !(loaded_4 < count) {
                break;
            }
            let loaded_5 = j;
            store(
                machine,
                first.wrapping_add(loaded_5.wrapping_mul(stride)),
                constant,
            );
            let loaded_6 = j;
            j = loaded_6.wrapping_add(step);
        }
        return;
    }
    let segment = segment_at_polynomial_segment(machine, location[0]);
    let loaded_7 = j;
    if loaded_7 < count {
        let _block = machine.block(line!(), 6);
        let loaded_8 = j;
        let loaded_9 = j;
        let result = sample_of_polynomial_segment(machine, item, segment, loaded_9, repetition);
        store(
            machine,
            first.wrapping_add(loaded_8.wrapping_mul(stride)),
            result,
        );
    }
    let loaded_10 = j;
    j = loaded_10.wrapping_add(step);
    loop {
        let _block = machine.block(line!(), 12);
        let loaded_11 = j;
        if !(loaded_11 < count) {
            break;
        }
        let loaded_12 = j;
        let loaded_13 = j;
        let result_2 = sample_of_polynomial_segment(machine, item, segment, loaded_13, repetition);
        store(
            machine,
            first.wrapping_add(loaded_12.wrapping_mul(stride)),
            result_2,
        );
        let loaded_14 = j;
        j = loaded_14.wrapping_add(step);
    }
}

pub(crate) fn tick_of<M: Machine>(machine: &M, entry: CrowdEntry, period: u32) -> u32 {
    const OF_KERNELS: [u8; 227] = [
        0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,
        0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,
        0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,
        0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,
        0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,
        0, 0, 0, 0, 1, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,
        0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,
        0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,
    ];
    match OF_KERNELS[machine.code()] {
        0 => tick_of_of_ticks(machine, entry, period),
        _ => tick_of_of_ticks_2(machine, entry, period),
    }
}

/// The tick of the clip at which a layer stands, from 0 to `period`.
pub(crate) fn tick_of_of_ticks<M: Machine>(machine: &M, entry: CrowdEntry, period: u32) -> u32 {
    let _block = machine.block(line!(), 41);
    let modes = entry.speed_and_modes;
    let backwards = modes & RUNS_BACKWARDS != 0u32;
    let wrap = (modes >> 29u32) & 3u32;
    let loaded = machine.load::<u32>(Global::Dispatch, 6);
    let loaded_2 = machine.load::<u32>(Global::Dispatch, 7);
    let clock = [loaded, loaded_2];
    let elapsed = wide_difference(
        machine,
        clock,
        [entry.anchor << 8u32, entry.anchor >> 24u32],
    );
    let moved = move_of(
        machine,
        modes & SPEED_MAGNITUDE,
        [elapsed[0], elapsed[1] & 255u32],
    );
    let ticks = moved.ticks;
    let part = moved.part;
    if wrap == WRAP_HOLD {
        let _block = machine.block(line!(), 1);
        let result = held_tick(machine, entry.start, ticks, part, backwards, period);
        return result;
    }
    let doubled = wrap.wrapping_sub(WRAP_LOOP);
    let whole = period << doubled;
    let half = [
        (ticks[0] >> doubled) | ((ticks[1] & doubled) << 31u32),
        ticks[1] >> doubled,
    ];
    let result_2 = tick_remainder(machine, half, period);
    let along = (result_2 << doubled) | (ticks[0] & doubled);
    let first = entry.start.wrapping_sub(START_BIAS);
    let start = if first == whole { 0u32 } else { first };
    let forwards = if backwards {
        whole.wrapping_sub(along).wrapping_sub(part)
    } else {
        along
    };
    let room = whole.wrapping_sub(forwards);
    let into = if start >= room {
        start.wrapping_sub(room)
    } else {
        start.wrapping_add(forwards)
    };
    if into.wrapping_add(part) > period {
        whole.wrapping_sub(into).wrapping_sub(part)
    } else {
        into
    }
}

/// The tick of the clip at which a layer stands, from 0 to `period`.
pub(crate) fn tick_of_of_ticks_2<M: Machine>(machine: &M, entry: CrowdEntry, period: u32) -> u32 {
    let _block = machine.block(line!(), 41);
    let modes = entry.speed_and_modes;
    let backwards = modes & RUNS_BACKWARDS != 0u32;
    let wrap = (modes >> 29u32) & 3u32;
    let loaded = machine.load::<u32>(Global::Dispatch, 3);
    let loaded_2 = machine.load::<u32>(Global::Dispatch, 4);
    let clock = [loaded, loaded_2];
    let elapsed = wide_difference(
        machine,
        clock,
        [entry.anchor << 8u32, entry.anchor >> 24u32],
    );
    let moved = move_of(
        machine,
        modes & SPEED_MAGNITUDE,
        [elapsed[0], elapsed[1] & 255u32],
    );
    let ticks = moved.ticks;
    let part = moved.part;
    if wrap == WRAP_HOLD {
        let _block = machine.block(line!(), 1);
        let result = held_tick(machine, entry.start, ticks, part, backwards, period);
        return result;
    }
    let doubled = wrap.wrapping_sub(WRAP_LOOP);
    let whole = period << doubled;
    let half = [
        (ticks[0] >> doubled) | ((ticks[1] & doubled) << 31u32),
        ticks[1] >> doubled,
    ];
    let result_2 = tick_remainder(machine, half, period);
    let along = (result_2 << doubled) | (ticks[0] & doubled);
    let first = entry.start.wrapping_sub(START_BIAS);
    let start = if first == whole { 0u32 } else { first };
    let forwards = if backwards {
        whole.wrapping_sub(along).wrapping_sub(part)
    } else {
        along
    };
    let room = whole.wrapping_sub(forwards);
    let into = if start >= room {
        start.wrapping_sub(room)
    } else {
        start.wrapping_add(forwards)
    };
    if into.wrapping_add(part) > period {
        whole.wrapping_sub(into).wrapping_sub(part)
    } else {
        into
    }
}

/// x modulo q, for x below 2^48 and q from 1 to 2^31.
pub(crate) fn tick_remainder<M: Machine>(machine: &M, x: [u32; 2], q: u32) -> u32 {
    let mut digit: u32 = 16u32;
    let mut rest: u32 = Default::default();
    let mut low: u32 = Default::default();
    let mut left: u32 = 32u32;
    let _block = machine.block(line!(), 6);
    if x[1] == 0u32 {
        let _block = machine.block(line!(), 1);
        let result = remainder(machine, x[0], q);
        return result;
    }
    loop {
        let _block = machine.block(line!(), 9);
        let loaded = digit;
        if !(q.wrapping_sub(1u32) >> 32u32.wrapping_sub(loaded) != 0u32) {
            break;
        }
        let loaded_2 = digit;
        digit = loaded_2 >> 1u32;
    }
    let result_2 = remainder(machine, x[1], q);
    rest = result_2;
    low = x[0];
    loop {
        let _block = machine.block(line!(), 21);
        let loaded_3 = left;
        if !(loaded_3 != 0u32) {
            break;
        }
        let loaded_4 = rest;
        let loaded_5 = digit;
        let loaded_6 = low;
        let loaded_7 = digit;
        let result_3 = remainder(
            machine,
            (loaded_4 << loaded_5) | (loaded_6 >> 32u32.wrapping_sub(loaded_7)),
            q,
        );
        rest = result_3;
        let loaded_8 = low;
        let loaded_9 = digit;
        low = loaded_8 << loaded_9;
        let loaded_10 = left;
        let loaded_11 = digit;
        left = loaded_10.wrapping_sub(loaded_11);
    }
    let loaded_12 = rest;
    loaded_12
}

/// As `to_half`, for values of any magnitude.
pub(crate) fn to_any_half<M: Machine>(machine: &M, value: [M::F; 4]) -> [u32; 4] {
    let _block = machine.block(line!(), 9);
    let bits = value.map(|x| x.bits());
    let large = both(
        both(bits, [0x7fffffffu32; 4], |x, y| x & y),
        [0x477ff000u32; 4],
        |x, y| x >= y,
    );
    let sign = both(
        both(bits, [16u32; 4], |x, y| x >> y),
        [0x8000u32; 4],
        |x, y| x & y,
    );
    let small = choose(large, [M::F::of(0.0); 4], value);
    let result = to_half(machine, small);
    choose(large, both(sign, [0x7c00u32; 4], |x, y| x | y), result)
}

/// The bits of each component as a half, for |component| < 2.
pub(crate) fn to_half<M: Machine>(machine: &M, value: [M::F; 4]) -> [u32; 4] {
    let _block = machine.block(line!(), 17);
    let bits = value.map(|x| x.bits());
    let sign = both(
        both(bits, [16u32; 4], |x, y| x >> y),
        [0x8000u32; 4],
        |x, y| x & y,
    );
    let magnitude = both(bits, [0x7fffffffu32; 4], |x, y| x & y);
    let odd = both(
        both(magnitude, [13u32; 4], |x, y| x >> y),
        [1u32; 4],
        |x, y| x & y,
    );
    let normal = both(
        both(
            both(
                both(magnitude, [0xfffu32; 4], |x, y| x.wrapping_add(y)),
                odd,
                |x, y| x.wrapping_add(y),
            ),
            [0x38000000u32; 4],
            |x, y| x.wrapping_sub(y),
        ),
        [13u32; 4],
        |x, y| x >> y,
    );
    let small = both(
        both(
            magnitude.map(|x| M::F::of_bits(x)),
            [M::F::of(0.5); 4],
            |x, y| x + y,
        )
        .map(|x| x.bits()),
        [0x3f000000u32; 4],
        |x, y| x.wrapping_sub(y),
    );
    both(
        sign,
        choose(
            both(magnitude, [0x38800000u32; 4], |x, y| x < y),
            small,
            normal,
        ),
        |x, y| x | y,
    )
}

/// The whole number of each component, for |component| < 1 + 2^-16.
pub(crate) fn to_snorm<M: Machine>(machine: &M, value: [M::F; 4]) -> [u32; 4] {
    let _block = machine.block(line!(), 4);
    both(
        both(
            both(value, [M::F::of(32767.0); 4], |x, y| x * y),
            [M::F::of(12582912.0); 4],
            |x, y| x + y,
        )
        .map(|x| x.bits()),
        [0xffffu32; 4],
        |x, y| x & y,
    )
}

/// Evaluates a joint in its parent's frame.
pub(crate) fn transform_joint<M: Machine>(machine: &M, instance: u32, joint: u32) {
    let _block = machine.block(line!(), 16);
    let result = layered(machine, instance, joint, ROTATION);
    let axes = matrix_rows(machine, result, 0u32);
    let moved = layered(machine, instance, joint, TRANSLATION);
    let scale = layered(machine, instance, joint, SCALE);
    let loaded = machine.load::<u32>(Global::Dispatch, 2);
    let row = instance
        .wrapping_mul(loaded)
        .wrapping_add(joint)
        .wrapping_mul(3u32);
    let result_2 = transform_row(machine, axes.first, scale, moved[0]);
    machine.store::<[M::F; 4]>(Global::Rows, 4 * (row as usize), result_2);
    let result_3 = transform_row(machine, axes.second, scale, moved[1]);
    machine.store::<[M::F; 4]>(
        Global::Rows,
        4 * (row.wrapping_add(1u32) as usize),
        result_3,
    );
    let result_4 = transform_row(machine, axes.third, scale, moved[2]);
    machine.store::<[M::F; 4]>(
        Global::Rows,
        4 * (row.wrapping_add(2u32) as usize),
        result_4,
    );
}

/// A row of R with the columns scaled, and the translation behind it.
pub(crate) fn transform_row<M: Machine>(
    machine: &M,
    axis: [M::F; 3],
    scale: [M::F; 4],
    moved: M::F,
) -> [M::F; 4] {
    let _block = machine.block(line!(), 5);
    let row = canonical(machine, [axis[0], axis[1], axis[2], M::F::of(0.0)]);
    let result = canonical(
        machine,
        [
            row[0] * scale[0],
            row[1] * scale[1],
            row[2] * scale[2],
            moved,
        ],
    );
    result
}

pub(crate) fn unpacked<M: Machine>(machine: &M, words: [u32; 2]) -> [M::F; 4] {
    let _block = machine.block(line!(), 30);
    let a = packed_component(machine, words[0]);
    let b = packed_component(machine, (words[0] >> 20u32) | (words[1] << 12u32));
    let c = packed_component(machine, words[1] >> 8u32);
    let square = (a * a + b * b) + c * c;
    let rest = M::F::of(1.0) - square;
    let d = exact_root(
        machine,
        if rest < M::F::of(0.0) {
            M::F::of(0.0)
        } else {
            rest
        },
    );
    let largest = (words[1] >> 28u32) & 3u32;
    let value = if largest >= 2u32 {
        if largest == 3u32 {
            [a, b, c, d]
        } else {
            [b, c, d, a]
        }
    } else {
        if largest == 1u32 {
            [c, d, a, b]
        } else {
            [d, a, b, c]
        }
    };
    let is_negative = (words[1] >> 30u32) & 1u32 == 1u32;
    let result = canonical(
        machine,
        if is_negative {
            value.map(|x| -x)
        } else {
            value
        },
    );
    result
}

/// The value of a curve of so many coefficients, or its derivative by its parameter.
pub(crate) fn value_and_slope<M: Machine>(
    machine: &M,
    channel: CrowdChannel,
    along: MotionSpan<M::F>,
    coefficients: u32,
) -> ValueAndSlope<M::F> {
    let mut cell: u32 = Default::default();
    let mut slope: [M::F; 4] = Default::default();
    let mut value: [M::F; 4] = Default::default();
    let mut power: u32 = Default::default();
    let _block = machine.block(line!(), 23);
    let first = channel.first.wrapping_add(
        along
            .index
            .wrapping_mul(channel.count)
            .wrapping_mul(coefficients),
    );
    cell = first.wrapping_add(coefficients.wrapping_sub(1u32).wrapping_mul(channel.count));
    let loaded = cell;
    let result = cell_at(machine, loaded);
    slope = result;
    let loaded_2 = cell;
    cell = loaded_2.wrapping_sub(channel.count);
    let loaded_3 = slope;
    let loaded_4 = cell;
    let result_2 = cell_at(machine, loaded_4);
    value = both(
        both(loaded_3, [along.parameter; 4], |x, y| x * y),
        result_2,
        |x, y| x + y,
    );
    power = coefficients.wrapping_sub(2u32);
    loop {
        let _block = machine.block(line!(), 20);
        let loaded_5 = power;
        if !(loaded_5 != 0u32) {
            break;
        }
        let loaded_6 = slope;
        let loaded_7 = value;
        slope = both(
            both(loaded_6, [along.parameter; 4], |x, y| x * y),
            loaded_7,
            |x, y| x + y,
        );
        let loaded_8 = cell;
        cell = loaded_8.wrapping_sub(channel.count);
        let loaded_9 = value;
        let loaded_10 = cell;
        let result_3 = cell_at(machine, loaded_10);
        value = both(
            both(loaded_9, [along.parameter; 4], |x, y| x * y),
            result_3,
            |x, y| x + y,
        );
        let loaded_11 = power;
        power = loaded_11.wrapping_sub(1u32);
    }
    let loaded_12 = value;
    let loaded_13 = slope;
    ValueAndSlope {
        value: loaded_12,
        slope: loaded_13,
    }
}

pub(crate) fn vector_at<M: Machine>(machine: &M, word: u32) -> [M::F; 3] {
    let _block = machine.block(line!(), 5);
    let loaded = machine.load::<M::F>(Global::Tracks, word as usize);
    let loaded_2 = machine.load::<M::F>(Global::Tracks, word.wrapping_add(1u32) as usize);
    let loaded_3 = machine.load::<M::F>(Global::Tracks, word.wrapping_add(2u32) as usize);
    [loaded, loaded_2, loaded_3]
}

/// Makes the matrix of a joint one in the model, where its parent's is one.
pub(crate) fn walk<M: Machine>(machine: &M, instance: u32, link: CrowdLink) {
    let _block = machine.block(line!(), 26);
    let loaded = machine.load::<u32>(Global::Dispatch, 2);
    let above = instance
        .wrapping_mul(loaded)
        .wrapping_add(link.parent)
        .wrapping_mul(3u32);
    let loaded_2 = machine.load::<u32>(Global::Dispatch, 2);
    let row = instance
        .wrapping_mul(loaded_2)
        .wrapping_add(link.joint)
        .wrapping_mul(3u32);
    let first = machine.load::<[M::F; 4]>(Global::Rows, 4 * (row as usize));
    let second = machine.load::<[M::F; 4]>(Global::Rows, 4 * (row.wrapping_add(1u32) as usize));
    let third = machine.load::<[M::F; 4]>(Global::Rows, 4 * (row.wrapping_add(2u32) as usize));
    let loaded_3 = machine.load::<[M::F; 4]>(Global::Rows, 4 * (above as usize));
    let result = row_product(machine, loaded_3, first, second, third);
    machine.store::<[M::F; 4]>(Global::Rows, 4 * (row as usize), result);
    let loaded_4 = machine.load::<[M::F; 4]>(Global::Rows, 4 * (above.wrapping_add(1u32) as usize));
    let result_2 = row_product(machine, loaded_4, first, second, third);
    machine.store::<[M::F; 4]>(
        Global::Rows,
        4 * (row.wrapping_add(1u32) as usize),
        result_2,
    );
    let loaded_5 = machine.load::<[M::F; 4]>(Global::Rows, 4 * (above.wrapping_add(2u32) as usize));
    let result_3 = row_product(machine, loaded_5, first, second, third);
    machine.store::<[M::F; 4]>(
        Global::Rows,
        4 * (row.wrapping_add(2u32) as usize),
        result_3,
    );
}

/// Stores the state of a frame, which comes after the frame above it.
pub(crate) fn walk_to<M: Machine>(
    machine: &M,
    frame: TreeFrame<M::F>,
    first_word: u32,
    first: u32,
    state: u32,
) {
    let mut above: [M::F; 4] = [M::F::of(0.0), M::F::of(0.0), M::F::of(0.0), M::F::of(1.0)];
    let mut from_root: [M::F; 3] = [M::F::of(0.0); 3];
    let mut velocity_above: [M::F; 3] = [M::F::of(0.0); 3];
    let mut angular_above: [M::F; 3] = [M::F::of(0.0); 3];
    let mut arm: [M::F; 3] = Default::default();
    let mut rotation: [M::F; 4] = Default::default();
    let mut linear: [M::F; 3] = [M::F::of(0.0); 3];
    let mut angular: [M::F; 3] = [M::F::of(0.0); 3];
    let mut rate: M::F = M::F::of(0.0);
    let mut in_world: [M::F; 4] = Default::default();
    let _block = machine.block(line!(), 38);
    let loaded = machine.load::<u32>(Global::Dispatch, 4);
    let moves = loaded != 0u32;
    if frame.above != NO_FRAME {
        let _block = machine.block(line!(), 10);
        let parent = first.wrapping_add(frame.above).wrapping_mul(STATE_VECTORS);
        let loaded_2 = machine.load::<[M::F; 4]>(
            Global::States,
            4 * (parent.wrapping_add(WORLD_ROTATION) as usize),
        );
        above = loaded_2;
        let loaded_3 = machine.load::<[M::F; 4]>(
            Global::States,
            4 * (parent.wrapping_add(FROM_ROOT) as usize),
        );
        from_root = [loaded_3[0], loaded_3[1], loaded_3[2]];
        if moves {
            let _block = machine.block(line!(), 8);
            let loaded_4 = machine
                .load::<[M::F; 4]>(Global::States, 4 * (parent.wrapping_add(VELOCITY) as usize));
            velocity_above = [loaded_4[0], loaded_4[1], loaded_4[2]];
            let loaded_5 = machine.load::<[M::F; 4]>(
                Global::States,
                4 * (parent.wrapping_add(ANGULAR_VELOCITY) as usize),
            );
            angular_above = [loaded_5[0], loaded_5[1], loaded_5[2]];
        }
    }
    let word = first_word.wrapping_add(frame.source);
    let loaded_6 = above;
    let axes = product(machine, loaded_6, frame.rest);
    let loaded_7 = above;
    let result = rotated(machine, loaded_7, frame.offset);
    arm = result;
    rotation = axes;
    if (frame.kind == FRAME_HINGE) | (frame.kind == FRAME_SLIDE) {
        let _block = machine.block(line!(), 6);
        let loaded_8 = machine.load::<M::F>(Global::Tracks, word as usize);
        let value = frame.multiplier * loaded_8 + frame.shift;
        if moves {
            let _block = machine.block(line!(), 4);
            let loaded_9 =
                machine.load::<M::F>(Global::Tracks, word.wrapping_add(VECTOR_WORDS) as usize);
            rate = frame.multiplier * loaded_9;
        }
        if frame.kind == FRAME_HINGE {
            let _block = machine.block(line!(), 6);
            let result_2 = rotation_about(machine, frame.axis, value);
            let result_3 = product(machine, axes, result_2);
            rotation = result_3;
            let loaded_10 = rate;
            angular = both(frame.axis, [loaded_10; 3], |x, y| x * y);
        } else {
            let _block = machine.block(line!(), 8);
            let loaded_11 = arm;
            let result_4 = rotated(machine, axes, both(frame.axis, [value; 3], |x, y| x * y));
            arm = both(loaded_11, result_4, |x, y| x + y);
            let loaded_12 = rate;
            linear = both(frame.axis, [loaded_12; 3], |x, y| x * y);
        }
    } else {
        let _block = machine.block(line!(), 2);
        if frame.kind != FRAME_FIXED {
            let _block = machine.block(line!(), 7);
            let result_5 = rotation_at_2(machine, word.wrapping_add(4u32));
            let result_6 = product(machine, axes, result_5);
            rotation = result_6;
            if frame.kind == FRAME_FREE {
                let _block = machine.block(line!(), 6);
                let loaded_13 = arm;
                let result_7 = vector_at(machine, word.wrapping_add(8u32));
                let result_8 = rotated(machine, axes, result_7);
                arm = both(loaded_13, result_8, |x, y| x + y);
            }
            if moves {
                let _block = machine.block(line!(), 5);
                let result_9 = vector_at(machine, word.wrapping_add(16u32));
                angular = result_9;
                if frame.kind != FRAME_BALL {
                    let _block = machine.block(line!(), 3);
                    let result_10 = vector_at(machine, word.wrapping_add(12u32));
                    linear = result_10;
                }
            }
        }
    }
    let loaded_14 = rotation;
    let loaded_15 = rotation;
    let result_11 = dot4(machine, loaded_14, loaded_15);
    let scale = M::F::of(1.5) - M::F::of(0.5) * result_11;
    let loaded_16 = rotation;
    let result_12 = canonical(machine, both(loaded_16, [scale; 4], |x, y| x * y));
    machine.store::<[M::F; 4]>(
        Global::States,
        4 * (state.wrapping_add(WORLD_ROTATION) as usize),
        result_12,
    );
    let loaded_17 = from_root;
    let loaded_18 = arm;
    let position = canonical3(machine, both(loaded_17, loaded_18, |x, y| x + y));
    machine.store::<[M::F; 4]>(
        Global::States,
        4 * (state.wrapping_add(FROM_ROOT) as usize),
        position,
    );
    in_world = position;
    if frame.root != NO_FRAME {
        let _block = machine.block(line!(), 7);
        let root = vector_at(
            machine,
            first_word.wrapping_add(frame.root).wrapping_add(8u32),
        );
        let result_13 = canonical3(
            machine,
            both([position[0], position[1], position[2]], root, |x, y| x + y),
        );
        in_world = result_13;
    }
    let loaded_19 = in_world;
    machine.store::<[M::F; 4]>(
        Global::States,
        4 * (state.wrapping_add(POSITION) as usize),
        loaded_19,
    );
    if moves {
        let _block = machine.block(line!(), 18);
        let loaded_20 = velocity_above;
        let loaded_21 = angular_above;
        let loaded_22 = arm;
        let result_14 = cross3(machine, loaded_21, loaded_22);
        let carried = both(loaded_20, result_14, |x, y| x + y);
        let loaded_23 = linear;
        let result_15 = rotated(machine, axes, loaded_23);
        let result_16 = canonical3(machine, both(carried, result_15, |x, y| x + y));
        machine.store::<[M::F; 4]>(
            Global::States,
            4 * (state.wrapping_add(VELOCITY) as usize),
            result_16,
        );
        let loaded_24 = angular_above;
        let loaded_25 = angular;
        let result_17 = rotated(machine, axes, loaded_25);
        let result_18 = canonical3(machine, both(loaded_24, result_17, |x, y| x + y));
        machine.store::<[M::F; 4]>(
            Global::States,
            4 * (state.wrapping_add(ANGULAR_VELOCITY) as usize),
            result_18,
        );
        return;
    } else {
        return;
    }
}

pub(crate) fn weights_at<M: Machine>(machine: &M, index: u32) -> TangentWeights<M::F> {
    const OF_KERNELS: [u8; 227] = [
        0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,
        0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,
        0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,
        0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,
        0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,
        0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,
        0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,
        0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1, 0, 0, 0, 0, 0, 0,
    ];
    match OF_KERNELS[machine.code()] {
        0 => weights_at_of_readers(machine, index),
        _ => weights_at_of_readers_2(machine, index),
    }
}

pub(crate) fn weights_at_of_readers<M: Machine>(machine: &M, index: u32) -> TangentWeights<M::F> {
    let _block = machine.block(line!(), 1);
    let loaded = machine.load::<TangentWeights<M::F>>(Global::Weights, 4 * (index as usize));
    loaded
}

pub(crate) fn weights_at_of_readers_2<M: Machine>(machine: &M, index: u32) -> TangentWeights<M::F> {
    let _block = machine.block(line!(), 2);
    let loaded = machine.load::<[u32; 4]>(Global::Weights, 4 * (index as usize));
    let all = loaded.map(|x| M::F::of_bits(x));
    TangentWeights {
        before: all[0],
        after: all[1],
        outgoing: all[2],
        kind: all[3],
    }
}

pub(crate) fn weights_in<M: Machine>(machine: &M, cell: [M::F; 4]) -> TangentWeights<M::F> {
    TangentWeights {
        before: cell[0],
        after: cell[1],
        outgoing: cell[2],
        kind: cell[3],
    }
}

/// A rotation as two words of 64 bits: lavapipe stores word by word and lane by lane, so half as
/// many words take half the time.
pub(crate) fn wide<M: Machine>(machine: &M, rotation: [M::F; 4]) -> [u64; 2] {
    let _block = machine.block(line!(), 9);
    let words = rotation.map(|x| x.bits());
    [
        u64::from(words[0]) | (u64::from(words[1]) << 32u32),
        u64::from(words[2]) | (u64::from(words[3]) << 32u32),
    ]
}

/// Whole numbers of 64 bits: the lower word, the upper word.
pub(crate) fn wide_difference<M: Machine>(machine: &M, a: [u32; 2], b: [u32; 2]) -> [u32; 2] {
    let _block = machine.block(line!(), 5);
    [
        a[0].wrapping_sub(b[0]),
        a[1].wrapping_sub(b[1])
            .wrapping_sub(if a[0] < b[0] { 1u32 } else { 0u32 }),
    ]
}

/// An angle brought into -pi to pi.
pub(crate) fn wrapped<M: Machine>(machine: &M, angle: M::F) -> M::F {
    let _block = machine.block(line!(), 8);
    let low = if angle < M::F::of(-3.1415927) {
        (angle + M::F::of(6.2831855)) + M::F::of(-1.7484555e-7)
    } else {
        angle
    };
    if low > M::F::of(PI) {
        (low - M::F::of(6.2831855)) - M::F::of(-1.7484555e-7)
    } else {
        low
    }
}
