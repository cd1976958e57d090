//! The choice of a route, once for each request. A [`Plan`] says how a request is evaluated; it depends only on the
//! request and the [`Limits`] of a machine, not on a device. Every public function of the engine that evaluates makes a
//! plan and carries it out; `explain` prints the plan.
//!
//! Every route gives the same bits; routes differ in the segments that they prepare and keep. If a set has fewer
//! samples than keys, most prepared segments would never be used, and a set larger than memory cannot be prepared as
//! a whole.

use std::fmt;

use glam::Quat;

use crate::curve::options::Speed;
use crate::from_keys::KeyCurve;
use crate::method::interpolation::Interpolation;
use crate::output::encoding::Encoding;
use crate::output::rotations::Layout;
use crate::output::window::Window;
use crate::prepare::preparation::{PART_INTERVALS, SetRequest};
use crate::prepare::prepared::segment_size;
use crate::time::frames::Ticks;
use crate::time::spans::StoredSource;
use crate::tracks::set::TrackSet;

/// How a clip is evaluated whose segments are prepared.
pub(crate) const PREPARED: &str = "from the clip's segments, which are prepared already";

/// The capabilities of a machine on which plans depend.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Limits {
    pub(crate) kind: MachineKind,
    /// Bytes that segments may take, if there is a limit.
    pub(crate) memory: Option<usize>,
    /// Bytes of segments that go into one buffer of a device; `None` on the CPU.
    pub(crate) group_bytes: Option<usize>,
    /// With at least this many keys, the device prepares the arcs between them; `None` if the host always does.
    pub(crate) prepares_arcs_from: Option<usize>,
    /// If its segments take more bytes than this, a clip keeps only its keys, if samples can be computed from them;
    /// `None` if clips always keep segments.
    pub(crate) kept_segments: Option<usize>,
}

/// The kind of machine that evaluates.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum MachineKind {
    /// Threads of the CPU.
    Cpu {
        /// Their number.
        threads: usize,
    },
    /// A device that evaluates at most `window` rotations at once.
    #[cfg_attr(not(feature = "vulkan"), allow(dead_code))]
    Device {
        /// The number of rotations.
        window: usize,
    },
}

impl Limits {
    /// Whether clips keep packed segments: kernels of devices, and the small engine of a page, do not read them.
    pub(crate) fn packs_segments(&self) -> bool {
        !cfg!(smallest) && matches!(self.kind, MachineKind::Cpu { .. })
    }

    /// Whether a device prepares the arcs between this number of keys.
    pub(crate) fn prepares_arcs(&self, keys: usize) -> bool {
        self.prepares_arcs_from.is_some_and(|from| keys >= from)
    }
}

/// How values are computed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Route {
    /// The result is empty.
    Nothing,
    /// In rows, each with the samples of a track.
    Rows(Rows),
    /// In pieces: all segments of a piece are prepared, and uploaded to a device, before its first sample is
    /// evaluated.
    Pieces {
        /// The maximum size of the segments of a piece in bytes.
        limit: usize,
    },
}

/// How rows are computed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Rows {
    /// Every sample is evaluated directly from the keys next to it.
    FromKeys(KeyCurve),
    /// Only the key intervals that have a sample are prepared. For a device the host does this, so plans for devices
    /// do not have it.
    SparseSamples,
    /// In batches: a thread of the CPU prepares some intervals, evaluates them while their segments are in its cache,
    /// and drops them. With a device, the host does this, as for [`Rows::SparseSamples`].
    Batches {
        /// Whether a long track may be divided into several parts.
        cuts_tracks: bool,
    },
}

/// How a request is evaluated.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Plan {
    pub(crate) route: Route,
    pub(crate) layout: Layout,
    pub(crate) encoding: Encoding,
    /// The parts of the result, in order, whose segments are prepared together. Empty on other routes.
    pub(crate) pieces: Vec<Window>,
    /// How a stream divides the request.
    pub(crate) chunks: Chunks,
}

