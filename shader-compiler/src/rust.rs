//! The shaders' declarations in Rust: their constants, the structs that buffers hold, and the
//! kernels by name.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write;

use naga::{
    AddressSpace, ArraySize, Handle, Literal, Module, Scalar, ScalarKind, Type, TypeInner,
    VectorSize,
};

use crate::table::{FORMS, LISTS, Store, stores};

/// Everything that the kernels declare, once each. Two declarations of one name that differ are
/// an error.
#[derive(Default)]
pub(crate) struct Declared {
    constants: BTreeMap<String, String>,
    structs: BTreeMap<String, Layout>,
}

/// The constant that each store has of its own.
pub(crate) const PARTS: &str = "PARTS";

/// A struct as it lies in a buffer.
struct Layout {
    /// The members with their offsets, as text: they must be the same in every kernel.
    fields: Vec<String>,
    /// Rust's declaration; `None` for a struct that no buffer holds.
    rust: Option<String>,
}

impl Declared {
    pub(crate) fn collect(&mut self, kernel: &str, module: &Module) {
        for (_, constant) in module.constants.iter() {
            let (Some(name), naga::Expression::Literal(literal)) =
                (&constant.name, &module.global_expressions[constant.init])
            else {
                continue;
            };
            if name == PARTS {
                continue;
            }
            let value = match literal {
                Literal::F32(value) => format!("f32 = {value:?}"),
                Literal::U32(value) => format!("u32 = {value}"),
                Literal::I32(value) => format!("i32 = {value}"),
                _ => continue,
            };
            let other = self.constants.insert(name.clone(), value.clone());
            assert!(
                other.as_ref().is_none_or(|other| *other == value),
                "{kernel}: the constant {name} is {value} here, and {other:?} elsewhere"
            );
        }
        let shared = shared_structs(module);
        for (ty, declared) in module.types.iter() {
            let (Some(name), TypeInner::Struct { members, .. }) = (&declared.name, &declared.inner)
            else {
                continue;
            };
            let fields: Vec<String> = members
                .iter()
                .map(|m| {
                    let name = m.name.as_deref().unwrap_or_default();
                    format!("{name} at {}: {}", m.offset, described(module, m.ty))
                })
                .collect();
            let rust = shared.contains(&ty).then(|| declaration(module, ty, name));
            match self.structs.get_mut(name) {
                Some(other) => {
                    assert!(
                        other.fields == fields,
                        "{kernel}: two structs `{name}` differ:\n  {:?}\n  {fields:?}",
                        other.fields
                    );
                    other.rust = other.rust.take().or(rust);
                }
                None => {
                    self.structs.insert(name.clone(), Layout { fields, rust });
                }
            }
        }
    }

    /// The names of the structs that Rust has declarations of.
    pub(crate) fn in_buffers(&self) -> BTreeSet<String> {
        let structs = self.structs.iter().filter(|(_, item)| item.rust.is_some());
        structs.map(|(name, _)| name.clone()).collect()
    }

    /// Constants as Rust: those for whose name `is_used` is true.
    pub(crate) fn constants(&self, is_used: impl Fn(&str) -> bool) -> String {
        let mut text = String::new();
        for (name, value) in self.constants.iter().filter(|(name, _)| is_used(name)) {
            writeln!(text, "pub(crate) const {name}: {value};").unwrap();
        }
        text
    }

    /// Constants and structs as Rust.
    pub(crate) fn rust(&self) -> String {
        let mut text = String::from(
            "// Written by `cargo run -p tumble-shaders` from the shaders: change those.\n\n",
        );
        text.push_str(&self.constants(|_| true));
        for rust in self.structs.values().filter_map(|item| item.rust.as_ref()) {
            text.push_str(rust);
        }
        text
    }
}

/// A description of a type that is the same in every module.
fn described(module: &Module, ty: Handle<Type>) -> String {
    match module.types[ty].inner {
        TypeInner::Array { base, size, stride } => {
            format!("[{}; {size:?}] by {stride}", described(module, base))
        }
        TypeInner::Struct { .. } => module.types[ty].name.clone().unwrap_or_default(),
        ref other => format!("{other:?}"),
    }
}

/// Structs that lie in a buffer, or come with a dispatch.
fn shared_structs(module: &Module) -> Vec<Handle<Type>> {
    let variables = module.global_variables.iter();
    let shared = variables.filter(|(_, variable)| {
        matches!(
            variable.space,
            AddressSpace::Storage { .. } | AddressSpace::Immediate
        )
    });
    shared
        .map(|(_, variable)| match module.types[variable.ty].inner {
            TypeInner::Array { base, .. } => base,
            _ => variable.ty,
        })
        .collect()
}

fn declaration(module: &Module, ty: Handle<Type>, name: &str) -> String {
    let TypeInner::Struct { members, span } = &module.types[ty].inner else {
        unreachable!("a struct");
    };
    let docs = module.doc_comments.as_deref();
    let mut text = String::new();
    doc(&mut text, docs.and_then(|docs| docs.types.get(&ty)));
    text.push_str(
        "#[derive(Debug, Clone, Copy, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]\n#[repr(C)]\n",
    );
    writeln!(text, "pub(crate) struct {name} {{").unwrap();
    let (mut end, mut asserts) = (0, String::new());
    for (i, member) in members.iter().enumerate() {
        let field = member.name.as_deref().expect("members have names");
        padding(&mut text, member.offset - end, i);
        doc(
            &mut text,
            docs.and_then(|docs| docs.struct_members.get(&(ty, i))),
        );
        let (rust, size) = rust_type(module, member.ty);
        writeln!(text, "    pub(crate) {field}: {rust},").unwrap();
        let offset = member.offset;
        writeln!(
            asserts,
            "    assert!(std::mem::offset_of!({name}, {field}) == {offset});"
        )
        .unwrap();
        end = offset + size;
    }
    padding(&mut text, span - end, members.len());
    writeln!(
        text,
        "}}\nconst _: () = {{\n    assert!(size_of::<{name}>() == {span});"
    )
    .unwrap();
    text + &asserts + "};\n"
}

