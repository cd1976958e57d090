//! The values of a pickle as named arrays, as those of an NPZ file: `a.b` is the entry `b` of the dict `a`.

use std::borrow::Cow;
use std::ops::Range;

use crate::array::{ArrayHeader, Element};
use crate::budget::Budget;
use crate::diagnostic::{Code, Diagnostic};
use crate::npz::archive::{Member, ONLY_ARRAY};
use crate::pickle::globals::{Class, shown};
use crate::pickle::machine::{Array, Data, Node, NodeId, Tree, resolve, text};
use crate::warnings::{Warnings, listed};

/// The largest number of axes of an array that lists in lists become.
const MAX_AXES: usize = 4;

/// Bytes of memory of a value in addition to its name and its numbers.
const VALUE: usize = 256;

/// Collects the values of a pickle.
pub(super) struct Values<'a> {
    file: &'a str,
    input: &'a [u8],
    tree: &'a Tree,
    budget: &'a Budget,
    /// Bytes that are not in the input; they are to follow it.
    added: Vec<u8>,
    members: Vec<Member>,
    /// The dicts of a dict, by their keys, and the number of members before each.
    entries: Vec<(String, usize)>,
    /// The objects of unknown classes, in words.
    inert: Vec<String>,
}

/// The values of a pickle as the members of an archive.
pub(super) struct NamedValues {
    pub(super) members: Vec<Member>,
    /// The dicts of a dict that holds nothing else, by their keys, and the number of members before each.
    pub(super) dicts: Vec<(String, usize)>,
    /// Bytes that are to follow the input.
    pub(super) added: Vec<u8>,
}

/// A value to be visited.
struct Visit {
    name: String,
    /// The value as an expression of Python without the name of the whole.
    location: String,
    node: NodeId,
    /// The value that it is part of.
    parent: Option<NodeId>,
    /// Its key there.
    key: String,
}

impl<'a> Values<'a> {
    /// Lists the values. `name` is that of the whole value, or empty.
    ///
    /// # Errors
    /// When they take more memory than the budget.
    pub(super) fn of(
        file: &'a str,
        input: &'a [u8],
        tree: &'a Tree,
        name: &str,
        budget: &'a Budget,
        warnings: &mut Warnings,
    ) -> Result<NamedValues, Diagnostic> {
        let mut values = Self {
            file,
            input,
            tree,
            budget,
            added: Vec::new(),
            members: Vec::new(),
            entries: Vec::new(),
            inert: Vec::new(),
        };
        values.visit(Visit {
            name: name.to_owned(),
            location: name.to_owned(),
            node: tree.root,
            parent: None,
            key: String::new(),
        })?;
        let is_dict_of_dicts = match &tree.nodes[tree.root.index()] {
            Node::Dict(pairs) => pairs.len() == values.entries.len(),
            _ => false,
        };
        if !is_dict_of_dicts {
            values.entries.clear();
        }
        let count = values.inert.len();
        if let Some(objects) = listed(values.inert) {
            let message = format!("objects of classes that are not read: {objects}");
            warnings.warn_of(count, Code::InertObjects, || (None, message));
        }
        Ok(NamedValues {
            members: values.members,
            dicts: values.entries,
            added: values.added,
        })
    }

    fn visit(&mut self, root: Visit) -> Result<(), Diagnostic> {
        let mut stack = vec![root];
        while let Some(visit) = stack.pop() {
            let Some(node) = resolve(&self.tree.nodes, visit.node) else {
                continue;
            };
            let tree = self.tree;
            match &tree.nodes[node.index()] {
                Node::None => {}
                Node::Dict(pairs) => {
                    if visit.parent == Some(tree.root) {
                        self.entries.push((visit.key.clone(), self.members.len()));
                    }
                    let first = stack.len();
                    for (index, &(key, value)) in pairs.iter().enumerate() {
                        let key = self.key(key, index);
                        stack.push(self.child(&visit, &key, &format!("['{key}']"), value)?);
                    }
                    stack[first..].reverse();
                }
                Node::List(items) | Node::Tuple(items) | Node::Set(items) => {
                    if self.numbers(&visit, node)? || self.texts(&visit, items)? {
                        continue;
                    }
                    let first = stack.len();
                    for (index, &item) in items.iter().enumerate() {
                        let location = format!("[{index}]");
                        stack.push(self.child(&visit, &index.to_string(), &location, item)?);
                    }
                    stack[first..].reverse();
                }
                Node::Array(array) => {
                    let data = match &array.data {
                        Data::Input(range) => range.clone(),
                        Data::Decoded(bytes) => self.add(bytes)?,
                    };
                    self.member(visit, array.header.clone(), data)?;
                }
                Node::Inert(inert) => self.class(visit, &inert.class.to_string())?,
                Node::Class(Class::Other(class)) => self.class(visit, &class.to_string())?,
                Node::Class(Class::Known(class)) => self.class(visit, class.name())?,
                Node::Dtype(_) => self.class(visit, "numpy.dtype")?,
                Node::Storage(_) => self.class(visit, "torch.Storage")?,
                Node::Unbuilt(_) => self.class(visit, "array without its state")?,
                single => self.single(visit, single)?,
            }
        }
        Ok(())
    }

