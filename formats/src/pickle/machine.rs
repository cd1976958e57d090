//! The machine that carries out the opcodes of a pickle, as data: no class is looked up and no function is called.
//!
//! Values are nodes of one list and refer to each other by index. So objects may share values and change after they
//! are referred to, as in Python, and neither reading nor freeing them is recursive. `globals` has the meanings of the
//! names of a few classes; the arrays of `NumPy`, joblib and `PyTorch` are made in the modules beside this one.

pub(super) mod arrays;
pub(super) mod joblib;
pub(super) mod torch;

use std::borrow::Cow;
use std::collections::HashMap;
use std::ops::Range;

use crate::array::ArrayHeader;
use crate::budget::Budget;
use crate::diagnostic::{Code, Diagnostic};
use crate::pickle::globals::{Class, ClassName, Global, shown};
use crate::pickle::machine::arrays::{Dtype, Unbuilt};
use crate::pickle::machine::torch::{Storage, Storages};

/// The deepest nesting of values.
const MAX_DEPTH: u32 = 1000;

/// The largest number of values.
const MAX_NODES: usize = 1 << 24;

/// Bytes of memory of a node.
const NODE: usize = 48;

/// Bytes of memory of an entry of the memo.
const MEMO: usize = 32;

/// The longest number whose digits are kept, in bytes.
const LONGEST_NUMBER: usize = 64;

/// The largest number of arguments of a call, and of fields of a state that are looked at.
const MAX_FIELDS: usize = 64;

/// How many references are followed from an object to the value that it stands for.
const MAX_REFERENCES: usize = 64;

/// The index of a node.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct NodeId(u32);

const _: () = assert!(size_of::<Node>() <= NODE);

/// A value.
#[derive(Debug)]
pub(super) enum Node {
    None,
    Bool(bool),
    Int(i64),
    /// A whole number that i64 cannot hold, in digits.
    Big(Box<str>),
    Float(f64),
    /// UTF-8.
    Text(Data),
    Bytes(Data),
    List(Vec<NodeId>),
    Tuple(Vec<NodeId>),
    Set(Vec<NodeId>),
    Dict(Vec<(NodeId, NodeId)>),
    Array(Box<Array>),
    Dtype(Box<Dtype>),
    Storage(Box<Storage>),
    Class(Class),
    /// An object whose state follows.
    Unbuilt(Unbuilt),
    /// An object of a class that means nothing here.
    Inert(Box<Inert>),
    /// The same value as another node.
    Same(NodeId),
}

/// An object of a class that means nothing here: its class, and the values it was made of.
#[derive(Debug)]
pub(super) struct Inert {
    pub(super) class: ClassName,
    pub(super) arguments: NodeId,
    pub(super) state: Option<NodeId>,
}

/// An array with all its bytes.
#[derive(Debug)]
pub(super) struct Array {
    pub(super) header: ArrayHeader,
    pub(super) data: Data,
}

/// Bytes of the input, or bytes that were decoded.
#[derive(Debug, Clone)]
pub(super) enum Data {
    Input(Range<usize>),
    Decoded(Box<[u8]>),
}

impl Data {
    pub(super) fn bytes<'a>(&'a self, input: &'a [u8]) -> &'a [u8] {
        match self {
            Self::Input(range) => &input[range.clone()],
            Self::Decoded(bytes) => bytes,
        }
    }

    pub(super) fn len(&self) -> usize {
        match self {
            Self::Input(range) => range.len(),
            Self::Decoded(bytes) => bytes.len(),
        }
    }
}

/// All values of a pickle.
pub(super) struct Tree {
    pub(super) nodes: Vec<Node>,
    pub(super) root: NodeId,
    /// Where the pickle ends in the input.
    pub(super) end: usize,
}

/// A pickle around the one that is read: joblib puts arrays of objects into its files as pickles of their own.
struct Outer {
    stack: Vec<NodeId>,
    marks: Vec<usize>,
    memo: HashMap<u64, NodeId>,
    /// The object whose value the inner pickle is.
    object: NodeId,
}

/// A pickle that is being read.
pub(super) struct Machine<'a> {
    file: &'a str,
    pub(super) input: &'a [u8],
    /// Where the next byte is.
    at: usize,
    end: usize,
    /// Where the opcode is that is carried out.
    opcode: usize,
    budget: &'a Budget,
    /// The storages of a file of `PyTorch`.
    pub(super) storages: Option<&'a Storages>,
    nodes: Vec<Node>,
    stack: Vec<NodeId>,
    marks: Vec<usize>,
    memo: HashMap<u64, NodeId>,
    outer: Vec<Outer>,
}

impl<'a> Machine<'a> {
    /// A machine for the pickle in some bytes of the input.
    pub(super) fn new(
        file: &'a str,
        input: &'a [u8],
        pickle: Range<usize>,
        budget: &'a Budget,
        storages: Option<&'a Storages>,
    ) -> Self {
        Self {
            file,
            input,
            at: pickle.start,
            end: pickle.end,
            opcode: pickle.start,
            budget,
            storages,
            nodes: Vec::new(),
            stack: Vec::new(),
            marks: Vec::new(),
            memo: HashMap::new(),
            outer: Vec::new(),
        }
    }

