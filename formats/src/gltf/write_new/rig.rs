//! The nodes and skins of a new glTF file: a node for each track of a skeleton.

use std::collections::HashSet;

use glam::{DAffine3, DMat3, Vec3};
use tumble::Skeleton;

use crate::gltf::write_new::json::Node;
use crate::motion::{Motion, Transform};

/// The nodes of all skeletons of a file.
#[derive(Default)]
pub(super) struct Nodes {
    pub(super) list: Vec<Node>,
    pub(super) roots: Vec<usize>,
    /// The joints of each skin, the root first, and their inverse bind matrices.
    pub(super) skins: Vec<(Vec<usize>, Vec<[f32; 16]>)>,
    names: UniqueNames,
}

impl Nodes {
    /// Adds a node for each track of a clip, in their order, and a skin for each tree of its
    /// skeleton, as the joints of a skin have one root in common. Gives the first node's place.
    ///
    /// # Errors
    /// Why the joints are no trees, in words.
    pub(super) fn add(&mut self, clip: &Motion) -> Result<usize, String> {
        let first = self.list.len();
        let tracks = clip.set.track_count();
        let parents: Vec<Option<usize>> = match clip.skeleton.is_empty() {
            true => vec![None; tracks],
            false => clip.skeleton.iter().map(|joint| joint.parent).collect(),
        };
        Skeleton::new(parents.clone(), vec![Vec3::ZERO; tracks]).map_err(|e| e.to_string())?;
        for track in 0..tracks {
            let rest = clip.skeleton.get(track).map(|joint| joint.rest);
            let rest = rest.unwrap_or_default();
            let name = clip.set.track_name(track);
            if !rest.translation.is_finite()
                || !rest.rotation.is_finite()
                || !rest.scale.is_finite()
            {
                return Err(format!(
                    "the rest pose of `{name}` has a number that is not finite"
                ));
            }
            self.list.push(Node {
                name: self.names.unique(name, first + track),
                translation: rest.translation.to_array(),
                rotation: rest.rotation.to_array(),
                scale: rest.scale.to_array(),
                children: Vec::new(),
            });
        }
        let mut roots = Vec::new();
        for (track, parent) in parents.into_iter().enumerate() {
            match parent {
                Some(parent) => self.list[first + parent].children.push(first + track),
                None => roots.push(first + track),
            }
        }
        if !clip.skeleton.is_empty() {
            for &root in &roots {
                self.add_skin(root, first, clip);
            }
        }
        self.roots.extend(roots);
        Ok(first)
    }

    /// A skin of all nodes under `root`. `first` is the node of the clip's first track.
    fn add_skin(&mut self, root: usize, first: usize, clip: &Motion) {
        let mut joints = vec![(root, DAffine3::IDENTITY)];
        let mut next = 0;
        while let Some(&(node, parent)) = joints.get(next) {
            let own = parent * affine(&clip.skeleton[node - first].rest);
            joints[next].1 = own;
            joints.extend(self.list[node].children.iter().map(|&child| (child, own)));
            next += 1;
        }
        let matrices = joints.iter().map(|(_, world)| inverse(*world)).collect();
        let joints = joints.into_iter().map(|(node, _)| node).collect();
        self.skins.push((joints, matrices));
    }
}

fn affine(rest: &Transform) -> DAffine3 {
    DAffine3::from_scale_rotation_translation(
        rest.scale.as_dvec3(),
        rest.rotation.as_dquat(),
        rest.translation.as_dvec3(),
    )
}

/// The columns of the inverse, whose last row is exactly 0 0 0 1; the identity where there is no
/// inverse, as of a joint at scale 0, which shows nothing at rest.
fn inverse(world: DAffine3) -> [f32; 16] {
    let columns = |of: DAffine3| {
        let DMat3 {
            x_axis,
            y_axis,
            z_axis,
        } = of.matrix3;
        let columns = [
            (x_axis, 0.0),
            (y_axis, 0.0),
            (z_axis, 0.0),
            (of.translation, 1.0),
        ];
        let rows = columns.map(|(v, last)| [v.x as f32, v.y as f32, v.z as f32, last]);
        std::array::from_fn(|i| rows[i / 4][i % 4])
    };
    let inverse: [f32; 16] = columns(world.inverse());
    match inverse.iter().all(|number| number.is_finite()) {
        true => inverse,
        false => columns(DAffine3::IDENTITY),
    }
}

/// Names that were given.
#[derive(Default)]
pub(super) struct UniqueNames(HashSet<String>);

impl UniqueNames {
    /// `name`, or where another has it, `name#place`.
    pub(super) fn unique(&mut self, name: String, place: usize) -> String {
        let mut own = name;
        while !self.0.insert(own.clone()) {
            own = format!("{own}#{place}");
        }
        own
    }
}
