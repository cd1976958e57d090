//! The orders in which other programs list the bodies of a tree.

use crate::names::names;
use crate::pose::tree::Tree;

/// The order in which bodies are listed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum BodyOrder {
    /// A body is followed by its first child's whole branch, then by the next child's: `MuJoCo`, mjlab, `ProtoMotions`.
    #[default]
    DepthFirst,
    /// All bodies of a level come before those of the next: `PhysX`, Isaac Sim and `IsaacLab`.
    BreadthFirst,
}

names! {
    BodyOrder, "body order",
    DepthFirst => "depth-first",
    BreadthFirst => "breadth-first",
}

/// The order of bodies with the same parent.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum Siblings {
    /// As in the file.
    #[default]
    File,
    /// Sorted by the names of the bodies.
    BodyName,
    /// Sorted by the name of each body's first joint, as in pinocchio. A body without joints is sorted by its name.
    JointName,
}

names! {
    Siblings, "order of siblings",
    File => "file",
    BodyName => "body-name",
    JointName => "joint-name",
}

impl Tree {
    /// The indices of all bodies in an order.
    #[must_use]
    pub fn order(&self, order: BodyOrder, siblings: Siblings) -> Vec<usize> {
        let count = self.bodies.len();
        // The last list has the bodies of the world.
        let mut children = vec![Vec::new(); count + 1];
        for (i, body) in self.bodies.iter().enumerate() {
            children[body.parent.unwrap_or(count)].push(i);
        }
        let key = |&i: &usize| {
            let body = &self.bodies[i];
            match (siblings, body.joints.first()) {
                (Siblings::JointName, Some(joint)) => &*joint.name,
                _ => &*body.name,
            }
        };
        if siblings != Siblings::File {
            for list in &mut children {
                list.sort_by(|a, b| key(a).cmp(key(b)));
            }
        }
        let mut listed = Vec::with_capacity(count);
        match order {
            BodyOrder::BreadthFirst => {
                listed.append(&mut children[count]);
                let mut next = 0;
                while let Some(&body) = listed.get(next) {
                    listed.append(&mut children[body]);
                    next += 1;
                }
            }
            BodyOrder::DepthFirst => {
                let mut stack = std::mem::take(&mut children[count]);
                stack.reverse();
                while let Some(body) = stack.pop() {
                    listed.push(body);
                    stack.extend(std::mem::take(&mut children[body]).into_iter().rev());
                }
            }
        }
        listed
    }
}