    /// Reads the pickle.
    ///
    /// # Errors
    /// When it is damaged, names a function, or exceeds the limits.
    pub(super) fn run(mut self) -> Result<Tree, Diagnostic> {
        loop {
            self.opcode = self.at;
            let [opcode] = self.array()?;
            if opcode != b'.' {
                self.step(opcode)?;
                continue;
            }
            let root = self.pop()?;
            match self.outer.pop() {
                Some(outer) => {
                    (self.stack, self.marks) = (outer.stack, outer.marks);
                    self.memo = outer.memo;
                    self.set(outer.object, Node::Same(root));
                }
                None => {
                    self.check_limits(root)?;
                    return Ok(Tree {
                        nodes: self.nodes,
                        root,
                        end: self.at,
                    });
                }
            }
        }
    }

    fn step(&mut self, opcode: u8) -> Result<(), Diagnostic> {
        match opcode {
            0x80 => {
                let [protocol] = self.array()?;
                if !(2..=5).contains(&protocol) {
                    let message = format!(
                        "the pickle is of protocol {protocol}; 0 to 5 are read: save it again \
                         with pickle.dump(…, protocol=4)"
                    );
                    return Err(self.refuse(Code::PickleForm, message));
                }
            }
            // A frame only states how many bytes Python should read ahead.
            0x95 => {
                self.array::<8>()?;
            }
            b'(' => {
                self.charge(1, size_of::<usize>())?;
                self.marks.push(self.stack.len());
            }
            b'0' => match self.marks.last() == Some(&self.stack.len()) {
                true => drop(self.marks.pop()),
                false => drop(self.pop()?),
            },
            b'1' => drop(self.pop_mark()?),
            b'2' => {
                let top = self.top()?;
                self.push(top)?;
            }
            b'N' => self.add(Node::None)?,
            0x88 => self.add(Node::Bool(true))?,
            0x89 => self.add(Node::Bool(false))?,
            b'I' | b'L' | b'F' | b'J' | b'K' | b'M' | b'G' | 0x8a | 0x8b => self.number(opcode)?,
            b'S' | b'T' | b'U' | b'B' | b'C' | 0x8e | 0x96 => self.bytes_value(opcode)?,
            b'V' | b'X' | 0x8c | 0x8d => self.text_value(opcode)?,
            b']'
            | b'l'
            | b'a'
            | b'e'
            | b')'
            | b't'
            | 0x85..=0x87
            | b'}'
            | b'd'
            | b's'
            | b'u'
            | 0x8f..=0x91 => self.container(opcode)?,
            b'g' | b'h' | b'j' | b'p' | b'q' | b'r' | 0x94 => self.memo(opcode)?,
            b'c' => {
                let [module, name] = [self.line()?, self.line()?];
                let [module, name] = [module, name]
                    .map(|line| String::from_utf8_lossy(&self.input[line]).into_owned());
                self.global(module, name)?;
            }
            _ => return self.object(opcode),
        }
        Ok(())
    }

    /// Opcodes of numbers.
    fn number(&mut self, opcode: u8) -> Result<(), Diagnostic> {
        let node = match opcode {
            b'J' => Node::Int(i32::from_le_bytes(self.array()?).into()),
            b'K' => Node::Int(u8::from_le_bytes(self.array()?).into()),
            b'M' => Node::Int(u16::from_le_bytes(self.array()?).into()),
            b'G' => Node::Float(f64::from_be_bytes(self.array()?)),
            0x8a | 0x8b => {
                let length = match opcode {
                    0x8a => u8::from_le_bytes(self.array()?).into(),
                    _ => u32::from_le_bytes(self.array()?).into(),
                };
                let range = self.range(length)?;
                whole_number(&self.input[range])
            }
            _ => {
                let line = self.line()?;
                let text = String::from_utf8_lossy(&self.input[line]);
                let digits = text.strip_suffix('L').unwrap_or(&text);
                let node = match (opcode, &*text) {
                    (b'I', "00") => Some(Node::Bool(false)),
                    (b'I', "01") => Some(Node::Bool(true)),
                    (b'F', text) => text.parse().ok().map(Node::Float),
                    _ => number_of_digits(digits),
                };
                node.ok_or_else(|| self.damaged(format!("`{}` is no number", shown(&text))))?
            }
        };
        self.add(node)
    }

    /// Opcodes of bytes, and of the strings of Python 2, which are bytes.
    fn bytes_value(&mut self, opcode: u8) -> Result<(), Diagnostic> {
        if opcode == b'S' {
            let line = self.line()?;
            let bytes = quoted(&self.input[line]);
            let bytes = bytes.ok_or_else(|| self.damaged("a string has no quotes"))?;
            let data = self.decoded(bytes)?;
            return self.add(Node::Bytes(data));
        }
        let length = match opcode {
            b'U' | b'C' => u8::from_le_bytes(self.array()?).into(),
            b'T' | b'B' => u32::from_le_bytes(self.array()?).into(),
            _ => u64::from_le_bytes(self.array()?),
        };
        let range = self.range(length)?;
        self.add(Node::Bytes(Data::Input(range)))
    }

