//! The kernels as Rust, one invocation at a time. This is another back end for naga's representation; it handles all
//! parts of a kernel: the entry point, memory, branches, loops and barriers. The check of kernels compares a device
//! with these functions, and tests count their operations.
//!
//! They are written for clarity, not for speed, and share no arithmetic with [`crate::functions`]. A function is
//! generic over a `Machine`, which has the memory and the type of numbers. Functions that reach a barrier are `async`:
//! there they yield until the whole workgroup has arrived. Functions that exchange values with other lanes of a
//! subgroup are `async`, too.
//!
//! Kernels are joined from files that they share. A function is written once for all kernels in which it is the same.
//! If functions of one name differ between kernels, a further function asks the machine which kernel runs and calls the
//! right one.

use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::fmt::Write as _;

use naga::valid::{FunctionInfo, ModuleInfo};
use naga::{
    AddressSpace, ArraySize, BinaryOperator, Binding, Block, BuiltIn, Expression, Function,
    GatherMode, Handle, Literal, LocalVariable, MathFunction, Module, ScalarKind, Span, Statement,
    Type, TypeInner, UnaryOperator,
};

use crate::functions::{ATOM, LOOSE, Result, Text, UNARY, atom, binary, docs, field, formatted};
use crate::rust::{PARTS, variant};

/// A kernel that is written, or its variant that reads texel buffers.
pub(crate) struct Source<'a> {
    pub(crate) name: &'a str,
    pub(crate) text: &'a str,
    /// The files that it is joined from, with their texts.
    pub(crate) files: &'a [(&'static str, String)],
    pub(crate) module: &'a Module,
    pub(crate) info: &'a ModuleInfo,
}

impl<'a> Source<'a> {
    fn types(&self, float: &'static str) -> Types<'a> {
        Types {
            module: self.module,
            float,
        }
    }
}

/// A function that kernels call by one name and with one signature.
#[derive(Default)]
struct Called {
    /// Each text that it has, and where: the name of the file, and the kernels' indices.
    bodies: Vec<(String, String, Vec<usize>)>,
    parameters: String,
    arguments: String,
}

/// Kernels as one file of Rust.
///
/// # Panics
/// With the kernel and the function that cannot be written.
pub(crate) fn rust(kernels: &[Source<'_>]) -> String {
    let names = Names::new(kernels);
    let mut called = BTreeMap::<String, Called>::new();
    let mut structs = BTreeMap::new();
    for (index, kernel) in kernels.iter().enumerate() {
        for one in functions(kernel) {
            let types = kernel.types("M::F");
            let call = names.of(&types, one.name, one.function);
            let mut writer = Writer {
                types,
                info: one.info,
                function: one.function,
                names: &names,
                named: HashMap::new(),
                locals: HashMap::new(),
                used: BTreeSet::from(["machine".to_owned()]),
                lines: String::new(),
            };
            let body = writer
                .body()
                .unwrap_or_else(|why| panic!("{}: {} in Rust: {why}", kernel.name, one.name));
            let entry = called.entry(call).or_default();
            let (parameters, arguments) = one.signature(&types);
            let documented = match one.name {
                "main" => String::new(),
                name => docs(kernel.text, name),
            };
            let text = format!("{documented}@{parameters} {body}");
            (entry.parameters, entry.arguments) = (parameters, arguments);
            let file = one.file;
            match entry.bodies.iter_mut().find(|(known, ..)| *known == text) {
                Some((.., kernels)) => kernels.push(index),
                None => entry.bodies.push((text, file, vec![index])),
            }
        }
        for (ty, declared) in kernel.module.types.iter() {
            if let (Some(name), TypeInner::Struct { .. }) = (&declared.name, &declared.inner)
                && let Ok(text) = kernel.types("F").declaration(ty)
            {
                structs.insert(name.clone(), text);
            }
        }
    }
    let functions: String = called
        .iter()
        .map(|(name, called)| called.rust(name, names.is_async(name), kernels.len()))
        .collect();
    let mut text = String::from(
        "//! The kernels, one invocation at a time. Written by `cargo run -p tumble-shaders` from the shaders: change \
         those.\n\n\
         use crate::shader::*;\n\
         use crate::twin::machine::{\
         Entry, Float, Machine, ballot, barrier, both, choose, quotient, shuffled, stored};\n\n",
    );
    text += &globals(kernels);
    for (name, declaration) in structs {
        if functions.contains(&name) {
            text += &declaration;
        }
    }
    formatted(&(text + &functions))
}

/// A function of a kernel, or its entry point as `main`.
struct One<'a> {
    name: &'a str,
    function: &'a Function,
    info: &'a FunctionInfo,
    file: String,
}

fn functions<'a>(kernel: &Source<'a>) -> Vec<One<'a>> {
    let entry = &kernel.module.entry_points[0];
    let all = kernel.module.functions.iter();
    let all = all.map(|(handle, function)| {
        let name = function.name.as_deref().unwrap_or_default();
        (name, function, &kernel.info[handle])
    });
    all.chain([("main", &entry.function, kernel.info.get_entry_point(0))])
        .map(|(name, function, info)| {
            let start = format!("fn {name}(");
            let mut files = kernel.files.iter();
            let file = files.find(|(_, text)| text.contains(&start));
            One {
                name,
                function,
                info,
                file: file.map_or("readers", |(file, _)| *file).to_owned(),
            }
        })
        .collect()
}

