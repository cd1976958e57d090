// The arguments of one dispatch over a crowd.

/// The arguments of one dispatch over a crowd.
struct CrowdDispatch {
    /// The number of invocations with work; of instances, where a workgroup takes one.
    count: u32,
    /// The first instance of the window that is evaluated.
    first_instance: u32,
    /// Joints of the skeleton; when a level is walked, joints of the level.
    joints: u32,
    /// Layers of an instance; when all levels are walked, how many there are.
    layers: u32,
    /// The most time bases of a clip.
    bases: u32,
    /// The first link of the level; when all levels are walked, the first of the links that say where each
    /// begins and ends.
    first_link: u32,
    /// The clock, ticks: the lower 32 bits.
    clock_low: u32,
    /// The clock's upper bits.
    clock_high: u32,
    /// The cell of the first mask.
    masks: u32,
    /// The cell of the first reference pose.
    references: u32,
}

var<immediate> dispatch: CrowdDispatch;
