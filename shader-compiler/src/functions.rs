//! The shaders' arithmetic as Rust: another back end for naga's representation, for functions that compute values from
//! values. Each operation of the shader becomes one in Rust, in the same order, so both round in the same way. Names of
//! `let` are kept.
//!
//! A function is written in the first of these forms that its operations allow:
//! * for any `N: Number`, a number or a vector with the numbers of several samples, or where the list asks for it any
//!   `N: Choice`, whose numbers can be compared and chosen, else for f32;
//! * where it treats all components of its vectors alike, for one of them: a caller passes it each component, or all
//!   of them side by side in one vector. Otherwise vectors are arrays, and those of two components are pairs.
//!
//! Vector operations are written out for each component. Loops over arrays and calls of closures are not always
//! compiled to vector instructions.

use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::fmt::Write as _;
use std::io::Write as _;
use std::process::{Command, Stdio};

use naga::valid::{FunctionInfo, ModuleInfo};
use naga::{
    ArraySize, BinaryOperator, Block, Expression, Function, Handle, Literal, LocalVariable, Module,
    ScalarKind, Statement, StructMember, Type, TypeInner, UnaryOperator, VectorSize,
};

use crate::rust::Declared;

/// The functions that are written, each with its cut: the names of `let` after which a pipelined loop interrupts it.
/// A function `f` with a cut is written as `f_begin` and `f_end`, too.
const FUNCTIONS: [(&str, &[&str]); 38] = [
    ("canonical", &[]),
    ("flushed", &[]),
    ("flushed4", &[]),
    ("magnitude", &[]),
    ("reciprocal", &[]),
    ("reciprocal_root", &[]),
    ("root", &[]),
    ("acute_arc_tangent", &[]),
    ("arc_tangent", &[]),
    ("sine_cosine", &[]),
    ("sine_cosm1", &[]),
    ("sine_cosm1_quarter", &["zx", "sine_tail", "cosine_tail"]),
    ("norm_squared", &[]),
    ("normalised", &[]),
    ("rotated", &[]),
    ("slerp", &[]),
    ("over", &[]),
    ("polynomial", &["z", "zz"]),
    ("arc_between", &[]),
    ("to_half", &[]),
    ("to_any_half", &[]),
    ("to_snorm", &[]),
    ("matrix_rows", &[]),
    ("axis_angle", &[]),
    ("wrapped", &[]),
    ("euler", &[]),
    ("rotated_by", &[]),
    ("cubic", &[]),
    ("rotation_added", &[]),
    ("laid_over", &[]),
    ("step_vector", &[]),
    ("small_log", &[]),
    ("small_exp", &[]),
    ("composed", &[]),
    ("inverse_rotated", &[]),
    ("canonical_product", &[]),
    ("small_angle_cubic", &[]),
    ("rotation_about", &[]),
];

/// The functions that `tumble-exact` offers to other shaders, with those that they call, and the files that have them.
const EXACT_FUNCTIONS: [&str; 9] = [
    "flushed",
    "magnitude",
    "reciprocal",
    "reciprocal_root",
    "root",
    "acute_arc_tangent",
    "arc_tangent",
    "sine_cosine",
    "sine_cosm1",
];

/// The shader files of [`EXACT_FUNCTIONS`].
pub(crate) const EXACT_FILES: [&str; 2] = ["math/sine_cosine", "math/arc_tangent"];

/// Functions that Rust has already, and which those of the list call: the algebra that f64 shares. They take any
/// numbers.
const BY_HAND: [(&str, &str); 4] = [
    ("product", "math::quaternion::product"),
    ("dot4", "math::quaternion::dot as dot4"),
    ("dot3", "math::quaternion::dot3"),
    ("cross3", "math::quaternion::cross3"),
];

/// The functions that are written for vectors although they compare numbers: loops over whole vectors call them. Others
/// stay functions of f32, whose `if` evaluates one side only.
const CHOOSING: [&str; 2] = ["small_angle_cubic", "rotation_about"];

/// A result, or the reason why a function cannot be written in a form.
pub(crate) type Result<T> = std::result::Result<T, String>;

/// The types of numbers that a function takes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Numbers {
    /// Any `N: Number`.
    Any,
    /// f32.
    One,
}

/// How a function takes vectors.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Vectors {
    /// The function is written for one number, because it treats all components alike.
    Alike,
    /// As arrays of components.
    Apart,
}

/// The numbers and vectors for which a function is written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Shape {
    numbers: Numbers,
    vectors: Vectors,
    /// Whether the numbers, of any type, can be compared.
    chooses: bool,
}

impl Shape {
    const fn new(numbers: Numbers, vectors: Vectors) -> Self {
        Self {
            numbers,
            vectors,
            chooses: false,
        }
    }

    /// Of vectors with the comparisons of their numbers.
    const CHOOSING: Self = Self {
        chooses: true,
        ..Self::new(Numbers::Any, Vectors::Apart)
    };
}

/// Every function that is written, by its name, and the structs that they share.
pub(crate) struct Functions {
    functions: BTreeMap<String, (Shape, String)>,
    structs: BTreeMap<String, String>,
    /// The structs that lie in buffers: Rust has declarations of them.
    shared: BTreeSet<String>,
}

impl Functions {
    pub(crate) fn new(shared: BTreeSet<String>) -> Self {
        let by_hand = BY_HAND.map(|(name, _)| {
            let shape = Shape::new(Numbers::Any, Vectors::Apart);
            (name.to_owned(), (shape, String::new()))
        });
        Self {
            functions: BTreeMap::from(by_hand),
            structs: BTreeMap::new(),
            shared,
        }
    }

