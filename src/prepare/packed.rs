//! Packed segments of clips that are kept on the CPU: the coefficients that are +0 are left out. Nearly all curves of
//! recorded motion have small angles and need seven rows of eleven, 112 bytes instead of 176, so that samples read less
//! memory. The index of a segment contains its degree; it is stored in the span, which is read anyway.

use bytemuck::TransparentWrapper;

use crate::shader::{POWERS, PolynomialSegment};
use crate::time::spans::{SOURCE_INDEX, SpanSource, StoredSource};
use crate::twin::Evaluate as _;
use crate::twin::evaluate_polynomial::Polynomial;

/// The rows of some packed segments, one segment after the other. It is an unsized type around a slice, not a struct
/// that refers to a slice. If a function takes a reference to such a type, the compiler knows that stores to the output
/// change no coefficient, and keeps the coefficients in registers.
#[derive(TransparentWrapper)]
#[repr(transparent)]
pub(crate) struct PackedSegments([[f32; 4]]);

/// A packed segment. The whole degree is also that of segments whose samples may need a filter for nearly 0
/// ([`Evaluate::is_canonical`](crate::twin::Evaluate::is_canonical)).
pub(crate) enum PackedSegment<'a> {
    Degree6(&'a Polynomial<7>),
    Degree8(&'a Polynomial<9>),
    Degree10(&'a Polynomial<POWERS>),
}

/// An expression for a packed segment, compiled for the type of each degree. A macro, because closures are not always
/// inlined.
macro_rules! of_degree {
    ($packed:expr, $segment:ident => $value:expr) => {
        match $packed {
            $crate::prepare::packed::PackedSegment::Degree6($segment) => $value,
            $crate::prepare::packed::PackedSegment::Degree8($segment) => $value,
            $crate::prepare::packed::PackedSegment::Degree10($segment) => $value,
        }
    };
}
pub(crate) use of_degree;

/// The index of a packed segment: its first row and, in the bits above, its degree.
#[derive(Clone, Copy)]
struct PackedIndex(u32);

impl PackedIndex {
    const ROW: u32 = SOURCE_INDEX >> 2;
    const DEGREE_8: u32 = Self::ROW + 1;
    const DEGREE_10: u32 = 2 * Self::DEGREE_8;

    fn new(row: u32, segment: &PolynomialSegment) -> Self {
        let degree = match segment.degree() {
            6 if segment.is_canonical() => 0,
            8 if segment.is_canonical() => Self::DEGREE_8,
            _ => Self::DEGREE_10,
        };
        Self(degree | row)
    }

    #[inline(always)]
    fn row(self) -> usize {
        (self.0 & Self::ROW) as usize
    }

    #[inline(always)]
    fn degree(self) -> u32 {
        self.0 & !Self::ROW
    }

    fn row_count(self) -> usize {
        match self.degree() {
            0 => 7,
            Self::DEGREE_8 => 9,
            _ => POWERS,
        }
    }
}

impl PackedSegments {
    /// The segment with the index that its span has.
    #[inline(always)]
    pub(crate) fn get(&self, index: u32) -> PackedSegment<'_> {
        let index = PackedIndex(index);
        let row = index.row();
        match index.degree() {
            0 => PackedSegment::Degree6(self.rows(row)),
            PackedIndex::DEGREE_8 => PackedSegment::Degree8(self.rows(row)),
            _ => PackedSegment::Degree10(self.rows(row)),
        }
    }

    #[inline(always)]
    fn rows<const ROWS: usize>(&self, row: usize) -> &Polynomial<ROWS> {
        let rows = self.0[row..row + ROWS].first_chunk();
        // The zeros are never used, because the slice has `ROWS` rows. They are given so that no code for a panic is
        // compiled.
        rows.unwrap_or(const { &[[0.0; 4]; ROWS] })
    }

    /// The value of a segment at a parameter.
    #[inline(always)]
    pub(crate) fn value_at(&self, index: u32, parameter: f32) -> [f32; 4] {
        of_degree!(self.get(index), segment => segment.value_at(parameter))
    }
}

/// Packs polynomials, after all of them are fitted and divided, and changes the indices in the sources of their spans;
/// returns the rows. Nothing is packed if an index has too few bits for so many rows, or if there is not enough memory.
pub(crate) fn pack(
    polynomials: &mut Vec<PolynomialSegment>,
    sources: &mut [StoredSource],
) -> Vec<[f32; 4]> {
    let mut indices: Vec<PackedIndex> = Vec::new();
    if polynomials.is_empty()
        || polynomials.len() > PackedIndex::ROW as usize / POWERS
        || indices.try_reserve_exact(polynomials.len()).is_err()
    {
        return Vec::new();
    }
    let mut end = 0;
    for segment in &*polynomials {
        let index = PackedIndex::new(end as u32, segment);
        indices.push(index);
        end += index.row_count();
    }
    // The rows are moved within the same memory. This overwrites no row that is still needed, because a segment never
    // moves towards the end.
    let mut rows: Vec<[f32; 4]> = bytemuck::cast_vec(std::mem::take(polynomials));
    for (index, first) in indices.iter().zip((0..).step_by(POWERS)) {
        rows.copy_within(first..first + index.row_count(), index.row());
    }
    rows.truncate(end);
    rows.shrink_to_fit();
    for stored in sources {
        if let SpanSource::Segment(index) = stored.source() {
            let PackedIndex(packed) = indices[index as usize];
            *stored = SpanSource::Segment(packed).into();
        }
    }
    rows
}

#[cfg(test)]
mod tests {
    use fastrand::Rng;
    use glam::{Quat, Vec3};

    use super::*;
    use crate::cpu::engine::CpuEngine;
    use crate::method;
    use crate::method::interpolation::Interpolation;
    use crate::output::rotations::Layout;
    use crate::output::window::Window;
    use crate::prepare::clip_data::{ClipData, PrepareRequest};
    use crate::prepare::prepared::Prepared;
    use crate::simd::dispatch::VectorWidth;
    use crate::time::frames::SampleTimes;
    use crate::time::runs::NONE;
    use crate::time::wrap::WrapMode;
    use crate::tracks::set::TrackSet;

    /// Rotations by steps of all sizes, from a thousandth of a turn to half a turn, also where a component is nearly 0.
    fn set() -> TrackSet {
        let random = &mut Rng::with_seed(5);
        let mut set = TrackSet::new();
        for track in 0..40 {
            let mut time = 0.0;
            let mut times = Vec::new();
            let mut rotation = Quat::IDENTITY;
            let mut keys = Vec::new();
            for _ in 0..30 {
                time += match (track % 4, random.u32(0..16)) {
                    (0, 0) => 1e-5,
                    (0, 1) => 1000.0,
                    (0, _) => f64::from(random.f32()) + 0.01,
                    _ => 0.1,
                };
                times.push(time);
                let angle =
                    [0.01, 0.05, 0.3, 0.5, 0.9, 1.6, 3.1][random.usize(0..7)] * random.f32();
                let mut part = || random.f32() - 0.5;
                let axis = Vec3::new(part(), part(), part()).normalize_or(Vec3::Y);
                rotation = match track % 5 {
                    // About an axis that is nearly in a plane: x and z stay nearly 0.
                    0 => Quat::from_rotation_y(angle) * rotation,
                    _ => (rotation * Quat::from_axis_angle(axis, angle)).normalize(),
                };
                let mut key = rotation.normalize();
                if track % 10 == 0 {
                    key.x = 2.0f32.powi(-45) * (random.f32() - 0.5);
                }
                keys.push(key);
            }
            set.push("", &times, &keys).unwrap();
        }
        set
    }

    /// How many segments of each degree a group has, and how many of the whole degree need a filter.
    #[derive(Default, Debug)]
    struct Counts {
        degrees: [usize; 3],
        filtered: usize,
        cut: usize,
        exact: usize,
        bytes: usize,
    }

    impl Counts {
        fn add(&mut self, prepared: &Prepared) {
            let packed = prepared.segments.packed().unwrap();
            for (span, stored) in prepared.spans.sources.iter().enumerate() {
                let index = match stored.source() {
                    SpanSource::Segment(index) => index,
                    SpanSource::Constant(_) => continue,
                    SpanSource::Exact(_) => {
                        self.exact += 1;
                        continue;
                    }
                };
                self.cut += usize::from(prepared.spans.keys[span] == NONE);
                let (number, bytes) = match packed.get(index) {
                    PackedSegment::Degree6(segment) => (0, size_of_val(segment)),
                    PackedSegment::Degree8(segment) => (1, size_of_val(segment)),
                    PackedSegment::Degree10(segment) => {
                        self.filtered += usize::from(!segment.is_canonical());
                        (2, size_of_val(segment))
                    }
                };
                self.degrees[number] += 1;
                self.bytes += bytes;
            }
        }
    }

    /// Catches a segment that is moved over another, an index without its degree, and a sum that is not the whole one.
    #[test]
    fn packed_segments_have_the_bits_of_whole_ones() {
        let set = set();
        let tracks = set.track_count();
        let mut counts = Counts::default();
        let frames = [5, 24, 60, 300].map(SampleTimes::fps);
        let times = (0..400).map(|i| f64::from(i * 173 % 400) * 0.031 - 0.5);
        let times = SampleTimes::at(times.collect());
        for (method, after) in [
            (method::BESSEL_OVERHAUSER, WrapMode::Hold),
            (method::SQUAD, WrapMode::Loop),
            (method::C2, WrapMode::Extrapolate),
        ] {
            let interpolation = Interpolation::from(method).with_after(after);
            let [whole, packed] = [false, true].map(|packs| {
                let request = PrepareRequest {
                    packs,
                    ..PrepareRequest::all(&set)
                };
                ClipData::new(&set, interpolation, request).unwrap()
            });
            let whole_bytes: usize = whole.groups.iter().map(Prepared::bytes).sum();
            let bytes: usize = packed.groups.iter().map(Prepared::bytes).sum();
            let mut of_method = Counts::default();
            let mut unpacked_bytes = 0;
            for (group, unpacked) in packed.groups.iter().zip(&whole.groups) {
                assert!(group.segments.polynomials.is_empty());
                assert_eq!(
                    group.segments.packed.capacity(),
                    group.segments.packed.len()
                );
                of_method.add(group);
                unpacked_bytes += size_of_val(&*unpacked.segments.polynomials);
            }
            let rows: usize = packed
                .groups
                .iter()
                .map(|group| group.segments.packed.len())
                .sum();
            assert_eq!(whole_bytes - bytes, unpacked_bytes - rows * 16, "{method}");
            // A curve that no polynomial fits leaves its segment of zeros unused.
            assert!(rows * 16 - of_method.bytes <= of_method.exact.max(of_method.cut) * 112);
            for (degree, count) in counts.degrees.iter_mut().zip(of_method.degrees) {
                *degree += count;
            }
            counts.filtered += of_method.filtered;
            counts.cut += of_method.cut;
            counts.exact += of_method.exact;
            for frames in frames.iter().chain([&times]) {
                let timeline = frames.resolve(tracks, set.time_span()).unwrap();
                let folded = whole.folded(&timeline).unwrap();
                let samples = folded.len().min(40_000 / tracks);
                for layout in Layout::ALL {
                    let window = Window::of(0..tracks, 0..samples, layout);
                    let [expected, found] = [&whole, &packed].map(|clip| {
                        let mut output = vec![[0.0; 4]; window.len()];
                        CpuEngine::on_shared_threads(VectorWidth::widest())
                            .evaluate(clip, &folded, &window, &mut output)
                            .unwrap();
                        output
                    });
                    let bits = |value: &[f32; 4]| value.map(f32::to_bits);
                    let mut pairs = expected.iter().zip(&found);
                    let differs = pairs.position(|(one, other)| bits(one) != bits(other));
                    assert_eq!(differs, None, "{method}, {frames:?}, {layout}");
                }
            }
        }
        let all = counts
            .degrees
            .into_iter()
            .chain([counts.filtered, counts.cut]);
        assert!(all.into_iter().all(|count| count > 20), "{counts:?}");
        assert!(counts.exact > 0, "{counts:?}");
    }
}
