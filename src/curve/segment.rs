//! Segments: the constants of a curve between two keys, as a kernel reads them.

use crate::math::canonical::canonical;
use crate::shader::{ArcSegment, Form, PolynomialSegment};

/// Coefficients of a [`PolynomialSegment`]: those of 1, s, … s¹⁰.
pub(crate) const POWERS: usize = 11;

/// The segments of one clip, all of one form.
#[derive(Debug, Clone)]
pub(crate) enum Segments {
    Arc(Vec<ArcSegment>),
    Polynomial(Vec<PolynomialSegment>),
}

impl Segments {
    pub(crate) fn new(form: Form) -> Self {
        match form {
            Form::Arc => Self::Arc(Vec::new()),
            Form::Polynomial => Self::Polynomial(Vec::new()),
        }
    }

    pub(crate) fn len(&self) -> usize {
        match self {
            Self::Arc(segments) => segments.len(),
            Self::Polynomial(segments) => segments.len(),
        }
    }

    pub(crate) fn reserve(&mut self, count: usize) {
        match self {
            Self::Arc(segments) => segments.reserve(count),
            Self::Polynomial(segments) => segments.reserve(count),
        }
    }

    pub(crate) fn clear(&mut self) {
        match self {
            Self::Arc(segments) => segments.clear(),
            Self::Polynomial(segments) => segments.clear(),
        }
    }

    pub(crate) fn as_bytes(&self) -> &[u8] {
        match self {
            Self::Arc(segments) => bytemuck::cast_slice(segments),
            Self::Polynomial(segments) => bytemuck::cast_slice(segments),
        }
    }

    /// The same rotations with the other sign.
    pub(crate) fn negate(&mut self) {
        let components: &mut [f32] = match self {
            Self::Arc(segments) => bytemuck::cast_slice_mut(segments),
            Self::Polynomial(segments) => bytemuck::cast_slice_mut(segments),
        };
        for component in components {
            *component = canonical(-*component);
        }
    }

    /// Moves all of `other` behind its own.
    pub(crate) fn append(&mut self, other: Self) {
        match (self, other) {
            (Self::Arc(own), Self::Arc(other)) => own.extend(other),
            (Self::Polynomial(own), Self::Polynomial(other)) => own.extend(other),
            _ => unreachable!("segments of one clip have one form"),
        }
    }
}

/// Bytes of one segment of a form.
pub(crate) fn segment_size(form: Form) -> usize {
    match form {
        Form::Arc => size_of::<ArcSegment>(),
        Form::Polynomial => size_of::<PolynomialSegment>(),
    }
}
