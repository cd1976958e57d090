//! Memory for the values of a result in an encoding.

use crate::output::encoding::Encoding;

/// Memory for consecutive values of a result, and their encoding.
pub(crate) struct EncodedOutput<'o> {
    pub(crate) encoding: Encoding,
    /// As long as its values are in this encoding.
    pub(crate) bytes: &'o mut [u8],
}

impl<'o> EncodedOutput<'o> {
    /// Memory for values of four f32.
    pub(crate) fn of_values(values: &'o mut [[f32; 4]]) -> Self {
        Self {
            encoding: Encoding::F32,
            bytes: bytemuck::cast_slice_mut(values),
        }
    }

    /// The number of values.
    pub(crate) fn len(&self) -> usize {
        self.bytes.len() / self.encoding.bytes()
    }

    /// Takes the first values out of it.
    pub(crate) fn split_off(&mut self, count: usize) -> Self {
        let bytes = self.bytes.split_off_mut(..count * self.encoding.bytes());
        Self {
            encoding: self.encoding,
            bytes: bytes.unwrap_or_default(),
        }
    }

    /// The memory as values of four f32; itself if the encoding is another, or the memory is not aligned.
    pub(crate) fn into_values(self) -> Result<&'o mut [[f32; 4]], Self> {
        let is_f32 = self.encoding == Encoding::F32;
        match bytemuck::try_cast_slice::<u8, [f32; 4]>(self.bytes).is_ok() && is_f32 {
            true => Ok(bytemuck::cast_slice_mut(self.bytes)),
            false => Err(self),
        }
    }

    /// Stores values, which are as many as there is memory for.
    pub(crate) fn store(self, values: &[[f32; 4]]) {
        self.encoding.encode_all(values, self.bytes);
    }

    /// Fills the memory by a function that makes values of four f32: directly, or in other memory and encoded from
    /// there.
    pub(crate) fn fill<E>(
        self,
        make: impl FnOnce(&mut [[f32; 4]]) -> Result<(), E>,
    ) -> Result<(), E> {
        match self.into_values() {
            Ok(values) => make(values),
            Err(encoded) => {
                let mut values = vec![[0.0; 4]; encoded.len()];
                make(&mut values)?;
                encoded.store(&values);
                Ok(())
            }
        }
    }
}