impl One<'_> {
    /// The function's parameters with its result as text, and the arguments of a call that passes these parameters on.
    fn signature(&self, types: &Types<'_>) -> (String, String) {
        let ty = |ty| types.name(ty).unwrap_or_default();
        // The arguments of an entry point are provided by the machine.
        let arguments = match self.name {
            "main" => &[],
            _ => &self.function.arguments[..],
        };
        let (mut parameters, mut passed) = ("(machine: &M".to_owned(), String::new());
        for argument in arguments {
            let name = argument.name.as_deref().unwrap_or_default();
            write!(parameters, ", {name}: {}", ty(argument.ty)).unwrap();
            write!(passed, ", {name}").unwrap();
        }
        let result = self.function.result.as_ref();
        let result = result.map_or_else(String::new, |result| format!(" -> {}", ty(result.ty)));
        (parameters + ")" + &result, passed)
    }
}

impl Called {
    fn rust(&self, name: &str, is_async: bool, kernels: usize) -> String {
        let (keyword, wait) = match is_async {
            true => ("async ", ".await"),
            false => ("", ""),
        };
        let Self {
            bodies,
            parameters,
            arguments,
        } = self;
        let head = |name: &str| format!("pub(crate) {keyword}fn {name}<M: Machine>");
        if let [(text, ..)] = &bodies[..] {
            return text.replace('@', &head(name));
        }
        let mut names = Vec::<String>::new();
        for (_, file, _) in bodies {
            let stem = file.rsplit('/').next().unwrap_or_default();
            let stem = format!("{name}_of_{stem}");
            let same = names
                .iter()
                .filter(|other| other.starts_with(&stem))
                .count();
            names.push(match same {
                0 => stem,
                more => format!("{stem}_{}", more + 1),
            });
        }
        let mut which = vec![0; kernels];
        let mut arms = String::new();
        for (i, (_, _, of)) in bodies.iter().enumerate() {
            of.iter().for_each(|&kernel| which[kernel] = i);
            let pattern = match i + 1 == bodies.len() {
                true => "_".to_owned(),
                false => i.to_string(),
            };
            let call = format!("{}(machine{arguments}){wait}", names[i]);
            writeln!(arms, "{pattern} => {call},").unwrap();
        }
        let mut text = format!(
            "{}{parameters} {{\nconst OF_KERNELS: [u8; {kernels}] = {which:?};\n\
             match OF_KERNELS[machine.code()] {{\n{arms}}}\n}}\n\n",
            head(name)
        );
        for ((body, ..), name) in bodies.iter().zip(&names) {
            text += &body.replace('@', &head(name));
        }
        text
    }
}

