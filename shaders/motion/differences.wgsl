// Sets a joint's velocities to the differences between two states of it.
// Twin: src/crowd/states.rs.

// Steps in a second, of each instance.
@group(0) @binding(0) var<storage, read> rates: array<f32>;
// [state][instance][joint][vector]: the state itself, the one before and the one after.
@group(0) @binding(1) var<storage, read_write> states: array<vec4f>;

fn motion_work(index: u32) {
    let rate = rates[dispatch.first_sample + index / dispatch.joints];
    let before = (dispatch.count + index) * STATE_VECTORS;
    let after = (2u * dispatch.count + index) * STATE_VECTORS;
    let state = index * STATE_VECTORS;
    let moved = states[after + POSITION].xyz - states[before + POSITION].xyz;
    states[state + VELOCITY] = canonical3(moved * rate);
    let start = states[before + WORLD_ROTATION];
    let rotation = flushed4(product(states[after + WORLD_ROTATION], vec4f(-start.xyz, start.w)));
    let sine = root(rotation.x * rotation.x + rotation.y * rotation.y + rotation.z * rotation.z);
    // The shorter arc, by the rotation vector's length; 0 if the angle is.
    var along = 0.0;
    if sine != 0.0 {
        along = 2.0 * arc_tangent(sine, magnitude(rotation.w)) * reciprocal(sine);
    }
    let scale = select(along, -along, rotation.w < 0.0);
    states[state + ANGULAR_VELOCITY] = canonical3(rotation.xyz * (scale * rate));
}
