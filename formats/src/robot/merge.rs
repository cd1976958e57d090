//! Bodies without joints, merged into the bodies that they are fixed to.

use glam::{DQuat, DVec3};
use tumble::names;
use tumble::trees::{Tree, TreeBody, TreeError};

use crate::robot::Robot;

/// How bodies without joints are written.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum FixedBodies {
    /// They are bodies as all others.
    Keep,
    /// They are parts of the bodies that they are fixed to.
    Merge,
}

names! {
    FixedBodies, "rule for bodies without joints",
    Keep => "keep",
    Merge => "merge",
}

/// A mass in kilograms and its centre in the frame of a body.
#[derive(Debug, Clone, Copy)]
struct PointMass {
    /// `None` if the file does not say it.
    mass: Option<f64>,
    centre: Option<DVec3>,
}

impl Robot {
    /// The same robot without the bodies that have no joints: each is a part of the body that it is fixed to. The poses
    /// of the others stay, and their centres of mass are those of all their parts. Bodies of the world are kept.
    ///
    /// # Errors
    /// When a position is no longer finite.
    pub fn merged(&self) -> Result<Self, TreeError> {
        let all = self.tree.bodies();
        let kept = kept_bodies(&self.tree);
        // The kept body that each belongs to, and its pose there.
        let mut parts: Vec<(usize, DVec3, DQuat)> = Vec::with_capacity(all.len());
        let mut bodies: Vec<TreeBody> = Vec::with_capacity(kept.len());
        let mut masses: Vec<Vec<PointMass>> = Vec::with_capacity(kept.len());
        for (index, body) in all.iter().enumerate() {
            let mass = PointMass {
                mass: self.masses.get(index).copied().flatten(),
                centre: body.mass_centre,
            };
            let above = body.parent.map(|parent| parts[parent]);
            let placed = above.map(|(into, position, rotation)| {
                let position = position + rotation * body.position;
                (into, position, (rotation * body.rotation).normalize())
            });
            if kept.binary_search(&index).is_ok() {
                parts.push((bodies.len(), DVec3::ZERO, DQuat::IDENTITY));
                let (parent, position, rotation) = match placed {
                    Some((parent, position, rotation)) => (Some(parent), position, rotation),
                    None => (None, body.position, body.rotation),
                };
                bodies.push(TreeBody {
                    parent,
                    position,
                    rotation,
                    ..body.clone()
                });
                masses.push(vec![mass]);
            } else if let Some((into, position, rotation)) = placed {
                parts.push((into, position, rotation));
                masses[into].push(PointMass {
                    centre: mass.centre.map(|centre| position + rotation * centre),
                    ..mass
                });
            }
        }
        for (body, masses) in bodies.iter_mut().zip(&masses) {
            body.mass_centre = common_centre(masses);
        }
        let is_merged = |index: &usize| kept.binary_search(index).is_err();
        let merged = (0..all.len()).filter(is_merged);
        Ok(Self {
            tree: Tree::new(bodies)?,
            masses: masses
                .iter()
                .map(|masses| masses.iter().map(|part| part.mass).sum())
                .collect(),
            merged: merged.map(|index| all[index].name.clone()).collect(),
            ..self.clone()
        })
    }
}

/// The bodies that [`Robot::merged`] keeps, by their indices in [`Tree::bodies`].
pub(super) fn kept_bodies(tree: &Tree) -> Vec<usize> {
    let bodies = tree.bodies().iter().enumerate();
    let kept = bodies.filter(|(_, body)| body.parent.is_none() || !body.joints.is_empty());
    kept.map(|(index, _)| index).collect()
}

/// The centre of several masses; `None` if the file does not say one of them.
fn common_centre(masses: &[PointMass]) -> Option<DVec3> {
    if let &[single] = masses {
        return single.centre;
    }
    let (mut total, mut moment) = (0.0, DVec3::ZERO);
    for part in masses {
        let mass = part.mass?;
        total += mass;
        if mass > 0.0 {
            moment += mass * part.centre?;
        }
    }
    let centre = moment / total;
    match total > 0.0 && centre.is_finite() {
        true => Some(centre),
        false => masses.first()?.centre,
    }
}
