//! Division of curves that one polynomial does not fit into two subcurves, until every subcurve fits.

use bytemuck::Zeroable;

use crate::curve::options::Quantity;
use crate::fit::block::LANES;
use crate::fit::exact::fit::{CurvePiece, FitBlock, IntervalCurve, Shape, Tier};
use crate::shader::PolynomialSegment;
use crate::threads::stop;

/// Cuts curves; its memory is kept for the next ones.
#[derive(Default)]
pub(crate) struct Cutter {
    /// Made for the first curve to cut.
    block: Option<Box<FitBlock>>,
    pub(crate) curves: Vec<IntervalCurve>,
    waiting: Vec<Subcurve>,
    /// The subcurves of every curve that was cut, in order of spans and time.
    pub(crate) subcurves: Vec<Subcurve>,
}

/// A subcurve of a curve.
#[derive(Clone, Copy)]
pub(crate) struct Subcurve {
    /// The span to which the curve belongs.
    pub(crate) span: usize,
    /// The curve's index in [`Cutter::curves`].
    curve: usize,
    /// The start and the length of its interval in seconds.
    interval: (f64, f64),
    pub(crate) piece: CurvePiece,
    /// Its index among the segments, which is chosen when it is fitted; `None` afterwards if it is one of the smallest
    /// pieces and does not fit.
    pub(crate) segment: Option<usize>,
}

impl Subcurve {
    /// Both halves, if it is divided further. The first keeps the segment of the whole, so that segments are nearly
    /// in the order of evaluation.
    fn halves(self) -> Option<[Self; 2]> {
        let (start, duration) = self.interval;
        let [first, second] = self.piece.halves(start, duration)?;
        let first = Self {
            piece: first,
            ..self
        };
        let second = Self {
            piece: second,
            segment: None,
            ..self
        };
        Some([first, second])
    }
}

impl Cutter {
    /// Adds the curve of a span that starts at a time. If the span has a segment, the curve is known not to fit as a
    /// whole and is divided into at least two subcurves; otherwise it is divided only if it does not fit.
    pub(crate) fn push(
        &mut self,
        span: usize,
        start: f64,
        curve: IntervalCurve,
        segment: Option<usize>,
    ) {
        let whole = Subcurve {
            span,
            curve: self.curves.len(),
            interval: (start, 1.0 / curve.rate),
            piece: curve.piece,
            segment,
        };
        match (segment, whole.halves()) {
            (Some(_), Some(halves)) => self.waiting.extend(halves),
            (Some(_), None) => self.subcurves.push(Subcurve {
                segment: None,
                ..whole
            }),
            (None, _) => self.waiting.push(whole),
        }
        self.curves.push(curve);
    }

    /// Divides and fits the curves that were added. Shape and quantity are the same at every call.
    pub(crate) fn cut(
        &mut self,
        shape: &'static Shape,
        quantity: Quantity,
        segments: &mut Vec<PolynomialSegment>,
    ) {
        let mut done = 0;
        // If the work was stopped, the caller notices it after this function has returned.
        while done < self.waiting.len() && !stop::is_stopped() {
            let new = || Box::new(FitBlock::new(shape, quantity, Tier::Piece));
            let block = self.block.get_or_insert_with(new);
            block.clear();
            let some = done..self.waiting.len().min(done + LANES);
            for subcurve in &mut self.waiting[some.clone()] {
                block.push(&self.curves[subcurve.curve], subcurve.piece);
                if subcurve.segment.is_none() {
                    subcurve.segment = Some(segments.len());
                    segments.push(PolynomialSegment::zeroed());
                }
            }
            let batch = self.waiting[some.clone()].iter();
            block.run(segments, batch.filter_map(|subcurve| subcurve.segment));
            for (lane, subcurve) in some.clone().enumerate() {
                let subcurve = self.waiting[subcurve];
                if block.fits(lane, segments) {
                    self.subcurves.push(subcurve);
                } else if let Some(halves) = subcurve.halves() {
                    self.waiting.extend(halves);
                } else {
                    segments[block.segment_indices[lane]] = PolynomialSegment::zeroed();
                    self.subcurves.push(Subcurve {
                        segment: None,
                        ..subcurve
                    });
                }
            }
            done = some.end;
        }
        self.waiting.clear();
        // The sort is fast, because most subcurves are in order already.
        let times = |subcurve: &Subcurve| subcurve.piece.extent().0;
        self.subcurves.sort_by(|a, b| {
            let by_time = || times(a).total_cmp(&times(b));
            a.span.cmp(&b.span).then_with(by_time)
        });
    }

    /// The subcurve as a separate curve.
    pub(crate) fn curve(&self, subcurve: &Subcurve) -> IntervalCurve {
        IntervalCurve {
            piece: subcurve.piece,
            ..self.curves[subcurve.curve].clone()
        }
    }
}