    /// Adds the functions of a kernel.
    ///
    /// # Panics
    /// If one cannot be written, or is another function than that of the same name in an earlier kernel.
    pub(crate) fn collect(
        &mut self,
        kernel: &str,
        source: &str,
        module: &Module,
        info: &ModuleInfo,
    ) {
        for (handle, function) in module.functions.iter() {
            let name = function.name.as_deref().unwrap_or_default();
            let Some((_, cut)) = FUNCTIONS.iter().find(|(listed, _)| *listed == name) else {
                continue;
            };
            let of = |numbers| {
                [Vectors::Alike, Vectors::Apart].map(|vectors| Shape::new(numbers, vectors))
            };
            let choosing = CHOOSING.contains(&name).then_some(Shape::CHOOSING);
            let any = of(Numbers::Any).into_iter().chain(choosing);
            let mut shapes = any.chain(of(Numbers::One));
            let mut refused = Vec::new();
            let written = shapes.find_map(|shape| {
                let types = Types {
                    module,
                    shape,
                    shared: &self.shared,
                };
                let writer = Writer::new(types, &info[handle], function, &self.functions);
                match writer.function(name, cut) {
                    Ok(text) => Some((shape, text)),
                    Err(reason) => {
                        refused.push(reason);
                        None
                    }
                }
            });
            let (shape, text) =
                written.unwrap_or_else(|| panic!("{kernel}: {name} in Rust: {refused:?}"));
            let text = docs(source, name) + &text;
            let other = self.functions.get(name);
            assert!(
                other.is_none_or(|(_, other)| *other == text),
                "{kernel}: another function {name} than elsewhere:\n{text}"
            );
            self.functions.insert(name.to_owned(), (shape, text));
        }
        for (_, ty) in module.types.iter() {
            if let (Some(name), TypeInner::Struct { members, .. }) = (&ty.name, &ty.inner)
                && !self.shared.contains(name)
            {
                let types = Types {
                    module,
                    shape: Shape::CHOOSING,
                    shared: &self.shared,
                };
                let fields: Result<String> = members.iter().try_fold(String::new(), |text, m| {
                    Ok(format!(
                        "{text}pub(crate) {}: {},\n",
                        field(m),
                        types.name(m.ty)?
                    ))
                });
                if let Ok(fields) = fields {
                    let bound = if fields.contains("N::") {
                        ": Choice"
                    } else {
                        ""
                    };
                    let text = format!(
                        "#[derive(Debug, Clone, Copy)]\npub(crate) struct {name}<N{bound}> {{\n{fields}}}\n\n"
                    );
                    self.structs.insert(name.clone(), text);
                }
            }
        }
    }

    #[cfg(test)]
    pub(crate) fn text(&self, name: &str) -> &str {
        &self.functions[name].1
    }

    /// The file with all functions.
    ///
    /// # Panics
    /// If a function of the list is in no shader, or rustfmt is not installed.
    pub(crate) fn rust(&self) -> String {
        let mut text = String::from(
            "//! The shaders' arithmetic. Written by `cargo run -p tumble-shaders` from the shaders: change those.\n\n\
             use crate::shader::*;\nuse crate::simd::lanes::{Choice, Number};\n",
        );
        for (_, path) in BY_HAND {
            text += &format!("use crate::{path};\n");
        }
        text.push('\n');
        let functions: Vec<&String> = FUNCTIONS
            .iter()
            .map(|(name, _)| match self.functions.get(*name) {
                Some((_, text)) => text,
                None => panic!("no shader has a function {name}"),
            })
            .collect();
        for (name, declaration) in &self.structs {
            if functions.iter().any(|function| uses(function, name)) {
                text.push_str(declaration);
            }
        }
        text.extend(functions.into_iter().map(String::as_str));
        formatted(&text)
    }

    /// The file of `tumble-exact`: some of the functions with the constants that they use.
    ///
    /// # Panics
    /// If a function of the list is in no shader.
    pub(crate) fn exact_rust(&self, declared: &Declared) -> String {
        let functions: String = EXACT_FUNCTIONS
            .iter()
            .map(|name| self.functions[*name].1.as_str())
            .collect();
        let constants = declared.constants(|name| uses(&functions, name));
        let header = "//! Written by `cargo run -p tumble-shaders` from the shaders: change those.\n\n\
             #![allow(clippy::approx_constant)] // The shaders write pi in two parts.\n\n\
             use crate::functions::Number;\n\n";
        formatted(&format!("{header}{constants}\n{functions}"))
    }
}

/// The functions of `tumble-exact` as WGSL, without comments on the engine's files.
pub(crate) fn exact_wgsl(files: &[String]) -> String {
    let mut text = String::from(
        "// Written by `cargo run -p tumble-shaders` from the engine's shaders: change those.\n\n",
    );
    let lines = files.iter().flat_map(|file| file.lines());
    for line in lines.filter(|line| !line.starts_with("// Twin: ")) {
        text.push_str(line);
        text.push('\n');
    }
    text.truncate(text.trim_end().len());
    text.push('\n');
    text
}

/// The comment above a function, as Rust's documentation.
pub(crate) fn docs(source: &str, name: &str) -> String {
    let before = source
        .split(&format!("\nfn {name}("))
        .next()
        .unwrap_or_default();
    let comment: Vec<&str> = before
        .lines()
        .rev()
        .map_while(|line| line.strip_prefix("//"))
        .collect();
    comment
        .into_iter()
        .rev()
        .map(|line| format!("///{}\n", line.replace('[', "\\[")))
        .collect()
}

pub(crate) fn formatted(text: &str) -> String {
    let rustfmt = Command::new("rustfmt")
        .args(["--edition", "2024"])
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn();
    let mut rustfmt = rustfmt.unwrap_or_else(|error| panic!("rustfmt formats functions: {error}"));
    let mut input = rustfmt.stdin.take().expect("it is piped");
    input.write_all(text.as_bytes()).expect("rustfmt reads it");
    drop(input);
    let output = rustfmt.wait_with_output().expect("rustfmt ends");
    assert!(output.status.success(), "rustfmt refuses:\n{text}");
    String::from_utf8(output.stdout).expect("rustfmt writes UTF-8")
}

/// Whether a word occurs in a text.
fn uses(text: &str, word: &str) -> bool {
    let is_part = |c: char| c.is_alphanumeric() || c == '_';
    text.match_indices(word).any(|(at, _)| {
        let before = text[..at].chars().next_back();
        let after = text[at + word.len()..].chars().next();
        // A field is not a variable.
        !before.is_some_and(|c| is_part(c) || c == '.') && !after.is_some_and(is_part)
    })
}

/// The names of types of one shape.
#[derive(Clone, Copy)]
struct Types<'a> {
    module: &'a Module,
    shape: Shape,
    shared: &'a BTreeSet<String>,
}

