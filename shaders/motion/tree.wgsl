// Walks the frames of a robot's tree: the states of its tracks become those of its frames in the world.
// Twin: src/crowd/tree_walk.rs.

/// A frame of a robot's tree: a body before or after one of its joints. It has a fixed pose in the frame above it, and
/// then moves with its joint.
struct TreeFrame {
    /// The position in the frame above.
    offset: vec3f,
    /// The index of the frame above, or `NO_FRAME`.
    above: u32,
    /// The rotation in the frame above, before the joint moves it.
    rest: vec4f,
    /// The unit axis of a hinge or a slide, after `rest`.
    axis: vec3f,
    /// How it moves: a FRAME_….
    kind: u32,
    /// Where the states of a sample's tracks have its motion, in words: the coordinate of a hinge or a slide, else the
    /// first word of its track.
    source: u32,
    /// The first word of the track whose position is added last, or `NO_FRAME`.
    root: u32,
    /// A hinge turns by `multiplier * coordinate + shift`, a slide is moved so far.
    multiplier: f32,
    shift: f32,
}

const NO_FRAME: u32 = 0xffffffff;

const FRAME_FIXED: u32 = 0;
const FRAME_HINGE: u32 = 1;
const FRAME_SLIDE: u32 = 2;
const FRAME_BALL: u32 = 3;
// Moves freely in the frame above.
const FRAME_FREE: u32 = 4;
// Moves freely in the world. Its position is 0 until the end: sums of smaller numbers round less.
const FRAME_ROOT: u32 = 5;

// The vector of a frame's state with its position from the root.
const FROM_ROOT: u32 = 0;

const VECTOR_WORDS: u32 = 4;

@group(0) @binding(0) var<storage, read> frames: array<TreeFrame>;
// [sample][track][vector], in words.
@group(0) @binding(1) var<storage, read> tracks: array<f32>;
// [sample][frame][vector]
@group(0) @binding(2) var<storage, read_write> states: array<vec4f>;

// `index` is the sample, `dispatch.joints` the number of tracks and `dispatch.links` that of frames.
fn motion_work(index: u32) {
    let first_word = index * dispatch.joints * (STATE_VECTORS * VECTOR_WORDS);
    let first = index * dispatch.links;
    for (var i = 0u; i < dispatch.links; i++) {
        walk_to(frames[i], first_word, first, (first + i) * STATE_VECTORS);
    }
}

// Stores the state of a frame, which comes after the frame above it.
fn walk_to(frame: TreeFrame, first_word: u32, first: u32, state: u32) {
    let moves = dispatch.moves != 0u;
    var above = vec4f(0.0, 0.0, 0.0, 1.0);
    var from_root = vec3f(0.0);
    var velocity_above = vec3f(0.0);
    var angular_above = vec3f(0.0);
    if frame.above != NO_FRAME {
        let parent = (first + frame.above) * STATE_VECTORS;
        above = states[parent + WORLD_ROTATION];
        from_root = states[parent + FROM_ROOT].xyz;
        if moves {
            velocity_above = states[parent + VELOCITY].xyz;
            angular_above = states[parent + ANGULAR_VELOCITY].xyz;
        }
    }
    let word = first_word + frame.source;
    let axes = product(above, frame.rest);
    var arm = rotated(above, frame.offset);
    var rotation = axes;
    // Its velocities about and along `axes`.
    var linear = vec3f(0.0);
    var angular = vec3f(0.0);
    if (frame.kind == FRAME_HINGE) | (frame.kind == FRAME_SLIDE) {
        let value = frame.multiplier * tracks[word] + frame.shift;
        var rate = 0.0;
        if moves {
            rate = frame.multiplier * tracks[word + VECTOR_WORDS];
        }
        if frame.kind == FRAME_HINGE {
            rotation = product(axes, rotation_about(frame.axis, value));
            angular = frame.axis * rate;
        } else {
            arm = arm + rotated(axes, frame.axis * value);
            linear = frame.axis * rate;
        }
    } else if frame.kind != FRAME_FIXED {
        rotation = product(axes, rotation_at(word + WORLD_ROTATION * VECTOR_WORDS));
        if frame.kind == FRAME_FREE {
            arm = arm + rotated(axes, vector_at(word + POSITION * VECTOR_WORDS));
        }
        if moves {
            angular = vector_at(word + ANGULAR_VELOCITY * VECTOR_WORDS);
            if frame.kind != FRAME_BALL {
                linear = vector_at(word + VELOCITY * VECTOR_WORDS);
            }
        }
    }
    // One step of Newton's: rounding does not add up along the tree.
    let scale = 1.5 - 0.5 * dot4(rotation, rotation);
    states[state + WORLD_ROTATION] = canonical(rotation * scale);
    let position = canonical3(from_root + arm);
    states[state + FROM_ROOT] = position;
    var in_world = position;
    if frame.root != NO_FRAME {
        let root = vector_at(first_word + frame.root + POSITION * VECTOR_WORDS);
        in_world = canonical3(position.xyz + root);
    }
    states[state + POSITION] = in_world;
    if moves {
        let carried = velocity_above + cross3(angular_above, arm);
        states[state + VELOCITY] = canonical3(carried + rotated(axes, linear));
        states[state + ANGULAR_VELOCITY] = canonical3(angular_above + rotated(axes, angular));
    }
}

fn vector_at(word: u32) -> vec3f {
    return vec3f(tracks[word], tracks[word + 1u], tracks[word + 2u]);
}

fn rotation_at(word: u32) -> vec4f {
    return vec4f(vector_at(word), tracks[word + 3u]);
}
