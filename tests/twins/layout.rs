//! How values lie in cells.

use naga::{Arena, ArraySize, Expression, Handle, Literal, Module, Type, TypeInner};

use super::cells::Cells as _;
use super::machine::MANY;

pub(super) fn cells_of(module: &Module, ty: Handle<Type>) -> usize {
    cells(module, &module.types[ty].inner)
}

/// The number of cells of a value.
pub(super) fn cells(module: &Module, ty: &TypeInner) -> usize {
    let of = |ty| cells_of(module, ty);
    match *ty {
        TypeInner::Scalar(_)
        | TypeInner::Pointer { .. }
        | TypeInner::ValuePointer { .. }
        | TypeInner::Image { .. } => 1,
        TypeInner::Vector { size, .. } => size as usize,
        TypeInner::Array {
            base,
            size: ArraySize::Constant(count),
            ..
        } => count.get() as usize * of(base),
        TypeInner::Struct { ref members, .. } => members.iter().map(|member| of(member.ty)).sum(),
        ref other => panic!("{other:?} has no cells"),
    }
}

/// An element of a vector, an array or a struct: where it lies, its number of cells, and how many
/// there are.
pub(super) fn element(module: &Module, ty: &TypeInner, index: usize) -> (usize, usize, usize) {
    let of = |ty| cells_of(module, ty);
    match *ty {
        TypeInner::Vector { size, .. }
        | TypeInner::ValuePointer {
            size: Some(size), ..
        } => (index, 1, size as usize),
        TypeInner::Array { base, size, .. } => {
            let fixed = match size {
                ArraySize::Constant(count) => count.get() as usize,
                _ => MANY,
            };
            (index * of(base), of(base), fixed)
        }
        TypeInner::Struct { ref members, .. } => {
            let before = members[..index].iter().map(|member| of(member.ty)).sum();
            (before, of(members[index].ty), members.len())
        }
        ref other => panic!("{other:?} has no elements"),
    }
}

/// The cells of an expression that is known without running anything.
pub(super) fn constant(
    module: &Module,
    expressions: &Arena<Expression>,
    at: Handle<Expression>,
) -> Vec<u64> {
    let mut all = Vec::new();
    match expressions[at] {
        Expression::Literal(Literal::F32(value)) => value.put(&mut all),
        Expression::Literal(Literal::U32(value)) => value.put(&mut all),
        Expression::Literal(Literal::I32(value)) => value.put(&mut all),
        Expression::Literal(Literal::U64(value)) => value.put(&mut all),
        Expression::Literal(Literal::Bool(value)) => value.put(&mut all),
        Expression::Constant(named) => {
            return constant(
                module,
                &module.global_expressions,
                module.constants[named].init,
            );
        }
        Expression::ZeroValue(ty) => all.resize(cells_of(module, ty), 0),
        Expression::Compose { ref components, .. } => {
            return components
                .iter()
                .flat_map(|&part| constant(module, expressions, part))
                .collect();
        }
        Expression::Splat { size, value } => {
            return constant(module, expressions, value).repeat(size as usize);
        }
        ref other => panic!("{other:?} is no constant"),
    }
    all
}
