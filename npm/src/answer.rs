//! The answer to a call from JavaScript: JSON plus arrays of numbers, or an error.

use std::error::Error;

use glam::{Quat, Vec3};
use serde_json::{Value, json};
#[cfg(feature = "files")]
use tumble_formats::Diagnostic;

/// The answer to a call. `json` lists the arrays, because JavaScript copies each from its address in memory.
#[derive(Default)]
pub(crate) struct Answer {
    pub(crate) json: String,
    pub(crate) arrays: Vec<Array>,
}

/// An array of an answer. JavaScript sees vectors and quaternions as f32, three or four for each.
pub(crate) enum Array {
    F64(Vec<f64>),
    F32(Vec<f32>),
    Quats(Vec<Quat>),
    Vectors(Vec<Vec3>),
}

impl Array {
    pub(crate) fn bytes(&self) -> &[u8] {
        match self {
            Self::F64(numbers) => bytemuck::cast_slice(numbers),
            Self::F32(numbers) => bytemuck::cast_slice(numbers),
            Self::Quats(quats) => bytemuck::cast_slice(quats),
            Self::Vectors(vectors) => bytemuck::cast_slice(vectors),
        }
    }

    fn kind(&self) -> &'static str {
        match self {
            Self::F64(_) => "f64",
            _ => "f32",
        }
    }
}

impl Answer {
    /// An answer whose JSON gets the list `arrays`: the name, the kind (`f32`, `f64`) and the bytes of each array.
    pub(crate) fn new(mut json: Value, arrays: Vec<(&'static str, Array)>) -> Self {
        let listed = arrays.iter().map(|(name, array)| {
            json!({"name": name, "kind": array.kind(), "bytes": array.bytes().len()})
        });
        json["arrays"] = listed.collect();
        Self {
            json: json.to_string(),
            arrays: arrays.into_iter().map(|(_, array)| array).collect(),
        }
    }
}

/// The error of a call; `code` is the code of a file's error, such as `E011`.
#[derive(Debug)]
pub(crate) struct Fault {
    code: Option<&'static str>,
    pub(crate) message: String,
}

impl Fault {
    pub(crate) fn new(message: impl Into<String>) -> Self {
        Self {
            code: None,
            message: message.into(),
        }
    }

    pub(crate) fn into_answer(self) -> Answer {
        let json = json!({"code": self.code, "message": self.message});
        Answer::new(json, Vec::new())
    }

    #[cfg(feature = "files")]
    pub(crate) fn of_file(fault: &Diagnostic) -> Self {
        Self {
            code: Some(fault.code.name()),
            message: fault.to_string(),
        }
    }
}

impl<E: Error> From<E> for Fault {
    fn from(error: E) -> Self {
        Self::new(error.to_string())
    }
}