/// The names of the kernels' variables, and for each kernel those that it binds.
fn globals(kernels: &[Source<'_>]) -> String {
    let (mut all, mut private, mut entries) = (BTreeSet::new(), BTreeSet::new(), String::new());
    // Many kernels have the same bindings, so each list is written once.
    let mut bound = Vec::<String>::new();
    for kernel in kernels {
        let texels = format!("{}_texels", kernel.name);
        let texels = kernels.iter().position(|other| other.name == texels);
        let (mut bindings, mut pushed) = (BTreeMap::new(), "None".to_owned());
        for (_, variable) in kernel.module.global_variables.iter() {
            let name = global(variable.name.as_deref());
            let path = format!("Global::{name}");
            all.insert(name);
            match (&variable.binding, variable.space) {
                (Some(binding), _) => drop(bindings.insert(binding.binding, path)),
                (None, AddressSpace::Immediate) => pushed = format!("Some({path})"),
                (None, AddressSpace::Private) => drop(private.insert(path)),
                (None, _) => {}
            }
        }
        let list = format!("&[{}]", Vec::from_iter(bindings.into_values()).join(", "));
        let known = bound.iter().position(|other| *other == list);
        let index = known.unwrap_or(bound.len());
        if known.is_none() {
            bound.push(list);
        }
        let size = kernel.module.entry_points[0].workgroup_size[0];
        writeln!(entries, "entry({index}, {pushed}, {size}, {texels:?}),").unwrap();
    }
    let (names, private) = (Vec::from_iter(all), Vec::from_iter(private));
    format!(
        "/// The variables of the kernels, by their names.\n\
         #[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]\n\
         pub(crate) enum Global {{ {} }}\n\n\
         impl Global {{\n/// All of them, in their order.\n\
         pub(crate) const ALL: [Self; GLOBALS] = [{}];\n}}\n\n\
         pub(crate) const GLOBALS: usize = {};\n\n\
         /// Variables of which each invocation has its own.\n\
         pub(crate) const PRIVATE: [Global; {}] = [{}];\n\n\
         /// The variables that kernels bind, in the order of the bindings.\n\
         const BOUND: [&[Global]; {}] = [{}];\n\n\
         const fn entry(bound: usize, pushed: Option<Global>, workgroup: u32, texels: Option<usize>) -> Entry {{\n\
         Entry {{ bound: BOUND[bound], pushed, workgroup, texels }}\n}}\n\n\
         /// The entry points: those of the kernels in their order, and then those that read texel buffers.\n\
         pub(crate) static ENTRIES: [Entry; {}] = [{entries}];\n\n",
        names.join(", "),
        names
            .iter()
            .map(|name| format!("Self::{name}"))
            .collect::<Vec<_>>()
            .join(", "),
        names.len(),
        private.len(),
        private.join(", "),
        bound.len(),
        bound.join(", "),
        kernels.len(),
    )
}

/// `first_entry` as `FirstEntry`.
fn global(name: Option<&str>) -> String {
    variant(name.unwrap_or_default())
}

/// The names by which functions are called, and the functions that wait for barriers.
struct Names {
    /// The signatures of each name.
    signatures: BTreeMap<String, BTreeSet<String>>,
    waits: BTreeSet<String>,
}

impl Names {
    fn new(kernels: &[Source<'_>]) -> Self {
        let mut names = Self {
            signatures: BTreeMap::new(),
            waits: BTreeSet::new(),
        };
        for kernel in kernels {
            for one in functions(kernel) {
                let signature = signature(&kernel.types("M::F"), one.function);
                let of = names.signatures.entry(one.name.to_owned()).or_default();
                of.insert(signature);
            }
        }
        // A function is async if it has a barrier, uses the other lanes of its subgroup, or calls an async function.
        loop {
            let before = names.waits.len();
            for kernel in kernels {
                let types = kernel.types("M::F");
                for one in functions(kernel) {
                    if names.block_waits(&types, &one.function.body) {
                        let name = names.of(&types, one.name, one.function);
                        names.waits.insert(name);
                    }
                }
            }
            if names.waits.len() == before {
                // All entry points have the same signature.
                names.waits.insert("main".to_owned());
                return names;
            }
        }
    }

    fn block_waits(&self, types: &Types<'_>, block: &Block) -> bool {
        block.iter().any(|statement| match statement {
            Statement::ControlBarrier(_)
            | Statement::SubgroupBallot { .. }
            | Statement::SubgroupGather { .. } => true,
            Statement::Block(inner) => self.block_waits(types, inner),
            Statement::If { accept, reject, .. } => {
                self.block_waits(types, accept) || self.block_waits(types, reject)
            }
            Statement::Loop {
                body, continuing, ..
            } => self.block_waits(types, body) || self.block_waits(types, continuing),
            Statement::Call { function, .. } => {
                let function = &types.module.functions[*function];
                let name = function.name.as_deref().unwrap_or_default();
                self.is_async(&self.of(types, name, function))
            }
            _ => false,
        })
    }

    fn is_async(&self, name: &str) -> bool {
        self.waits.contains(name)
    }

    /// The name by which a function is called: its own, with what its signature has alone if there are others of this
    /// name.
    fn of(&self, types: &Types<'_>, name: &str, function: &Function) -> String {
        let all = &self.signatures[name];
        if name == "main" || all.len() == 1 {
            return name.to_owned();
        }
        let this_signature = signature(types, function);
        let word = |text: &str| -> Option<String> {
            let words = text.split(|c: char| !c.is_alphanumeric());
            let mut words =
                words.filter(|word| word.len() > 2 && word.starts_with(char::is_uppercase));
            let others = || all.iter().filter(|other| **other != this_signature);
            words
                .find(|word| others().all(|other| !other.contains(word)))
                .map(|word| {
                    let mut snake = String::new();
                    for c in word.chars() {
                        if c.is_uppercase() {
                            snake.push('_');
                        }
                        snake.extend(c.to_lowercase());
                    }
                    snake
                })
        };
        let index = all
            .iter()
            .position(|other| *other == this_signature)
            .unwrap_or(0);
        name.to_owned() + &word(&this_signature).unwrap_or_else(|| format!("_{}", index + 1))
    }
}

/// The types of a function's arguments and of its result.
fn signature(types: &Types<'_>, function: &Function) -> String {
    let name = |ty| types.name(ty).unwrap_or_default();
    let arguments = function.arguments.iter().map(|argument| name(argument.ty));
    let result = function.result.iter().map(|result| name(result.ty));
    arguments.chain(result).collect::<Vec<_>>().join(", ")
}

/// Types in Rust.
#[derive(Clone, Copy)]
struct Types<'a> {
    module: &'a Module,
    /// The name of the type of numbers.
    float: &'static str,
}

impl Types<'_> {
    fn name(&self, ty: Handle<Type>) -> Result<String> {
        let declared = &self.module.types[ty];
        match (&declared.name, &declared.inner) {
            (Some(name), TypeInner::Struct { .. }) => Ok(match self.has_floats(ty) {
                true => format!("{name}<{}>", self.float),
                false => name.clone(),
            }),
            (_, inner) => self.inner(inner),
        }
    }

    fn inner(&self, inner: &TypeInner) -> Result<String> {
        let scalar = |of: naga::Scalar| match (of.kind, of.width) {
            (ScalarKind::Float, 4) => Ok(self.float),
            (ScalarKind::Uint, 4) => Ok("u32"),
            (ScalarKind::Uint, 8) => Ok("u64"),
            (ScalarKind::Sint, 4) => Ok("i32"),
            (ScalarKind::Bool, _) => Ok("bool"),
            other => Err(format!("numbers {other:?}")),
        };
        match *inner {
            TypeInner::Scalar(of) => Ok(scalar(of)?.to_owned()),
            TypeInner::Vector { size, scalar: of } => {
                Ok(format!("[{}; {}]", scalar(of)?, size as u8))
            }
            TypeInner::Array {
                base,
                size: ArraySize::Constant(count),
                ..
            } => Ok(format!("[{}; {count}]", self.name(base)?)),
            ref other => Err(format!("a {other:?}")),
        }
    }

    fn has_floats(&self, ty: Handle<Type>) -> bool {
        match &self.module.types[ty].inner {
            TypeInner::Scalar(scalar) | TypeInner::Vector { scalar, .. } => {
                scalar.kind == ScalarKind::Float
            }
            TypeInner::Array { base, .. } => self.has_floats(*base),
            TypeInner::Struct { members, .. } => members.iter().any(|m| self.has_floats(m.ty)),
            _ => false,
        }
    }

    /// Words of memory.
    fn words(&self, ty: Handle<Type>) -> u32 {
        self.module.types[ty].inner.size(self.module.to_ctx()) / 4
    }

    /// The declaration of a struct, and its layout in memory if it has one.
    fn declaration(&self, ty: Handle<Type>) -> Result<String> {
        let declared = &self.module.types[ty];
        let TypeInner::Struct { members, span } = &declared.inner else {
            return Err("no struct".to_owned());
        };
        let (mut fields, mut offsets, mut is_stored) = (String::new(), String::new(), true);
        for member in members {
            let name = self.name(member.ty)?;
            writeln!(fields, "pub(crate) {}: {name},", field(member)).unwrap();
            write!(offsets, ", {} {}", field(member), member.offset / 4).unwrap();
            is_stored &= name != "bool";
        }
        let name = self.name(ty)?;
        let mut text = format!(
            "#[derive(Debug, Clone, Copy, Default)]\npub(crate) struct {name} {{\n{fields}}}\n\n"
        );
        if is_stored {
            let generics = if self.has_floats(ty) { "<F>" } else { "" };
            let of = declared.name.as_deref().unwrap_or_default();
            writeln!(
                text,
                "stored!({of}, ({generics}), {}{offsets});\n",
                span / 4
            )
            .unwrap();
        }
        Ok(text)
    }
}