    /// Opcodes of texts.
    fn text_value(&mut self, opcode: u8) -> Result<(), Diagnostic> {
        let length = match opcode {
            b'V' => {
                let line = self.line()?;
                let text = unescaped(&self.input[line]);
                let text = text.ok_or_else(|| self.damaged("a text has a broken escape"))?;
                let data = self.decoded(text.into_bytes())?;
                return self.add(Node::Text(data));
            }
            b'X' => u32::from_le_bytes(self.array()?).into(),
            0x8c => u8::from_le_bytes(self.array()?).into(),
            _ => u64::from_le_bytes(self.array()?),
        };
        let range = self.range(length)?;
        if std::str::from_utf8(&self.input[range.clone()]).is_err() {
            return Err(self.damaged("a text is not UTF-8"));
        }
        self.add(Node::Text(Data::Input(range)))
    }

    /// Opcodes of lists, tuples, dicts and sets.
    fn container(&mut self, opcode: u8) -> Result<(), Diagnostic> {
        match opcode {
            b']' => self.add(Node::List(Vec::new())),
            b'}' => self.add(Node::Dict(Vec::new())),
            b')' => self.add(Node::Tuple(Vec::new())),
            0x8f => self.add(Node::Set(Vec::new())),
            b'l' | b't' | 0x91 => {
                let items = self.pop_mark()?;
                self.charge(items.len(), size_of::<NodeId>())?;
                self.add(match opcode {
                    b'l' => Node::List(items),
                    b't' => Node::Tuple(items),
                    _ => Node::Set(items),
                })
            }
            0x85..=0x87 => {
                let mut items = Vec::new();
                for _ in 0x85..=opcode {
                    items.push(self.pop()?);
                }
                items.reverse();
                self.add(Node::Tuple(items))
            }
            b'd' => {
                let items = self.pop_mark()?;
                let pairs = self.pairs(&items)?;
                self.add(Node::Dict(pairs))
            }
            b'a' => {
                let item = self.pop()?;
                self.extend(&[item])
            }
            b's' => {
                let value = self.pop()?;
                let key = self.pop()?;
                self.extend(&[key, value])
            }
            // The remaining opcodes: b'e', b'u', 0x90.
            _ => {
                let items = self.pop_mark()?;
                self.extend(&items)
            }
        }
    }

    /// Adds items to the list, the set or the dict on top.
    fn extend(&mut self, items: &[NodeId]) -> Result<(), Diagnostic> {
        let target = self.top()?;
        let target = self.resolved(target)?;
        let pairs = match &self.nodes[target.index()] {
            Node::Dict(_) => self.pairs(items)?,
            _ => Vec::new(),
        };
        self.charge(items.len(), size_of::<NodeId>())?;
        match &mut self.nodes[target.index()] {
            Node::List(list) | Node::Set(list) => list.extend_from_slice(items),
            Node::Dict(dict) => dict.extend(pairs),
            // Items of an object whose class is not known here are dropped; a warning names the class.
            Node::Inert(_) => {}
            _ => return Err(self.damaged("items are added to a value that has none")),
        }
        Ok(())
    }

    fn pairs(&self, items: &[NodeId]) -> Result<Vec<(NodeId, NodeId)>, Diagnostic> {
        let (pairs, rest) = items.as_chunks::<2>();
        match rest {
            [] => Ok(pairs.iter().map(|&[key, value]| (key, value)).collect()),
            _ => Err(self.damaged("a key of a dict has no value")),
        }
    }

    /// Opcodes that keep a value for later, and fetch it.
    fn memo(&mut self, opcode: u8) -> Result<(), Diagnostic> {
        let index = match opcode {
            b'h' | b'q' => u8::from_le_bytes(self.array()?).into(),
            b'j' | b'r' => u32::from_le_bytes(self.array()?).into(),
            0x94 => self.memo.len() as u64,
            _ => {
                let line = self.line()?;
                let text = String::from_utf8_lossy(&self.input[line]);
                let index = text.parse::<u64>();
                index.map_err(|_| self.damaged(format!("`{}` is no index", shown(&text))))?
            }
        };
        if let b'g' | b'h' | b'j' = opcode {
            let node = self.memo.get(&index).copied();
            let node = node.ok_or_else(|| self.damaged(format!("value {index} was not kept")))?;
            return self.push(node);
        }
        self.charge(1, MEMO)?;
        let top = self.top()?;
        self.memo.insert(index, top);
        Ok(())
    }