    /// A number or a text.
    fn single(&mut self, visit: Visit, node: &Node) -> Result<(), Diagnostic> {
        let (element, bytes): (Element, Cow<'_, [u8]>) = match node {
            Node::Bool(truth) => (Element::Bool, vec![u8::from(*truth)].into()),
            Node::Int(number) => (Element::Signed(8), number.to_le_bytes().to_vec().into()),
            Node::Float(number) => (Element::F64, number.to_le_bytes().to_vec().into()),
            Node::Bytes(data) => {
                let bytes = data.bytes(self.input);
                (Element::Bytes(bytes.len()), bytes.into())
            }
            Node::Text(data) => {
                let text = std::str::from_utf8(data.bytes(self.input)).unwrap_or_default();
                self.take(text.len(), 4)?;
                (
                    Element::Unicode(text.chars().count()),
                    utf_32(text, 0).into(),
                )
            }
            Node::Big(digits) => (Element::Unicode(digits.len()), utf_32(digits, 0).into()),
            _ => return Ok(()),
        };
        let data = self.add(&bytes)?;
        self.member(visit, header(element, Vec::new()), data)
    }

    /// Adds a list of numbers, or lists of equal lengths in lists; `false` for other values.
    fn numbers(&mut self, visit: &Visit, list: NodeId) -> Result<bool, Diagnostic> {
        let nodes = &self.tree.nodes;
        let value = |node: NodeId| resolve(nodes, node).map(|node| &nodes[node.index()]);
        let (mut level, mut shape) = (vec![list], Vec::new());
        loop {
            let mut lengths = level.iter().map(|&node| match value(node) {
                Some(Node::List(items) | Node::Tuple(items)) => Some(items.len()),
                _ => None,
            });
            let Some(Some(length)) = lengths.next() else {
                break;
            };
            if shape.len() == MAX_AXES || !lengths.all(|other| other == Some(length)) {
                return Ok(false);
            }
            self.take(level.len().saturating_mul(length), size_of::<NodeId>())?;
            shape.push(length);
            level = level
                .iter()
                .flat_map(|&node| match value(node) {
                    Some(Node::List(items) | Node::Tuple(items)) => &items[..],
                    _ => &[],
                })
                .copied()
                .collect();
        }
        let number = |&node: &NodeId| match value(node) {
            Some(&Node::Int(number)) => Some((Element::Signed(8), number, number as f64)),
            Some(&Node::Bool(truth)) => Some((Element::Bool, truth.into(), truth.into())),
            Some(&Node::Float(number)) => Some((Element::F64, 0, number)),
            Some(Node::Array(array)) => Some((Element::F64, 0, single_number(array, self.input)?)),
            _ => None,
        };
        let mut kinds = level.iter().map(|node| number(node).map(|(kind, ..)| kind));
        let first = kinds.next().unwrap_or(Some(Element::F64));
        let same = kinds.try_fold(first, |kind, next| {
            let (kind, next) = (kind?, next?);
            Some(Some(if kind == next { kind } else { Element::F64 }))
        });
        let Some(Some(element)) = same else {
            return Ok(false);
        };
        self.take(level.len(), 2 * size_of::<f64>())?;
        let mut bytes = Vec::with_capacity(8 * level.len());
        for (_, whole, float) in level.iter().filter_map(number) {
            match element {
                Element::Signed(_) => bytes.extend(whole.to_le_bytes()),
                Element::Bool => bytes.push(whole as u8),
                _ => bytes.extend(float.to_le_bytes()),
            }
        }
        let data = self.add(&bytes)?;
        let visit = visit.again();
        self.member(visit, header(element, shape), data)?;
        Ok(true)
    }