/// Where a pointer points.
enum Location {
    Local(String),
    Global {
        name: String,
        /// The words before it.
        at: Vec<String>,
    },
}

impl Location {
    fn word(at: &[String]) -> String {
        match at {
            [] => "0".to_owned(),
            terms => terms.join(" + "),
        }
    }
}

/// Writes one function.
struct Writer<'a> {
    types: Types<'a>,
    info: &'a FunctionInfo,
    function: &'a Function,
    names: &'a Names,
    /// Expressions whose values have a name.
    named: HashMap<Handle<Expression>, String>,
    locals: HashMap<Handle<LocalVariable>, String>,
    used: BTreeSet<String>,
    lines: String,
}

impl<'a> Writer<'a> {
    fn body(&mut self) -> Result<String> {
        let mut start = String::new();
        for (i, argument) in self.function.arguments.iter().enumerate() {
            let name = argument.name.clone().unwrap_or_default();
            self.used.insert(name.clone());
            if let Some(Binding::BuiltIn(builtin)) = argument.binding {
                let of = match builtin {
                    BuiltIn::GlobalInvocationId => "global_invocation_id",
                    BuiltIn::WorkGroupId => "workgroup_id",
                    BuiltIn::NumWorkGroups => "num_workgroups",
                    BuiltIn::LocalInvocationIndex => "local_invocation_index",
                    BuiltIn::SubgroupId => "subgroup_id",
                    BuiltIn::NumSubgroups => "num_subgroups",
                    BuiltIn::SubgroupInvocationId => "subgroup_invocation_id",
                    other => return Err(format!("argument {i}: {other:?}")),
                };
                writeln!(start, "let {name} = machine.ids().{of};").unwrap();
            }
        }
        for (handle, variable) in self.function.local_variables.iter() {
            // naga adds variables without names for `||` and `&&`.
            let name = variable.name.as_deref().unwrap_or("condition");
            let name = self.unique(name);
            self.locals.insert(handle, name.clone());
            let ty = self.types.name(variable.ty)?;
            let value = match variable.init {
                Some(init) => self.value(init)?.text,
                None => "Default::default()".to_owned(),
            };
            writeln!(start, "let mut {name}: {ty} = {value};").unwrap();
        }
        let block = self.block(&self.function.body, true)?;
        Ok(format!("{{\n{start}{block}}}\n\n"))
    }

