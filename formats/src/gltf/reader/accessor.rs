//! Reads accessors: bytes as numbers.

use crate::diagnostic::{Code, Diagnostic};
use crate::gltf::reader::GltfReader;
use crate::gltf::schema::{Accessor, Sparse};

/// The type of a stored number, by its OpenGL constant.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum ComponentType {
    I8,
    U8,
    I16,
    U16,
    U32,
    F32,
}

impl ComponentType {
    fn of(constant: u32) -> Option<Self> {
        Some(match constant {
            5120 => Self::I8,
            5121 => Self::U8,
            5122 => Self::I16,
            5123 => Self::U16,
            5125 => Self::U32,
            5126 => Self::F32,
            _ => return None,
        })
    }

    fn size(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::U32 | Self::F32 => 4,
        }
    }

    /// The fraction that a normalised integer stands for (glTF 2.0, 3.11).
    fn fraction(self, number: f64) -> f64 {
        match self {
            Self::I8 => (number / 127.0).max(-1.0),
            Self::U8 => number / 255.0,
            Self::I16 => (number / 32_767.0).max(-1.0),
            Self::U16 => number / 65_535.0,
            Self::U32 | Self::F32 => number,
        }
    }
}

/// Bytes of elements of one type.
struct Elements<'a> {
    bytes: &'a [u8],
    stride: usize,
    count: usize,
    component: ComponentType,
    width: usize,
}

impl Elements<'_> {
    fn numbers(&self) -> Vec<f64> {
        match self.component {
            ComponentType::I8 => self.each(|bytes| f64::from(i8::from_le_bytes(bytes))),
            ComponentType::U8 => self.each(|bytes| f64::from(u8::from_le_bytes(bytes))),
            ComponentType::I16 => self.each(|bytes| f64::from(i16::from_le_bytes(bytes))),
            ComponentType::U16 => self.each(|bytes| f64::from(u16::from_le_bytes(bytes))),
            ComponentType::U32 => self.each(|bytes| f64::from(u32::from_le_bytes(bytes))),
            ComponentType::F32 => self.each(|bytes| f64::from(f32::from_le_bytes(bytes))),
        }
    }

    /// The numbers that `number` makes of the bytes of each component.
    fn each<const SIZE: usize>(&self, number: impl Fn([u8; SIZE]) -> f64) -> Vec<f64> {
        let used = self.width * SIZE;
        let mut numbers = Vec::with_capacity(self.count * self.width);
        let mut add = |bytes: &[u8]| {
            numbers.extend(bytes.as_chunks().0.iter().map(|bytes| number(*bytes)));
        };
        if self.stride == used {
            add(&self.bytes[..self.count * used]);
        } else {
            for element in self.bytes.chunks(self.stride).take(self.count) {
                add(&element[..used]);
            }
        }
        numbers
    }
}

/// The name in glTF of elements with this number of components.
fn kind(width: usize) -> &'static str {
    match width {
        1 => "SCALAR",
        2 => "VEC2",
        3 => "VEC3",
        4 => "VEC4",
        _ => "MAT4",
    }
}

impl<'a> GltfReader<'a> {
    /// An accessor; `from` is the JSON pointer of the value that names it.
    ///
    /// # Errors
    /// When there is no such accessor, or when it lacks a property.
    pub(in crate::gltf) fn accessor(
        &self,
        index: usize,
        from: &str,
    ) -> Result<Accessor, Diagnostic> {
        self.json.entry("accessors", index, from)
    }

    /// The numbers of an accessor whose elements have `width` components, one element after another: floats or
    /// normalized integers. `from` is the JSON pointer of the value that names it.
    ///
    /// # Errors
    /// When the accessor is of another type, when its bytes are missing, or when its sparse indices are out of range.
    pub(in crate::gltf) fn numbers(
        &self,
        index: usize,
        accessor: &Accessor,
        width: usize,
        from: &str,
    ) -> Result<Vec<f64>, Diagnostic> {
        self.numbers_of(index, accessor, (width, true), from)
    }

    /// The times of an accessor, which are floats.
    ///
    /// # Errors
    /// As [`GltfReader::numbers`].
    pub(in crate::gltf) fn times(
        &self,
        index: usize,
        accessor: &Accessor,
        from: &str,
    ) -> Result<Vec<f64>, Diagnostic> {
        self.numbers_of(index, accessor, (1, false), from)
    }

    fn numbers_of(
        &self,
        index: usize,
        accessor: &Accessor,
        (width, takes_fractions): (usize, bool),
        from: &str,
    ) -> Result<Vec<f64>, Diagnostic> {
        let kind = kind(width);
        let component = ComponentType::of(accessor.component_type).filter(|component| {
            let is_fraction = accessor.normalized && component.size() < 4 && takes_fractions;
            *component == ComponentType::F32 || is_fraction
        });
        let Some(component) = component.filter(|_| accessor.kind == kind) else {
            let normalized = if accessor.normalized {
                ", normalized"
            } else {
                ""
            };
            let or = if takes_fractions {
                " or normalized integers"
            } else {
                ""
            };
            let message = format!(
                "accessor {index} has {} of component type {}{normalized}; this needs {kind} of \
                 floats (5126){or}",
                accessor.kind, accessor.component_type
            );
            return Err(self.json.refuse(from, Code::AccessorType, message));
        };
        let pointer = format!("/accessors/{index}");
        let mut numbers: Vec<f64> = match accessor.buffer_view {
            Some(view) => {
                let named = format!("{pointer}/bufferView");
                let range = (view, accessor.byte_offset, accessor.count);
                let elements = self.elements(range, (component, width), (&pointer, &named))?;
                elements.numbers()
            }
            None if self.fits(accessor.count) => vec![0.0; accessor.count as usize * width],
            None => {
                let message = format!(
                    "{} elements and no buffer view; the file is shorter than that",
                    accessor.count
                );
                return Err(self.json.refuse(&pointer, Code::TooShort, message));
            }
        };
        if let Some(sparse) = &accessor.sparse {
            self.replace(&mut numbers, sparse, (component, width), &pointer)?;
        }
        if accessor.normalized {
            for number in &mut numbers {
                *number = component.fraction(*number);
            }
        }
        Ok(numbers)
    }

