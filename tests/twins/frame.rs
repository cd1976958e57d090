//! A function made into steps: every expression gets its cells in the function's frame, and everything
//! that is known before it runs is worked out once.
//!
//! Types and the order of evaluation are naga's, as its validator reports them. An expression or a
//! statement that is not known here panics with its text.

use naga::valid::FunctionInfo;
use naga::{
    Block, Expression, Function, Handle, MathFunction, Module, Scalar, Statement, TypeInner,
};

use super::layout::{cells, cells_of, constant, element};
use super::machine::{MachineStep, pointer_to_global};
use super::operations::{CellIndex, FloatMode, Operand, binary, conversion, unary};
use super::program::Compiled;

/// Makes a function of a module into steps; `info` is what the validator found out about it, or about
/// a function whose expressions have the same types.
pub(super) fn compiled(
    module: &Module,
    function: &Function,
    info: &FunctionInfo,
    arithmetic: FloatMode,
) -> Compiled {
    let mut compiler = FunctionCompiler {
        module,
        function,
        info,
        arithmetic,
        start: Vec::new(),
        size: 0,
        indices: vec![None; function.expressions.len()],
        steps: Vec::new(),
    };
    compiler.begin();
    let body = compiler.block(&function.body);
    let mut steps = compiler.steps;
    steps.extend(body);
    let result = function.result.as_ref();
    Compiled {
        name: function.name.clone().unwrap_or_else(|| "main".to_owned()),
        start: compiler.start,
        size: compiler.size,
        result: result.map_or(0, |result| cells_of(module, result.ty)),
        steps,
    }
}

/// A function while it is made into steps.
struct FunctionCompiler<'a> {
    module: &'a Module,
    function: &'a Function,
    info: &'a FunctionInfo,
    arithmetic: FloatMode,
    start: Vec<u64>,
    size: usize,
    /// The first cell of each expression, once it has been evaluated.
    indices: Vec<Option<CellIndex>>,
    steps: Vec<MachineStep>,
}

