// Walks the skeleton of a sample: states in the parents' frames become states in the world.
// Twin: src/crowd/states.rs.

// Level by level.
@group(0) @binding(0) var<storage, read> links: array<CrowdLink>;
@group(0) @binding(1) var<storage, read_write> states: array<vec4f>;

fn motion_work(index: u32) {
    let first = index * dispatch.joints;
    for (var i = 0u; i < dispatch.links; i++) {
        let link = links[i];
        hang_on((first + link.parent) * STATE_VECTORS, (first + link.joint) * STATE_VECTORS);
    }
}

// Converts a joint's state from its parent's frame to the world.
fn hang_on(parent: u32, child: u32) {
    let above = states[parent + WORLD_ROTATION];
    let arm = rotated(above, states[child + POSITION].xyz);
    states[child + POSITION] = canonical3(states[parent + POSITION].xyz + arm);
    let rotation = product(above, states[child + WORLD_ROTATION]);
    // One step of Newton's: rounding does not add up along the skeleton.
    let scale = 1.5 - 0.5 * dot4(rotation, rotation);
    states[child + WORLD_ROTATION] = canonical(rotation * scale);
    if dispatch.moves != 0u {
        let angular_above = states[parent + ANGULAR_VELOCITY].xyz;
        let carried = states[parent + VELOCITY].xyz + cross3(angular_above, arm);
        let velocity = rotated(above, states[child + VELOCITY].xyz);
        states[child + VELOCITY] = canonical3(carried + velocity);
        let angular = rotated(above, states[child + ANGULAR_VELOCITY].xyz);
        states[child + ANGULAR_VELOCITY] = canonical3(angular_above + angular);
    }
}