    /// The indices of an accessor of unsigned integers, which must not be sparse.
    ///
    /// # Errors
    /// When the accessor is of another type, or when its bytes are missing.
    pub(in crate::gltf) fn indices(
        &self,
        index: usize,
        accessor: &Accessor,
        from: &str,
    ) -> Result<Vec<u32>, Diagnostic> {
        self.whole_numbers(index, accessor, 1, from)
    }

    /// As [`GltfReader::indices`], for elements of `width` numbers.
    ///
    /// # Errors
    /// As there.
    pub(in crate::gltf) fn whole_numbers(
        &self,
        index: usize,
        accessor: &Accessor,
        width: usize,
        from: &str,
    ) -> Result<Vec<u32>, Diagnostic> {
        let component = ComponentType::of(accessor.component_type).filter(|listed| {
            let is_index = matches!(
                listed,
                ComponentType::U8 | ComponentType::U16 | ComponentType::U32
            );
            is_index && accessor.kind == kind(width) && accessor.sparse.is_none()
        });
        let (Some(component), Some(view)) = (component, accessor.buffer_view) else {
            let message = format!(
                "accessor {index} has {} of component type {}; indices are unsigned integers in a \
                 buffer view",
                accessor.kind, accessor.component_type
            );
            return Err(self.json.refuse(from, Code::AccessorType, message));
        };
        let pointer = format!("/accessors/{index}");
        let named = format!("{pointer}/bufferView");
        let range = (view, accessor.byte_offset, accessor.count);
        let elements = self.elements(range, (component, width), (&pointer, &named))?;
        let numbers = elements.numbers();
        Ok(numbers.into_iter().map(|number| number as u32).collect())
    }

    /// Overwrites values by those of a sparse accessor.
    fn replace(
        &self,
        numbers: &mut [f64],
        sparse: &Sparse,
        (component, width): (ComponentType, usize),
        accessor: &str,
    ) -> Result<(), Diagnostic> {
        let pointer = format!("{accessor}/sparse/indices");
        let refuse = |message| self.json.refuse(&pointer, Code::Sparse, message);
        let indices = &sparse.indices;
        let unsigned = ComponentType::of(indices.component_type).filter(|component| {
            matches!(
                component,
                ComponentType::U8 | ComponentType::U16 | ComponentType::U32
            )
        });
        let Some(unsigned) = unsigned else {
            let message = format!(
                "indices of component type {}; they are unsigned integers",
                indices.component_type
            );
            return Err(refuse(message));
        };
        let named = format!("{pointer}/bufferView");
        let range = (indices.buffer_view, indices.byte_offset, sparse.count);
        let indices = self.elements(range, (unsigned, 1), (&pointer, &named))?;
        let values_pointer = format!("{accessor}/sparse/values");
        let named = format!("{values_pointer}/bufferView");
        let values_range = (
            sparse.values.buffer_view,
            sparse.values.byte_offset,
            sparse.count,
        );
        let values = self
            .elements(values_range, (component, width), (&values_pointer, &named))?
            .numbers();
        let mut before = None;
        for (index, value) in indices
            .numbers()
            .into_iter()
            .zip(values.chunks_exact(width))
        {
            let index = index as usize;
            let count = numbers.len() / width;
            if index >= count || before.is_some_and(|before| index <= before) {
                let message = format!(
                    "index {index} of {count} elements; indices must increase and be less than {count}"
                );
                return Err(refuse(message));
            }
            numbers[index * width..][..width].copy_from_slice(value);
            before = Some(index);
        }
        Ok(())
    }

    /// Elements of a buffer view: `(view, offset, count)` is the view, the offset of the first element and their
    /// number; `(pointer, named)` are the JSON pointers of their description and of the name of the view.
    fn elements(
        &self,
        (view, offset, count): (usize, u64, u64),
        (component, width): (ComponentType, usize),
        (pointer, named): (&str, &str),
    ) -> Result<Elements<'_>, Diagnostic> {
        let found = self.view(view, named)?;
        let size = component.size() * width;
        let stride = found.stride.unwrap_or(size);
        if stride < size {
            let message =
                format!("the stride, {stride} bytes, is less than an element, {size} bytes");
            return Err(self
                .json
                .refuse(&format!("/bufferViews/{view}"), Code::Property, message));
        }
        let needed = match count.checked_sub(1) {
            Some(before) => u128::from(offset) + u128::from(before) * stride as u128 + size as u128,
            None => 0,
        };
        if needed > found.bytes.len() as u128 {
            let message = format!(
                "{count} elements of {size} bytes from byte {offset} on need {needed} bytes of \
                 buffer view {view}, which has {}",
                found.bytes.len()
            );
            return Err(self.json.refuse(pointer, Code::TooShort, message));
        }
        Ok(Elements {
            bytes: &found.bytes[(offset as usize).min(found.bytes.len())..],
            stride,
            count: count as usize,
            component,
            width,
        })
    }
}
