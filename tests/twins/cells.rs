//! Values as cells. A cell holds the bits of one scalar; a vector, an array or a struct is the cells
//! of its parts, one after another.

/// The one NaN of the comparison: IEEE 754 leaves the sign and the payload of a NaN that an operation
/// makes to the processor.
const NAN: u64 = 0x7fc0_0000;

pub(super) fn of_f32(value: f32) -> u64 {
    match value.is_nan() {
        true => NAN,
        false => value.to_bits().into(),
    }
}

pub(super) fn as_f32(cell: u64) -> f32 {
    f32::from_bits(cell as u32)
}

/// What a shader's value is made of.
pub(super) trait Cells {
    fn put(&self, cells: &mut Vec<u64>);
}

impl Cells for f32 {
    fn put(&self, cells: &mut Vec<u64>) {
        cells.push(of_f32(*self));
    }
}

impl Cells for u32 {
    fn put(&self, cells: &mut Vec<u64>) {
        cells.push((*self).into());
    }
}

impl Cells for i32 {
    fn put(&self, cells: &mut Vec<u64>) {
        cells.push((*self as u32).into());
    }
}

impl Cells for u64 {
    fn put(&self, cells: &mut Vec<u64>) {
        cells.push(*self);
    }
}

impl Cells for bool {
    fn put(&self, cells: &mut Vec<u64>) {
        cells.push((*self).into());
    }
}

impl<T: Cells> Cells for [T] {
    fn put(&self, cells: &mut Vec<u64>) {
        for part in self {
            part.put(cells);
        }
    }
}

impl<T: Cells, const N: usize> Cells for [T; N] {
    fn put(&self, cells: &mut Vec<u64>) {
        self.as_slice().put(cells);
    }
}

impl<T: Cells> Cells for Vec<T> {
    fn put(&self, cells: &mut Vec<u64>) {
        self.as_slice().put(cells);
    }
}

macro_rules! tuple {
    ($($part:ident)+) => {
        impl<$($part: Cells),+> Cells for ($($part,)+) {
            #[allow(non_snake_case)] // the parts are named as their types
            fn put(&self, cells: &mut Vec<u64>) {
                let ($($part,)+) = self;
                $($part.put(cells);)+
            }
        }
    };
}
tuple!(A);
tuple!(A B);
tuple!(A B C);
tuple!(A B C D);
tuple!(A B C D E);
tuple!(A B C D E F);
