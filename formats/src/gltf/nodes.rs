//! The nodes of a file: what hangs on what, what each is called, and where it rests.

use std::cell::OnceCell;
use std::collections::HashSet;

use glam::{DQuat, Vec3};

use crate::diagnostic::{Code, Diagnostic, Place};
use crate::gltf::json::Json;
use crate::gltf::matrix::split;
use crate::gltf::reader::Reader;
use crate::gltf::schema::Node;
use crate::keys::{Duplicates, Origin};
use crate::motion::Transform;

/// Every node of a file.
pub(super) struct Nodes {
    list: Vec<Node>,
    parents: Vec<Option<usize>>,
    names: Vec<String>,
    rests: Vec<OnceCell<Result<Rest, Diagnostic>>>,
}

/// Where a node rests.
#[derive(Debug, Clone, Copy)]
pub(super) struct Rest {
    pub(super) transform: Transform,
    /// Its matrix shears or projects, which no transform does.
    pub(super) is_sheared: bool,
}

impl Nodes {
    /// # Errors
    /// When a node is broken, or they make no trees.
    pub(super) fn read(json: &Json<'_>) -> Result<Self, Diagnostic> {
        let count = json.entries("nodes").len();
        let node = |index| json.entry("nodes", index, "/nodes");
        let list: Vec<Node> = (0..count).map(node).collect::<Result<_, _>>()?;
        Ok(Self {
            parents: parents(json, &list)?,
            names: names(&list),
            rests: list.iter().map(|_| OnceCell::new()).collect(),
            list,
        })
    }

    pub(super) fn count(&self) -> usize {
        self.list.len()
    }

    pub(super) fn parent(&self, node: usize) -> Option<usize> {
        self.parents[node]
    }

    /// What the track of a node is called; no two nodes are called the same.
    pub(super) fn name(&self, node: usize) -> &str {
        &self.names[node]
    }

    pub(super) fn has_matrix(&self, node: usize) -> bool {
        self.list[node].matrix.is_some()
    }

    /// Where a node rests.
    ///
    /// # Errors
    /// When its numbers are too large for f32, or its rotation is none.
    pub(super) fn rest(&self, node: usize, reader: &Reader<'_>) -> Result<Rest, Diagnostic> {
        let find = || find_rest(&self.list[node], node, reader);
        self.rests[node].get_or_init(find).clone()
    }
}

/// The parent of each node.
fn parents(json: &Json<'_>, list: &[Node]) -> Result<Vec<Option<usize>>, Diagnostic> {
    let mut parents: Vec<Option<usize>> = vec![None; list.len()];
    for (parent, node) in list.iter().enumerate() {
        for (place, &child) in node.children.iter().enumerate() {
            let pointer = format!("/nodes/{parent}/children/{place}");
            match parents.get_mut(child) {
                None => return Err(json.no_such("nodes", child, list.len(), &pointer)),
                Some(own @ None) => *own = Some(parent),
                Some(Some(other)) => {
                    let message = format!(
                        "node {child} hangs on nodes {other} and {parent}; it can hang on one alone"
                    );
                    return Err(json.refuse(&pointer, Code::NodeTree, message));
                }
            }
        }
    }
    // The number of the walk that came by a node, from 1.
    let mut walks = vec![0; list.len()];
    for start in 0..list.len() {
        let mut next = Some(start);
        while let Some(node) = next.filter(|&node| walks[node] == 0) {
            walks[node] = start + 1;
            next = parents[node];
        }
        if let Some(node) = next.filter(|&node| walks[node] == start + 1) {
            let message = format!("node {node} hangs on itself, by way of its children");
            return Err(json.refuse(&format!("/nodes/{node}"), Code::NodeTree, message));
        }
    }
    Ok(parents)
}

/// The nodes' own names; `node7` where there is none, `hand#12` where an earlier node is `hand`.
fn names(list: &[Node]) -> Vec<String> {
    let mut taken = HashSet::new();
    let name = |(index, node): (usize, &Node)| {
        let own = node.name.clone().filter(|name| !name.is_empty());
        let mut name = own.unwrap_or_else(|| format!("node{index}"));
        while !taken.insert(name.clone()) {
            name = format!("{name}#{index}");
        }
        name
    };
    list.iter().enumerate().map(name).collect()
}

fn find_rest(node: &Node, index: usize, reader: &Reader<'_>) -> Result<Rest, Diagnostic> {
    let pointer = format!("/nodes/{index}");
    let too_large = |what: &str| {
        let message = "a number here passes the largest f32, 3.4e38";
        reader
            .json
            .refuse(&format!("{pointer}/{what}"), Code::TooLarge, message)
    };
    if let Some(matrix) = node.matrix {
        let (transform, is_sheared) = split(matrix).ok_or_else(|| too_large("matrix"))?;
        return Ok(Rest {
            transform,
            is_sheared,
        });
    }
    let mut transform = Transform::default();
    let vector = |given: Option<[f64; 3]>, what| match given {
        None => Ok(None),
        Some(given) => {
            let vector = Vec3::from_array(given.map(|number| number as f32));
            vector
                .is_finite()
                .then_some(Some(vector))
                .ok_or_else(|| too_large(what))
        }
    };
    if let Some(translation) = vector(node.translation, "translation")? {
        transform.translation = translation;
    }
    if let Some(scale) = vector(node.scale, "scale")? {
        transform.scale = scale;
    }
    if let Some(rotation) = node.rotation {
        let origin = Origin {
            file: reader.json.name,
            place: &|_| Place::Inside(format!("{pointer}/rotation")),
            duplicates: Duplicates::default(),
        };
        let keys = origin.unit(
            [DQuat::from_array(rotation)],
            &mut reader.warnings.borrow_mut(),
        )?;
        transform.rotation = keys[0];
    }
    Ok(Rest {
        transform,
        is_sheared: false,
    })
}