impl Types<'_> {
    /// Whether a struct is a tuple: Rust's declaration has numbers of f32.
    fn is_tuple(&self, name: &str) -> bool {
        self.shape.numbers == Numbers::Any && self.shared.contains(name)
    }

    fn name(&self, ty: Handle<Type>) -> Result<String> {
        let Self { module, shape, .. } = *self;
        let Shape {
            numbers,
            vectors,
            chooses,
        } = shape;
        let scalar = |kind: ScalarKind, width: u8| match (kind, width, numbers) {
            (ScalarKind::Float, 4, Numbers::Any) => Ok("N"),
            (ScalarKind::Float, 4, Numbers::One) => Ok("f32"),
            (ScalarKind::Uint, 4, _) => Ok("u32"),
            (ScalarKind::Sint, 4, _) => Ok("i32"),
            (ScalarKind::Bool, ..) if chooses => Ok("N::Flags"),
            (ScalarKind::Bool, ..) => Ok("bool"),
            other => Err(format!("numbers {other:?}")),
        };
        let declared = &module.types[ty];
        match &declared.inner {
            TypeInner::Scalar(of) => Ok(scalar(of.kind, of.width)?.to_owned()),
            TypeInner::Vector { size, scalar: of } => {
                let name = scalar(of.kind, of.width)?;
                Ok(match (vectors, size) {
                    (Vectors::Apart, VectorSize::Bi) => format!("({name}, {name})"),
                    (Vectors::Apart, _) => format!("[{name}; {}]", *size as u8),
                    (Vectors::Alike, _) => name.to_owned(),
                })
            }
            TypeInner::Array {
                base,
                size: ArraySize::Constant(count),
                ..
            } => Ok(format!("[{}; {count}]", self.name(*base)?)),
            TypeInner::Struct { members, .. } => {
                let name = declared.name.clone().unwrap_or_default();
                match (self.shared.contains(&name), numbers) {
                    (true, Numbers::One) => Ok(name),
                    // The struct in Rust has fields of f32, so a tuple is used for other numbers.
                    (true, Numbers::Any) => {
                        let fields: Result<Vec<String>> =
                            members.iter().map(|m| self.name(m.ty)).collect();
                        Ok(format!("({})", fields?.join(", ")))
                    }
                    (false, Numbers::One) => Ok(name + "<f32>"),
                    (false, Numbers::Any) => Ok(name + "<N>"),
                }
            }
            other => Err(format!("{other:?}")),
        }
    }
}

/// An expression in Rust.
#[derive(Clone)]
pub(crate) struct Text {
    pub(crate) text: String,
    /// How strongly its outermost operator binds.
    pub(crate) level: u8,
}

/// A name, a call, an element: nothing binds more strongly.
pub(crate) const ATOM: u8 = 20;
pub(crate) const UNARY: u8 = 18;
/// Always between parentheses as an operand.
pub(crate) const LOOSE: u8 = 0;

pub(crate) fn atom(text: impl Into<String>) -> Text {
    Text {
        text: text.into(),
        level: ATOM,
    }
}

impl Text {
    /// As an operand of an operator that binds this strongly.
    pub(crate) fn within(self, level: u8) -> String {
        match self.level < level {
            true => format!("({})", self.text),
            false => self.text,
        }
    }

    /// Whether it may be repeated: a name, an element, a constant.
    fn is_simple(&self) -> bool {
        let is_constant = self.text.starts_with("N::all(") && !self.text.contains(' ');
        self.level >= UNARY && (is_constant || !self.text.contains(['(', '{']))
    }
}

/// A statement.
enum Line {
    /// `let name = value;`
    Let(String, String),
    /// Any other one, as it is.
    Other(String),
}

impl Line {
    fn text(&self) -> &str {
        match self {
            Self::Let(_, text) | Self::Other(text) => text,
        }
    }
}

impl std::fmt::Display for Line {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Let(name, value) => writeln!(f, "let {name} = {value};"),
            Self::Other(text) => writeln!(f, "{text}"),
        }
    }
}

/// Writes one function of one shape.
struct Writer<'a> {
    types: Types<'a>,
    module: &'a Module,
    info: &'a FunctionInfo,
    function: &'a Function,
    shape: Shape,
    /// The functions that are written already: all that this one calls.
    known: &'a BTreeMap<String, (Shape, String)>,
    /// Expressions whose values have a name.
    named: HashMap<Handle<Expression>, String>,
    /// The arguments of calls, by their results.
    calls: HashMap<Handle<Expression>, Vec<Handle<Expression>>>,
    /// Variables that naga adds for `||` and `&&`.
    conditions: HashMap<Handle<LocalVariable>, Text>,
    lines: Vec<Line>,
    /// How many names were invented.
    invented: usize,
}

impl<'a> Writer<'a> {
    fn new(
        types: Types<'a>,
        info: &'a FunctionInfo,
        function: &'a Function,
        known: &'a BTreeMap<String, (Shape, String)>,
    ) -> Self {
        Self {
            types,
            module: types.module,
            info,
            function,
            shape: types.shape,
            known,
            named: HashMap::new(),
            calls: HashMap::new(),
            conditions: HashMap::new(),
            lines: Vec::new(),
            invented: 0,
        }
    }

