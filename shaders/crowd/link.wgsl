// How the joints of a skeleton hang together.

/// A joint and its parent.
struct CrowdLink {
    joint: u32,
    parent: u32,
}

@group(0) @binding(0) var<storage, read> links: array<CrowdLink>;
@group(0) @binding(1) var<storage, read_write> matrices: array<vec4f>;