    /// Adds a list of texts; `false` for other values.
    fn texts(&mut self, visit: &Visit, items: &[NodeId]) -> Result<bool, Diagnostic> {
        let nodes = &self.tree.nodes;
        let value = |node: NodeId| resolve(nodes, node).map(|node| &nodes[node.index()]);
        let one = |&item: &NodeId| match value(item)? {
            Node::Array(array) => single_text(array, self.input).map(Cow::Owned),
            other => text(other, self.input),
        };
        let is_text = |item: &NodeId| {
            matches!(
                value(*item),
                Some(Node::Text(_) | Node::Bytes(_) | Node::Array(_))
            )
        };
        if items.is_empty() || !items.iter().all(is_text) {
            return Ok(false);
        }
        let texts: Vec<Cow<'_, str>> = items.iter().filter_map(one).collect();
        if texts.len() < items.len() {
            return Ok(false);
        }
        let lengths = texts.iter().map(|text| text.chars().count());
        let longest = lengths.max().unwrap_or(0);
        self.take(items.len(), longest.saturating_mul(8))?;
        let bytes: Vec<u8> = texts
            .iter()
            .flat_map(|text| utf_32(text, longest))
            .collect();
        let data = self.add(&bytes)?;
        let header = header(Element::Unicode(longest), vec![items.len()]);
        self.member(visit.again(), header, data)?;
        Ok(true)
    }

    /// Adds an object of a class that is not read.
    fn class(&mut self, visit: Visit, class: &str) -> Result<(), Diagnostic> {
        let of = if visit.name.is_empty() {
            "it"
        } else {
            &visit.name
        };
        self.inert.push(format!("`{}` of {class}", shown(of)));
        self.member(
            visit,
            header(Element::Class(class.to_owned()), Vec::new()),
            0..0,
        )
    }

    fn member(
        &mut self,
        visit: Visit,
        header: ArrayHeader,
        data: Range<usize>,
    ) -> Result<(), Diagnostic> {
        let name = if visit.name.is_empty() {
            ONLY_ARRAY.to_owned()
        } else {
            visit.name
        };
        self.take(1, VALUE + name.len() + visit.location.len())?;
        self.members
            .push(Member::of_value(name, visit.location, header, data));
        Ok(())
    }

    fn child(
        &self,
        parent: &Visit,
        key: &str,
        location: &str,
        node: NodeId,
    ) -> Result<Visit, Diagnostic> {
        let name = match parent.name.is_empty() {
            true => key.to_owned(),
            false => format!("{}.{key}", parent.name),
        };
        let location = format!("{}{location}", parent.location);
        self.take(1, size_of::<Visit>() + name.len() + location.len())?;
        Ok(Visit {
            name,
            location,
            node,
            parent: Some(parent.node),
            key: key.to_owned(),
        })
    }

    /// A key as a name: a text, or a whole number.
    fn key(&self, key: NodeId, index: usize) -> String {
        let nodes = &self.tree.nodes;
        let key = resolve(nodes, key).map(|key| &nodes[key.index()]);
        match key {
            Some(Node::Int(number)) => number.to_string(),
            Some(node) => match text(node, self.input) {
                Some(text) => text.into_owned(),
                None => format!("key {index}"),
            },
            None => format!("key {index}"),
        }
    }

    fn add(&mut self, bytes: &[u8]) -> Result<Range<usize>, Diagnostic> {
        self.take(1, bytes.len())?;
        let start = self.input.len() + self.added.len();
        self.added.extend_from_slice(bytes);
        Ok(start..start + bytes.len())
    }

    fn take(&self, count: usize, bytes: usize) -> Result<(), Diagnostic> {
        let budgeted = self.budget.take(count, bytes);
        budgeted.map_err(|error| Diagnostic::new(self.file, Code::PickleLimits, error.to_string()))
    }
}

impl Visit {
    fn again(&self) -> Self {
        Self {
            name: self.name.clone(),
            location: self.location.clone(),
            node: self.node,
            parent: self.parent,
            key: self.key.clone(),
        }
    }
}

fn header(element: Element, shape: Vec<usize>) -> ArrayHeader {
    ArrayHeader {
        element,
        is_big_endian: false,
        is_fortran: false,
        shape,
        start: 0,
    }
}

/// The number of an array with one of no axis.
fn single_number(array: &Array, input: &[u8]) -> Option<f64> {
    let array = crate::npz::array::Array {
        header: Some(&array.header).filter(|header| header.shape.is_empty())?,
        bytes: array.data.bytes(input).into(),
    };
    array.numbers()?.first().copied()
}

/// The text of an array without axes, such as `numpy.str_`.
fn single_text(array: &Array, input: &[u8]) -> Option<String> {
    let array = crate::npz::array::Array {
        header: Some(&array.header).filter(|header| header.shape.is_empty())?,
        bytes: array.data.bytes(input).into(),
    };
    array.texts().ok()?.pop()
}

/// The characters of a text in four bytes each, at least as many as `least`.
fn utf_32(text: &str, least: usize) -> Vec<u8> {
    let mut bytes: Vec<u8> = text
        .chars()
        .flat_map(|c| u32::from(c).to_le_bytes())
        .collect();
    bytes.resize(bytes.len().max(4 * least), 0);
    bytes
}
