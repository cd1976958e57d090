//! A module of naga's as it was parsed, and as it can run.

use naga::valid::{Capabilities, FunctionInfo, ModuleInfo, ValidationFlags, Validator};
use naga::{Function, Module};

use super::frame::compiled;
use super::machine::MachineStep;
use super::operations::FloatMode;

/// A function that can run.
pub(super) struct Compiled {
    pub(super) name: String,
    /// How a frame begins: arguments, constants, variables and pointers to globals.
    pub(super) start: Vec<u64>,
    /// Cells of a frame.
    pub(super) size: usize,
    /// Cells of the result.
    pub(super) result: usize,
    pub(super) steps: Vec<MachineStep>,
}

/// All functions of a module, the entry point last, and the names of its global variables.
pub(super) struct Program {
    pub(super) functions: Vec<Compiled>,
    pub(super) globals: Vec<String>,
}

/// A module with what naga's validator found out about it.
pub(super) struct Checked {
    pub(super) module: Module,
    pub(super) info: ModuleInfo,
}

impl Checked {
    pub(super) fn parse(source: &str) -> Self {
        let module = naga::front::wgsl::parse_str(source).expect("it was compiled");
        let capabilities = Capabilities::IMMEDIATES | Capabilities::SHADER_INT64;
        let info = Validator::new(ValidationFlags::all(), capabilities)
            .validate(&module)
            .expect("it was compiled");
        Self { module, info }
    }

    /// The functions in the order of [`Program::functions`].
    pub(super) fn functions(&self) -> Vec<(&Function, &FunctionInfo)> {
        let named = self.module.functions.iter();
        let named = named.map(|(handle, function)| (function, &self.info[handle]));
        let entries = self.module.entry_points.iter().enumerate();
        let entries = entries.map(|(i, entry)| (&entry.function, self.info.get_entry_point(i)));
        named.chain(entries).collect()
    }

    pub(super) fn program(&self, arithmetic: FloatMode) -> Program {
        let all = self.functions().into_iter();
        let globals = self.module.global_variables.iter();
        Program {
            functions: all
                .map(|(function, info)| compiled(&self.module, function, info, arithmetic))
                .collect(),
            globals: globals
                .map(|(_, global)| global.name.clone().unwrap_or_default())
                .collect(),
        }
    }

    /// One function; `info` is that of this function, or of one with expressions of the same types.
    pub(super) fn compiled(&self, function: &Function, info: &FunctionInfo) -> Compiled {
        compiled(&self.module, function, info, FloatMode::AsWritten)
    }
}
