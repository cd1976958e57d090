// Stores vectors, such as angular velocities, as three numbers: the fourth is always 0.

alias Stored = f32;

const PARTS: u32 = 3;

fn parts(rotation: vec4f) -> array<Stored, PARTS> {
    return array<Stored, PARTS>(rotation.x, rotation.y, rotation.z);
}

fn store(index: u32, rotation: vec4f) {
    var all = parts(rotation);
    for (var part = 0u; part < PARTS; part++) {
        rotations[index * PARTS + part] = all[part];
    }
}
