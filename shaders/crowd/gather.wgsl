// Copies the entries of the instances of a list side by side, in the list's order: the other kernels then see a
// crowd of these instances alone.
// Twin: src/twin/crowd_entries.rs.

@group(0) @binding(0) var<storage, read> all: array<vec4u>;
@group(0) @binding(1) var<storage, read> visible: array<u32>;
@group(0) @binding(2) var<storage, read_write> gathered: array<vec4u>;

// `index` is a layer of an instance of the window.
fn crowd_work(index: u32) {
    let instance = index / dispatch.layers;
    let layer = index - instance * dispatch.layers;
    gathered[index] = all[visible[dispatch.first_instance + instance] * dispatch.layers + layer];
}
