//! Arrays of `NumPy`, sparse matrices of `SciPy` and arrays of chumpy, as their pickles store them.

use std::borrow::Cow;

use crate::array::{ArrayHeader, Element, element, shape_text};
use crate::diagnostic::{Code, Diagnostic};
use crate::npz::array as stored;
use crate::pickle::globals::{ClassName, shown};
use crate::pickle::machine::{Array, Data, Inert, Machine, Node, NodeId};

/// An object whose state follows.
#[derive(Debug, Clone, Copy)]
pub(in crate::pickle) enum Unbuilt {
    NumpyArray,
    JoblibArray,
    Sparse,
    Chumpy,
}

/// The type of an array's elements.
#[derive(Debug, Clone)]
pub(in crate::pickle) struct Dtype {
    element: Element,
    is_big_endian: bool,
}

impl Machine<'_> {
    pub(in crate::pickle) fn numpy_dtype(&self, name: NodeId) -> Result<Node, Diagnostic> {
        let name = self.text(name);
        let name = name.ok_or_else(|| self.damaged("the type of an array has no name"))?;
        let (element, is_big_endian) = match element(&name) {
            Ok(found) => found,
            Err(_) => (Element::Other(shown(&name)), false),
        };
        Ok(Node::Dtype(Box::new(Dtype {
            element,
            is_big_endian,
        })))
    }

    /// The state of a type: (3, byte order, subtype, names, fields, size, alignment, flags).
    pub(in crate::pickle) fn build_dtype(
        &mut self,
        target: NodeId,
        state: NodeId,
    ) -> Result<(), Diagnostic> {
        let (order, subtype, names) = match self.items(state) {
            Some(&[_, order, subtype, names, ..]) => (order, subtype, names),
            _ => return Err(self.damaged("the type of an array has another state")),
        };
        let is_none = |node| matches!(self.value(node), Some(Node::None));
        let is_plain = is_none(subtype) && is_none(names);
        let is_big_endian = self.text(order).is_some_and(|order| order == ">");
        let mut dtype = self.dtype(target)?;
        dtype.is_big_endian |= is_big_endian;
        if !is_plain {
            dtype.element = Element::Other("records".to_owned());
        }
        self.set(target, Node::Dtype(Box::new(dtype)));
        Ok(())
    }

    pub(in crate::pickle) fn dtype(&self, node: NodeId) -> Result<Dtype, Diagnostic> {
        match self.value(node) {
            Some(Node::Dtype(dtype)) => Ok(Dtype::clone(dtype)),
            _ => Err(self.damaged("an array has no type")),
        }
    }

    /// `numpy.core.multiarray.scalar`: a number with a type.
    pub(in crate::pickle) fn numpy_scalar(
        &self,
        dtype: NodeId,
        value: NodeId,
    ) -> Result<Node, Diagnostic> {
        let dtype = self.dtype(dtype)?;
        if dtype.is_object() {
            return Ok(Node::Same(value));
        }
        let data = self.array_data(value)?;
        self.new_array(dtype, Vec::new(), false, data)
    }

    /// `numpy.core.numeric._frombuffer`: how protocol 5 stores arrays.
    pub(in crate::pickle) fn numpy_from_buffer(
        &self,
        buffer: NodeId,
        dtype: NodeId,
        shape: NodeId,
        order: NodeId,
    ) -> Result<Node, Diagnostic> {
        let is_fortran = self.text(order).is_some_and(|order| order == "F");
        let (dtype, shape) = (self.dtype(dtype)?, self.lengths(shape)?);
        let data = self.array_data(buffer)?;
        self.new_array(dtype, shape, is_fortran, data)
    }

    /// The state of an array: (version, shape, type, whether in Fortran's order, bytes or a list of objects).
    pub(in crate::pickle) fn build_numpy_array(
        &mut self,
        state: NodeId,
    ) -> Result<Node, Diagnostic> {
        let (shape, dtype, order, data) = match self.items(state) {
            Some(&[_, shape, dtype, order, data]) | Some(&[shape, dtype, order, data]) => {
                (shape, dtype, order, data)
            }
            _ => {
                return Err(self.damaged(
                    "the state of an array is not its version, shape, type, order and data",
                ));
            }
        };
        let (shape, dtype) = (self.lengths(shape)?, self.dtype(dtype)?);
        if !dtype.is_object() {
            let is_fortran = self.int(order) == Some(1);
            self.check_type(&dtype)?;
            let data = self.array_data(data)?;
            return self.new_array(dtype, shape, is_fortran, data);
        }
        let items = self.items(data);
        let items = items.ok_or_else(|| self.damaged("an array of objects has no list of them"))?;
        let count = shape
            .iter()
            .try_fold(1usize, |n, &length| n.checked_mul(length));
        if count != Some(items.len()) {
            let message = format!(
                "an array of shape {} has {} objects",
                shape_text(&shape),
                items.len()
            );
            return Err(self.damaged(message));
        }
        match (&*shape, items) {
            // An array of one object, as `numpy.save` stores a dict: only the object is kept.
            ([], &[only]) => Ok(Node::Same(only)),
            ([_, rows @ ..], _) if !rows.is_empty() && count != Some(0) => {
                let items = items.to_vec();
                self.charge(items.len(), size_of::<NodeId>())?;
                self.rows(items, rows)
            }
            _ => Ok(Node::Same(data)),
        }
    }

    /// Lists of lists, from objects in C order and the lengths of all axes but the first.
    fn rows(&mut self, objects: Vec<NodeId>, lengths: &[usize]) -> Result<Node, Diagnostic> {
        let mut level = objects;
        for &length in lengths.iter().rev() {
            self.charge(level.len(), size_of::<NodeId>())?;
            let rows = level.chunks(length).map(<[NodeId]>::to_vec);
            let rows: Vec<Vec<NodeId>> = rows.collect();
            level = rows
                .into_iter()
                .map(|row| self.new_node(Node::List(row)))
                .collect::<Result<_, _>>()?;
        }
        Ok(Node::List(level))
    }

    /// An array, whose bytes must be as many as its shape and its type say.
    pub(in crate::pickle) fn new_array(
        &self,
        dtype: Dtype,
        shape: Vec<usize>,
        is_fortran: bool,
        data: Data,
    ) -> Result<Node, Diagnostic> {
        let header = self.array_header(dtype, shape, is_fortran)?;
        if header.byte_count() != Some(data.len()) {
            let message = format!("an array {header} has {} bytes", data.len());
            return Err(self.damaged(message));
        }
        self.charge(1, size_of::<Array>() + 8 * header.shape.len())?;
        Ok(Node::Array(Box::new(Array { header, data })))
    }

    /// The header of an array of numbers or texts.
    pub(in crate::pickle) fn array_header(
        &self,
        dtype: Dtype,
        shape: Vec<usize>,
        is_fortran: bool,
    ) -> Result<ArrayHeader, Diagnostic> {
        self.check_type(&dtype)?;
        Ok(ArrayHeader {
            element: dtype.element,
            is_big_endian: dtype.is_big_endian,
            is_fortran,
            shape,
            start: 0,
        })
    }

    /// Refuses records and others that are neither numbers nor texts.
    fn check_type(&self, dtype: &Dtype) -> Result<(), Diagnostic> {
        if dtype.element.size().is_some() {
            return Ok(());
        }
        let message = format!(
            "an array of {} is not read; save one of numbers (f2 to f8, i1 to i8, u1 to u8, bool) \
             or texts",
            dtype.element
        );
        Err(self.refuse(Code::PickleType, message))
    }

    /// The bytes of an array.
    fn array_data(&self, node: NodeId) -> Result<Data, Diagnostic> {
        let data = self.bytes(node);
        let data = data.ok_or_else(|| self.damaged("the data of an array are no bytes"))?;
        if let Data::Decoded(bytes) = data {
            self.charge(1, bytes.len())?;
        }
        Ok(data.clone())
    }

    /// A matrix by columns: for each column, where its entries begin; of each entry, its row and its value. It becomes
    /// a full matrix.
    pub(in crate::pickle) fn build_sparse(&self, state: NodeId) -> Result<Node, Diagnostic> {
        let numbers = |name: &str| match self.value(self.get(state, name)?)? {
            Node::Array(array) => self.numbers(array).ok(),
            _ => None,
        };
        let shape = self.get(state, "_shape").or(self.get(state, "shape"));
        let shape = shape.and_then(|shape| self.lengths(shape).ok());
        let wrong = || self.damaged("the state of a sparse matrix does not fit its shape");
        let (Some(shape), Some(values), Some(rows), Some(starts)) = (
            shape,
            numbers("data"),
            numbers("indices"),
            numbers("indptr"),
        ) else {
            return Err(wrong());
        };
        let &[height, width] = &*shape else {
            return Err(wrong());
        };
        let count = height.saturating_mul(width);
        self.charge(count, size_of::<f64>())?;
        if width.checked_add(1) != Some(starts.len()) || rows.len() != values.len() {
            return Err(wrong());
        }
        let mut full = vec![0.0f64; count];
        for (column, ends) in starts.windows(2).enumerate() {
            let entries = ends[0] as usize..ends[1] as usize;
            let (Some(rows), Some(values)) = (rows.get(entries.clone()), values.get(entries))
            else {
                return Err(wrong());
            };
            for (&row, value) in rows.iter().zip(values) {
                if row < 0.0 || row >= height as f64 {
                    return Err(wrong());
                }
                full[row as usize * width + column] += value;
            }
        }
        let dtype = Dtype {
            element: Element::F64,
            is_big_endian: false,
        };
        let bytes = full
            .iter()
            .flat_map(|number| number.to_le_bytes())
            .collect();
        self.new_array(dtype, shape, false, self.decoded(bytes)?)
    }

    /// The numbers of an array.
    fn numbers(&self, array: &Array) -> Result<Vec<f64>, Diagnostic> {
        self.charge(array.data.len(), size_of::<f64>())?;
        let array = stored::Array {
            header: &array.header,
            bytes: Cow::Borrowed(array.data.bytes(self.input)),
        };
        let numbers = array.numbers();
        numbers.ok_or_else(|| self.damaged("an array of texts stands for one of numbers"))
    }

    /// The state of an array of chumpy, whose values are `x`.
    pub(in crate::pickle) fn build_chumpy(&self, state: NodeId) -> Result<Node, Diagnostic> {
        Ok(match self.get(state, "x") {
            Some(values) => Node::Same(values),
            // Without `x`, the object is a formula of chumpy, which is not evaluated.
            None => Node::Inert(Box::new(Inert {
                class: ClassName {
                    module: "chumpy.ch".to_owned(),
                    name: "Ch".to_owned(),
                },
                arguments: state,
                state: None,
            })),
        })
    }
}

impl Dtype {
    pub(in crate::pickle) fn is_object(&self) -> bool {
        self.element == Element::Object
    }

    pub(in crate::pickle) fn of(element: Element) -> Self {
        Self {
            element,
            is_big_endian: false,
        }
    }
}