    fn inner(&self, handle: Handle<Expression>) -> &'a TypeInner {
        self.info[handle].ty.inner_with(&self.module.types)
    }

    /// The number of components of a value that is taken apart, if it is.
    fn components(&self, handle: Handle<Expression>) -> Option<u8> {
        match (self.shape.vectors, self.inner(handle)) {
            (Vectors::Apart, TypeInner::Vector { size, .. }) => Some(*size as u8),
            _ => None,
        }
    }

    fn has_vectors(&self) -> bool {
        let is_vector = |ty: Handle<Type>| match self.module.types[ty].inner {
            TypeInner::Vector { size, .. } => size != VectorSize::Bi,
            TypeInner::Array { base, .. } => {
                matches!(self.module.types[base].inner, TypeInner::Vector { .. })
            }
            _ => false,
        };
        self.function
            .arguments
            .iter()
            .any(|argument| is_vector(argument.ty))
    }

    /// The whole function, in two parts if it has a cut.
    fn function(mut self, name: &str, cut: &[&str]) -> Result<String> {
        if self.shape.vectors == Vectors::Alike && !self.has_vectors() {
            return Err("no vectors".to_owned());
        }
        let parameters: Result<Vec<(String, String)>> = self
            .function
            .arguments
            .iter()
            .map(|argument| {
                let name = argument.name.clone().unwrap_or_default();
                Ok((name, self.types.name(argument.ty)?))
            })
            .collect();
        let parameters = parameters?;
        let Some(result) = &self.function.result else {
            return Err("no result".to_owned());
        };
        let result = self.types.name(result.ty)?;
        for (_, variable) in self.function.local_variables.iter() {
            // The variables that naga adds for `||` and `&&` have no name.
            let Some(name) = &variable.name else { continue };
            let value = match variable.init {
                Some(init) => self.whole(init)?,
                None => self.zero(variable.ty)?,
            };
            self.lines
                .push(Line::Other(format!("let mut {name} = {value};")));
        }
        self.block(&self.function.body, true)?;
        prune(&mut self.lines);
        let all: Vec<&(String, String)> = parameters.iter().collect();
        if cut.is_empty() {
            let body: String = self.lines.iter().map(Line::to_string).collect();
            return Ok(self.declaration(name, &all, &result, &body));
        }
        self.parts(name, cut, &all, &result)
    }

    fn declaration(
        &self,
        name: &str,
        parameters: &[&(String, String)],
        result: &str,
        body: &str,
    ) -> String {
        let parameters: String = parameters
            .iter()
            .map(|(name, ty)| format!("{name}: {ty}, "))
            .collect();
        let generics = match self.shape.numbers {
            Numbers::Any if self.shape.chooses => "<N: Choice>",
            Numbers::Any => "<N: Number>",
            Numbers::One => "",
        };
        format!(
            "#[inline(always)]\npub(crate) fn {name}{generics}({parameters}) -> {result} {{\n{body}}}\n\n"
        )
    }

    /// The function in two parts, before and after a cut. The first part takes the parameters that it uses. The second
    /// part takes the other parameters, and the values of the first part that it needs.
    fn parts(
        &self,
        name: &str,
        cut: &[&str],
        parameters: &[&(String, String)],
        result: &str,
    ) -> Result<String> {
        let mut before: Vec<bool> = self.lines.iter().map(|_| false).collect();
        for (i, line) in self.lines.iter().enumerate().rev() {
            let Line::Let(name, _) = line else { continue };
            let mut later = before.iter().zip(&self.lines).skip(i + 1);
            let is_used = later.any(|(is_before, line)| *is_before && uses(line.text(), name));
            before[i] = is_used || cut.contains(&name.as_str());
        }
        let part = |is_before: bool| -> Vec<&Line> {
            let lines = self.lines.iter().zip(&before);
            lines
                .filter(|(_, b)| **b == is_before)
                .map(|(line, _)| line)
                .collect()
        };
        let (first, second) = (part(true), part(false));
        let missing = cut.iter().find(|cut| {
            !first
                .iter()
                .any(|line| matches!(line, Line::Let(name, _) if name == **cut))
        });
        if let Some(missing) = missing {
            return Err(format!("no `let {missing}`"));
        }
        let used = |lines: &[&Line], name: &str| lines.iter().any(|line| uses(line.text(), name));
        let (early, left): (Vec<_>, Vec<_>) = parameters
            .iter()
            .copied()
            .partition(|(name, _)| used(&first, name));
        let number = match self.shape.numbers {
            Numbers::Any => "N",
            Numbers::One => "f32",
        };
        if let Some((name, ty)) = early.iter().find(|(_, ty)| ty != number) {
            return Err(format!("a {ty}, {name}, before a cut"));
        }
        let lets = first.iter().filter_map(|line| match line {
            Line::Let(name, _) => Some(name),
            Line::Other(_) => None,
        });
        let kept: Vec<&str> = early
            .iter()
            .map(|(name, _)| name)
            .chain(lets)
            .filter(|name| used(&second, name))
            .map(String::as_str)
            .collect();
        let begun = camel(name) + "Begun";
        let fields: String = kept
            .iter()
            .map(|name| format!("pub(crate) {name}: N, "))
            .collect();
        let list = kept.join(", ");
        let mut text = format!(
            "/// [`{name}`] up to its cut.\n#[derive(Clone, Copy)]\n\
             pub(crate) struct {begun}<N> {{ {fields} }}\n\n"
        );
        let join =
            |lines: Vec<&Line>| -> String { lines.into_iter().map(Line::to_string).collect() };
        let taking = format!("{begun}<{number}>");
        let body = join(first) + &format!("{begun} {{ {list} }}\n");
        let _ = writeln!(text, "/// The part of [`{name}`] before its cut.");
        text += &self.declaration(&format!("{name}_begin"), &early, &taking, &body);
        let last = ("begun".to_owned(), taking);
        let rest: Vec<_> = left.iter().copied().chain([&last]).collect();
        let body = format!("let {begun} {{ {list} }} = begun;\n") + &join(second);
        let _ = writeln!(text, "/// The part of [`{name}`] after its cut.");
        text += &self.declaration(&format!("{name}_end"), &rest, result, &body);
        let names = |list: &[&(String, String)]| -> String {
            list.iter().map(|(name, _)| format!("{name}, ")).collect()
        };
        let body = format!(
            "{name}_end({}{name}_begin({}))\n",
            names(&left),
            names(&early)
        );
        Ok(self.declaration(name, parameters, result, &body) + &text)
    }

    fn block(&mut self, block: &Block, is_last: bool) -> Result<()> {
        for (i, statement) in block.iter().enumerate() {
            let is_last = is_last && i + 1 == block.len();
            match statement {
                Statement::Emit(range) => {
                    for handle in range.clone() {
                        self.emitted(handle)?;
                    }
                }
                Statement::Call {
                    arguments,
                    result: Some(result),
                    ..
                } => {
                    self.calls.insert(*result, arguments.clone());
                    self.emitted(*result)?;
                }
                Statement::Store { pointer, value } => {
                    let (variable, value) = (self.variable(*pointer)?, self.whole(*value)?);
                    self.lines
                        .push(Line::Other(format!("{variable} = {value};")));
                }
                Statement::If {
                    condition,
                    accept,
                    reject,
                } => {
                    if self.short_circuit(*condition, accept, reject)? {
                        continue;
                    }
                    let condition = self.whole(*condition)?;
                    let mut text =
                        format!("if {condition} {{\n{}}}", self.inside(accept, is_last)?);
                    if !reject.is_empty() {
                        write!(text, " else {{\n{}}}", self.inside(reject, is_last)?).unwrap();
                    }
                    self.lines.push(Line::Other(text));
                }
                Statement::Block(inner) => self.block(inner, is_last)?,
                Statement::Return { value: Some(value) } => {
                    let value = self.whole(*value)?;
                    self.lines.push(Line::Other(match is_last {
                        true => value,
                        false => format!("return {value};"),
                    }));
                }
                other => return Err(format!("{other:?}")),
            }
        }
        Ok(())
    }

    /// Whether a statement is `||` or `&&`: the second operand is stored to a variable without a name if it counts, and
    /// else the result.
    fn short_circuit(
        &mut self,
        condition: Handle<Expression>,
        accept: &Block,
        reject: &Block,
    ) -> Result<bool> {
        let expressions = &self.function.expressions;
        let (
            Some(&Statement::Store { pointer, value }),
            [.., Statement::Store { value: other, .. }],
        ) = (accept.last(), &reject[..])
        else {
            return Ok(false);
        };
        let (Expression::LocalVariable(variable), Expression::Literal(Literal::Bool(other))) =
            (&expressions[pointer], &expressions[*other])
        else {
            return Ok(false);
        };
        if self.function.local_variables[*variable].name.is_some() {
            return Ok(false);
        }
        let (sign, level, first) = match (&expressions[condition], other) {
            (&Expression::Unary { expr, .. }, true) => ("||", 8, expr),
            (_, false) => ("&&", 9, condition),
            _ => return Ok(false),
        };
        let first = self.value(first, None)?.within(level);
        let second = self.value(value, None)?.within(level + 1);
        let text = format!("{first} {sign} {second}");
        self.conditions.insert(*variable, Text { text, level });
        Ok(true)
    }

    /// A block between braces; names that are given inside are not known after it.
    fn inside(&mut self, block: &Block, is_last: bool) -> Result<String> {
        let named = self.named.clone();
        let outside = std::mem::take(&mut self.lines);
        self.block(block, is_last)?;
        self.named = named;
        let inside = std::mem::replace(&mut self.lines, outside);
        Ok(inside.iter().map(Line::to_string).collect())
    }

    /// Gives an expression its name; one without a name is written where it is used.
    fn emitted(&mut self, handle: Handle<Expression>) -> Result<()> {
        if matches!(
            self.inner(handle),
            TypeInner::Pointer { .. } | TypeInner::ValuePointer { .. }
        ) {
            return Ok(());
        }
        let is_load = match self.function.expressions[handle] {
            Expression::Load { pointer } => match self.function.expressions[pointer] {
                Expression::LocalVariable(variable) => !self.conditions.contains_key(&variable),
                _ => true,
            },
            _ => false,
        };
        match self.function.named_expressions.get(&handle) {
            // Bit patterns are only named inside groups of operations that are replaced as a whole.
            Some(_) if self.shape.numbers == Numbers::Any && !self.is_float(handle) => Ok(()),
            Some(name) => {
                let value = self.whole(handle)?;
                self.lines.push(Line::Let(name.clone(), value));
                self.named.insert(handle, name.clone());
                Ok(())
            }
            // A later store may change the variable, so the loaded value needs a name.
            None if is_load => self.name(handle).map(|_| ()),
            None => Ok(()),
        }
    }

    fn is_float(&self, handle: Handle<Expression>) -> bool {
        self.inner(handle)
            .scalar()
            .is_none_or(|scalar| scalar.kind == ScalarKind::Float)
    }

    /// Names a value that is used several times.
    fn name(&mut self, handle: Handle<Expression>) -> Result<Text> {
        let value = self.value(handle, None)?;
        self.invented += 1;
        let kind = match self.components(handle) {
            Some(_) => "vector",
            None => "number",
        };
        let name = format!("{kind}_{}", self.invented);
        self.lines.push(Line::Let(name.clone(), value.text));
        self.named.insert(handle, name.clone());
        Ok(atom(name))
    }

    /// A value that is taken once for each component of another.
    fn repeated(&mut self, handle: Handle<Expression>) -> Result<Text> {
        let text = self.value(handle, None)?;
        match text.is_simple() {
            true => Ok(text),
            false => self.name(handle),
        }
    }

    fn whole(&mut self, handle: Handle<Expression>) -> Result<String> {
        Ok(self.value(handle, None)?.text)
    }

    /// An operand: of a vector's operation the component, or a number that all components share.
    fn operand(&mut self, handle: Handle<Expression>, component: Option<u8>) -> Result<Text> {
        match (component, self.components(handle)) {
            (Some(_), None) => self.repeated(handle),
            (component, _) => self.value(handle, component),
        }
    }

    /// A value, or this component of it.
    fn value(&mut self, handle: Handle<Expression>, component: Option<u8>) -> Result<Text> {
        let Some(count) = self.components(handle) else {
            return self.expression(handle, None);
        };
        match (component, self.is_whole(handle)?) {
            (None, false) => {
                let all: Result<Vec<String>> = (0..count)
                    .map(|i| Ok(self.expression(handle, Some(i))?.text))
                    .collect();
                let list = all?.join(", ");
                Ok(atom(match count {
                    2 => format!("({list})"),
                    _ => format!("[{list}]"),
                }))
            }
            (Some(i), true) => {
                let vector = self.repeated(handle)?.within(ATOM);
                Ok(atom(match count {
                    2 => format!("{vector}.{i}"),
                    _ => format!("{vector}[{i}]"),
                }))
            }
            _ => self.expression(handle, component),
        }
    }

    /// Whether a vector is a value before its components are taken from it.
    fn is_whole(&self, handle: Handle<Expression>) -> Result<bool> {
        Ok(match self.function.expressions[handle] {
            _ if self.named.contains_key(&handle) => true,
            Expression::FunctionArgument(_)
            | Expression::Load { .. }
            | Expression::AccessIndex { .. }
            | Expression::Access { .. } => true,
            Expression::CallResult(function) => self.shape_of(function)?.vectors == Vectors::Apart,
            Expression::Select { condition, .. } => {
                self.components(condition).is_none() && !self.shape.chooses
            }
            _ => false,
        })
    }

    fn expression(&mut self, handle: Handle<Expression>, i: Option<u8>) -> Result<Text> {
        if let Some(name) = self.named.get(&handle) {
            return Ok(atom(name.clone()));
        }
        if let Some(text) = self.known_operation(handle, i)? {
            return Ok(text);
        }
        let function = self.function;
        match function.expressions[handle] {
            Expression::Constant(constant) => {
                let constant = &self.module.constants[constant];
                let name = constant.name.clone().unwrap_or_default();
                match (&self.module.types[constant.ty].inner, self.shape.numbers) {
                    (TypeInner::Vector { .. }, _) => self.global(constant.init, i),
                    (_, Numbers::One) => Ok(atom(name)),
                    (TypeInner::Scalar(scalar), _) if scalar.kind == ScalarKind::Float => {
                        Ok(atom(format!("N::all({name})")))
                    }
                    (other, _) => Err(format!("a constant {other:?}")),
                }
            }
            Expression::FunctionArgument(i) => {
                let argument = &function.arguments[i as usize];
                Ok(atom(argument.name.clone().unwrap_or_default()))
            }
            Expression::Splat { value, .. } => self.operand(value, i),
            Expression::Compose { ty, ref components } => match i {
                Some(i) => self.part(components, i),
                None => self.composed(ty, components),
            },
            Expression::Swizzle {
                vector, pattern, ..
            } => match i {
                Some(i) => self.value(vector, Some(pattern[usize::from(i)] as u8)),
                None => Err("components in another order".to_owned()),
            },
            Expression::AccessIndex { base, index } => match self.inner(base) {
                TypeInner::Vector { .. } if self.shape.vectors == Vectors::Apart => {
                    self.value(base, Some(index as u8))
                }
                TypeInner::Struct { members, .. } => {
                    let ty = self.info[base].ty.handle();
                    let name = ty.and_then(|ty| self.module.types[ty].name.as_deref());
                    let base = self.value(base, None)?.within(ATOM);
                    Ok(atom(match self.types.is_tuple(name.unwrap_or_default()) {
                        true => format!("{base}.{index}"),
                        false => format!("{base}.{}", field(&members[index as usize])),
                    }))
                }
                TypeInner::Array { .. } => {
                    let base = self.value(base, None)?.within(ATOM);
                    Ok(atom(format!("{base}[{index}]")))
                }
                other => Err(format!("an element of {other:?}")),
            },
            Expression::Access { base, index } if self.shape.vectors == Vectors::Apart => {
                let base = self.value(base, None)?.within(ATOM);
                let index = self.value(index, None)?.within(UNARY);
                Ok(atom(format!("{base}[{index} as usize]")))
            }
            Expression::Load { pointer } => match function.expressions[pointer] {
                Expression::LocalVariable(variable) if self.conditions.contains_key(&variable) => {
                    Ok(self.conditions[&variable].clone())
                }
                _ => Ok(atom(self.variable(pointer)?)),
            },
            Expression::CallResult(function) => self.call(handle, function, i),
            _ => self.operation(handle, i),
        }
    }

    /// A component of a vector that is made of numbers and vectors.
    fn part(&mut self, parts: &[Handle<Expression>], i: u8) -> Result<Text> {
        let mut first = 0;
        for &part in parts {
            let count = self.components(part).unwrap_or(1);
            if i < first + count {
                return self.value(part, Some(i - first));
            }
            first += count;
        }
        Err("a vector without this component".to_owned())
    }

    /// A struct, an array, or a vector; if components are treated alike, the vector must have the same number in all
    /// components.
    fn composed(&mut self, ty: Handle<Type>, components: &[Handle<Expression>]) -> Result<Text> {
        let parts: Result<Vec<String>> = components.iter().map(|&part| self.whole(part)).collect();
        let parts = parts?;
        let declared = &self.module.types[ty];
        let name = declared.name.as_deref().unwrap_or_default();
        match &declared.inner {
            TypeInner::Vector { .. } if parts.iter().all(|part| *part == parts[0]) => {
                self.value(components[0], None)
            }
            TypeInner::Array { .. } => Ok(atom(format!("[{}]", parts.join(", ")))),
            TypeInner::Struct { .. } if self.types.is_tuple(name) => {
                Ok(atom(format!("({})", parts.join(", "))))
            }
            TypeInner::Struct { members, .. } => {
                let fields: String = members
                    .iter()
                    .zip(parts)
                    .map(|(member, value)| match field(member) {
                        field if field == value => format!("{field}, "),
                        field => format!("{field}: {value}, "),
                    })
                    .collect();
                Ok(Text {
                    text: format!("{name} {{ {fields} }}"),
                    level: LOOSE,
                })
            }
            other => Err(format!("parts of {other:?}")),
        }
    }

    fn operation(&mut self, handle: Handle<Expression>, i: Option<u8>) -> Result<Text> {
        if self.shape.numbers == Numbers::Any && !self.is_float(handle) {
            return match self.shape.chooses {
                true => self.flags(handle),
                false => Err("bits of any number".to_owned()),
            };
        }
        match self.function.expressions[handle] {
            Expression::Literal(literal) => self.literal(literal),
            Expression::ZeroValue(ty) => match self.components(handle) {
                Some(_) => self.literal(Literal::F32(0.0)),
                None => Ok(atom(self.zero(ty)?)),
            },
            Expression::Unary { op, expr } => {
                let sign = match op {
                    UnaryOperator::Negate => '-',
                    UnaryOperator::LogicalNot | UnaryOperator::BitwiseNot => '!',
                };
                let value = self.operand(expr, i)?.within(UNARY);
                Ok(Text {
                    text: format!("{sign}{value}"),
                    level: UNARY,
                })
            }
            Expression::Binary { op, left, right } => {
                let is_float = self.is_float(left);
                let (left, right) = (self.operand(left, i)?, self.operand(right, i)?);
                binary(op, is_float, left, right)
            }
            Expression::Select {
                condition,
                accept,
                reject,
            } => {
                if self.shape.numbers == Numbers::Any && !self.shape.chooses {
                    return Err("a choice between any numbers".to_owned());
                }
                let condition = self.operand(condition, i)?.text;
                let accept = self.operand(accept, i)?.text;
                let reject = self.operand(reject, i)?.text;
                if self.shape.chooses {
                    return Ok(atom(format!("N::choose({condition}, {accept}, {reject})")));
                }
                let reject = match reject.starts_with("if ") {
                    true => reject,
                    false => format!("{{ {reject} }}"),
                };
                Ok(Text {
                    text: format!("if {condition} {{ {accept} }} else {reject}"),
                    level: LOOSE,
                })
            }
            Expression::As {
                expr,
                kind,
                convert,
            } => {
                let from = self.inner(expr).scalar().map(|scalar| scalar.kind);
                let value = self.operand(expr, i)?;
                let to = match kind {
                    ScalarKind::Uint => "u32",
                    ScalarKind::Sint => "i32",
                    ScalarKind::Float => "f32",
                    other => return Err(format!("a conversion to {other:?}")),
                };
                Ok(match (from, kind, convert) {
                    (Some(from), to, _) if from == to => value,
                    (Some(ScalarKind::Float), ScalarKind::Uint, None) => {
                        atom(format!("{}.to_bits()", value.within(ATOM)))
                    }
                    (Some(ScalarKind::Uint), ScalarKind::Float, None) => {
                        atom(format!("f32::from_bits({})", value.text))
                    }
                    (Some(ScalarKind::Uint | ScalarKind::Sint), _, _) => Text {
                        text: format!("{} as {to}", value.within(UNARY)),
                        level: LOOSE,
                    },
                    other => return Err(format!("a conversion {other:?}")),
                })
            }
            ref other => Err(format!("{other:?}")),
        }
    }

    /// A comparison of any numbers, or several that are joined.
    fn flags(&mut self, handle: Handle<Expression>) -> Result<Text> {
        let Expression::Binary { op, left, right } = self.function.expressions[handle] else {
            return Err("flags of any number".to_owned());
        };
        if op == BinaryOperator::And {
            let (left, right) = (self.value(left, None)?, self.value(right, None)?);
            return binary(op, false, left, right);
        }
        if let Some((number, mask)) = self.has_bits(handle) {
            let number = self.value(number, None)?.within(ATOM);
            return Ok(atom(format!("{number}.has_bits({mask})")));
        }
        let (method, sign) = match op {
            BinaryOperator::LessEqual => ("at_most", ""),
            BinaryOperator::Equal => ("equals", ""),
            BinaryOperator::NotEqual => ("equals", "!"),
            other => return Err(format!("{other:?} of any number")),
        };
        let left = self.value(left, None)?.within(ATOM);
        let right = self.value(right, None)?.text;
        Ok(Text {
            text: format!("{sign}{left}.{method}({right})"),
            level: if sign.is_empty() { ATOM } else { UNARY },
        })
    }

    /// Operations on the bits of any number, which [`Number`](../../src/simd/lanes.rs) has as a whole.
    fn known_operation(
        &mut self,
        handle: Handle<Expression>,
        i: Option<u8>,
    ) -> Result<Option<Text>> {
        if let Some((x, limit)) = self.zero_below(handle) {
            let value = self.operand(x, i)?.within(ATOM);
            return Ok(Some(atom(format!(
                "{value}.zero_below(f32::from_bits({limit}))"
            ))));
        }
        if let Some((x, seed, shift)) = self.guess(handle) {
            let value = self.operand(x, i)?.within(ATOM);
            return Ok(Some(atom(format!("{value}.guess({seed}, {shift})"))));
        }
        Ok(None)
    }

    /// `select(x, 0.0, (bitcast<u32>(x) & 0x7fffffffu) < LIMIT)`: the number and the limit.
    fn zero_below(&self, handle: Handle<Expression>) -> Option<(Handle<Expression>, &'a str)> {
        let Expression::Select {
            condition,
            accept,
            reject,
        } = self.function.expressions[handle]
        else {
            return None;
        };
        let (magnitude, limit) = self.operands(condition, BinaryOperator::Less)?;
        let (bits, mask) = self.operands(magnitude, BinaryOperator::And)?;
        let is_known = self.bits_of(bits) == Some(reject)
            && self.literal_in_all(mask) == Some(Literal::U32(0x7fff_ffff))
            && self.literal_in_all(accept) == Some(Literal::F32(0.0));
        is_known.then_some((reject, self.constant_name(limit)?))
    }

    /// `bitcast<f32>(SEED - (bitcast<u32>(x) >> shift))`: the number, the seed, the shift.
    fn guess(&self, handle: Handle<Expression>) -> Option<(Handle<Expression>, &'a str, u32)> {
        let Expression::As {
            expr,
            kind: ScalarKind::Float,
            convert: None,
        } = self.function.expressions[handle]
        else {
            return None;
        };
        let (seed, bits) = self.operands(expr, BinaryOperator::Subtract)?;
        let seed = self.constant_name(seed)?;
        let Some((shifted, shift)) = self.operands(bits, BinaryOperator::ShiftRight) else {
            return Some((self.bits_of(bits)?, seed, 0));
        };
        match self.literal_in_all(shift)? {
            Literal::U32(shift) => Some((self.bits_of(shifted)?, seed, shift)),
            _ => None,
        }
    }

    /// `(bitcast<u32>(x) & MASK) == MASK`: the number and the mask, which is not 0.
    fn has_bits(&self, handle: Handle<Expression>) -> Option<(Handle<Expression>, u32)> {
        let (masked, all) = self.operands(handle, BinaryOperator::Equal)?;
        let (bits, mask) = self.operands(masked, BinaryOperator::And)?;
        match [mask, all].map(|handle| self.literal_in_all(handle)) {
            [Some(Literal::U32(mask)), Some(Literal::U32(all))] if mask == all && mask != 0 => {
                Some((self.bits_of(bits)?, mask))
            }
            _ => None,
        }
    }

    /// The operands of an operator, if an expression has it.
    fn operands(
        &self,
        handle: Handle<Expression>,
        operator: BinaryOperator,
    ) -> Option<(Handle<Expression>, Handle<Expression>)> {
        match self.function.expressions[handle] {
            Expression::Binary { op, left, right } if op == operator => Some((left, right)),
            _ => None,
        }
    }

    /// The float whose bits an expression is.
    fn bits_of(&self, handle: Handle<Expression>) -> Option<Handle<Expression>> {
        match self.function.expressions[handle] {
            Expression::As {
                expr,
                kind: ScalarKind::Uint,
                convert: None,
            } => self.is_float(expr).then_some(expr),
            _ => None,
        }
    }

    /// The number that all components of a vector have, or the number itself.
    fn in_all(&self, handle: Handle<Expression>) -> &'a Expression {
        match &self.function.expressions[handle] {
            Expression::Splat { value, .. } => self.in_all(*value),
            Expression::Compose { components, .. } => self.in_all(components[0]),
            other => other,
        }
    }

    fn literal_in_all(&self, handle: Handle<Expression>) -> Option<Literal> {
        match *self.in_all(handle) {
            Expression::Literal(literal) => Some(literal),
            Expression::ZeroValue(_) => Some(Literal::F32(0.0)),
            _ => None,
        }
    }

    /// The name of a constant, in all components or as the only one.
    fn constant_name(&self, handle: Handle<Expression>) -> Option<&'a str> {
        match *self.in_all(handle) {
            Expression::Constant(constant) => self.module.constants[constant].name.as_deref(),
            Expression::Literal(literal) => self.name_of(literal),
            _ => None,
        }
    }

    /// The name of a number of 32 bits that stands in vectors: naga has replaced the constant by its value.
    fn name_of(&self, literal: Literal) -> Option<&'a str> {
        // 0x7fff_ffff, the bits of a magnitude, also happens to be a constant of crowds.
        let is_wide =
            matches!(literal, Literal::U32(value) if value > 0xffff && value != 0x7fff_ffff);
        let mut constants = self.module.constants.iter().map(|(_, constant)| constant);
        let constant = constants.find(|constant| {
            let value = &self.module.global_expressions[constant.init];
            is_wide && matches!(value, Expression::Literal(value) if *value == literal)
        });
        constant?.name.as_deref()
    }

    fn shape_of(&self, function: Handle<Function>) -> Result<Shape> {
        let name = self.module.functions[function]
            .name
            .as_deref()
            .unwrap_or_default();
        match self.known.get(name) {
            Some((shape, _)) => Ok(*shape),
            None => Err(format!("a call of {name}, which is not written")),
        }
    }

    fn call(
        &mut self,
        result: Handle<Expression>,
        function: Handle<Function>,
        i: Option<u8>,
    ) -> Result<Text> {
        let Shape {
            numbers, vectors, ..
        } = self.shape_of(function)?;
        let name = self.module.functions[function]
            .name
            .as_deref()
            .unwrap_or_default();
        if self.shape.numbers == Numbers::Any && numbers == Numbers::One {
            return Err(format!("a call of {name}, which takes f32"));
        }
        let arguments = self.calls[&result].clone();
        let takes_vectors = arguments
            .iter()
            .any(|&argument| matches!(self.inner(argument), TypeInner::Vector { .. }));
        if self.shape.vectors == Vectors::Alike && vectors == Vectors::Apart && takes_vectors {
            return Err(format!("a call of {name}, which takes vectors apart"));
        }
        let arguments: Result<Vec<String>> = arguments
            .into_iter()
            .map(|argument| Ok(self.operand(argument, i)?.text))
            .collect();
        Ok(atom(format!("{name}({})", arguments?.join(", "))))
    }

    /// A variable, or a part of one.
    fn variable(&mut self, pointer: Handle<Expression>) -> Result<String> {
        match self.function.expressions[pointer] {
            Expression::LocalVariable(variable) => {
                let variable = &self.function.local_variables[variable];
                Ok(variable.name.clone().unwrap_or_default())
            }
            Expression::AccessIndex { base, index } => {
                let TypeInner::Pointer { base: ty, .. } = *self.inner(base) else {
                    return Err("a component of a variable".to_owned());
                };
                let variable = self.variable(base)?;
                match &self.module.types[ty].inner {
                    TypeInner::Struct { members, .. } => {
                        Ok(format!("{variable}.{}", field(&members[index as usize])))
                    }
                    TypeInner::Array { .. } => Ok(format!("{variable}[{index}]")),
                    other => Err(format!("a part of {other:?}")),
                }
            }
            ref other => Err(format!("{other:?}")),
        }
    }

    fn literal(&self, literal: Literal) -> Result<Text> {
        if let (Some(name), Numbers::One) = (self.name_of(literal), self.shape.numbers) {
            return Ok(atom(name));
        }
        let value = match (literal, self.shape.numbers) {
            (Literal::F32(value), Numbers::Any) => return Ok(atom(format!("N::all({value:?})"))),
            (Literal::F32(value), Numbers::One) => format!("{value:?}"),
            (Literal::U32(value), Numbers::One) if value > 0xff => format!("{value:#x}"),
            (Literal::U32(value), Numbers::One) => value.to_string(),
            (Literal::I32(value), Numbers::One) => value.to_string(),
            (Literal::Bool(value), Numbers::One) => value.to_string(),
            (other, _) => return Err(format!("{other:?}")),
        };
        Ok(Text {
            level: if value.starts_with('-') { UNARY } else { ATOM },
            text: value,
        })
    }

    /// A component of a constant vector.
    fn global(&self, handle: Handle<Expression>, i: Option<u8>) -> Result<Text> {
        match (&self.module.global_expressions[handle], i) {
            (Expression::Compose { components, .. }, Some(i)) => {
                self.global(components[usize::from(i)], None)
            }
            (Expression::Literal(literal), None) => self.literal(*literal),
            (other, _) => Err(format!("a constant {other:?}")),
        }
    }

    fn zero(&self, ty: Handle<Type>) -> Result<String> {
        let number = match self.shape.numbers {
            Numbers::Any => "N::all(0.0)",
            Numbers::One => "0.0",
        };
        Ok(match (&self.module.types[ty].inner, self.shape.vectors) {
            (TypeInner::Scalar(scalar), _) if scalar.kind == ScalarKind::Float => number.to_owned(),
            (TypeInner::Scalar(_), _) => "0".to_owned(),
            (TypeInner::Vector { .. }, Vectors::Alike) => number.to_owned(),
            (TypeInner::Vector { size, .. }, Vectors::Apart) => {
                format!("[{number}; {}]", *size as u8)
            }
            (TypeInner::Struct { members, .. }, _) => {
                let name = self.module.types[ty].name.clone().unwrap_or_default();
                let fields: Result<String> = members.iter().try_fold(String::new(), |text, m| {
                    Ok(format!("{text}{}: {}, ", field(m), self.zero(m.ty)?))
                });
                format!("{name} {{ {} }}", fields?)
            }
            (other, _) => return Err(format!("a variable {other:?}")),
        })
    }
}