    /// A name that nothing else in the function has.
    fn unique(&mut self, name: &str) -> String {
        let mut unique_name = name.to_owned();
        let mut count = 1;
        while !self.used.insert(unique_name.clone()) {
            count += 1;
            unique_name = format!("{name}_{count}");
        }
        unique_name
    }

    /// A block between braces, and how many operations it has.
    fn block(&mut self, block: &Block, is_whole: bool) -> Result<String> {
        let outside = std::mem::take(&mut self.lines);
        let steps = self.statements(block, is_whole)?;
        let inside = std::mem::replace(&mut self.lines, outside);
        Ok(match steps {
            0 => inside,
            _ => format!("let _block = machine.block(line!(), {steps});\n{inside}"),
        })
    }

    fn statements(&mut self, block: &Block, is_whole: bool) -> Result<usize> {
        let mut steps = 0;
        for (i, statement) in block.iter().enumerate() {
            let is_last = is_whole && i + 1 == block.len();
            match statement {
                Statement::Emit(range) => {
                    for handle in range.clone() {
                        steps += usize::from(self.emitted(handle)?);
                    }
                }
                Statement::Block(inner) => steps += self.statements(inner, is_last)?,
                Statement::If {
                    condition,
                    accept,
                    reject,
                } => {
                    let condition = self.value(*condition)?;
                    // naga ends loops by an `if` whose first branch is empty. The condition is inverted instead.
                    let (condition, accept, reject) = match accept.is_empty() {
                        true => (format!("!{}", condition.within(UNARY)), reject, accept),
                        false => (condition.text, accept, reject),
                    };
                    let accept = self.block(accept, false)?;
                    let mut text = format!("if {condition} {{\n{accept}}}");
                    if !reject.is_empty() {
                        write!(text, " else {{\n{}}}", self.block(reject, false)?).unwrap();
                    }
                    self.line(&text);
                    steps += 1;
                }
                Statement::Loop {
                    body,
                    continuing,
                    break_if,
                } => {
                    let mut both = body.clone();
                    both.extend_block(continuing.clone());
                    if let Some(condition) = *break_if {
                        let (accept, reject) = (vec![Statement::Break].into(), Block::new());
                        let last = Statement::If {
                            condition,
                            accept,
                            reject,
                        };
                        both.push(last, Span::UNDEFINED);
                    }
                    let text = format!("loop {{\n{}}}", self.block(&both, false)?);
                    self.line(&text);
                }
                Statement::Break => self.line("break;"),
                Statement::Return { value } => {
                    let value = match value {
                        Some(value) => self.value(*value)?.text,
                        None => String::new(),
                    };
                    match (is_last, value.is_empty()) {
                        (true, true) => {}
                        (true, false) => self.line(&value),
                        (false, _) => self.line(&format!("return {value};")),
                    }
                }
                Statement::Store { pointer, value } => {
                    let written = self.value(*value)?.text;
                    let text = match self.location(*pointer)? {
                        Location::Local(location) => format!("{location} = {written};"),
                        Location::Global { name, at } => {
                            let ty = self.ty(*value)?;
                            let at = Location::word(&at);
                            format!("machine.store::<{ty}>(Global::{name}, {at}, {written});")
                        }
                    };
                    self.line(&text);
                    steps += 1;
                }
                Statement::Call {
                    function,
                    arguments,
                    result,
                } => {
                    let callee = &self.types.module.functions[*function];
                    let name = callee.name.as_deref().unwrap_or_default();
                    let name = self.names.of(&self.types, name, callee);
                    let mut text = format!("{name}(machine");
                    for &argument in arguments {
                        write!(text, ", {}", self.value(argument)?.text).unwrap();
                    }
                    text += if self.names.is_async(&name) {
                        ").await"
                    } else {
                        ")"
                    };
                    match result {
                        Some(result) => self.bind(*result, "result", &text),
                        None => self.line(&(text + ";")),
                    }
                    steps += 1;
                }
                Statement::ControlBarrier(_) => self.line("barrier().await;"),
                Statement::SubgroupBallot { result, predicate } => {
                    let predicate = match predicate {
                        Some(predicate) => self.value(*predicate)?.text,
                        None => "true".to_owned(),
                    };
                    let text = format!("ballot(machine, {predicate}).await");
                    self.bind(*result, "ballot", &text);
                    steps += 1;
                }
                Statement::SubgroupGather {
                    mode: GatherMode::Shuffle(lane),
                    argument,
                    result,
                } => {
                    let (value, lane) = (self.value(*argument)?.text, self.value(*lane)?.text);
                    let text = format!("shuffled(machine, {value}, {lane}).await");
                    self.bind(*result, "shuffled_value", &text);
                    steps += 1;
                }
                other => return Err(format!("{other:?}")),
            }
        }
        Ok(steps)
    }

    fn line(&mut self, text: &str) {
        self.lines.push_str(text);
        self.lines.push('\n');
    }

    /// Gives a value a name.
    fn bind(&mut self, handle: Handle<Expression>, otherwise: &str, value: &str) {
        let name = self.function.named_expressions.get(&handle);
        let name = name.map_or(otherwise, String::as_str);
        let unique_name = self.unique(name);
        self.line(&format!("let {unique_name} = {value};"));
        self.named.insert(handle, unique_name);
    }