    /// Opcodes of classes and objects.
    fn object(&mut self, opcode: u8) -> Result<(), Diagnostic> {
        match opcode {
            0x93 => {
                let [name, module] = [self.pop()?, self.pop()?];
                let both = [module, name].map(|node| self.text(node).map(Cow::into_owned));
                let [Some(module), Some(name)] = both else {
                    return Err(self.damaged("a class has no name"));
                };
                self.global(module, name)
            }
            b'R' => {
                let [arguments, function] = [self.pop()?, self.pop()?];
                self.call(function, arguments)
            }
            0x81 | 0x92 => {
                if opcode == 0x92 {
                    self.pop()?;
                }
                let [arguments, class] = [self.pop()?, self.pop()?];
                self.instance(class, arguments)
            }
            b'b' => {
                let state = self.pop()?;
                let target = self.top()?;
                let target = self.resolved(target)?;
                self.build(target, state)
            }
            b'Q' if self.storages.is_some() => {
                let id = self.pop()?;
                self.storage(id)
            }
            b'P' | b'Q' => Err(self.refuse(
                Code::PickleForm,
                "a value is in another file (a persistent id); only files of torch.save contain such values: save the \
                 values themselves"
                    .to_owned(),
            )),
            0x97 | 0x98 => Err(self.refuse(
                Code::PickleForm,
                "the data of an array is outside the pickle (buffer_callback); save it again without buffer_callback"
                    .to_owned(),
            )),
            b'i' | b'o' | 0x82..=0x84 => {
                let name = match opcode {
                    b'i' => "INST",
                    b'o' => "OBJ",
                    _ => "EXT",
                };
                let message = format!(
                    "the opcode {name} runs what it names, and is not read; save numbers and \
                     texts alone"
                );
                Err(self.refuse(Code::PickleCalls, message))
            }
            _ => Err(self.damaged(format!("0x{opcode:02x} is no opcode of a pickle"))),
        }
    }

    fn global(&mut self, module: String, name: String) -> Result<(), Diagnostic> {
        let class = Class::of(ClassName { module, name });
        let class = class.map_err(|message| self.refuse(Code::PickleCalls, message))?;
        if let Class::Other(class) = &class {
            self.charge(1, class.module.len() + class.name.len() + 64)?;
        }
        self.add(Node::Class(class))
    }

    /// Calls a function, as far as its name means something here.
    fn call(&mut self, function: NodeId, arguments: NodeId) -> Result<(), Diagnostic> {
        let function = self.resolved(function)?;
        let global = match &self.nodes[function.index()] {
            Node::Class(Class::Known(global)) => *global,
            Node::Class(Class::Other(class)) => {
                let class = class.clone();
                return self.inert(class, arguments);
            }
            _ => return Err(self.damaged("a value is called that is no class")),
        };
        let items = self
            .items(arguments)
            .filter(|items| items.len() <= MAX_FIELDS);
        let items = items.map(<[NodeId]>::to_vec);
        let items = items.ok_or_else(|| self.damaged("the arguments of a call are no tuple"))?;
        let node = match (global, &*items) {
            (Global::Reconstruct, [class, ..]) if self.is_class(*class, Global::NdArray) => {
                Node::Unbuilt(Unbuilt::NumpyArray)
            }
            (Global::Scalar, [dtype, value]) => self.numpy_scalar(*dtype, *value)?,
            (Global::FromBuffer, [buffer, dtype, shape, order]) => {
                self.numpy_from_buffer(*buffer, *dtype, *shape, *order)?
            }
            (Global::Dtype, [name, ..]) => self.numpy_dtype(*name)?,
            (Global::Encode, [text, ..]) => self.latin_1(*text)?,
            (Global::ByteArray, []) => Node::Bytes(Data::Input(0..0)),
            (Global::ByteArray, [bytes]) => Node::Same(*bytes),
            (Global::ByteArray, [text, _]) => self.latin_1(*text)?,
            (Global::List, []) => Node::List(Vec::new()),
            (Global::Tuple, []) => Node::Tuple(Vec::new()),
            (Global::Set, []) => Node::Set(Vec::new()),
            (Global::Dict | Global::DefaultDict, [])
            // The class of missing values is of no use here.
            | (Global::DefaultDict, [_]) => Node::Dict(Vec::new()),
            (Global::List | Global::Tuple | Global::Set | Global::Size, [of]) => {
                let items = self.items(*of);
                let items = items.ok_or_else(|| self.damaged("a list is made of no items"))?;
                self.charge(items.len(), size_of::<NodeId>())?;
                let items = items.to_vec();
                match global {
                    Global::List => Node::List(items),
                    Global::Set => Node::Set(items),
                    _ => Node::Tuple(items),
                }
            }
            (Global::Dict, [of]) => self.dict_of(*of)?,
            (Global::Reconstructor, [class, base, _]) if self.is_class(*base, Global::Object) => {
                return self.instance(*class, arguments);
            }
            (Global::RebuildTensor, [storage, offset, size, stride, ..]) => {
                self.tensor(*storage, *offset, *size, *stride)?
            }
            (Global::RebuildParameter, [tensor, ..]) => Node::Same(*tensor),
            (Global::Path, parts) => {
                let parts: Option<Vec<_>> = parts.iter().map(|&part| self.text(part)).collect();
                let parts =
                    parts.ok_or_else(|| self.damaged("a path has a part that is no text"))?;
                let path = parts.join("/").into_bytes();
                Node::Text(self.decoded(path)?)
            }
            _ => {
                let message = format!("{} is called with other arguments", global.name());
                return Err(self.damaged(message));
            }
        };
        self.add(node)
    }

