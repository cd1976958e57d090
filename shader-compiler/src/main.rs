//! `cargo run -p tumble-shaders`, after a shader has changed.

fn main() {
    tumble_shaders::write();
}
