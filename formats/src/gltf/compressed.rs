//! Decodes buffer views that meshopt compressed.

use crate::gltf::meshopt::{Filter, decode_attributes};
use crate::gltf::schema::MeshoptView;

/// The elements of a compressed view, up to `limit` bytes.
///
/// # Errors
/// Why they cannot be decoded, as text.
pub(super) fn decode(bytes: &[u8], view: &MeshoptView, limit: u64) -> Result<Vec<u8>, String> {
    let filter = Filter::named(&view.mode, view.filter.as_deref());
    let filter = filter.map_err(|error| error.to_string())?;
    let length = view.count as u128 * view.byte_stride as u128;
    if length > u128::from(limit) {
        return Err(format!(
            "the view is said to have {length} bytes; more than {limit} are not read"
        ));
    }
    decode_attributes(bytes, view.count, view.byte_stride, filter)
        .map_err(|error| error.to_string())
}