    /// An object of a class.
    fn instance(&mut self, class: NodeId, arguments: NodeId) -> Result<(), Diagnostic> {
        let class = self.resolved(class)?;
        let unbuilt = match &self.nodes[class.index()] {
            Node::Class(Class::Known(Global::NdArray)) => Unbuilt::NumpyArray,
            Node::Class(Class::Known(Global::Wrapper)) => Unbuilt::JoblibArray,
            Node::Class(Class::Known(Global::Csc)) => Unbuilt::Sparse,
            Node::Class(Class::Known(Global::Chumpy)) => Unbuilt::Chumpy,
            _ => return self.call(class, arguments),
        };
        self.add(Node::Unbuilt(unbuilt))
    }

    fn inert(&mut self, class: ClassName, arguments: NodeId) -> Result<(), Diagnostic> {
        self.charge(1, class.module.len() + class.name.len() + 96)?;
        self.add(Node::Inert(Box::new(Inert {
            class,
            arguments,
            state: None,
        })))
    }

    /// Sets the state of an object.
    fn build(&mut self, target: NodeId, state: NodeId) -> Result<(), Diagnostic> {
        let built = match &mut self.nodes[target.index()] {
            Node::Inert(inert) => {
                inert.state = Some(state);
                return Ok(());
            }
            // Attributes of an OrderedDict, as in PyTorch's models, are ignored.
            Node::Dict(_) => return Ok(()),
            Node::Dtype(_) => return self.build_dtype(target, state),
            Node::Unbuilt(Unbuilt::NumpyArray) => self.build_numpy_array(state)?,
            Node::Unbuilt(Unbuilt::Sparse) => self.build_sparse(state)?,
            Node::Unbuilt(Unbuilt::Chumpy) => self.build_chumpy(state)?,
            Node::Unbuilt(Unbuilt::JoblibArray) => return self.build_joblib_array(target, state),
            _ => return Err(self.damaged("a value has a state that has none")),
        };
        self.set(target, built);
        Ok(())
    }

    /// Reads the pickle that follows, whose value is then that of `object`.
    pub(super) fn enter(&mut self, object: NodeId) -> Result<(), Diagnostic> {
        self.charge(1, size_of::<Outer>())?;
        self.outer.push(Outer {
            stack: std::mem::take(&mut self.stack),
            marks: std::mem::take(&mut self.marks),
            memo: std::mem::take(&mut self.memo),
            object,
        });
        Ok(())
    }

    /// A dict of a dict, or of a list of pairs.
    fn dict_of(&mut self, of: NodeId) -> Result<Node, Diagnostic> {
        let pairs = match self.value(of) {
            Some(Node::Dict(pairs)) => {
                self.charge(pairs.len(), 2 * size_of::<NodeId>())?;
                Some(pairs.clone())
            }
            Some(Node::List(items) | Node::Tuple(items)) => {
                self.charge(items.len(), 2 * size_of::<NodeId>())?;
                let pair = |&item: &NodeId| match *self.items(item)? {
                    [key, value] => Some((key, value)),
                    _ => None,
                };
                items.iter().map(pair).collect()
            }
            _ => None,
        };
        pairs
            .map(Node::Dict)
            .ok_or_else(|| self.damaged("a dict is made of no pairs"))
    }

    /// The bytes of a text whose characters are bytes: how protocols 0 to 2 store bytes.
    fn latin_1(&mut self, text: NodeId) -> Result<Node, Diagnostic> {
        let text = self.text(text);
        let text = text.ok_or_else(|| self.damaged("bytes are made of no text"))?;
        let byte = |character: char| u8::try_from(u32::from(character)).ok();
        let bytes: Option<Vec<u8>> = text.chars().map(byte).collect();
        let bytes = bytes.ok_or_else(|| self.damaged("bytes are made of other characters"))?;
        Ok(Node::Bytes(self.decoded(bytes)?))
    }