fn padding(text: &mut String, bytes: u32, offset: usize) {
    if bytes > 0 {
        let words = bytes / 4;
        writeln!(text, "    pub(crate) padding_{offset}: [u32; {words}],").unwrap();
    }
}

fn doc(text: &mut String, lines: Option<&Vec<String>>) {
    for line in lines.into_iter().flatten() {
        writeln!(text, "{line}").unwrap();
    }
}

/// A type of a member in Rust, and its size.
fn rust_type(module: &Module, ty: Handle<Type>) -> (String, u32) {
    let scalar = |Scalar { kind, width }: Scalar| match (kind, width) {
        (ScalarKind::Float, 4) => "f32",
        (ScalarKind::Uint, 4) => "u32",
        (ScalarKind::Sint, 4) => "i32",
        other => panic!("no Rust type for {other:?}"),
    };
    match module.types[ty].inner {
        TypeInner::Scalar(scalar_type) => (scalar(scalar_type).to_owned(), 4),
        TypeInner::Vector {
            size,
            scalar: scalar_type,
        } => {
            let count = match size {
                VectorSize::Bi => 2,
                VectorSize::Tri => 3,
                VectorSize::Quad => 4,
            };
            (format!("[{}; {count}]", scalar(scalar_type)), 4 * count)
        }
        TypeInner::Array {
            base,
            size: ArraySize::Constant(count),
            stride,
        } => {
            let (element, size) = rust_type(module, base);
            assert_eq!(size, stride, "arrays without gaps");
            (format!("[{element}; {count}]"), stride * count.get())
        }
        ref other => panic!("no Rust type for {other:?}"),
    }
}

/// A kernel that was compiled, and how long its code is.
pub(crate) struct Compiled {
    pub(crate) name: String,
    /// How it uses the buffer of each binding.
    pub(crate) bindings: Vec<&'static str>,
    pub(crate) words: usize,
    /// The length of its variant that reads texel buffers.
    pub(crate) texel_words: Option<usize>,
    /// The length of its variant that converts to half precision.
    pub(crate) converting_words: Option<usize>,
    /// Whether the lanes of its subgroups ask each other.
    pub(crate) subgroups: bool,
}

/// The kernels as Rust: an enum of their names, their code, and the choice of a kernel by form,
/// list and store.
pub(crate) fn kernels(all: &[Compiled]) -> String {
    let mut text = String::from(
        "/// A kernel, by its name.\n\
         #[derive(Debug, Clone, Copy, PartialEq, Eq)]\npub(crate) enum Kernel {\n",
    );
    for kernel in all {
        writeln!(text, "    {},", variant(&kernel.name)).unwrap();
    }
    text.push_str("}\n");
    for (summary, names) in [
        (
            "How the work over segments is listed.",
            ("List", LISTS.map(|list| list.0).to_vec()),
        ),
        (
            "The representation in which a kernel stores rotations.",
            ("Store", stores().iter().map(|store| store.name).collect()),
        ),
    ] {
        let (name, variants) = names;
        let variants: Vec<String> = variants.into_iter().map(variant).collect();
        let variants = variants.join(",\n    ");
        writeln!(
            text,
            "/// {summary}\n#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]\n\
             pub(crate) enum {name} {{\n    {variants},\n}}"
        )
        .unwrap();
    }
    writeln!(
        text,
        "impl Kernel {{\n    /// The kernel for a form of segments, a list and a store.\n    \
         pub(crate) fn over_segments(form: Form, list: List, store: Store) -> Self {{\n        \
         match (form, list, store) {{"
    )
    .unwrap();
    let mut over_segments = BTreeMap::new();
    for (form, _) in FORMS {
        for (list, _, _) in LISTS {
            for Store { name: store, .. } in stores() {
                let name = format!("{form}_{list}_{store}");
                let [form, list, store] = [form, list, store].map(variant);
                let choice = format!("(Form::{form}, List::{list}, Store::{store})");
                writeln!(text, "            {choice} => Self::{},", variant(&name)).unwrap();
                over_segments.insert(name, choice);
            }
        }
    }
    text.push_str("        }\n    }\n}\n");
    writeln!(
        text,
        "pub(crate) static KERNELS: [KernelCode; {}] = [",
        all.len()
    )
    .unwrap();
    for kernel in all {
        let Compiled {
            name,
            bindings,
            words,
            texel_words,
            converting_words,
            subgroups,
        } = kernel;
        let texels = texel_words.map(|words| (format!("{name}_texels"), words));
        let converting = converting_words.map(|words| (format!("{name}_converting"), words));
        let segments = over_segments
            .get(name)
            .map_or_else(|| "None".to_owned(), |choice| format!("Some({choice})"));
        writeln!(
            text,
            "    KernelCode {{ kernel: Kernel::{}, storage: ({name:?}, {words}), texels: {texels:?}, \
             converting: {converting:?}, \
             bindings: &[{}], segments: {segments}, subgroups: {subgroups} }},",
            variant(name),
            bindings.join(", ")
        )
        .unwrap();
    }
    text + "];\n"
}

/// `arc_frames_f32` as `ArcFramesF32`.
pub(crate) fn variant(name: &str) -> String {
    let words = name.split('_').map(|word| {
        let (first, rest) = word.split_at(1);
        first.to_uppercase() + rest
    });
    words.collect()
}
