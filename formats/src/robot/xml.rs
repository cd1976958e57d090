//! XML of robots: elements with their places in the text, over the files that an MJCF includes.

use std::collections::HashMap;
use std::ops::Range;
use std::path::{Path, PathBuf};

use glam::{DQuat, DVec3};
use roxmltree::{Document, Node, NodeId, ParsingOptions};

use crate::diagnostic::{Code, Diagnostic, Location};
use crate::limits::Limits;
use crate::source::Source;

/// The texts of a file and of those that it includes.
pub(super) struct Files {
    files: Vec<TextFile>,
    /// Their paths, relative to the folder of the first.
    paths: Vec<PathBuf>,
    /// The file that takes the place of an `include`.
    included: HashMap<Element, usize>,
}

struct TextFile {
    name: String,
    text: String,
}

/// An element: the file, and the node in it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(super) struct Element {
    file: usize,
    node: NodeId,
}

/// The parsed files.
pub(super) struct Documents<'a> {
    files: &'a Files,
    documents: Vec<Document<'a>>,
}

/// The largest number of nodes in a file.
const MAX_NODES: u32 = 1_000_000;

/// The largest number of attributes of an element: the parser compares each with all others.
const MAX_ATTRIBUTES: usize = 256;

/// The largest number of `=` between attributes in one tag, which no element has fewer attributes than.
fn largest_attributes(text: &str) -> usize {
    let (mut largest, mut rest) = (0, text.as_bytes());
    while let Some(start) = rest.iter().position(|&byte| byte == b'<') {
        rest = &rest[start + 1..];
        if let Some(comment) = rest.strip_prefix(b"!--") {
            let end = comment.windows(3).position(|three| three == b"-->");
            rest = &comment[end.unwrap_or(comment.len())..];
            continue;
        }
        let (mut count, mut quote, mut length) = (0, None, 0);
        for &byte in rest {
            match (quote, byte) {
                (Some(open), _) if open == byte => quote = None,
                (Some(_), _) => {}
                (None, b'"' | b'\'') => quote = Some(byte),
                (None, b'>') => break,
                (None, b'=') => count += 1,
                (None, _) => {}
            }
            length += 1;
        }
        largest = largest.max(count);
        rest = &rest[length..];
    }
    largest
}

fn parse(file: &TextFile) -> Result<Document<'_>, Diagnostic> {
    let options = ParsingOptions {
        allow_dtd: false,
        nodes_limit: MAX_NODES,
        ..ParsingOptions::default()
    };
    let attributes = largest_attributes(&file.text);
    if attributes > MAX_ATTRIBUTES {
        let message =
            format!("has an element with {attributes} attributes; elements of robots have a few");
        return Err(Diagnostic::new(&file.name, Code::RobotXml, message));
    }
    Document::parse_with_options(&file.text, options).map_err(|error| {
        let at = error.pos();
        let mut refusal = Diagnostic::new(&file.name, Code::RobotXml, error.to_string());
        refusal.location = Some(Location::Text {
            line: u64::from(at.row),
            column: u64::from(at.col),
        });
        refusal
    })
}

impl Files {
    /// Reads a file and those that it includes, which must be below its folder.
    pub(super) fn open(path: &Path, limits: Limits) -> Result<Self, Diagnostic> {
        let folder = path.parent().unwrap_or(Path::new(""));
        let first = text(Source::open(path, false)?, limits.file)?;
        Self::with_included(first, path, Some(folder), limits)
    }

    /// The text of a file in memory, which can include no others.
    pub(super) fn of_bytes(name: &str, bytes: Vec<u8>, limits: Limits) -> Result<Self, Diagnostic> {
        let length = bytes.len();
        if length as u64 > limits.file {
            let message = format!("has {length} bytes; robots have at most {}", limits.file);
            return Err(Diagnostic::new(name, Code::FileTooLong, message));
        }
        let first = text_of(name.to_owned(), bytes)?;
        Self::with_included(first, Path::new(name), None, limits)
    }

