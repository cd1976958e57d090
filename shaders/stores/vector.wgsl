// Stores vectors, such as angular velocities, as three numbers: the fourth is always 0.

alias Stored = f32;

fn store(place: u32, rotation: vec4f) {
    rotations[place * 3u] = rotation.x;
    rotations[place * 3u + 1u] = rotation.y;
    rotations[place * 3u + 2u] = rotation.z;
}
