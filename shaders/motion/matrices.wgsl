// Stores the matrix of a rotation of every joint's state, or the first six numbers of it.
// Twin: src/twin/matrix.rs.

@group(0) @binding(0) var<storage, read> states: array<vec4f>;
@group(0) @binding(1) var<storage, read_write> values: array<f32>;

// `index` is a joint of an instance.
fn motion_work(index: u32) {
    let rows = matrix_rows(states[index * STATE_VECTORS + dispatch.vector], dispatch.detail);
    let first = index * dispatch.numbers;
    store_three(first, canonical3(rows.first));
    store_three(first + 3u, canonical3(rows.second));
    if dispatch.numbers == 9u {
        store_three(first + 6u, canonical3(rows.third));
    }
}

fn store_three(first: u32, numbers: vec4f) {
    values[first] = numbers.x;
    values[first + 1u] = numbers.y;
    values[first + 2u] = numbers.z;
}