    /// A file with those that it includes from `folder`.
    fn with_included(
        first: TextFile,
        path: &Path,
        folder: Option<&Path>,
        limits: Limits,
    ) -> Result<Self, Diagnostic> {
        let mut rest = limits.file.saturating_sub(first.text.len() as u64);
        let mut this = Self {
            files: vec![first],
            // The main file is in the list of included files, so that it cannot include itself.
            paths: vec![path.file_name().map_or(path, Path::new).to_owned()],
            included: HashMap::new(),
        };
        let mut next = 0;
        while let Some(file) = this.files.get(next) {
            let document = parse(file)?;
            let mut found = Vec::new();
            for node in document
                .descendants()
                .filter(|node| node.has_tag_name("include"))
            {
                let element = Element {
                    file: next,
                    node: node.id(),
                };
                let refuse = |code, message: String| refusal(file, &document, node, code, message);
                let Some(name) = node.attribute("file") else {
                    return Err(refuse(
                        Code::RobotTree,
                        "<include> has no `file`".to_owned(),
                    ));
                };
                let Some(name) = crate::beneath::plain(Path::new(name)) else {
                    let message =
                        format!("includes `{name}`, which leads out of the file's folder");
                    return Err(refuse(Code::RobotInclude, message));
                };
                if folder.is_none() {
                    let message = format!(
                        "includes `{}`, which is not found from bytes in memory; read it from its file",
                        name.display()
                    );
                    return Err(refuse(Code::RobotInclude, message));
                }
                if this.paths.contains(&name) {
                    let message = format!("includes `{}` twice", name.display());
                    return Err(refuse(Code::RobotInclude, message));
                }
                found.push((element, name));
            }
            for (element, name) in found {
                let folder = folder.unwrap_or(Path::new(""));
                let file = text(Source::open_beneath(folder, &name)?, rest)?;
                rest = rest.saturating_sub(file.text.len() as u64);
                this.included.insert(element, this.files.len());
                this.files.push(file);
                this.paths.push(name);
            }
            next += 1;
        }
        Ok(this)
    }

    /// The files that the first includes, relative to its folder.
    pub(super) fn into_included(mut self) -> Vec<PathBuf> {
        self.paths.split_off(1)
    }

    pub(super) fn parse(&self) -> Result<Documents<'_>, Diagnostic> {
        let documents: Result<Vec<_>, _> = self.files.iter().map(parse).collect();
        Ok(Documents {
            files: self,
            documents: documents?,
        })
    }
}

fn text(source: Source, limit: u64) -> Result<TextFile, Diagnostic> {
    let name = source.name.clone();
    text_of(name, source.into_bytes(limit)?)
}

fn text_of(name: String, bytes: Vec<u8>) -> Result<TextFile, Diagnostic> {
    match String::from_utf8(bytes) {
        Ok(text) => Ok(TextFile { name, text }),
        Err(_) => Err(Diagnostic::new(
            name,
            Code::RobotXml,
            "is not UTF-8; save it as UTF-8",
        )),
    }
}

fn refusal(
    file: &TextFile,
    document: &Document<'_>,
    node: Node<'_, '_>,
    code: Code,
    message: String,
) -> Diagnostic {
    let at = document.text_pos_at(node.range().start);
    let mut refusal = Diagnostic::new(&file.name, code, message);
    refusal.location = Some(Location::Text {
        line: u64::from(at.row),
        column: u64::from(at.col),
    });
    refusal
}

impl<'a> Documents<'a> {
    pub(super) fn root(&self) -> Element {
        Element {
            file: 0,
            node: self.documents[0].root_element().id(),
        }
    }

    fn node(&self, element: Element) -> Node<'_, 'a> {
        let document = &self.documents[element.file];
        // Elements are only made of nodes of their document.
        document
            .get_node(element.node)
            .unwrap_or_else(|| document.root())
    }

    pub(super) fn tag(&self, element: Element) -> &str {
        self.node(element).tag_name().name()
    }

    /// The elements in an element, with those of included files in the place of an `include`.
    pub(super) fn children(&self, element: Element) -> Vec<Element> {
        let elements = |Element { file, node }: Element| {
            let document = &self.documents[file];
            let children = document
                .get_node(node)
                .into_iter()
                .flat_map(|node| node.children());
            let children = children.filter(Node::is_element);
            children.map(move |node| Element {
                file,
                node: node.id(),
            })
        };
        let mut waiting: Vec<Element> = elements(element).collect();
        waiting.reverse();
        let mut found = Vec::new();
        while let Some(child) = waiting.pop() {
            match self.files.included.get(&child) {
                None => found.push(child),
                Some(&file) => {
                    let root = Element {
                        file,
                        node: self.documents[file].root_element().id(),
                    };
                    let of_file: Vec<_> = elements(root).collect();
                    waiting.extend(of_file.into_iter().rev());
                }
            }
        }
        found
    }