/// How the chunks of a stream are evaluated.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Chunks {
    /// There is one chunk.
    Single,
    /// Each by the plan's route. The pieces of the whole request are not used.
    Each,
    /// From segments that are prepared for all chunks before the first.
    PreparedOnce,
    /// No stream, but some tracks at a time, which are copied to their places among others; each by the plan's route.
    SomeTracks,
}

/// A result that is handed over in chunks.
struct Stream {
    /// The number of values of a chunk.
    chunk: usize,
    /// Bytes of the segments that would be prepared before the first chunk.
    segment_bytes: usize,
}

/// The number of values of tracks with one of several interpolations that are evaluated before they are copied to their
/// places. It limits the memory of these values.
const GROUP_VALUES: usize = 1 << 22;

/// How many tracks with one of several interpolations are evaluated before their values are copied to their places.
pub(crate) fn tracks_at_once(samples: usize) -> usize {
    (GROUP_VALUES / samples.max(1)).max(1)
}

/// The number of samples for each key from which on the CPU prepares segments. With fewer samples, it is faster to
/// compute the curve of each interval while its samples are evaluated.
const SAMPLES_OF_A_KEY: usize = 8;

/// Rotations for which another thread is worth waking.
const SHARE: usize = 16 * 1024;

/// The maximum average number of keys of a track for batches of a set whose tracks must not be divided: with longer
/// tracks, too few threads would have work.
const LONG_TRACK: usize = 16 * 1024;

/// The number of key intervals that are prepared for one separate sample, plus the same number for the time to find
/// them. With fewer keys for each sample, preparing all intervals takes no longer.
const KEYS_OF_A_SAMPLE: usize = 8;

/// The same number for methods that solve equations for the velocities at the keys of a whole window of the track.
const KEYS_OF_A_SOLUTION: usize = 2048;

/// The maximum size in bytes of the segments of a piece, if the engine's options have no limit.
const SEGMENT_BYTES: usize = 256 << 20;

/// The size in bytes of segments that a device gets at once if a request has far more keys than samples. Each piece
/// uses the buffers of the previous one: fresh memory for all segments would take longer than preparing them.
const DENSE_BYTES: usize = 64 << 20;

/// The minimum number of keys of a piece: with fewer, the repeated preparation of neighbouring intervals would take
/// most of the time.
const MIN_KEYS: usize = 256;

/// Pieces of a track with at least this many keys may be divided at a sample. Both pieces prepare the intervals at the
/// division; with so many keys, these are only a small part.
const KEYS_TO_CUT: usize = 8;

impl Plan {
    /// Decides how a request is evaluated; with `chunk`, as a stream in chunks of about `chunk` values.
    pub(crate) fn of(
        request: &SetRequest<'_>,
        layout: Layout,
        encoding: Encoding,
        chunk: Option<usize>,
        limits: &Limits,
    ) -> Self {
        let chunk = chunk.filter(|&chunk| chunk < request.len());
        let stream = chunk.map(|chunk| Stream {
            chunk,
            segment_bytes: bytes_of(request),
        });
        Self::new(request, layout, encoding, stream, limits)
    }

    /// Decides how tracks with different interpolations are evaluated, which are some or all of a result: each request
    /// has its plan. With `chunk`, the whole result is a stream in chunks of so many values.
    pub(crate) fn of_groups(
        requests: &[SetRequest<'_>],
        whole: &Window,
        encoding: Encoding,
        chunk: Option<usize>,
        limits: &Limits,
    ) -> Vec<Self> {
        let chunk = chunk.filter(|&chunk| chunk < whole.len());
        // The bytes are added, because the segments of all groups are in memory at the same time.
        let bytes = requests.iter().map(bytes_of);
        let segment_bytes = bytes.fold(0, usize::saturating_add);
        let plan = |request: &SetRequest<'_>| {
            let stream = chunk.map(|chunk| Stream {
                chunk,
                segment_bytes,
            });
            let mut plan = Self::new(request, whole.layout, encoding, stream, limits);
            let are_many = request.tracks.len() > tracks_at_once(request.samples.len());
            if plan.chunks == Chunks::Single && are_many {
                (plan.chunks, plan.pieces) = (Chunks::SomeTracks, Vec::new());
            }
            plan
        };
        requests.iter().map(plan).collect()
    }

