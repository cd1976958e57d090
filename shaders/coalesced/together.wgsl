// Values of several parts: neighbours that stored each its own would write a little of many lines at a time.
// So eight put theirs together in memory of the workgroup, and store the parts in the order in which they lie.
// It is joined with a store that has `parts`.

var<workgroup> tile: array<array<Stored, PARTS>, WORKGROUP>;
// Whether an invocation has a value there.
var<workgroup> is_there: array<u32, WORKGROUP>;

fn finish(lane: u32, index: u32, rotation: vec4f, is_stored: bool) {
    is_there[lane] = select(0u, 1u, is_stored);
    if is_stored {
        tile[lane] = parts(rotation);
    }
    workgroupBarrier();
    let within = lane & (LINE - 1u);
    let first = (index - within) * PARTS;
    for (var part = within; part < LINE * PARTS; part += LINE) {
        let value = part / PARTS;
        let other = lane - within + value;
        if is_there[other] != 0u {
            rotations[first + part] = tile[other][part - value * PARTS];
        }
    }
    workgroupBarrier();
}