    /// Refuses values that are too deep, contain themselves, or are too many when each reference to them counts.
    fn check_limits(&self, root: NodeId) -> Result<(), Diagnostic> {
        #[derive(Clone, Copy, Default)]
        struct Extent {
            /// 0: not seen; of a value whose parts are being visited, the largest number.
            depth: u32,
            count: u64,
        }
        const OPEN: u32 = u32::MAX;
        self.charge(self.nodes.len(), size_of::<Extent>())?;
        let mut extents = vec![Extent::default(); self.nodes.len()];
        let refuse = |message: String| Err(self.refuse(Code::PickleLimits, message));
        let mut path = vec![(root, self.parts(root), 0usize)];
        extents[root.index()].depth = OPEN;
        while let Some((node, parts, next)) = path.last_mut() {
            if let Some(&part) = parts.get(*next) {
                *next += 1;
                match extents[part.index()].depth {
                    0 => {
                        extents[part.index()].depth = OPEN;
                        if path.len() as u32 >= MAX_DEPTH {
                            return refuse(format!("values are nested deeper than {MAX_DEPTH}"));
                        }
                        path.push((part, self.parts(part), 0));
                    }
                    OPEN => return refuse("a value contains itself".to_owned()),
                    _ => {}
                }
                continue;
            }
            let of_parts = parts.iter().map(|part| extents[part.index()]);
            let whole = of_parts.fold(Extent { depth: 0, count: 1 }, |whole, part| Extent {
                depth: whole.depth.max(part.depth),
                count: whole.count.saturating_add(part.count),
            });
            if whole.depth >= MAX_DEPTH {
                return refuse(format!("values are nested deeper than {MAX_DEPTH}"));
            }
            extents[node.index()] = Extent {
                depth: whole.depth + 1,
                ..whole
            };
            path.pop();
        }
        let count = extents[root.index()].count;
        let expanded = usize::try_from(count).unwrap_or(usize::MAX);
        if let Err(error) = self.budget.borrow(expanded, size_of::<NodeId>()) {
            return refuse(format!(
                "if each reference counts, it has {count} values: {error}"
            ));
        }
        Ok(())
    }

    /// The parts of a value.
    fn parts(&self, node: NodeId) -> Cow<'_, [NodeId]> {
        match &self.nodes[node.index()] {
            Node::List(items) | Node::Tuple(items) | Node::Set(items) => Cow::Borrowed(items),
            Node::Dict(pairs) => pairs
                .iter()
                .flat_map(|&(key, value)| [key, value])
                .collect(),
            Node::Same(node) => vec![*node].into(),
            Node::Inert(inert) => [Some(inert.arguments), inert.state]
                .into_iter()
                .flatten()
                .collect(),
            _ => Cow::Borrowed(&[]),
        }
    }

    /// The node that a node stands for.
    pub(super) fn resolved(&self, node: NodeId) -> Result<NodeId, Diagnostic> {
        resolve(&self.nodes, node)
            .ok_or_else(|| self.refuse(Code::PickleLimits, "a value contains itself".to_owned()))
    }

    /// The value of a node; `None` for a value that contains itself.
    pub(super) fn value(&self, node: NodeId) -> Option<&Node> {
        resolve(&self.nodes, node).map(|node| &self.nodes[node.index()])
    }

    /// The items of a list, a tuple or a set.
    pub(super) fn items(&self, node: NodeId) -> Option<&[NodeId]> {
        match self.value(node)? {
            Node::List(items) | Node::Tuple(items) | Node::Set(items) => Some(items),
            _ => None,
        }
    }

    pub(super) fn int(&self, node: NodeId) -> Option<i64> {
        match *self.value(node)? {
            Node::Int(number) => Some(number),
            Node::Bool(truth) => Some(truth.into()),
            _ => None,
        }
    }

    /// Lengths of axes and the like: a tuple of numbers from 0 on.
    pub(super) fn lengths(&self, node: NodeId) -> Result<Vec<usize>, Diagnostic> {
        let items = self.items(node).filter(|items| items.len() <= 32);
        let length = |&item: &NodeId| usize::try_from(self.int(item)?).ok();
        let lengths = items.and_then(|items| items.iter().map(length).collect());
        lengths.ok_or_else(|| self.damaged("a shape is no tuple of up to 32 lengths"))
    }

    /// A text; bytes are one in Latin-1, as the strings of Python 2.
    pub(super) fn text(&self, node: NodeId) -> Option<Cow<'_, str>> {
        text(self.value(node)?, self.input)
    }

    pub(super) fn bytes(&self, node: NodeId) -> Option<&Data> {
        match self.value(node)? {
            Node::Bytes(data) => Some(data),
            _ => None,
        }
    }

    pub(super) fn is_class(&self, node: NodeId, global: Global) -> bool {
        matches!(self.value(node), Some(Node::Class(Class::Known(known))) if *known == global)
    }

    /// The value of a key of an object's state.
    pub(super) fn get(&self, state: NodeId, key: &str) -> Option<NodeId> {
        let Some(Node::Dict(pairs)) = self.value(state) else {
            return None;
        };
        let is_key = |&&(name, _): &&(NodeId, NodeId)| match self.value(name) {
            Some(Node::Text(data) | Node::Bytes(data)) => data.bytes(self.input) == key.as_bytes(),
            _ => false,
        };
        let mut pairs = pairs.iter().take(MAX_FIELDS).rev();
        pairs.find(is_key).map(|&(_, value)| value)
    }

    pub(super) fn set(&mut self, node: NodeId, value: Node) {
        self.nodes[node.index()] = value;
    }

    /// Adds a node, and pushes it.
    pub(super) fn add(&mut self, node: Node) -> Result<(), Diagnostic> {
        let id = self.new_node(node)?;
        self.push(id)
    }

    /// A node that is not on the stack.
    pub(super) fn new_node(&mut self, node: Node) -> Result<NodeId, Diagnostic> {
        if self.nodes.len() >= MAX_NODES {
            let message = format!("it has more than {MAX_NODES} values");
            return Err(self.refuse(Code::PickleLimits, message));
        }
        self.charge(1, NODE)?;
        let id = NodeId(self.nodes.len() as u32);
        self.nodes.push(node);
        Ok(id)
    }

    fn push(&mut self, node: NodeId) -> Result<(), Diagnostic> {
        self.charge(1, size_of::<NodeId>())?;
        self.stack.push(node);
        Ok(())
    }

    fn top(&self) -> Result<NodeId, Diagnostic> {
        let floor = self.marks.last().copied().unwrap_or(0);
        let top = self.stack.get(floor..).and_then(<[NodeId]>::last);
        top.copied()
            .ok_or_else(|| self.damaged("a value is missing on the stack"))
    }

    fn pop(&mut self) -> Result<NodeId, Diagnostic> {
        let top = self.top()?;
        self.stack.pop();
        Ok(top)
    }

    /// The values since the last mark.
    fn pop_mark(&mut self) -> Result<Vec<NodeId>, Diagnostic> {
        let mark = self.marks.pop();
        let mark = mark.ok_or_else(|| self.damaged("a mark is missing on the stack"))?;
        Ok(self.stack.split_off(mark))
    }

    /// The next bytes.
    pub(super) fn range(&mut self, length: u64) -> Result<Range<usize>, Diagnostic> {
        let left = (self.end - self.at) as u64;
        if length > left {
            let message = format!("{length} bytes should follow, and {left} do; the file is cut");
            return Err(self.damaged(message));
        }
        let range = self.at..self.at + length as usize;
        self.at = range.end;
        Ok(range)
    }

    pub(super) fn array<const N: usize>(&mut self) -> Result<[u8; N], Diagnostic> {
        let range = self.range(N as u64)?;
        let mut bytes = [0; N];
        bytes.copy_from_slice(&self.input[range]);
        Ok(bytes)
    }

    /// The next line, without its end.
    fn line(&mut self) -> Result<Range<usize>, Diagnostic> {
        let rest = &self.input[self.at..self.end];
        let length = rest.iter().position(|&byte| byte == b'\n');
        let length = length.ok_or_else(|| self.damaged("a line has no end; the file is cut"))?;
        let range = self.at..self.at + length;
        self.at = range.end + 1;
        Ok(range)
    }

    /// Bytes that are not in the input.
    pub(super) fn decoded(&self, bytes: Vec<u8>) -> Result<Data, Diagnostic> {
        self.charge(1, bytes.len())?;
        Ok(Data::Decoded(bytes.into()))
    }

    /// Takes memory from the budget.
    pub(super) fn charge(&self, count: usize, bytes: usize) -> Result<(), Diagnostic> {
        self.budget
            .take(count, bytes)
            .map_err(|error| self.refuse(Code::Memory, error.to_string()))
    }

    pub(super) fn damaged(&self, message: impl Into<String>) -> Diagnostic {
        self.refuse(Code::PickleDamaged, message.into())
    }

    pub(super) fn refuse(&self, code: Code, message: String) -> Diagnostic {
        let location = format!("byte {}", self.opcode);
        Diagnostic::new(self.file, code, message).inside(location)
    }
}