    fn new(
        request: &SetRequest<'_>,
        layout: Layout,
        encoding: Encoding,
        stream: Option<Stream>,
        limits: &Limits,
    ) -> Self {
        // With a single sample per track, both layouts are the same.
        let layout = layout.of(request.samples.len());
        let is_of_rows = layout == Layout::TrackMajor;
        let has_rows = |stream: &Stream| is_of_rows && request.samples.len() <= stream.chunk;
        let (route, chunks) = match stream {
            None => (Route::of(request, layout, limits), Chunks::Single),
            Some(stream) if has_rows(&stream) => (Route::of(request, layout, limits), Chunks::Each),
            // A chunk has some samples of many tracks, or some of one track. So several chunks need the same segments.
            // Therefore all segments are prepared at once, unless they need too much memory.
            Some(stream) => {
                let limit = limits.memory.unwrap_or(SEGMENT_BYTES);
                let chunks = match stream.segment_bytes <= limit {
                    true => Chunks::PreparedOnce,
                    false => Chunks::Each,
                };
                (Route::Pieces { limit }, chunks)
            }
        };
        let whole = Window::of(request.tracks.clone(), request.samples.clone(), layout);
        let pieces = match (route, chunks) {
            (Route::Pieces { limit }, Chunks::Single) => pieces(request, whole, limit),
            (_, Chunks::PreparedOnce) => vec![whole],
            _ => Vec::new(),
        };
        Self {
            route,
            layout,
            encoding,
            pieces,
            chunks,
        }
    }

    /// The plan for a chunk of the request, or for some of its tracks.
    pub(crate) fn of_chunk(&self, request: &SetRequest<'_>, chunk: &Window) -> Self {
        let pieces = match self.route {
            Route::Pieces { limit } => {
                let chunk = Window::of(chunk.tracks.clone(), chunk.samples.clone(), self.layout);
                pieces(request, chunk, limit)
            }
            _ => Vec::new(),
        };
        Self {
            pieces,
            chunks: Chunks::Single,
            ..self.clone()
        }
    }

    /// Whether rows, each with the samples of a track, are computed and then copied into frames.
    pub(crate) fn transposes(&self) -> bool {
        matches!(self.route, Route::Rows(_)) && self.layout == Layout::FrameMajor
    }
}

impl Route {
    fn of(request: &SetRequest<'_>, layout: Layout, limits: &Limits) -> Self {
        if request.len() == 0 {
            return Self::Nothing;
        }
        if cfg!(smallest) {
            let limit = piece_limit(request, limits);
            return Self::Pieces { limit };
        }
        let in_rows = layout == Layout::TrackMajor;
        let in_order = matches!(request.timeline.ticks, Ticks::Frames { .. });
        let is_sparse =
            matches!(limits.kind, MachineKind::Cpu { .. }) && has_sparse_samples(request);
        let limit = match limits.kind {
            MachineKind::Cpu { .. } if in_order => SAMPLES_OF_A_KEY,
            _ => 1,
        };
        let curve = match in_rows || is_sparse {
            true => KeyCurve::of(request, limit),
            false => None,
        };
        let pieces = Self::Pieces {
            limit: piece_limit(request, limits),
        };
        match (limits.kind, curve) {
            (MachineKind::Cpu { .. }, Some(curve)) => Self::Rows(Rows::FromKeys(curve)),
            (MachineKind::Cpu { .. }, None) if is_sparse => Self::Rows(Rows::SparseSamples),
            (MachineKind::Cpu { .. }, None) if !in_rows => pieces,
            (MachineKind::Cpu { threads }, None) => {
                let cuts_tracks = in_order && request.prepares_apart();
                let (tracks, keys) = (request.tracks.len(), request.batch().keys(request.set));
                let are_short = keys <= LONG_TRACK * tracks;
                let is_held = request.interpolation.wrap().are_held();
                // All threads share the samples of a piece, but one thread evaluates a whole batch.
                let batches = match cuts_tracks {
                    true => tracks + keys / PART_INTERVALS,
                    false => tracks,
                };
                let is_shared = batches >= threads.min(request.len() / SHARE);
                let is_small = keys * key_bytes(request.interpolation) <= SEGMENT_BYTES;
                match is_held && (are_short || cuts_tracks) && (is_shared || !is_small) {
                    true => Self::Rows(Rows::Batches { cuts_tracks }),
                    false => pieces,
                }
            }
            (MachineKind::Device { window }, Some(curve)) => {
                // With explicit times, the keys of a track are not divided.
                let longest = (request.set.longest()).max(request.samples.len());
                match in_order || longest <= window {
                    true => Self::Rows(Rows::FromKeys(curve)),
                    false => pieces,
                }
            }
            (MachineKind::Device { .. }, None) => pieces,
        }
    }
}