impl FunctionCompiler<'_> {
    fn ty(&self, at: Handle<Expression>) -> &TypeInner {
        self.info[at].ty.inner_with(&self.module.types)
    }

    fn cells(&self, at: Handle<Expression>) -> usize {
        cells(self.module, self.ty(at))
    }

    fn scalar(&self, at: Handle<Expression>) -> Scalar {
        let ty = self.ty(at);
        ty.scalar()
            .unwrap_or_else(|| panic!("{ty:?} is no scalar or vector"))
    }

    fn index_of(&self, at: Handle<Expression>) -> CellIndex {
        let index = self.indices[at.index()];
        index.unwrap_or_else(|| panic!("used first: {:?}", self.function.expressions[at]))
    }

    /// The index of each of the cells of an expression.
    fn each(&self, at: Handle<Expression>) -> impl Iterator<Item = CellIndex> + use<> {
        let first = self.index_of(at);
        first..first + self.cells(at)
    }

    fn operand(&self, at: Handle<Expression>) -> Operand {
        let step = usize::from(self.cells(at) > 1);
        Operand {
            first: self.index_of(at),
            step,
        }
    }

    /// Arguments, and whatever has a value before the first statement.
    fn begin(&mut self) {
        let (module, function) = (self.module, self.function);
        let mut arguments = Vec::new();
        for argument in &function.arguments {
            arguments.push(self.start.len());
            let count = cells_of(module, argument.ty);
            self.start.resize(self.start.len() + count, 0);
        }
        let mut variables = Vec::new();
        for (_, variable) in function.local_variables.iter() {
            variables.push(self.start.len());
            match variable.init {
                Some(value) => self
                    .start
                    .extend(constant(module, &function.expressions, value)),
                None => {
                    let count = cells_of(module, variable.ty);
                    self.start.resize(self.start.len() + count, 0);
                }
            }
        }
        for (at, expression) in function.expressions.iter() {
            let mut index = self.start.len();
            match *expression {
                Expression::Literal(_) | Expression::Constant(_) | Expression::ZeroValue(_) => {
                    self.start
                        .extend(constant(module, &function.expressions, at));
                }
                Expression::GlobalVariable(global) => {
                    self.start.push(pointer_to_global(global.index()));
                }
                Expression::LocalVariable(variable) => {
                    self.start.push(0);
                    let variable = variables[variable.index()];
                    self.steps.push(MachineStep::Local {
                        variable,
                        to: index,
                    });
                }
                Expression::FunctionArgument(number) => index = arguments[number as usize],
                _ => continue,
            }
            self.indices[at.index()] = Some(index);
        }
        self.size = self.start.len();
    }

    fn block(&mut self, block: &Block) -> Vec<MachineStep> {
        let outer = std::mem::take(&mut self.steps);
        for statement in block {
            self.statement(statement);
        }
        std::mem::replace(&mut self.steps, outer)
    }

    fn statement(&mut self, statement: &Statement) {
        let step = match *statement {
            Statement::Emit(ref range) => {
                for at in range.clone() {
                    self.expression(at);
                }
                return;
            }
            Statement::Block(ref inner) => {
                let steps = self.block(inner);
                self.steps.extend(steps);
                return;
            }
            Statement::If {
                condition,
                ref accept,
                ref reject,
            } => MachineStep::If {
                condition: self.index_of(condition),
                accept: self.block(accept),
                reject: self.block(reject),
            },
            Statement::Loop {
                ref body,
                ref continuing,
                break_if: None,
            } => MachineStep::Loop {
                body: self.block(body),
                continuing: self.block(continuing),
            },
            // An invocation runs alone: what others of its workgroup would leave, trials fill in.
            Statement::ControlBarrier(_) => return,
            Statement::Break => MachineStep::Break,
            Statement::Return { value } => MachineStep::Return {
                from: value.map_or(0, |value| self.index_of(value)),
            },
            Statement::Store { pointer, value } => MachineStep::Store {
                pointer: self.index_of(pointer),
                from: self.index_of(value),
                count: self.cells(value),
            },
            Statement::Call {
                function,
                ref arguments,
                result,
            } => {
                let arguments = arguments
                    .iter()
                    .flat_map(|&argument| self.each(argument))
                    .collect();
                let (to, count) = match result {
                    Some(result) => (self.allocate(result), self.cells(result)),
                    None => (0, 0),
                };
                MachineStep::Call {
                    function: function.index(),
                    arguments,
                    to,
                    count,
                }
            }
            ref other => panic!("{other:?} has no evaluation"),
        };
        self.steps.push(step);
    }

    fn allocate(&mut self, at: Handle<Expression>) -> CellIndex {
        let index = self.size;
        self.indices[at.index()] = Some(index);
        self.size += self.cells(at);
        index
    }

    fn expression(&mut self, at: Handle<Expression>) {
        let function = self.function;
        let expression = &function.expressions[at];
        let count = self.cells(at);
        // A fixed part of a value lies within it.
        if let Expression::AccessIndex { base, index } = *expression
            && self.ty(base).pointer_space().is_none()
        {
            let (offset, ..) = element(self.module, self.ty(base), index as usize);
            self.indices[at.index()] = Some(self.index_of(base) + offset);
            return;
        }
        let to = self.allocate(at);
        let step = match *expression {
            Expression::Compose { ref components, .. } => MachineStep::Compose {
                from: components
                    .iter()
                    .flat_map(|&part| self.each(part))
                    .collect(),
                to,
            },
            Expression::Splat { value, .. } => MachineStep::Compose {
                from: vec![self.index_of(value); count],
                to,
            },
            Expression::Swizzle {
                vector, pattern, ..
            } => {
                let first = self.index_of(vector);
                let from = pattern[..count]
                    .iter()
                    .map(|&component| first + component as usize);
                MachineStep::Compose {
                    from: from.collect(),
                    to,
                }
            }
            Expression::AccessIndex { base, index } => {
                let (by, ..) = element(self.module, self.pointee(base), index as usize);
                MachineStep::Advance {
                    base: self.index_of(base),
                    by,
                    to,
                }
            }
            Expression::Access { base, index } => {
                let is_value = self.ty(base).pointer_space().is_none();
                let ty = if is_value {
                    self.ty(base)
                } else {
                    self.pointee(base)
                };
                let (_, count, of) = element(self.module, ty, 0);
                let (base, index) = (self.index_of(base), self.index_of(index));
                match is_value {
                    true => MachineStep::Element {
                        base,
                        index,
                        of,
                        to,
                        count,
                    },
                    false => MachineStep::Point {
                        base,
                        index,
                        of,
                        to,
                        count,
                    },
                }
            }
            Expression::Load { pointer } => MachineStep::Load {
                pointer: self.index_of(pointer),
                to,
                count,
            },
            Expression::ImageLoad {
                image,
                coordinate,
                array_index: None,
                sample: None,
                ..
            } => MachineStep::Texel {
                buffer: self.index_of(image),
                index: self.index_of(coordinate),
                to,
            },
            Expression::Unary { op, expr } => {
                let work = unary(op, self.scalar(expr));
                MachineStep::Unary {
                    work,
                    from: self.index_of(expr),
                    to,
                    count,
                }
            }
            Expression::Binary { op, left, right } => {
                let work = binary(op, self.scalar(left), self.arithmetic);
                MachineStep::Binary {
                    work,
                    operands: [self.operand(left), self.operand(right)],
                    to,
                    count,
                }
            }
            Expression::Select {
                condition,
                accept,
                reject,
            } => MachineStep::Select {
                condition: self.operand(condition),
                accept: self.index_of(accept),
                reject: self.index_of(reject),
                to,
                count,
            },
            Expression::As { expr, convert, .. } => {
                let from = self.index_of(expr);
                let work = convert.and_then(|_| conversion(self.scalar(expr), self.scalar(at)));
                match work {
                    Some(work) => MachineStep::Unary {
                        work,
                        from,
                        to,
                        count,
                    },
                    None => MachineStep::Compose {
                        from: (from..from + count).collect(),
                        to,
                    },
                }
            }
            Expression::Math {
                fun: MathFunction::CountOneBits,
                arg,
                ..
            } => MachineStep::Unary {
                work: |bits| (bits as u32).count_ones().into(),
                from: self.index_of(arg),
                to,
                count,
            },
            Expression::ArrayLength(pointer) => {
                let (_, stride, _) = element(self.module, self.pointee(pointer), 0);
                MachineStep::ArrayLength {
                    pointer: self.index_of(pointer),
                    to,
                    stride,
                }
            }
            ref other => panic!("{other:?} has no evaluation"),
        };
        self.steps.push(step);
    }

    /// What a pointer points to.
    fn pointee(&self, pointer: Handle<Expression>) -> &TypeInner {
        match *self.ty(pointer) {
            TypeInner::Pointer { base, .. } => &self.module.types[base].inner,
            ref vector => vector,
        }
    }
}