impl NodeId {
    pub(super) fn index(self) -> usize {
        self.0 as usize
    }
}

/// The node that a node stands for; `None` if it stands for itself.
pub(super) fn resolve(nodes: &[Node], node: NodeId) -> Option<NodeId> {
    let mut node = node;
    for _ in 0..MAX_REFERENCES {
        match nodes[node.index()] {
            Node::Same(other) => node = other,
            _ => return Some(node),
        }
    }
    None
}

/// A text, or bytes as one in Latin-1.
pub(super) fn text<'a>(node: &'a Node, input: &'a [u8]) -> Option<Cow<'a, str>> {
    match node {
        Node::Text(data) => std::str::from_utf8(data.bytes(input))
            .ok()
            .map(Cow::Borrowed),
        Node::Bytes(data) => {
            let bytes = data.bytes(input).iter();
            Some(
                bytes
                    .map(|&byte| char::from(byte))
                    .collect::<String>()
                    .into(),
            )
        }
        _ => None,
    }
}

/// A whole number in two's complement, the least significant byte first.
fn whole_number(bytes: &[u8]) -> Node {
    let is_negative = bytes.last().is_some_and(|&byte| byte >= 0x80);
    if bytes.len() <= 8 {
        let mut word = [if is_negative { 0xff } else { 0 }; 8];
        word[..bytes.len()].copy_from_slice(bytes);
        return Node::Int(i64::from_le_bytes(word));
    }
    if bytes.len() > LONGEST_NUMBER {
        return Node::Big(format!("a number of {} bytes", bytes.len()).into());
    }
    let mut magnitude = bytes.to_vec();
    if is_negative {
        magnitude.iter_mut().for_each(|byte| *byte = !*byte);
        for byte in &mut magnitude {
            let (sum, is_over) = byte.overflowing_add(1);
            *byte = sum;
            if !is_over {
                break;
            }
        }
    }
    // Long division by ten, from the most significant byte.
    let mut digits = Vec::new();
    while magnitude.iter().any(|&byte| byte != 0) {
        let mut rest = 0u32;
        for byte in magnitude.iter_mut().rev() {
            let value = rest << 8 | u32::from(*byte);
            *byte = (value / 10) as u8;
            rest = value % 10;
        }
        digits.push(b'0' + rest as u8);
    }
    if is_negative {
        digits.push(b'-');
    }
    digits.reverse();
    let text = String::from_utf8_lossy(&digits).into_owned();
    text.parse().map_or(Node::Big(text.into()), Node::Int)
}