/// Whether there are so few samples for so many keys that only the intervals with a sample should be prepared, and
/// each of these can be prepared without the others.
fn has_sparse_samples(request: &SetRequest<'_>) -> bool {
    let interpolation = request.interpolation;
    let in_frames = matches!(request.timeline.ticks, Ticks::Frames { .. });
    let are_together = in_frames && interpolation.wrap().repeats();
    let each = match interpolation.method.is_solved() {
        true => KEYS_OF_A_SOLUTION,
        false => KEYS_OF_A_SAMPLE,
    };
    interpolation.speed == Speed::AsKeyed
        && !are_together
        && request.len().saturating_mul(each) <= request.set.keys_of(request.tracks.clone())
}

/// Bytes that a key takes when it is prepared: its segment, its constant, and its span.
fn key_bytes(interpolation: &Interpolation) -> usize {
    const SPAN: usize = size_of::<f64>() + size_of::<StoredSource>() + size_of::<u32>();
    segment_size(interpolation.form()) + size_of::<Quat>() + SPAN
}

/// About how many bytes all segments of a set take.
pub(crate) fn segment_bytes(set: &TrackSet, interpolation: &Interpolation) -> usize {
    set.key_count().saturating_mul(key_bytes(interpolation))
}

/// About how many bytes the segments that a request needs take.
pub(crate) fn bytes_of(request: &SetRequest<'_>) -> usize {
    let keys = request.batch().keys(request.set);
    keys.saturating_mul(key_bytes(request.interpolation))
}

/// The maximum size of the segments of a piece in bytes.
fn piece_limit(request: &SetRequest<'_>, limits: &Limits) -> usize {
    match limits.kind {
        MachineKind::Cpu { .. } => limits.memory.unwrap_or(SEGMENT_BYTES),
        MachineKind::Device { .. } => {
            let result = request.len().saturating_mul(size_of::<Quat>());
            let budget = limits.memory.unwrap_or(usize::MAX);
            match bytes_of(request) / 4 > result {
                true => budget.min(DENSE_BYTES),
                false => budget,
            }
        }
    }
}

/// Divides a window of a request into windows whose segments take at most `limit` bytes.
fn pieces(request: &SetRequest<'_>, whole: Window, limit: usize) -> Vec<Window> {
    let limit = (limit / key_bytes(request.interpolation)).max(MIN_KEYS);
    let (mut pieces, mut pending) = (Vec::new(), vec![whole]);
    while let Some(piece) = pending.pop() {
        let is_large = keys_of(request, &piece) > limit;
        match is_large.then(|| halves(request, &piece)).flatten() {
            Some([first, second]) => pending.extend([second, first]),
            None => pieces.push(piece),
        }
    }
    pieces
}

