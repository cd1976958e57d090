//! The operations on scalars that shaders use, each of one IEEE 754 operation or of integers. What is
//! not here is refused by name.

use naga::{BinaryOperator, Scalar, UnaryOperator};

use super::cells::{as_f32, of_f32};

/// Where the cells of a value lie in the frame of its function.
pub(super) type CellIndex = usize;

/// An operand of an operation on several cells; `step` is 0 where all of them use the same one.
#[derive(Clone, Copy)]
pub(super) struct Operand {
    pub(super) first: CellIndex,
    pub(super) step: usize,
}

pub(super) type Unary = fn(u64) -> u64;

/// An operation on two scalars, done for so many cells of a frame: one call for all of them.
pub(super) trait Binary {
    fn run(&self, frame: &mut [u64], operands: [Operand; 2], to: CellIndex, count: usize);
}

impl<F: Fn(u64, u64) -> u64> Binary for F {
    fn run(&self, frame: &mut [u64], [a, b]: [Operand; 2], to: CellIndex, count: usize) {
        for i in 0..count {
            frame[to + i] = self(frame[a.first + a.step * i], frame[b.first + b.step * i]);
        }
    }
}

fn word(value: u32) -> u64 {
    value.into()
}

pub(super) fn unary(operator: UnaryOperator, of: Scalar) -> Unary {
    match (operator, of) {
        (UnaryOperator::Negate, Scalar::F32) => |a| of_f32(-as_f32(a)),
        (UnaryOperator::BitwiseNot, Scalar::U32) => |a| word(!(a as u32)),
        (UnaryOperator::LogicalNot, Scalar::BOOL) => |a| 1 - a,
        _ => panic!("{operator:?} of {of:?} has no evaluation"),
    }
}

/// How a device computes with f32, where Vulkan or a translator of its shaders leaves a choice.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum FloatMode {
    AsWritten,
    /// Numbers smaller than the least normal one are 0 as operands and as results.
    SubnormalsFlushed,
    /// Products are `fma(a, b, 0)`, as SPIRV-Cross writes them for Metal: where a factor is 0, the product
    /// is +0 whatever the signs.
    ProductsFused,
}

fn flushed(a: f32) -> f32 {
    if a.is_subnormal() { 0.0 } else { a }
}

/// The sum of an exact product and +0, rounded once: -0 becomes +0, but a product that is too small
/// keeps its sign.
fn fused_product(a: f32, b: f32) -> f32 {
    if a == 0.0 || b == 0.0 {
        a * b + 0.0
    } else {
        a * b
    }
}

