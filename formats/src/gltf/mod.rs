//! glTF 2.0, as text (`.gltf`) and as GLB.

#[cfg_attr(
    not(test),
    expect(dead_code, reason = "called by the reader of buffer views")
)]
mod meshopt;
pub mod write_new;
