//! The list of the operations that round exactly, and a search for other operations in a module.

use std::collections::BTreeSet;
use std::fmt;

use crate::spirv::{Instruction, SpirvError, instructions, op, text_of};

/// An operation whose result may differ from driver to driver.
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub struct InexactOperation {
    /// The offset of the instruction in the module, in words.
    pub word: usize,
    /// The opcode of the instruction.
    pub opcode: u16,
    /// The name of the operation, such as `OpFDiv` or `Sqrt`.
    pub name: String,
    /// The line of the source, if the module has lines.
    pub line: Option<u32>,
}

impl fmt::Display for InexactOperation {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            word, name, line, ..
        } = self;
        if let Some(line) = line {
            write!(f, "line {line}: ")?;
        }
        write!(f, "{name}, at word {word}, does not round exactly")
    }
}

/// Operations that have a looser bound in Vulkan, are left to the device, or are computed in any order.
const OPERATIONS: [(u16, &str); 45] = [
    (87, "OpImageSampleImplicitLod"),
    (88, "OpImageSampleExplicitLod"),
    (89, "OpImageSampleDrefImplicitLod"),
    (90, "OpImageSampleDrefExplicitLod"),
    (91, "OpImageSampleProjImplicitLod"),
    (92, "OpImageSampleProjExplicitLod"),
    (93, "OpImageSampleProjDrefImplicitLod"),
    (94, "OpImageSampleProjDrefExplicitLod"),
    (109, "OpConvertFToU"),
    (110, "OpConvertFToS"),
    (op::F_CONVERT, "OpFConvert"),
    (116, "OpQuantizeToF16"),
    (136, "OpFDiv"),
    (140, "OpFRem"),
    (141, "OpFMod"),
    (op::VECTOR_TIMES_SCALAR, "OpVectorTimesScalar"),
    (143, "OpMatrixTimesScalar"),
    (144, "OpVectorTimesMatrix"),
    (145, "OpMatrixTimesVector"),
    (146, "OpMatrixTimesMatrix"),
    (147, "OpOuterProduct"),
    (148, "OpDot"),
    (207, "OpDPdx"),
    (208, "OpDPdy"),
    (209, "OpFwidth"),
    (210, "OpDPdxFine"),
    (211, "OpDPdyFine"),
    (212, "OpFwidthFine"),
    (213, "OpDPdxCoarse"),
    (214, "OpDPdyCoarse"),
    (215, "OpFwidthCoarse"),
    (265, "OpGroupFAdd"),
    (305, "OpImageSparseSampleImplicitLod"),
    (306, "OpImageSparseSampleExplicitLod"),
    (307, "OpImageSparseSampleDrefImplicitLod"),
    (308, "OpImageSparseSampleDrefExplicitLod"),
    (309, "OpImageSparseSampleProjImplicitLod"),
    (310, "OpImageSparseSampleProjExplicitLod"),
    (311, "OpImageSparseSampleProjDrefImplicitLod"),
    (312, "OpImageSparseSampleProjDrefExplicitLod"),
    (350, "OpGroupNonUniformFAdd"),
    (352, "OpGroupNonUniformFMul"),
    (4459, "OpCooperativeMatrixMulAddKHR"),
    (6035, "OpAtomicFAddEXT"),
    (6402, "OpGroupFMulKHR"),
];

/// The functions of `GLSL.std.450` on integers. Those on floats round freely, or choose among zeros and NaN.
const INTEGER_FUNCTIONS: [u32; 11] = [5, 7, 38, 39, 41, 42, 44, 45, 73, 74, 75];

