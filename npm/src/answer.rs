//! The answer to a call: JSON and arrays of numbers, or why it was not done.

use std::error::Error;

use glam::{Quat, Vec3};
use serde_json::{Value, json};
#[cfg(feature = "files")]
use tumble_formats::Diagnostic;

/// The answer to a call.
#[derive(Default)]
pub(crate) struct Answer {
    pub(crate) json: String,
    pub(crate) arrays: Vec<Array>,
}

/// Numbers of an answer.
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
    /// The JSON, with the names, kinds and lengths of the arrays in it.
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

/// Why a call was not done.
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
