//! The classes and functions whose names mean something here, and those whose files are refused.

use crate::array::Element;

/// A class or a function by its module and its name.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct ClassName {
    pub(super) module: String,
    pub(super) name: String,
}

/// A class or a function.
#[derive(Debug, Clone)]
pub(super) enum Class {
    Known(Global),
    Other(ClassName),
}

/// The classes and functions whose meaning is known.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Global {
    Reconstruct,
    Scalar,
    FromBuffer,
    NdArray,
    Dtype,
    Encode,
    Dict,
    DefaultDict,
    /// A type of single values, which nothing may call.
    Type(&'static str),
    Set,
    List,
    Tuple,
    ByteArray,
    Object,
    Reconstructor,
    RebuildTensor,
    RebuildParameter,
    Storage(StorageKind),
    Size,
    Wrapper,
    Csc,
    Chumpy,
    Path,
}

/// The type of the numbers of a storage of `PyTorch`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum StorageKind {
    Float,
    Double,
    Half,
    BFloat16,
    Long,
    Int,
    Short,
    Char,
    Byte,
    Bool,
}

impl StorageKind {
    /// The type of the numbers; `None` for bfloat16, which `NumPy` lacks.
    pub(super) fn element(self) -> Option<Element> {
        Some(match self {
            Self::Float => Element::F32,
            Self::Double => Element::F64,
            Self::Half => Element::F16,
            Self::BFloat16 => return None,
            Self::Long => Element::Signed(8),
            Self::Int => Element::Signed(4),
            Self::Short => Element::Signed(2),
            Self::Char => Element::Signed(1),
            Self::Byte => Element::Unsigned(1),
            Self::Bool => Element::Bool,
        })
    }

    pub(super) fn size(self) -> usize {
        self.element()
            .and_then(|element| element.size())
            .unwrap_or(2)
    }
}

/// The modules and the name of each. `NumPy` 2 renamed `numpy.core`, Python 3 `__builtin__` and `copy_reg`.
const KNOWN: &[(&[&str], &str, Global)] = &[
    (NUMPY_MULTIARRAY, "_reconstruct", Global::Reconstruct),
    (NUMPY_MULTIARRAY, "scalar", Global::Scalar),
    (NUMPY_NUMERIC, "_frombuffer", Global::FromBuffer),
    (&["numpy"], "ndarray", Global::NdArray),
    (&["numpy"], "dtype", Global::Dtype),
    (&["_codecs"], "encode", Global::Encode),
    (&["collections"], "OrderedDict", Global::Dict),
    (&["collections"], "defaultdict", Global::DefaultDict),
    (BUILTINS, "dict", Global::Dict),
    (BUILTINS, "set", Global::Set),
    (BUILTINS, "frozenset", Global::Set),
    (BUILTINS, "list", Global::List),
    (BUILTINS, "tuple", Global::Tuple),
    (BUILTINS, "bytearray", Global::ByteArray),
    // Protocols 0 to 2 store empty bytes in this way.
    (BUILTINS, "bytes", Global::ByteArray),
    (BUILTINS, "object", Global::Object),
    // The function that a `defaultdict` calls for keys that it does not have.
    (BUILTINS, "int", Global::Type("int")),
    (BUILTINS, "long", Global::Type("long")),
    (BUILTINS, "float", Global::Type("float")),
    (BUILTINS, "bool", Global::Type("bool")),
    (BUILTINS, "str", Global::Type("str")),
    (BUILTINS, "unicode", Global::Type("unicode")),
    (
        &["copy_reg", "copyreg"],
        "_reconstructor",
        Global::Reconstructor,
    ),
    (
        &["torch._utils"],
        "_rebuild_tensor_v2",
        Global::RebuildTensor,
    ),
    (
        &["torch._utils"],
        "_rebuild_parameter",
        Global::RebuildParameter,
    ),
    (
        &["torch"],
        "FloatStorage",
        Global::Storage(StorageKind::Float),
    ),
    (
        &["torch"],
        "DoubleStorage",
        Global::Storage(StorageKind::Double),
    ),
    (
        &["torch"],
        "HalfStorage",
        Global::Storage(StorageKind::Half),
    ),
    (
        &["torch"],
        "BFloat16Storage",
        Global::Storage(StorageKind::BFloat16),
    ),
    (
        &["torch"],
        "LongStorage",
        Global::Storage(StorageKind::Long),
    ),
    (&["torch"], "IntStorage", Global::Storage(StorageKind::Int)),
    (
        &["torch"],
        "ShortStorage",
        Global::Storage(StorageKind::Short),
    ),
    (
        &["torch"],
        "CharStorage",
        Global::Storage(StorageKind::Char),
    ),
    (
        &["torch"],
        "ByteStorage",
        Global::Storage(StorageKind::Byte),
    ),
    (
        &["torch"],
        "BoolStorage",
        Global::Storage(StorageKind::Bool),
    ),
    (&["torch"], "Size", Global::Size),
    (
        &["joblib.numpy_pickle"],
        "NumpyArrayWrapper",
        Global::Wrapper,
    ),
    (SPARSE, "csc_matrix", Global::Csc),
    (SPARSE, "csc_array", Global::Csc),
    (&["chumpy.ch"], "Ch", Global::Chumpy),
    (&["pathlib"], "PosixPath", Global::Path),
];