/// Names of the functions of `GLSL.std.450`, from 1 on.
const FUNCTIONS: [&str; 81] = [
    "Round",
    "RoundEven",
    "Trunc",
    "FAbs",
    "SAbs",
    "FSign",
    "SSign",
    "Floor",
    "Ceil",
    "Fract",
    "Radians",
    "Degrees",
    "Sin",
    "Cos",
    "Tan",
    "Asin",
    "Acos",
    "Atan",
    "Sinh",
    "Cosh",
    "Tanh",
    "Asinh",
    "Acosh",
    "Atanh",
    "Atan2",
    "Pow",
    "Exp",
    "Log",
    "Exp2",
    "Log2",
    "Sqrt",
    "InverseSqrt",
    "Determinant",
    "MatrixInverse",
    "Modf",
    "ModfStruct",
    "FMin",
    "UMin",
    "SMin",
    "FMax",
    "UMax",
    "SMax",
    "FClamp",
    "UClamp",
    "SClamp",
    "FMix",
    "IMix",
    "Step",
    "SmoothStep",
    "Fma",
    "Frexp",
    "FrexpStruct",
    "Ldexp",
    "PackSnorm4x8",
    "PackUnorm4x8",
    "PackSnorm2x16",
    "PackUnorm2x16",
    "PackHalf2x16",
    "PackDouble2x32",
    "UnpackSnorm2x16",
    "UnpackUnorm2x16",
    "UnpackHalf2x16",
    "UnpackSnorm4x8",
    "UnpackUnorm4x8",
    "UnpackDouble2x32",
    "Length",
    "Distance",
    "Cross",
    "Normalize",
    "FaceForward",
    "Reflect",
    "Refract",
    "FindILsb",
    "FindSMsb",
    "FindUMsb",
    "InterpolateAtCentroid",
    "InterpolateAtSample",
    "InterpolateAtOffset",
    "NMin",
    "NMax",
    "NClamp",
];

/// The operations of a module whose results may differ from driver to driver, in their order. An empty list means that
/// the pass accepts the module, except for products of vectors and scalars, which [`exact`](crate::exact) replaces.
///
/// These are exact: `+`, `-`, `*` and negation of f32, comparisons, selections, integers, bits, and moves of values. A
/// float type of another width than 32 bits is listed once. Conversions of integers to f32 are not listed, although
/// they are exact only for integers up to 2^24 in magnitude; the shader must not convert larger ones.
///
/// # Errors
/// A [`SpirvError`] for words that are no module.
pub fn inexact(module: &[u32]) -> Result<Vec<InexactOperation>, SpirvError> {
    Ok(found(&instructions(module)?, HalfFloats::Refused))
}

/// Floats of 16 bits, and conversions to them.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum HalfFloats {
    Refused,
    /// The module states their rounding.
    Accepted,
}

/// The inexact operations among instructions, in their order.
pub(crate) fn found(code: &[Instruction<'_>], halves: HalfFloats) -> Vec<InexactOperation> {
    const LINE: u16 = 8;
    const NO_LINE: u16 = 317;
    const FUNCTION_END: u16 = 56;
    // The ids of the imported sets of extended instructions: of the sets that compute nothing, such as debug
    // information, and of GLSL's set.
    let (mut silent, mut glsl) = (BTreeSet::new(), BTreeSet::new());
    let mut line = None;
    let mut all = Vec::new();
    for instruction in code {
        let opcode = instruction.opcode;
        let name = match (opcode, instruction.words) {
            (LINE, &[_, _, number, ..]) => {
                line = Some(number);
                None
            }
            (NO_LINE | FUNCTION_END, _) => {
                line = None;
                None
            }
            (op::EXT_INST_IMPORT, [_, id, name @ ..]) => {
                let name = text_of(name);
                if name == "GLSL.std.450" {
                    glsl.insert(*id);
                } else if name.starts_with("NonSemantic.") || name.contains("DebugInfo") {
                    silent.insert(*id);
                }
                None
            }
            (op::EXT_INST, &[_, _, _, set, function, ..]) => match glsl.contains(&set) {
                true if INTEGER_FUNCTIONS.contains(&function) => None,
                true => {
                    let name = FUNCTIONS.get((function as usize).wrapping_sub(1));
                    let unknown = || format!("function {function} of GLSL.std.450");
                    Some(name.map_or_else(unknown, |name| (*name).to_owned()))
                }
                false if silent.contains(&set) => None,
                false => Some("a function of an unknown set".to_owned()),
            },
            (op::EXT_INST, _) => Some("a function without a name".to_owned()),
            (op::TYPE_FLOAT, &[_, _, bits, ..])
                if bits != 32 && !(bits == 16 && halves == HalfFloats::Accepted) =>
            {
                Some(format!("a float of {bits} bits"))
            }
            (op::F_CONVERT, _) if halves == HalfFloats::Accepted => None,
            _ => OPERATIONS
                .iter()
                .find(|(inexact, _)| *inexact == opcode)
                .map(|(_, name)| (*name).to_owned()),
        };
        all.extend(name.map(|name| InexactOperation {
            word: instruction.start,
            opcode,
            name,
            line,
        }));
    }
    all
}
