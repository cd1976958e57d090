//! The caller's pointers and sizes, checked before they are used.

use std::ffi::{CStr, c_char, c_void};
use std::mem::MaybeUninit;

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

/// The product of `count` and `each`; an error if no memory can contain so many numbers.
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

/// The caller's list of `count` values; empty if `count` is 0, for any pointer.
///
/// # Safety
/// If `count` is not 0 and `pointer` is neither null nor unaligned, it must point to `count` values, which do not
/// change during the call.
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
    // SAFETY: the pointer is not null and aligned, and the size does not overflow. The caller promises the rest: the
    // memory has `count` values, which do not change during the call.
    Ok(unsafe { std::slice::from_raw_parts(pointer, count) })
}

/// Numbers, and structures of them, for which every bit pattern is valid.
pub(crate) trait Number: Copy {}

impl Number for f32 {}
impl Number for u8 {}
impl Number for u16 {}
impl Number for i32 {}

/// The caller's memory for `count` numbers.
///
/// # Safety
/// As [`list`]; nothing else may use the memory during the call.
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
    // SAFETY: as in `list`; the memory may have any content, because every bit pattern is a valid `T`.
    Ok(unsafe { std::slice::from_raw_parts_mut(pointer, count) })
}

/// A Vulkan handle that is not null.
pub(crate) fn vulkan<T: Handle>(pointer: *mut c_void, name: &str) -> Result<T, Failure> {
    if pointer.is_null() {
        let message = format!("`{name}` is null");
        return Err(Failure::new(TumbleResult::InvalidPointer, message));
    }
    Ok(T::from_raw(pointer.expose_provenance() as u64))
}

/// A structure whose first member is its size. Later versions add members at the end only, for which 0 means what the
/// versions before did, so that programs may be older than the library.
///
/// # Safety
/// The structure is `repr(C)`, its first member is a `usize`, and zeros are valid values of all members.
pub(crate) unsafe trait SizedStructure: Copy {
    /// The size of the first version's structure in bytes.
    const FIRST_SIZE: usize;
}

/// The caller's structure, whose members beyond its size are 0.
///
/// # Safety
/// The pointer must not be null and must be aligned; it must point to a structure whose first member is its size in
/// bytes.
unsafe fn of_any_version<T: SizedStructure>(
    pointer: *const T,
    name: impl FnOnce() -> String,
) -> Result<T, Failure> {
    // SAFETY: aligned and not null; the first member is there in every version of the structure.
    let size = unsafe { pointer.cast::<usize>().read() };
    let newest = size_of::<T>();
    if !(T::FIRST_SIZE..=newest).contains(&size) || !size.is_multiple_of(align_of::<T>()) {
        let expected = match T::FIRST_SIZE == newest {
            true => format!("{newest} bytes"),
            false => format!("{} to {newest} bytes", T::FIRST_SIZE),
        };
        return Err(Failure::argument(format!(
            "`{}size` is {size}, and the structure has {expected}; set it to `sizeof`, with a header that is not \
             newer than the library",
            name()
        )));
    }
    let mut structure = MaybeUninit::<T>::zeroed();
    // SAFETY: the caller's structure has `size` bytes, and this one has at least as many. The bytes that are not copied
    // are 0, which is a valid value of every member.
    unsafe {
        let bytes = structure.as_mut_ptr().cast::<u8>();
        pointer.cast::<u8>().copy_to_nonoverlapping(bytes, size);
        Ok(structure.assume_init())
    }
}

/// The caller's structure; `None` if the pointer is null.
///
/// # Safety
/// The pointer must be null or unaligned, or point to a structure whose first member is its size in bytes.
pub(crate) unsafe fn sized<T: SizedStructure>(
    pointer: *const T,
    name: &str,
) -> Result<Option<T>, Failure> {
    if pointer.is_null() {
        return Ok(None);
    }
    check(pointer, name)?;
    // SAFETY: not null and aligned; the rest is the caller's promise.
    unsafe { of_any_version(pointer, || format!("{name}->")).map(Some) }
}

/// As [`sized`], but a null pointer is an error.
///
/// # Safety
/// As [`sized`].
pub(crate) unsafe fn needed<T: SizedStructure>(
    pointer: *const T,
    name: &str,
) -> Result<T, Failure> {
    // SAFETY: as the caller promises.
    let found = unsafe { sized(pointer, name)? };
    found.ok_or_else(|| {
        let message = format!("`{name}` is null");
        Failure::new(TumbleResult::InvalidPointer, message)
    })
}