/// Integers have no bits above their width, and a bool is 0 or 1.
pub(super) fn binary(
    operator: BinaryOperator,
    of: Scalar,
    arithmetic: FloatMode,
) -> &'static dyn Binary {
    use BinaryOperator as Operator;
    /// A closure of two cells, or of their values.
    macro_rules! on {
        ($a:ident $b:ident => $result:expr) => {
            &|$a: u64, $b: u64| $result
        };
        (f32 $a:ident $b:ident => $result:expr) => {
            &|a: u64, b: u64| {
                let ($a, $b) = (as_f32(a), as_f32(b));
                $result
            }
        };
        (flushed $a:ident $b:ident => $result:expr) => {
            on!(f32 a b => {
                let ($a, $b) = (flushed(a), flushed(b));
                of_f32(flushed($result))
            })
        };
    }
    // Comparisons are as they are where no subnormal is left.
    match (arithmetic, operator, of) {
        (FloatMode::SubnormalsFlushed, Operator::Add, Scalar::F32) => {
            return on!(flushed a b => a + b);
        }
        (FloatMode::SubnormalsFlushed, Operator::Subtract, Scalar::F32) => {
            return on!(flushed a b => a - b);
        }
        (FloatMode::SubnormalsFlushed, Operator::Multiply, Scalar::F32) => {
            return on!(flushed a b => a * b);
        }
        (FloatMode::ProductsFused, Operator::Multiply, Scalar::F32) => {
            return on!(f32 a b => of_f32(fused_product(a, b)));
        }
        _ => {}
    }
    match (operator, of) {
        (Operator::Add, Scalar::F32) => on!(f32 a b => of_f32(a + b)),
        (Operator::Subtract, Scalar::F32) => on!(f32 a b => of_f32(a - b)),
        (Operator::Multiply, Scalar::F32) => on!(f32 a b => of_f32(a * b)),
        (Operator::Equal, Scalar::F32) => on!(f32 a b => (a == b).into()),
        (Operator::NotEqual, Scalar::F32) => on!(f32 a b => (a != b).into()),
        (Operator::Less, Scalar::F32) => on!(f32 a b => (a < b).into()),
        (Operator::LessEqual, Scalar::F32) => on!(f32 a b => (a <= b).into()),
        (Operator::Greater, Scalar::F32) => on!(f32 a b => (a > b).into()),
        // Two's complement adds and subtracts signed and unsigned numbers alike.
        (Operator::Add, Scalar::U32 | Scalar::I32) => {
            on!(a b => word((a as u32).wrapping_add(b as u32)))
        }
        (Operator::Subtract, Scalar::U32 | Scalar::I32) => {
            on!(a b => word((a as u32).wrapping_sub(b as u32)))
        }
        (Operator::Multiply, Scalar::U32) => on!(a b => word((a as u32).wrapping_mul(b as u32))),
        // The only divisors are constants.
        (Operator::Divide, Scalar::U32) => on!(a b => a / b),
        (Operator::Equal, Scalar::U32) => on!(a b => (a == b).into()),
        (Operator::NotEqual, Scalar::U32) => on!(a b => (a != b).into()),
        (Operator::Less, Scalar::U32) => on!(a b => (a < b).into()),
        (Operator::LessEqual, Scalar::U32) => on!(a b => (a <= b).into()),
        (Operator::GreaterEqual, Scalar::U32) => on!(a b => (a >= b).into()),
        (Operator::And, Scalar::U32 | Scalar::I32 | Scalar::BOOL) => on!(a b => a & b),
        (Operator::InclusiveOr, Scalar::U32 | Scalar::U64) => on!(a b => a | b),
        (Operator::ExclusiveOr, Scalar::U32) => on!(a b => a ^ b),
        (Operator::ShiftLeft, Scalar::U32) => on!(a b => word((a as u32) << (b & 31))),
        (Operator::ShiftLeft, Scalar::U64) => on!(a b => a << (b & 63)),
        (Operator::ShiftRight, Scalar::U32) => on!(a b => a >> (b & 31)),
        _ => panic!("{operator:?} of {of:?} has no evaluation"),
    }
}

/// A conversion; `None` where the cell stays as it is.
pub(super) fn conversion(from: Scalar, to: Scalar) -> Option<Unary> {
    match (from, to) {
        (Scalar::I32, Scalar::F32) => Some(|a| of_f32(a as u32 as i32 as f32)),
        (Scalar::U32, Scalar::I32 | Scalar::U64) | (Scalar::I32, Scalar::U32) => None,
        _ => panic!("a conversion from {from:?} to {to:?} has no evaluation"),
    }
}

/// What the modes change, and what they leave.
#[test]
fn a_mode_changes_what_it_says() {
    let product = |arithmetic, a: f32, b: f32| {
        let mut frame = [of_f32(a), of_f32(b), 0];
        let operand = |first| Operand { first, step: 0 };
        let multiply = binary(BinaryOperator::Multiply, Scalar::F32, arithmetic);
        multiply.run(&mut frame, [operand(0), operand(1)], 2, 1);
        as_f32(frame[2]).to_bits()
    };
    let tiny = f32::MIN_POSITIVE;
    let [zero, minus_zero] = [0.0f32, -0.0].map(f32::to_bits);
    for (a, b, [written, flushed, fused]) in [
        (-1.0, 0.0, [minus_zero, minus_zero, zero]),
        (0.0, -3.0, [minus_zero, minus_zero, zero]),
        (-tiny, tiny, [minus_zero, minus_zero, minus_zero]),
        (
            tiny,
            0.5,
            [(tiny / 2.0).to_bits(), zero, (tiny / 2.0).to_bits()],
        ),
        (-3.0, 0.5, [(-1.5f32).to_bits(); 3]),
    ] {
        assert_eq!(product(FloatMode::AsWritten, a, b), written, "{a} {b}");
        assert_eq!(
            product(FloatMode::SubnormalsFlushed, a, b),
            flushed,
            "{a} {b}"
        );
        assert_eq!(product(FloatMode::ProductsFused, a, b), fused, "{a} {b}");
    }
}