pub(crate) fn binary(op: BinaryOperator, is_float: bool, left: Text, right: Text) -> Result<Text> {
    use BinaryOperator as Op;
    let (sign, level) = match op {
        Op::Multiply => ("*", 16),
        Op::Add => ("+", 15),
        Op::Subtract => ("-", 15),
        Op::ShiftLeft => ("<<", 14),
        Op::ShiftRight => (">>", 14),
        Op::And => ("&", 13),
        Op::ExclusiveOr => ("^", 12),
        Op::InclusiveOr => ("|", 11),
        Op::Equal => ("==", 10),
        Op::NotEqual => ("!=", 10),
        Op::Less => ("<", 10),
        Op::LessEqual => ("<=", 10),
        Op::Greater => (">", 10),
        Op::GreaterEqual => (">=", 10),
        Op::LogicalAnd => ("&&", 9),
        Op::LogicalOr => ("||", 8),
        Op::Divide | Op::Modulo => return Err(format!("{op:?}")),
    };
    let method = match op {
        Op::Add => "wrapping_add",
        Op::Subtract => "wrapping_sub",
        Op::Multiply => "wrapping_mul",
        _ => "",
    };
    if !is_float && !method.is_empty() {
        let text = format!("{}.{method}({})", left.within(ATOM), right.text);
        return Ok(atom(text));
    }
    // The right operand keeps its parentheses, so that the order of operations does not change. Mixed operators on bits
    // also keep them, because they are easier to read.
    let inside = |operand: &Text| match (11..=14).contains(&level) && operand.level != level {
        true => UNARY,
        false => level,
    };
    let (left, right) = match level {
        10 => (left.within(level + 1), right.within(level + 1)),
        _ => {
            let (least, right_least) = (inside(&left), inside(&right).max(level + 1));
            (left.within(least), right.within(right_least))
        }
    };
    Ok(Text {
        text: format!("{left} {sign} {right}"),
        level,
    })
}

/// Removes lines whose value no later line uses.
fn prune(lines: &mut Vec<Line>) {
    for i in (0..lines.len()).rev() {
        if let Line::Let(name, _) = &lines[i]
            && !lines[i + 1..].iter().any(|line| uses(line.text(), name))
        {
            lines.remove(i);
        }
    }
    // A value that is returned immediately needs no name.
    let count = lines.len();
    if let [.., Line::Let(name, value), Line::Other(last)] = &lines[..]
        && name == last
    {
        let value = value.clone();
        lines.truncate(count - 2);
        lines.push(Line::Other(value));
    }
}

pub(crate) fn field(member: &StructMember) -> &str {
    member.name.as_deref().unwrap_or_default()
}

/// `sine_cosm1` as `SineCosm1`.
fn camel(name: &str) -> String {
    crate::rust::variant(name)
}