    /// The children with a tag, in no namespace.
    pub(super) fn tagged(&self, element: Element, tag: &str) -> impl Iterator<Item = Element> {
        let children = self.children(element).into_iter();
        children.filter(move |&child| self.is_tagged(child, tag))
    }

    pub(super) fn is_tagged(&self, element: Element, tag: &str) -> bool {
        let name = self.node(element).tag_name();
        name.name() == tag && name.namespace().is_none()
    }

    pub(super) fn namespace(&self, element: Element) -> Option<&str> {
        self.node(element).tag_name().namespace()
    }

    pub(super) fn attribute(&self, element: Element, name: &str) -> Option<&str> {
        self.node(element).attribute(name)
    }

    pub(super) fn attributes(&self, element: Element) -> impl Iterator<Item = (&str, &str)> {
        let attributes = self.node(element).attributes();
        attributes.map(|attribute| (attribute.name(), attribute.value()))
    }

    /// An attribute that an element must have.
    pub(super) fn required(&self, element: Element, name: &str) -> Result<&str, Diagnostic> {
        self.attribute(element, name).ok_or_else(|| {
            let message = format!("<{}> has no `{name}`", self.tag(element));
            self.refuse(element, Code::RobotTree, message)
        })
    }

    pub(super) fn refuse(
        &self,
        element: Element,
        code: Code,
        message: impl Into<String>,
    ) -> Diagnostic {
        let (file, document) = (
            &self.files.files[element.file],
            &self.documents[element.file],
        );
        refusal(file, document, self.node(element), code, message.into())
    }

    /// The numbers of a text, as many as `counts` says.
    pub(super) fn numbers(
        &self,
        element: Element,
        (name, text): (&str, &str),
        counts: Range<usize>,
    ) -> Result<Vec<f64>, Diagnostic> {
        let mut numbers = Vec::new();
        for token in text.split_ascii_whitespace() {
            match token.parse::<f64>() {
                Ok(number) if number.is_finite() => numbers.push(number),
                _ if token.contains("${") => {
                    let message = format!(
                        "`{name}` has `{token}`, an expression of xacro, which is not computed; write the URDF by \
                         `xacro FILE > robot.urdf` first"
                    );
                    return Err(self.refuse(element, Code::RobotElement, message));
                }
                _ => {
                    let message = format!("`{name}` has `{token}`, which is not a finite number");
                    return Err(self.refuse(element, Code::Number, message));
                }
            }
        }
        if counts.contains(&numbers.len()) {
            return Ok(numbers);
        }
        let message = format!(
            "`{name}` has {} numbers, and takes {}",
            numbers.len(),
            counts.start
        );
        Err(self.refuse(element, Code::RobotTree, message))
    }

    /// The numbers of an attribute, if the element has it.
    pub(super) fn list<const N: usize>(
        &self,
        element: Element,
        name: &str,
    ) -> Result<Option<[f64; N]>, Diagnostic> {
        let Some(text) = self.attribute(element, name) else {
            return Ok(None);
        };
        let numbers = self.numbers(element, (name, text), N..N + 1)?;
        Ok(numbers.try_into().ok())
    }

    pub(super) fn vector(&self, element: Element, name: &str) -> Result<DVec3, Diagnostic> {
        Ok(self
            .list(element, name)?
            .map_or(DVec3::ZERO, DVec3::from_array))
    }

    /// The limits of a joint, the smaller first.
    pub(super) fn limits(
        &self,
        element: Element,
        limits: [f64; 2],
    ) -> Result<[f64; 2], Diagnostic> {
        let [low, high] = limits;
        if low <= high {
            return Ok(limits);
        }
        let message = format!("the limits are {low} and {high}; the smaller comes first");
        Err(self.refuse(element, Code::RobotTree, message))
    }

    /// A vector of length 1.
    pub(super) fn unit(
        &self,
        element: Element,
        name: &str,
        vector: DVec3,
    ) -> Result<DVec3, Diagnostic> {
        let length = vector.length();
        if length > 1e-14 && length.is_finite() {
            return Ok(vector / length);
        }
        let message = format!("`{name}` is {vector}, which has no direction");
        Err(self.refuse(element, Code::RobotTree, message))
    }
}

/// The rotation about a unit axis by an angle in rad.
pub(super) fn about(axis: DVec3, angle: f64) -> DQuat {
    let (sine, cosine) = libm::sincos(angle * 0.5);
    let [x, y, z] = (axis * sine).to_array();
    DQuat::from_xyzw(x, y, z, cosine)
}
