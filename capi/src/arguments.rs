//! Pointers and sizes of the caller's, checked before they are used.

use std::ffi::{CStr, c_char, c_void};

use tumble::ash::vk::Handle;

use crate::result::{Failure, TumbleResult};

fn check<T>(pointer: *const T, name: &str) -> Result<(), Failure> {
    if pointer.is_null() {
        let message = format!("`{name}` is null");
        return Err(Failure::new(TumbleResult::InvalidPointer, message));
    }
    if !pointer.is_aligned() {
        let message = format!("`{name}` is not aligned to {} bytes", align_of::<T>());
        return Err(Failure::new(TumbleResult::InvalidPointer, message));
    }
    Ok(())
}

/// The product of `count` and `each`; an error where no memory can have so many numbers.
pub(crate) fn product<T>(count: usize, each: usize, name: &str) -> Result<usize, Failure> {
    let bytes = count
        .checked_mul(each)
        .and_then(|all| all.checked_mul(size_of::<T>()))
        .and_then(|bytes| isize::try_from(bytes).ok());
    match bytes {
        Some(_) => Ok(count * each),
        None => Err(Failure::argument(format!(
            "`{name}` would have {count} × {each} numbers, which no memory holds"
        ))),
    }
}

/// A list of the caller's; none where there is nothing in it, whatever the pointer is.
///
/// # Safety
/// Where `count` is not 0 and `pointer` is neither null nor unaligned, `count` values are there and
/// stay as they are during the call.
pub(crate) unsafe fn list<'a, T: Copy>(
    pointer: *const T,
    count: usize,
    name: &str,
) -> Result<&'a [T], Failure> {
    product::<T>(count, 1, name)?;
    if count == 0 {
        return Ok(&[]);
    }
    check(pointer, name)?;
    // SAFETY: not null, aligned, of a size that can be; the rest is the caller's promise.
    Ok(unsafe { std::slice::from_raw_parts(pointer, count) })
}

/// Numbers of which every pattern of bits is one.
pub(crate) trait Number: Copy {}

impl Number for f32 {}
impl Number for u8 {}
impl Number for u16 {}
impl Number for i32 {}

/// Memory of the caller's for numbers.
///
/// # Safety
/// As [`list`]; nothing else uses the memory during the call.
pub(crate) unsafe fn list_mut<'a, T: Number>(
    pointer: *mut T,
    count: usize,
    name: &str,
) -> Result<&'a mut [T], Failure> {
    product::<T>(count, 1, name)?;
    if count == 0 {
        return Ok(&mut []);
    }
    check(pointer, name)?;
    // SAFETY: as in `list`; every pattern of bits is a number.
    Ok(unsafe { std::slice::from_raw_parts_mut(pointer, count) })
}

/// A handle of Vulkan's that is not null.
pub(crate) fn vulkan<T: Handle>(pointer: *mut c_void, name: &str) -> Result<T, Failure> {
    if pointer.is_null() {
        let message = format!("`{name}` is null");
        return Err(Failure::new(TumbleResult::InvalidPointer, message));
    }
    Ok(T::from_raw(pointer.expose_provenance() as u64))
}

/// A structure of the caller's that begins with its size; `None` where the pointer is null.
///
/// # Safety
/// The pointer is null, unaligned, or that of a structure whose first member is its size in bytes,
/// with so many bytes behind it.
pub(crate) unsafe fn sized<T: Copy>(
    pointer: *const T,
    size: impl FnOnce(*const T) -> *const usize,
    name: &str,
) -> Result<Option<T>, Failure> {
    if pointer.is_null() {
        return Ok(None);
    }
    check(pointer, name)?;
    // SAFETY: aligned and not null; the first member is there in every version of the structure.
    let size = unsafe { size(pointer).read() };
    if size != size_of::<T>() {
        return Err(Failure::argument(format!(
            "`{name}->size` is {size}, and this version's structure has {} bytes; set it to \
             `sizeof`, with the header of the library's version",
            size_of::<T>()
        )));
    }
    // SAFETY: it has the size that this version's has.
    Ok(Some(unsafe { pointer.read() }))
}

/// As [`sized`], and an error where the pointer is null.
///
/// # Safety
/// As [`sized`].
pub(crate) unsafe fn needed<T: Copy>(
    pointer: *const T,
    size: impl FnOnce(*const T) -> *const usize,
    name: &str,
) -> Result<T, Failure> {
    // SAFETY: the caller's promise.
    let found = unsafe { sized(pointer, size, name)? };
    found.ok_or_else(|| {
        let message = format!("`{name}` is null");
        Failure::new(TumbleResult::InvalidPointer, message)
    })
}

/// Text of the caller's; `None` where the pointer is null.
///
/// # Safety
/// The pointer is null, or that of bytes which end with a zero and stay as they are during the call.
pub(crate) unsafe fn text<'a>(
    pointer: *const c_char,
    name: &str,
) -> Result<Option<&'a str>, Failure> {
    if pointer.is_null() {
        return Ok(None);
    }
    // SAFETY: the caller's promise.
    let text = unsafe { CStr::from_ptr(pointer) };
    let text = text.to_str();
    text.map(Some)
        .map_err(|_| Failure::argument(format!("`{name}` is not UTF-8")))
}

/// The destination of a value.
pub(crate) struct Out<T> {
    /// Null where the caller does not ask for the value.
    pointer: *mut T,
}

impl<T> Out<T> {
    /// Checked before the work, so that nothing is done that could not be given.
    pub(crate) fn new(pointer: *mut T, name: &str) -> Result<Self, Failure> {
        check(pointer, name)?;
        Ok(Self { pointer })
    }

    /// As [`Out::new`]; null where the caller does not ask for the value.
    pub(crate) fn optional(pointer: *mut T, name: &str) -> Result<Self, Failure> {
        if pointer.is_null() {
            Ok(Self { pointer })
        } else {
            Self::new(pointer, name)
        }
    }

    /// # Safety
    /// The pointer is that of memory for such a value, which nothing else uses during the call.
    pub(crate) unsafe fn set(self, value: T) {
        if self.pointer.is_null() {
            return;
        }
        // SAFETY: not null and aligned; the rest is the caller's promise. Nothing is dropped that
        // was there before: it may never have been written.
        unsafe { self.pointer.write(value) };
    }
}

/// What a constant of C's stands for.
pub(crate) fn constant<T: Copy>(value: u32, known: &[(u32, T)], name: &str) -> Result<T, Failure> {
    let found = known.iter().find(|&&(code, _)| code == value);
    found.map(|&(_, value)| value).ok_or_else(|| {
        let last = known.len() - 1;
        Failure::argument(format!(
            "`{name}` is {value}; its constants are 0 to {last}"
        ))
    })
}

/// The value of an option, whose constants count all its values from 0.
pub(crate) fn option<T: Copy>(value: u32, all: &[T], name: &str) -> Result<T, Failure> {
    let found = usize::try_from(value).ok().and_then(|index| all.get(index));
    found.copied().ok_or_else(|| {
        let last = all.len() - 1;
        Failure::argument(format!(
            "`{name}` is {value}; its constants are 0 to {last}"
        ))
    })
}

/// What 0 and 1 stand for.
pub(crate) fn flag(value: u32, name: &str) -> Result<bool, Failure> {
    constant(value, &[(0, false), (1, true)], name)
}
