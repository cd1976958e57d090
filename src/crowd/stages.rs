//! The last steps of an evaluation, in place: matrices relative to the parents become model matrices, and these become
//! skinning matrices.

use crate::shader::CrowdLink;
use crate::twin::crowd_matrices::{Rows, affine_product};

/// Matrices in the parents' frames become those in the model's.
#[inline(always)]
pub(crate) fn walk(links: &[CrowdLink], matrices: &mut [Rows]) {
    for link in links {
        let (joint, parent) = (link.joint as usize, link.parent as usize);
        matrices[joint] = affine_product(&matrices[parent], &matrices[joint]);
    }
}

/// Matrices in the model's frame become those for skinning.
#[inline(always)]
pub(crate) fn skin(bind: &[Rows], matrices: &mut [Rows]) {
    for (matrix, bind) in matrices.iter_mut().zip(bind) {
        *matrix = affine_product(matrix, bind);
    }
}
