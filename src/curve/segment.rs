//! Segments: the constants of a curve between two keys, as a kernel reads them.

use std::collections::TryReserveError;

use crate::shader::{ArcSegment, Form, PolynomialSegment};
use crate::twin::evaluate::Evaluate as _;

/// The segments of one clip, all of one form: the list of the other form stays empty.
#[derive(Debug, Clone)]
pub(crate) struct Segments {
    pub(crate) form: Form,
    pub(crate) arcs: Vec<ArcSegment>,
    pub(crate) polynomials: Vec<PolynomialSegment>,
}

impl Segments {
    pub(crate) fn new(form: Form) -> Self {
        Self {
            form,
            arcs: Vec::new(),
            polynomials: Vec::new(),
        }
    }

    pub(crate) fn len(&self) -> usize {
        self.arcs.len() + self.polynomials.len()
    }

    pub(crate) fn reserve(&mut self, count: usize) {
        match self.form {
            Form::Arc => self.arcs.reserve(count),
            Form::Polynomial => self.polynomials.reserve(count),
        }
    }

    pub(crate) fn try_reserve(&mut self, count: usize) -> Result<(), TryReserveError> {
        match self.form {
            Form::Arc => self.arcs.try_reserve(count),
            Form::Polynomial => self.polynomials.try_reserve(count),
        }
    }

    /// Whether a sample of a segment may have a component that is nearly 0, and needs the filter for
    /// those ([`Evaluate::is_canonical`](crate::twin::evaluate::Evaluate::is_canonical)).
    #[inline(always)]
    pub(crate) fn may_be_tiny(&self, index: u32) -> bool {
        match self.form {
            Form::Arc => !self.arcs[index as usize].is_canonical(),
            Form::Polynomial => !self.polynomials[index as usize].is_canonical(),
        }
    }

    pub(crate) fn as_bytes(&self) -> &[u8] {
        match self.form {
            Form::Arc => bytemuck::cast_slice(&self.arcs),
            Form::Polynomial => bytemuck::cast_slice(&self.polynomials),
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
