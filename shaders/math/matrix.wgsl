// The rows of a rotation's matrix. With `detail` 1 they are its columns, which are the rows of the
// inverse rotation's matrix.
// Twin: src/twin/matrix.rs.

struct MatrixRows {
    first: vec3f,
    second: vec3f,
    third: vec3f,
}

fn matrix_rows(rotation: vec4f, detail: u32) -> MatrixRows {
    let v = rotation.xyz;
    // The inverse of a rotation, with the other sign.
    let w = select(rotation.w, -rotation.w, detail == 1u);
    let double = v + v;
    let xx = v.x * double.x;
    let yy = v.y * double.y;
    let zz = v.z * double.z;
    let xy = v.x * double.y;
    let yz = v.y * double.z;
    let zx = v.z * double.x;
    let wx = w * double.x;
    let wy = w * double.y;
    let wz = w * double.z;
    var rows: MatrixRows;
    rows.first = vec3f(1.0 - (yy + zz), xy - wz, zx + wy);
    rows.second = vec3f(xy + wz, 1.0 - (xx + zz), yz - wx);
    rows.third = vec3f(zx - wy, yz + wx, 1.0 - (xx + yy));
    return rows;
}