    /// Names an expression that has a name in the shader, that is used several times, or whose value a later store
    /// changes. Returns whether it is an operation.
    fn emitted(&mut self, handle: Handle<Expression>) -> Result<bool> {
        if self.is_pointer(handle) {
            return Ok(false);
        }
        let expression = &self.function.expressions[handle];
        let is_part = matches!(
            expression,
            Expression::AccessIndex { .. } | Expression::Splat { .. } | Expression::Compose { .. }
        );
        let is_load = matches!(
            expression,
            Expression::Load { .. } | Expression::ImageLoad { .. }
        );
        let is_named = self.function.named_expressions.contains_key(&handle);
        let is_shared = self.info[handle].ref_count > 1 && !is_part;
        if is_load || is_named || is_shared {
            let kind = if is_load { "loaded" } else { "value" };
            let value = self.value(handle)?.text;
            self.bind(handle, kind, &value);
        }
        Ok(!is_part)
    }

    fn inner(&self, handle: Handle<Expression>) -> &'a TypeInner {
        self.info[handle].ty.inner_with(&self.types.module.types)
    }

    fn is_pointer(&self, handle: Handle<Expression>) -> bool {
        matches!(
            self.inner(handle),
            TypeInner::Pointer { .. } | TypeInner::ValuePointer { .. }
        )
    }

    fn ty(&self, handle: Handle<Expression>) -> Result<String> {
        match self.info[handle].ty.handle() {
            Some(ty) => self.types.name(ty),
            None => self.types.inner(self.inner(handle)),
        }
    }

    /// The number of components of a vector.
    fn size(&self, handle: Handle<Expression>) -> Option<usize> {
        match *self.inner(handle) {
            TypeInner::Vector { size, .. } => Some(size as usize),
            _ => None,
        }
    }

    fn kind(&self, handle: Handle<Expression>) -> Option<ScalarKind> {
        self.inner(handle).scalar().map(|scalar| scalar.kind)
    }

    fn location(&mut self, pointer: Handle<Expression>) -> Result<Location> {
        let module = self.types.module;
        match self.function.expressions[pointer] {
            Expression::LocalVariable(variable) => {
                Ok(Location::Local(self.locals[&variable].clone()))
            }
            Expression::GlobalVariable(variable) => Ok(Location::Global {
                name: global(module.global_variables[variable].name.as_deref()),
                at: Vec::new(),
            }),
            Expression::AccessIndex { base, index } => self.part(base, Some(index), None),
            Expression::Access { base, index } => {
                let index = self.value(index)?;
                self.part(base, None, Some(index))
            }
            ref other => Err(format!("a pointer {other:?}")),
        }
    }

    /// A field of the value to which a pointer points, or an element of it.
    fn part(
        &mut self,
        base: Handle<Expression>,
        fixed: Option<u32>,
        index: Option<Text>,
    ) -> Result<Location> {
        let module = self.types.module;
        let pointee = match *self.inner(base) {
            TypeInner::Pointer { base, .. } => &module.types[base].inner,
            ref other => return Err(format!("a part of {other:?}")),
        };
        let location = self.location(base)?;
        let (name, words) = match (pointee, fixed) {
            (TypeInner::Struct { members, .. }, Some(index)) => {
                let member = &members[index as usize];
                (format!(".{}", field(member)), member.offset / 4)
            }
            (TypeInner::Array { base, stride, .. }, _) => {
                if stride / 4 != self.types.words(*base) {
                    return Err("an array with gaps".to_owned());
                }
                (String::new(), stride / 4)
            }
            (TypeInner::Vector { .. }, _) => (String::new(), 1),
            (other, _) => return Err(format!("a part of {other:?}")),
        };
        let is_struct = !name.is_empty();
        Ok(match location {
            Location::Local(text) if is_struct => Location::Local(text + &name),
            Location::Local(text) => Location::Local(match (fixed, index) {
                (Some(index), _) => format!("{text}[{index}]"),
                (_, Some(index)) => format!("{text}[{} as usize]", index.within(UNARY)),
                _ => text,
            }),
            Location::Global { name, mut at } => {
                match (fixed, index) {
                    (Some(0), _) => {}
                    (Some(_), _) if is_struct && words == 0 => {}
                    (Some(_), _) if is_struct => at.push(words.to_string()),
                    (Some(index), _) => at.push((index * words).to_string()),
                    (_, Some(index)) if words == 1 => {
                        at.push(format!("{} as usize", index.within(UNARY)));
                    }
                    (_, Some(index)) => {
                        at.push(format!("{words} * ({} as usize)", index.within(UNARY)));
                    }
                    _ => {}
                }
                Location::Global { name, at }
            }
        })
    }

    fn value(&mut self, handle: Handle<Expression>) -> Result<Text> {
        if let Some(name) = self.named.get(&handle) {
            return Ok(atom(name.clone()));
        }
        let module = self.types.module;
        match self.function.expressions[handle] {
            Expression::Literal(literal) => Self::literal(literal),
            Expression::Constant(constant) => {
                let constant = &module.constants[constant];
                let init = &module.global_expressions[constant.init];
                match (constant.name.as_deref(), init) {
                    // Each store has its own value of this constant, so the literal is written.
                    (Some(PARTS), Expression::Literal(literal)) => Self::literal(*literal),
                    (Some(name), Expression::Literal(Literal::F32(_))) => {
                        Ok(atom(format!("M::F::of({name})")))
                    }
                    (Some(name), Expression::Literal(_)) => Ok(atom(name)),
                    _ => self.constant(constant.init),
                }
            }
            Expression::ZeroValue(ty) => Ok(atom(format!("<{}>::default()", self.types.name(ty)?))),
            Expression::FunctionArgument(i) => {
                let name = self.function.arguments[i as usize].name.clone();
                Ok(atom(name.unwrap_or_default()))
            }
            Expression::Splat { size, value } => {
                let value = self.value(value)?.text;
                Ok(atom(format!("[{value}; {}]", size as u8)))
            }
            Expression::Compose { ty, ref components } => self.compose(ty, components),
            Expression::Swizzle {
                size,
                vector,
                pattern,
            } => {
                let vector = self.value(vector)?.within(ATOM);
                let all = pattern[..size as usize].iter();
                let all: Vec<String> = all.map(|&i| format!("{vector}[{}]", i as u8)).collect();
                Ok(atom(format!("[{}]", all.join(", "))))
            }
            Expression::AccessIndex { base, index } => {
                let value = self.value(base)?.within(ATOM);
                Ok(atom(match self.inner(base) {
                    TypeInner::Struct { members, .. } => {
                        format!("{value}.{}", field(&members[index as usize]))
                    }
                    _ => format!("{value}[{index}]"),
                }))
            }
            Expression::Access { base, index } => {
                let value = self.value(base)?.within(ATOM);
                let index = self.value(index)?.within(UNARY);
                Ok(atom(format!("{value}[{index} as usize]")))
            }
            Expression::Load { pointer } => match self.location(pointer)? {
                Location::Local(location) => Ok(atom(location)),
                Location::Global { name, at } => {
                    let (ty, at) = (self.ty(handle)?, Location::word(&at));
                    Ok(atom(format!("machine.load::<{ty}>(Global::{name}, {at})")))
                }
            },
            // In memory, a texel buffer is an array of texels of four words.
            Expression::ImageLoad {
                image, coordinate, ..
            } => {
                let Expression::GlobalVariable(variable) = self.function.expressions[image] else {
                    return Err("an image that is no variable".to_owned());
                };
                let name = global(module.global_variables[variable].name.as_deref());
                let at = self.value(coordinate)?.within(UNARY);
                Ok(atom(format!(
                    "machine.load::<[u32; 4]>(Global::{name}, 4 * ({at} as usize))"
                )))
            }
            Expression::ArrayLength(pointer) => {
                let TypeInner::Pointer { base, .. } = *self.inner(pointer) else {
                    return Err("the length of no pointer".to_owned());
                };
                let TypeInner::Array { stride, .. } = module.types[base].inner else {
                    return Err("the length of no array".to_owned());
                };
                match self.location(pointer)? {
                    Location::Global { name, .. } => Ok(atom(format!(
                        "machine.length(Global::{name}, {})",
                        stride / 4
                    ))),
                    Location::Local(_) => Err("the length of a local array".to_owned()),
                }
            }
            _ => self.operation(handle),
        }
    }

    fn literal(literal: Literal) -> Result<Text> {
        Ok(match literal {
            Literal::F32(value) => atom(format!("M::F::of({value:?})")),
            Literal::U32(value) if value > 0xff => atom(format!("{value:#x}u32")),
            Literal::U32(value) => atom(format!("{value}u32")),
            Literal::I32(value) => atom(format!("{value}i32")),
            Literal::Bool(value) => atom(value.to_string()),
            other => return Err(format!("{other:?}")),
        })
    }

    /// A constant that is no single number.
    fn constant(&self, handle: Handle<Expression>) -> Result<Text> {
        match &self.types.module.global_expressions[handle] {
            Expression::Literal(literal) => Self::literal(*literal),
            Expression::Compose { components, .. } => {
                let all: Result<Vec<String>> = components
                    .iter()
                    .map(|&part| Ok(self.constant(part)?.text))
                    .collect();
                Ok(atom(format!("[{}]", all?.join(", "))))
            }
            other => Err(format!("a constant {other:?}")),
        }
    }

    fn compose(&mut self, ty: Handle<Type>, components: &[Handle<Expression>]) -> Result<Text> {
        let declared = &self.types.module.types[ty];
        let mut parts = Vec::new();
        for &component in components {
            let text = self.value(component)?;
            // A vector may be made of vectors.
            match (&declared.inner, self.size(component)) {
                (TypeInner::Vector { .. }, Some(size)) => {
                    let vector = text.within(ATOM);
                    parts.extend((0..size).map(|i| format!("{vector}[{i}]")));
                }
                _ => parts.push(text.text),
            }
        }
        match &declared.inner {
            TypeInner::Struct { members, .. } => {
                let fields: String = members
                    .iter()
                    .zip(parts)
                    .map(|(member, value)| match field(member) {
                        name if name == value => format!("{name}, "),
                        name => format!("{name}: {value}, "),
                    })
                    .collect();
                let name = declared.name.as_deref().unwrap_or_default();
                Ok(Text {
                    text: format!("{name} {{ {fields}}}"),
                    level: LOOSE,
                })
            }
            _ => Ok(atom(format!("[{}]", parts.join(", ")))),
        }
    }

    fn operation(&mut self, handle: Handle<Expression>) -> Result<Text> {
        let size = self.size(handle);
        match self.function.expressions[handle] {
            Expression::Unary { op, expr } => {
                let sign = match op {
                    UnaryOperator::Negate => '-',
                    UnaryOperator::LogicalNot | UnaryOperator::BitwiseNot => '!',
                };
                let value = self.value(expr)?;
                Ok(match size {
                    Some(_) => atom(format!("{}.map(|x| {sign}x)", value.within(ATOM))),
                    None => Text {
                        text: format!("{sign}{}", value.within(UNARY)),
                        level: UNARY,
                    },
                })
            }
            Expression::Binary { op, left, right } => {
                let is_float = self.kind(left) == Some(ScalarKind::Float);
                let operation = |left: Text, right: Text| match op {
                    BinaryOperator::Divide if !is_float => {
                        Ok(atom(format!("quotient({}, {})", left.text, right.text)))
                    }
                    // Each operation on numbers begins in a separate column, because tests name the places of planted
                    // mistakes by line and column.
                    BinaryOperator::Add | BinaryOperator::Subtract if left.level == 15 => {
                        binary(op, is_float, atom(left.within(16)), right)
                    }
                    BinaryOperator::Multiply if is_float && left.level == 16 => {
                        binary(op, is_float, atom(left.within(17)), right)
                    }
                    _ => binary(op, is_float, left, right),
                };
                match (self.size(left), self.size(right)) {
                    (None, None) => operation(self.value(left)?, self.value(right)?),
                    (a, b) => {
                        let count = a.or(b).unwrap_or(1);
                        let mut vector = |operand, size: Option<usize>| -> Result<String> {
                            let text = self.value(operand)?.text;
                            Ok(match size {
                                Some(_) => text,
                                None => format!("[{text}; {count}]"),
                            })
                        };
                        let (left, right) = (vector(left, a)?, vector(right, b)?);
                        let each = operation(atom("x"), atom("y"))?.text;
                        Ok(atom(format!("both({left}, {right}, |x, y| {each})")))
                    }
                }
            }
            Expression::Select {
                condition,
                accept,
                reject,
            } => {
                let is_vector = self.size(condition).is_some();
                let condition = self.value(condition)?.text;
                let (accept, reject) = (self.value(accept)?.text, self.value(reject)?.text);
                Ok(match is_vector {
                    true => atom(format!("choose({condition}, {accept}, {reject})")),
                    false => Text {
                        text: format!("if {condition} {{ {accept} }} else {{ {reject} }}"),
                        level: LOOSE,
                    },
                })
            }
            Expression::As {
                expr,
                kind,
                convert,
            } => {
                let from = self.kind(expr);
                let convert = |value: Text| match (from, kind, convert) {
                    (Some(ScalarKind::Uint), ScalarKind::Uint, Some(8)) => {
                        Ok(atom(format!("u64::from({})", value.text)))
                    }
                    (Some(from), to, _) if from == to => Ok(value),
                    (Some(ScalarKind::Float), ScalarKind::Uint, None) => {
                        Ok(atom(format!("{}.bits()", value.within(ATOM))))
                    }
                    (Some(ScalarKind::Uint), ScalarKind::Float, None) => {
                        Ok(atom(format!("M::F::of_bits({})", value.text)))
                    }
                    (Some(ScalarKind::Sint), ScalarKind::Float, Some(_)) => {
                        let value = value.within(UNARY);
                        Ok(atom(format!("M::F::of({value} as f32)")))
                    }
                    (Some(ScalarKind::Uint), ScalarKind::Sint, _) => Ok(Text {
                        text: format!("{} as i32", value.within(UNARY)),
                        level: LOOSE,
                    }),
                    (Some(ScalarKind::Sint), ScalarKind::Uint, _) => Ok(Text {
                        text: format!("{} as u32", value.within(UNARY)),
                        level: LOOSE,
                    }),
                    other => Err(format!("a conversion {other:?}")),
                };
                let value = self.value(expr)?;
                match size {
                    Some(_) if from == Some(kind) => Ok(value),
                    Some(_) => {
                        let each = convert(atom("x"))?.text;
                        Ok(atom(format!("{}.map(|x| {each})", value.within(ATOM))))
                    }
                    None => convert(value),
                }
            }
            Expression::Math {
                fun: MathFunction::CountOneBits,
                arg,
                ..
            } => {
                let value = self.value(arg)?.within(ATOM);
                Ok(atom(format!("{value}.count_ones()")))
            }
            ref other => Err(format!("{other:?}")),
        }
    }
}
