// A rotation as the rows of its matrix; as its columns when `detail` is 1: those of the
// inverse.
// Twin: src/cpu/matrix.rs.

@group(0) @binding(4) var<storage, read_write> rotations: array<f32>;

struct Rows {
    first: vec3f,
    second: vec3f,
    third: vec3f,
}

fn rows(rotation: vec4f, detail: u32) -> Rows {
    let along = select(rotation.xyz, -rotation.xyz, detail == 1u);
    let double = along + along;
    let xx = along.x * double.x;
    let yy = along.y * double.y;
    let zz = along.z * double.z;
    let xy = along.x * double.y;
    let yz = along.y * double.z;
    let zx = along.z * double.x;
    let wx = rotation.w * double.x;
    let wy = rotation.w * double.y;
    let wz = rotation.w * double.z;
    var rows: Rows;
    rows.first = vec3f(1.0 - (yy + zz), xy - wz, zx + wy);
    rows.second = vec3f(xy + wz, 1.0 - (xx + zz), yz - wx);
    rows.third = vec3f(zx - wy, yz + wx, 1.0 - (xx + yy));
    return rows;
}

fn put(place: u32, row: vec3f) {
    let settled = canonical(vec4f(row, 0.0));
    rotations[place] = settled.x;
    rotations[place + 1u] = settled.y;
    rotations[place + 2u] = settled.z;
}