/// A whole number of digits.
fn number_of_digits(text: &str) -> Option<Node> {
    if let Ok(number) = text.parse() {
        return Some(Node::Int(number));
    }
    let digits = text.strip_prefix('-').unwrap_or(text);
    let is_number = !digits.is_empty() && digits.bytes().all(|byte| byte.is_ascii_digit());
    is_number.then(|| match digits.len() <= 2 * LONGEST_NUMBER {
        true => Node::Big(text.into()),
        false => Node::Big(format!("a number of {} digits", digits.len()).into()),
    })
}

/// The bytes of a string in quotes, with the escapes of Python; `None` without quotes.
fn quoted(line: &[u8]) -> Option<Vec<u8>> {
    let line = line.trim_ascii();
    let (&quote, rest) = line
        .split_first()
        .filter(|(quote, _)| matches!(quote, b'\'' | b'"'))?;
    let inside = rest.strip_suffix(&[quote])?;
    let mut bytes = Vec::with_capacity(inside.len());
    let mut rest = inside;
    while let Some((&byte, after)) = rest.split_first() {
        rest = after;
        if byte != b'\\' {
            bytes.push(byte);
            continue;
        }
        let (&escape, after) = rest.split_first()?;
        rest = after;
        let byte = match escape {
            b'n' => b'\n',
            b'r' => b'\r',
            b't' => b'\t',
            b'a' => 7,
            b'b' => 8,
            b'f' => 12,
            b'v' => 11,
            b'x' => {
                let digits = std::str::from_utf8(rest.get(..2)?).ok()?;
                rest = &rest[2..];
                u8::from_str_radix(digits, 16).ok()?
            }
            b'0'..=b'7' => {
                let more = rest
                    .iter()
                    .take(2)
                    .take_while(|&&b| matches!(b, b'0'..=b'7'));
                let count = more.count();
                let digits = rest[..count].iter();
                let value = digits.fold(u32::from(escape - b'0'), |value, &digit| {
                    value * 8 + u32::from(digit - b'0')
                });
                rest = &rest[count..];
                u8::try_from(value).ok()?
            }
            b'\\' | b'\'' | b'"' => escape,
            other => {
                bytes.push(b'\\');
                other
            }
        };
        bytes.push(byte);
    }
    Some(bytes)
}

/// A text in raw-unicode-escape: Latin-1, and `\u` with four digits or `\U` with eight; `None` if an escape is broken.
fn unescaped(line: &[u8]) -> Option<String> {
    let mut text = String::with_capacity(line.len());
    let mut rest = line;
    while let Some((&byte, after)) = rest.split_first() {
        rest = after;
        let length = match (byte, rest.first()) {
            (b'\\', Some(b'u')) => 4,
            (b'\\', Some(b'U')) => 8,
            _ => {
                text.push(byte.into());
                continue;
            }
        };
        let digits = std::str::from_utf8(rest.get(1..=length)?).ok()?;
        text.push(char::from_u32(u32::from_str_radix(digits, 16).ok()?)?);
        rest = &rest[1 + length..];
    }
    Some(text)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_those_of_python() {
        let big = |bytes: &[u8]| match whole_number(bytes) {
            Node::Int(number) => number.to_string(),
            Node::Big(text) => text.into(),
            _ => panic!(),
        };
        assert_eq!(big(&[]), "0");
        assert_eq!(big(&[0xff]), "-1");
        assert_eq!(
            big(&[0, 0, 0, 0, 0, 0, 0, 0, 0x40]),
            "1180591620717411303424"
        );
        assert_eq!(
            big(&[0, 0, 0, 0, 0, 0, 0, 0, 0xc0]),
            "-1180591620717411303424"
        );
        assert_eq!(big(&[1; 65]), "a number of 65 bytes");
        assert!(matches!(number_of_digits("-12"), Some(Node::Int(-12))));
        assert!(number_of_digits("1e3").is_none() && number_of_digits("-").is_none());
    }

    #[test]
    fn escapes_are_those_of_python() {
        assert_eq!(quoted(b"'a\\x41\\n\\'\\101\\q'").unwrap(), b"aA\n'A\\q");
        assert!(quoted(b"a'").is_none() && quoted(b"'").is_none() && quoted(b"'\\'").is_none());
        assert_eq!(unescaped(b"h\xe4\\u0041\\n").unwrap(), "h\u{e4}A\\n");
        assert!(unescaped(b"\\u00").is_none() && unescaped(b"\\ud800").is_none());
    }
}
