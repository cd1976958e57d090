// How the joints of a skeleton hang together.

/// A joint and its parent.
struct CrowdLink {
    joint: u32,
    parent: u32,
}
