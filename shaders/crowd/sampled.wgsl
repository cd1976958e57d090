// Evaluates one channel of a joint.
// Twin: src/twin/crowd_layers.rs.

// The forms of channels: one constant; an arc's middle and tangent; the four coefficients of a cubic.
// Else it is the eleven coefficients of a polynomial.
const FORM_CONSTANT: u32 = 0;
const FORM_ARC: u32 = 1;
const FORM_CUBIC: u32 = 2;
const FORM_POLYNOMIAL: u32 = 3;

const ROTATION: u32 = 0;
const TRANSLATION: u32 = 1;
const SCALE: u32 = 2;

// A channel where its time base stands.
fn sampled(channel: CrowdChannel, at: CrowdPosition) -> vec4f {
    let form = channel.form_and_base >> 24u;
    let span = at.span & TICKS;
    let count = channel.count;
    let s = at.parameter;
    if form == FORM_CONSTANT {
        return cell_at(channel.first);
    }
    if (at.span & ON_KEY) != 0u {
        return cell_at(channel.keys + span * count);
    }
    if form == FORM_ARC {
        let first = channel.first + span * count * 2u;
        return canonical(evaluate(Segment(cell_at(first), cell_at(first + count)), s));
    }
    if form == FORM_CUBIC {
        let first = channel.first + span * count * 4u;
        let second = first + count;
        let third = second + count;
        let c0 = cell_at(first);
        let c1 = cell_at(second);
        return canonical(cubic(c0, c1, cell_at(third), cell_at(third + count), s));
    }
    var coefficients: array<vec4f, 11>;
    var next = channel.first + span * count * 11u;
    for (var power = 0u; power < 11u; power++) {
        coefficients[power] = cell_at(next);
        next = next + count;
    }
    return canonical(polynomial(coefficients, s));
}
