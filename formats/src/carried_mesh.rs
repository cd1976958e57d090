//! Meshes that the tracks of a clip carry.

/// Triangles that follow the tracks of a clip.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct CarriedMesh {
    /// Of the vertices, where the mesh itself has them.
    pub positions: Vec<[f32; 3]>,
    /// Three vertices each.
    pub triangles: Vec<[u32; 3]>,
    /// The bones that each vertex follows, by their indices in [`bones`](Self::bones).
    pub bones_of: Vec<[u16; 4]>,
    /// How much of each it follows; together 1.
    pub weights: Vec<[f32; 4]>,
    /// What vertices follow.
    pub bones: Vec<Bone>,
}

/// A track that vertices follow.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bone {
    /// The track of the clip.
    pub track: usize,
    /// What takes a vertex from the mesh to the track's joint, column after column.
    pub to_joint: [f32; 16],
}