const NUMPY_MULTIARRAY: &[&str] = &["numpy.core.multiarray", "numpy._core.multiarray"];
const NUMPY_NUMERIC: &[&str] = &["numpy.core.numeric", "numpy._core.numeric"];
const BUILTINS: &[&str] = &["builtins", "__builtin__"];
const SPARSE: &[&str] = &["scipy.sparse.csc", "scipy.sparse._csc"];

/// Beginnings of modules of which only the names above are read.
const REFUSED_BEGINNINGS: [&str; 3] = ["numpy", "torch", "scipy"];

/// Modules whose functions only an attack names; of the first two, only the names above are read.
const REFUSED: [&str; 17] = [
    "builtins",
    "__builtin__",
    "os",
    "posix",
    "nt",
    "sys",
    "subprocess",
    "shutil",
    "socket",
    "importlib",
    "runpy",
    "pty",
    "ctypes",
    "code",
    "pickle",
    "_pickle",
    "marshal",
];

impl Global {
    pub(super) fn name(self) -> &'static str {
        let of = KNOWN.iter().find(|(_, _, global)| *global == self);
        of.map_or("", |(_, name, _)| name)
    }
}

impl Class {
    /// The class with a name.
    ///
    /// # Errors
    /// Why a file that names it is refused, as text.
    pub(super) fn of(class: ClassName) -> Result<Self, String> {
        let ClassName { module, name } = &class;
        let known = KNOWN
            .iter()
            .find(|(modules, known, _)| modules.contains(&module.as_str()) && known == name);
        if let Some(&(_, _, global)) = known {
            return Ok(Self::Known(global));
        }
        let first = module.split('.').next().unwrap_or_default();
        let is_refused = REFUSED_BEGINNINGS
            .iter()
            .any(|start| module.starts_with(start))
            || REFUSED.contains(&first);
        // In Python, dots in a name lead to members of a class.
        if is_refused || name.contains('.') {
            return Err(format!(
                "the file names {class}, which Python would run; only numbers, texts and arrays \
                 are read: save only these"
            ));
        }
        Ok(Self::Other(class))
    }
}

impl std::fmt::Display for ClassName {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        // If the name of the module is long, its beginning is left out, because the name of the class tells more.
        let (module, name) = (self.module.as_str(), shown(&self.name));
        match module.char_indices().rev().nth(LONGEST_MODULE) {
            None => write!(f, "{module}.{name}"),
            Some((at, first)) => write!(f, "…{}.{name}", &module[at + first.len_utf8()..]),
        }
    }
}

/// How many characters of the name of a module messages have, the last ones.
const LONGEST_MODULE: usize = 120;

/// At most 60 characters of a text, for messages.
pub(super) fn shown(text: &str) -> String {
    const LONGEST: usize = 60;
    let mut shown: String = text.chars().take(LONGEST).collect();
    if shown.len() < text.len() {
        shown.push('…');
    }
    shown
}