/// The caller's list of `count` structures, all of one version; empty if `count` is 0, for any pointer.
///
/// # Safety
/// If `count` is not 0 and `pointer` is neither null nor unaligned, it must point to `count` structures, each of the
/// size that its first member says, which do not change while the iterator is used.
pub(crate) unsafe fn sized_list<T: SizedStructure>(
    pointer: *const T,
    count: usize,
    name: &str,
) -> Result<impl Iterator<Item = Result<T, Failure>>, Failure> {
    product::<T>(count, 1, name)?;
    let mut stride = 0;
    if count > 0 {
        check(pointer, name)?;
        // SAFETY: aligned and not null; the first member is there in every version of the structure.
        stride = unsafe { pointer.cast::<usize>().read() };
    }
    Ok((0..count).map(move |index| {
        let named = || format!("{name}[{index}].");
        // SAFETY: callers stop at the first error, so all structures before this one have the size of the first, and
        // the pointer is at a structure of the list. It is aligned, because `of_any_version` has checked that the first
        // size is a multiple of the alignment.
        let structure = unsafe { of_any_version(pointer.byte_add(index * stride), named)? };
        // SAFETY: as above.
        let size = unsafe { pointer.byte_add(index * stride).cast::<usize>().read() };
        if size != stride {
            return Err(Failure::argument(format!(
                "`{name}[{index}].size` is {size}, and that of the first is {stride}; set all to `sizeof`"
            )));
        }
        Ok(structure)
    }))
}

/// The caller's text; `None` if the pointer is null.
///
/// # Safety
/// The pointer must be null, or point to bytes that end with a zero and do not change during the call.
pub(crate) unsafe fn text<'a>(
    pointer: *const c_char,
    name: &str,
) -> Result<Option<&'a str>, Failure> {
    if pointer.is_null() {
        return Ok(None);
    }
    // SAFETY: as the caller promises.
    let text = unsafe { CStr::from_ptr(pointer) };
    let text = text.to_str();
    text.map(Some)
        .map_err(|_| Failure::argument(format!("`{name}` is not UTF-8")))
}

/// The caller's memory for a value that a call returns.
pub(crate) struct Out<T> {
    /// Null if the caller does not need the value.
    pointer: *mut T,
}

impl<T> Out<T> {
    /// Checks the pointer. Call it before any work whose result goes there.
    pub(crate) fn new(pointer: *mut T, name: &str) -> Result<Self, Failure> {
        check(pointer, name)?;
        Ok(Self { pointer })
    }

    /// As [`Out::new`], but null is allowed: the caller does not need the value.
    pub(crate) fn optional(pointer: *mut T, name: &str) -> Result<Self, Failure> {
        if pointer.is_null() {
            Ok(Self { pointer })
        } else {
            Self::new(pointer, name)
        }
    }

    /// Writes the value, unless the pointer is null.
    ///
    /// # Safety
    /// The pointer must be null or point to memory for such a value, which nothing else uses during the call.
    pub(crate) unsafe fn set(self, value: T) {
        if self.pointer.is_null() {
            return;
        }
        // SAFETY: not null and aligned; the caller promises the rest. The previous value is not dropped, because the
        // memory may not be initialised.
        unsafe { self.pointer.write(value) };
    }
}

impl<T: SizedStructure> Out<T> {
    /// Writes the first `size` bytes of a structure, which the caller's has.
    ///
    /// # Safety
    /// As [`Out::set`], for memory of `size` bytes.
    pub(crate) unsafe fn set_sized(self, value: &T, size: usize) {
        if self.pointer.is_null() {
            return;
        }
        let bytes: *const u8 = (&raw const *value).cast();
        // SAFETY: not null; the rest is the caller's promise.
        unsafe { bytes.copy_to_nonoverlapping(self.pointer.cast(), size.min(size_of::<T>())) };
    }
}

/// The value of a C constant, from a list of all constants with their values.
pub(crate) fn constant<T: Copy>(value: u32, known: &[(u32, T)], name: &str) -> Result<T, Failure> {
    let found = known.iter().find(|&&(code, _)| code == value);
    found.map(|&(_, value)| value).ok_or_else(|| {
        let last = known.len() - 1;
        Failure::argument(format!(
            "`{name}` is {value}; its constants are 0 to {last}"
        ))
    })
}

/// The value of an option whose C constants are the indices of `all`.
pub(crate) fn option<T: Copy>(value: u32, all: &[T], name: &str) -> Result<T, Failure> {
    let found = usize::try_from(value).ok().and_then(|index| all.get(index));
    found.copied().ok_or_else(|| {
        let last = all.len() - 1;
        Failure::argument(format!(
            "`{name}` is {value}; its constants are 0 to {last}"
        ))
    })
}

/// The truth value of 0 or 1; other numbers are an error.
pub(crate) fn flag(value: u32, name: &str) -> Result<bool, Failure> {
    constant(value, &[(0, false), (1, true)], name)
}