/// The two halves of a piece, if it can be divided: by its rows if it has several, else by the samples of the row.
/// Samples are divided only where that divides the keys too: not those at listed times in any order.
pub(crate) fn halves(request: &SetRequest<'_>, piece: &Window) -> Option<[Window; 2]> {
    let (tracks, samples) = (&piece.tracks, &piece.samples);
    let part = |tracks, samples| Window::of(tracks, samples, piece.layout);
    if (piece.layout == Layout::FrameMajor || tracks.len() == 1) && samples.len() > 1 {
        let middle = samples.start + samples.len() / 2;
        let halves = [samples.start..middle, middle..samples.end];
        let halves = halves.map(|samples| part(tracks.clone(), samples));
        let keys = keys_of(request, piece);
        let of_halves: usize = halves.iter().map(|half| keys_of(request, half)).sum();
        if keys > KEYS_TO_CUT * tracks.len() && of_halves <= keys + keys / 4 {
            return Some(halves);
        }
    }
    let middle = tracks.start + tracks.len() / 2;
    let halves = [tracks.start..middle, middle..tracks.end];
    (tracks.len() > 1).then(|| halves.map(|tracks| part(tracks, samples.clone())))
}

/// The number of keys of the intervals that are prepared for a piece.
fn keys_of(request: &SetRequest<'_>, piece: &Window) -> usize {
    let part = request.part(piece.tracks.clone(), piece.samples.clone());
    part.batch().keys(request.set)
}

impl fmt::Display for Plan {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.route)?;
        if self.pieces.len() > 1 {
            write!(f, "; {} pieces", self.pieces.len())?;
        }
        match self.chunks {
            Chunks::Single => {}
            Chunks::Each => f.write_str("; each chunk of the stream by itself")?,
            Chunks::PreparedOnce => f.write_str("; once for all chunks of the stream")?,
            Chunks::SomeTracks => f.write_str("; some tracks at a time")?,
        }
        if self.transposes() {
            f.write_str("; the rows of the tracks are then copied into frames")?;
        }
        match self.encoding {
            Encoding::F32 => Ok(()),
            encoding => write!(f, "; stored as {encoding}"),
        }
    }
}

