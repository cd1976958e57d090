//! Meshes that move with the tracks of a clip.

/// Triangles that move with the tracks of a clip (skinning).
#[derive(Debug, Clone, Default, PartialEq)]
pub struct CarriedMesh {
    /// Positions of the vertices, in the coordinates of the mesh.
    pub positions: Vec<[f32; 3]>,
    /// Three vertex indices for each triangle.
    pub triangles: Vec<[u32; 3]>,
    /// The four bones of each vertex, as indices into [`bones`](Self::bones).
    pub bones_of: Vec<[u16; 4]>,
    /// The weight of each of these bones; the four weights of a vertex sum to 1.
    pub weights: Vec<[f32; 4]>,
    /// The bones that vertices follow.
    pub bones: Vec<Bone>,
}

/// A bone: a track that vertices follow.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bone {
    /// Index of the track in the clip.
    pub track: usize,
    /// The matrix from the coordinates of the mesh to those of the joint, column by column.
    pub to_joint: [f32; 16],
}
