//! The operations on scalars that shaders use, each of one IEEE 754 operation or of integers. What is
//! not here is refused by name.

use naga::{BinaryOperator, Scalar, UnaryOperator};

use super::cells::{as_f32, of_f32};

/// Where the cells of a value lie in the frame of its function.
pub(super) type Place = usize;

/// An operand of an operation on several cells; `step` is 0 where all of them use the same one.
#[derive(Clone, Copy)]
pub(super) struct Operand {
    pub(super) place: Place,
    pub(super) step: usize,
}

pub(super) type Unary = fn(u64) -> u64;

/// An operation on two scalars, done for so many cells of a frame: one call for all of them.
pub(super) trait Binary {
    fn run(&self, frame: &mut [u64], operands: [Operand; 2], to: Place, count: usize);
}

impl<F: Fn(u64, u64) -> u64> Binary for F {
    fn run(&self, frame: &mut [u64], [a, b]: [Operand; 2], to: Place, count: usize) {
        for i in 0..count {
            frame[to + i] = self(frame[a.place + a.step * i], frame[b.place + b.step * i]);
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

pub(super) fn binary(operator: BinaryOperator, of: Scalar) -> &'static dyn Binary {
    use BinaryOperator as Operator;
    match (operator, of) {
        (Operator::Add, Scalar::F32) => &|a: u64, b: u64| of_f32(as_f32(a) + as_f32(b)),
        (Operator::Subtract, Scalar::F32) => &|a: u64, b: u64| of_f32(as_f32(a) - as_f32(b)),
        (Operator::Multiply, Scalar::F32) => &|a: u64, b: u64| of_f32(as_f32(a) * as_f32(b)),
        (Operator::Equal, Scalar::F32) => &|a: u64, b: u64| u64::from(as_f32(a) == as_f32(b)),
        (Operator::NotEqual, Scalar::F32) => &|a: u64, b: u64| u64::from(as_f32(a) != as_f32(b)),
        (Operator::Less, Scalar::F32) => &|a: u64, b: u64| u64::from(as_f32(a) < as_f32(b)),
        (Operator::LessEqual, Scalar::F32) => &|a: u64, b: u64| u64::from(as_f32(a) <= as_f32(b)),
        (Operator::Greater, Scalar::F32) => &|a: u64, b: u64| u64::from(as_f32(a) > as_f32(b)),
        (Operator::GreaterEqual, Scalar::F32) => {
            &|a: u64, b: u64| u64::from(as_f32(a) >= as_f32(b))
        }
        // Two's complement adds, subtracts and multiplies signed and unsigned numbers alike.
        (Operator::Add, Scalar::U32 | Scalar::I32) => {
            &|a: u64, b: u64| word((a as u32).wrapping_add(b as u32))
        }
        (Operator::Subtract, Scalar::U32 | Scalar::I32) => {
            &|a: u64, b: u64| word((a as u32).wrapping_sub(b as u32))
        }
        (Operator::Multiply, Scalar::U32 | Scalar::I32) => {
            &|a: u64, b: u64| word((a as u32).wrapping_mul(b as u32))
        }
        // The only divisors are constants.
        (Operator::Divide, Scalar::U32) => &|a: u64, b: u64| a / b,
        (Operator::Less, Scalar::U32) => &|a: u64, b: u64| u64::from(a < b),
        (Operator::LessEqual, Scalar::U32) => &|a: u64, b: u64| u64::from(a <= b),
        (Operator::Greater, Scalar::U32) => &|a: u64, b: u64| u64::from(a > b),
        (Operator::GreaterEqual, Scalar::U32) => &|a: u64, b: u64| u64::from(a >= b),
        (Operator::Equal, Scalar::U32 | Scalar::I32 | Scalar::BOOL) => {
            &|a: u64, b: u64| u64::from(a == b)
        }
        (Operator::NotEqual, Scalar::U32 | Scalar::I32 | Scalar::BOOL) => {
            &|a: u64, b: u64| u64::from(a != b)
        }
        // Integers have no bits above their width, and a bool is 0 or 1.
        (Operator::And, Scalar::U32 | Scalar::I32 | Scalar::U64 | Scalar::BOOL) => {
            &|a: u64, b: u64| a & b
        }
        (Operator::InclusiveOr, Scalar::U32 | Scalar::I32 | Scalar::U64 | Scalar::BOOL) => {
            &|a: u64, b: u64| a | b
        }
        (Operator::ExclusiveOr, Scalar::U32 | Scalar::I32) => &|a: u64, b: u64| a ^ b,
        (Operator::LogicalAnd, Scalar::BOOL) => &|a: u64, b: u64| a & b,
        (Operator::LogicalOr, Scalar::BOOL) => &|a: u64, b: u64| a | b,
        (Operator::ShiftLeft, Scalar::U32) => &|a: u64, b: u64| word((a as u32) << (b & 31)),
        (Operator::ShiftLeft, Scalar::U64) => &|a: u64, b: u64| a << (b & 63),
        (Operator::ShiftRight, Scalar::U32) => &|a: u64, b: u64| a >> (b & 31),
        _ => panic!("{operator:?} of {of:?} has no evaluation"),
    }
}

/// A conversion; `None` where the bits stay.
pub(super) fn conversion(from: Scalar, to: Scalar) -> Option<Unary> {
    match (from, to) {
        (Scalar::I32, Scalar::F32) => Some(|a| of_f32(a as u32 as i32 as f32)),
        (Scalar::U32, Scalar::F32) => Some(|a| of_f32(a as u32 as f32)),
        (Scalar::U32, Scalar::I32 | Scalar::U64) | (Scalar::I32, Scalar::U32) => None,
        _ => panic!("a conversion from {from:?} to {to:?} has no evaluation"),
    }
}