impl fmt::Display for Route {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Nothing => "no samples: nothing is computed",
            Self::Rows(Rows::FromKeys(KeyCurve::Arcs)) => {
                "few samples between keys: each sample is computed from the keys before and after it"
            }
            Self::Rows(Rows::FromKeys(KeyCurve::TwoKeys)) => {
                "fewer samples than keys, two keys per track: each sample is computed from the keys of its track"
            }
            Self::Rows(Rows::FromKeys(KeyCurve::Cubics(_))) => {
                "few samples between keys, with mostly small rotations between them: each sample is computed from the four keys around it; intervals with too large rotations are prepared"
            }
            Self::Rows(Rows::Batches { cuts_tracks: false }) => {
                "in batches: a thread prepares about a thousand keys, evaluates them while their segments are in the cache, and discards the segments"
            }
            Self::Rows(Rows::Batches { cuts_tracks: true }) => {
                "in batches: a thread prepares about a thousand keys, evaluates them while their segments are in the cache, and discards the segments; long tracks are divided among the threads"
            }
            Self::Rows(Rows::SparseSamples) => {
                "far fewer samples than keys: only the intervals that contain a sample are prepared"
            }
            Self::Pieces { .. } => {
                "as a clip: all segments are prepared, and uploaded if a device evaluates, as many at a time as there is memory for"
            }
        })
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use glam::Quat;

    use super::*;
    use crate::device::Device;
    use crate::engine::Engine;
    use crate::engine::clip::request::Request;
    use crate::error::Error;
    use crate::evaluate::steps::{self, Step};
    use crate::machine::options::EngineOptions;
    use crate::method;
    use crate::time::frames::SampleTimes;
    use crate::time::wrap::WrapMode;

    /// Tracks of these numbers of keys, at times of their own.
    fn set_of(counts: &[usize]) -> TrackSet {
        let mut set = TrackSet::new();
        for (track, &count) in counts.iter().enumerate() {
            let key = |i: usize| {
                let about_y = Quat::from_rotation_y(0.04 * (i * (track + 1)) as f32);
                about_y * Quat::from_rotation_x((0.11 * i as f32).sin())
            };
            let times: Vec<f64> = (0..count).map(|i| 0.1 * i as f64).collect();
            let keys: Vec<Quat> = (0..count).map(key).collect();
            set.push("", &times, &keys).unwrap();
        }
        set
    }

    /// The words of a text for a step, and whether a step is of that kind.
    type StepWords = (&'static str, fn(&Step) -> bool);
    const STEPS: [StepWords; 5] = [
        ("is computed from the", |step| {
            matches!(step, Step::Rows(Rows::FromKeys(_)))
        }),
        ("only the intervals", |step| {
            matches!(step, Step::Rows(Rows::SparseSamples))
        }),
        ("in batches", |step| {
            matches!(step, Step::Rows(Rows::Batches { .. }))
        }),
        ("as a clip", |step| *step == Step::Piece),
        ("copied into frames", |step| *step == Step::Transposed),
    ];

    /// The words for each step are in the text, and no others.
    fn assert_described(text: &str, done: &[Step], label: &str) {
        for (words, is_it) in STEPS {
            let was_done = done.iter().any(is_it);
            assert_eq!(text.contains(words), was_done, "{label}: {text}: {done:?}");
        }
    }

    fn check(engine: &Engine, request: &Request<'_>, expected: &[u8], label: &str) -> String {
        steps::of(&*engine.machine);
        let text = request.explain().unwrap();
        let found = request.evaluate_bytes().unwrap();
        assert!(found == expected, "{label}: {text}");
        let done = steps::of(&*engine.machine);
        assert_described(&text, &done, label);
        let pieces = done.iter().filter(|step| **step == Step::Piece).count();
        let counted: usize = text.lines().map(pieces_in).sum();
        assert_eq!(counted, pieces, "{label}: {text}");
        text
    }

    /// The number of pieces that a line of a text for a result in memory promises.
    fn pieces_in(line: &str) -> usize {
        let count = line.split("; ").find_map(|it| it.strip_suffix(" pieces"));
        match count {
            Some(count) => count.parse().unwrap(),
            None => usize::from(line.contains("as a clip")),
        }
    }

    /// A part of a request's result, in an encoding.
    fn in_part<'a>(request: Request<'a>, (encoding, part): &(Encoding, Window)) -> Request<'a> {
        let request = request.encoding(*encoding).layout(part.layout);
        let request = request.tracks(part.tracks.clone());
        request.samples(part.samples.clone())
    }

    /// Catches a group that is evaluated otherwise than by its printed plan, also where a stream cuts it.
    #[test]
    fn each_group_of_interpolations_has_the_plan_that_is_printed() {
        let set = set_of(&[300, 40, 3, 300, 25, 40, 300, 1, 40]);
        let looped = Interpolation {
            after: WrapMode::Loop,
            ..method::BESSEL_OVERHAUSER.into()
        };
        let each = [looped, method::SLERP.into(), method::C2.into()];
        let each: Vec<Interpolation> = each.into_iter().cycle().take(9).collect();
        let cpu = Engine::new(Device::Cpu).unwrap();
        let clip = cpu.upload(&set, each.clone()).unwrap();
        let mut texts = BTreeSet::new();
        for memory in [None, Some(1)] {
            let options = EngineOptions {
                memory,
                ..EngineOptions::default()
            };
            let engine = Engine::with_options(Device::Cpu, &options).unwrap();
            for (rate, layout) in [1, 20].into_iter().flat_map(|rate| {
                [Layout::TrackMajor, Layout::FrameMajor].map(|layout| (rate, layout))
            }) {
                let frames = SampleTimes::fps(rate);
                let whole = clip.timeline(&frames).unwrap().len();
                for (tracks, samples) in [(0..9, 0..whole), (1..5, 1..whole - 1), (4..5, 0..1)] {
                    for encoding in [Encoding::F32, Encoding::F16] {
                        let window = Window::of(tracks.clone(), samples.clone(), layout);
                        let part = (encoding, window);
                        let expected = in_part(clip.request(&frames), &part)
                            .evaluate_bytes()
                            .unwrap();
                        let label =
                            format!("{memory:?}, {rate}, {layout}, {tracks:?}, {samples:?}");
                        let of_keys = in_part(engine.request(&set, each.clone(), &frames), &part);
                        let text = check(&engine, &of_keys, &expected, &label);
                        assert_eq!(text.lines().count(), tracks.len().min(3), "{text}");
                        texts.insert(text);
                        if encoding == Encoding::F32 {
                            check_stream(&engine, &of_keys, &expected, &label);
                        }
                        let kept = engine.upload(&set, each.clone()).unwrap();
                        check(
                            &engine,
                            &in_part(kept.request(&frames), &part),
                            &expected,
                            &label,
                        );
                    }
                }
            }
        }
        for words in [
            "3 tracks by slerp: ",
            "1 track by bessel-overhauser: ",
            " pieces",
        ] {
            assert!(
                texts.iter().any(|text| text.contains(words)),
                "{words}: {texts:?}"
            );
        }
    }

    fn check_stream(engine: &Engine, request: &Request<'_>, expected: &[u8], label: &str) {
        for chunk in [7, 150, 4000] {
            let text = request.explain_stream(chunk).unwrap();
            let mut found: Vec<u8> = Vec::new();
            let sink = |chunk: crate::stream::Chunk<'_>| {
                found.extend_from_slice(bytemuck::cast_slice(chunk.rows));
                Ok::<(), Error>(())
            };
            request.stream(chunk, sink).unwrap();
            assert!(found == expected, "{label}, chunks of {chunk}: {text}");
            let done = steps::of(&*engine.machine);
            assert_described(&text, &done, label);
            let pieces = done.iter().filter(|step| **step == Step::Piece).count();
            let once = text
                .lines()
                .filter(|it| it.contains("once for all"))
                .count();
            assert!(once == 0 || pieces == once, "{text}: {done:?}");
        }
    }

    /// Catches a text that describes another route than the one that is used, a function of the engine that does not
    /// follow the plan, and a route with other bits.
    #[test]
    fn the_plan_that_is_printed_is_carried_out_by_every_door() {
        let (first, last) = (0.0, 3.9);
        let all_frames = [
            SampleTimes::fps(60),
            SampleTimes::fps(1),
            SampleTimes::fps(12).between(1.0, 1.7),
            SampleTimes::at(vec![3.1, 0.2, first, 1.77, 9.0, last, -1.0]),
            SampleTimes::at((0..90).map(|k| f64::from(k * 37 % 90) * 0.05).collect()),
        ];
        let set = set_of(&[40, 40, 3, 40, 25, 40, 1, 40, 40]);
        let mut devices = vec![Device::Cpu];
        devices.extend(Device::list().unwrap_or_default());
        let cpu = Engine::new(Device::Cpu).unwrap();
        let (mut texts, mut round) = (BTreeSet::new(), 0);
        for (device, memory) in devices
            .iter()
            .flat_map(|device| [(device, None), (device, Some(1))])
        {
            let options = EngineOptions {
                memory,
                ..EngineOptions::default()
            };
            let Ok(engine) = Engine::with_options(device.clone(), &options) else {
                continue; // a device that is not exact
            };
            let name = engine.device_name().to_owned();
            for (method, wrap) in [
                (method::SLERP, WrapMode::Hold),
                (method::BESSEL_OVERHAUSER, WrapMode::Hold),
                (method::BESSEL_OVERHAUSER, WrapMode::Loop),
                (method::C2, WrapMode::Mirror),
                (method::STEP, WrapMode::Hold),
            ] {
                let interpolation = Interpolation {
                    before: wrap,
                    after: wrap,
                    ..Interpolation::from(method)
                };
                let clip = cpu.upload(&set, interpolation).unwrap();
                for (frames, layout) in (all_frames.iter()).flat_map(|frames| {
                    [Layout::TrackMajor, Layout::FrameMajor].map(|it| (frames, it))
                }) {
                    let samples = clip.timeline(frames).unwrap().len();
                    let euler = Encoding::ALL
                        .into_iter()
                        .find(|it| it.to_string().contains("euler"));
                    for (tracks, samples) in [
                        (0..9, 0..samples),
                        (1..8, 0..samples),
                        (0..9, samples / 3..samples - samples / 4),
                        (4..5, 1..samples),
                        (2..2, 0..1),
                    ] {
                        for encoding in [Some(Encoding::F32), Some(Encoding::F16), euler] {
                            round += 1;
                            // Requests on a device take longer, so only some of them are tested.
                            if matches!(device, Device::Vulkan(_)) && round % 11 != 0 {
                                continue;
                            }
                            let of = |request: Request<'_>| {
                                let request = request.encoding(encoding.unwrap()).layout(layout);
                                let request = request.tracks(tracks.clone());
                                request.samples(samples.clone()).evaluate_bytes().unwrap()
                            };
                            let expected = of(clip.request(frames));
                            let request = engine.request(&set, interpolation, frames);
                            let request = request.encoding(encoding.unwrap()).layout(layout);
                            let request = request.tracks(tracks.clone()).samples(samples.clone());
                            let label = format!(
                                "{name}, {memory:?}, {method}, {wrap}, {layout}, {frames:?}, {tracks:?}, {samples:?}"
                            );
                            texts.insert(check(&engine, &request, &expected, &label));
                            if encoding == Some(Encoding::F32) {
                                check_stream(&engine, &request, &expected, &label);
                            }
                        }
                    }
                }
            }
        }
        // Check that every route occurred.
        for (words, _) in STEPS {
            assert!(
                texts.iter().any(|text| text.contains(words)),
                "{words}: {texts:?}"
            );
        }
        assert!(
            texts.iter().any(|text| text.contains(" pieces")),
            "{texts:?}"
        );
    }

    /// Samples at listed times in any order are not divided: both halves would prepare all keys.
    #[test]
    fn pieces_divide_what_is_prepared() {
        let set = set_of(&[3000, 3000]);
        let interpolation = Interpolation::from(method::SLERP);
        let made = |frames: SampleTimes, layout| {
            let timeline = frames.resolve(2, set.time_span()).unwrap();
            let request = SetRequest::whole(&set, &interpolation, &timeline);
            let whole = Window::of(0..2, 0..timeline.len(), layout);
            pieces(&request, whole, 1600 * key_bytes(&interpolation))
        };
        let mixed = || SampleTimes::at((0..900).map(|k| f64::from(k * 601 % 900) / 3.0).collect());
        let in_order = || SampleTimes::fps(3);
        let of = Window::of;
        for layout in [Layout::TrackMajor, Layout::FrameMajor] {
            let found = made(mixed(), layout);
            assert_eq!(found, [of(0..1, 0..900, layout), of(1..2, 0..900, layout)]);
        }
        let halves = [0..450, 450..900];
        let found = made(in_order(), Layout::TrackMajor);
        let expected = [0..1, 1..2].map(|tracks| {
            (halves.clone()).map(|samples| of(tracks.clone(), samples, Layout::TrackMajor))
        });
        assert_eq!(found, expected.concat());
        let found = made(in_order(), Layout::FrameMajor);
        let quarters = [0..225, 225..450, 450..675, 675..900];
        let expected = quarters.map(|samples| of(0..2, samples, Layout::FrameMajor));
        assert_eq!(found, expected);
    }
}
