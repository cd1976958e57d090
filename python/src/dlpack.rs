//! DLPack, the exchange of arrays between libraries: a capsule with a description of the memory, which its consumer
//! takes over by renaming it.
//!
//! `unsafe`: structs of a C interface, which the other side deletes through a pointer.
#![allow(unsafe_code)]

use std::ffi::{CStr, c_void};
use std::ptr::null_mut;
use std::sync::Arc;

use pyo3::ffi;
use pyo3::prelude::*;
use tumble::ComponentType;

use crate::array_memory::ArrayMemory;

/// The DLPack version of capsules with a version.
const VERSION: Version = Version { major: 1, minor: 0 };

/// `DLDevice`.
#[repr(C)]
struct Device {
    kind: i32,
    ordinal: i32,
}

/// `DLDataType`.
#[repr(C)]
struct DataType {
    code: u8,
    bits: u8,
    lanes: u16,
}

impl DataType {
    fn of(component: ComponentType) -> Self {
        let (code, bits) = match component {
            ComponentType::F32 => (2, 32),
            ComponentType::F16 => (2, 16),
            ComponentType::Snorm16 => (0, 16),
        };
        Self {
            code,
            bits,
            lanes: 1,
        }
    }
}

/// `DLTensor`.
#[repr(C)]
struct Tensor {
    data: *mut c_void,
    device: Device,
    axes: i32,
    kind: DataType,
    shape: *mut i64,
    strides: *mut i64,
    offset: u64,
}

/// `DLPackVersion`.
#[repr(C)]
struct Version {
    major: u32,
    minor: u32,
}

/// The memory behind the pointers of a tensor.
struct TensorBuffers {
    shape: Box<[i64]>,
    strides: Box<[i64]>,
    _memory: Arc<ArrayMemory>,
}

/// `DLManagedTensor`, followed by our fields, which keep the memory alive.
#[repr(C)]
struct Managed {
    tensor: Tensor,
    context: *mut c_void,
    delete: Option<unsafe extern "C" fn(*mut Managed)>,
    buffers: TensorBuffers,
}

/// `DLManagedTensorVersioned`, followed by our fields, which keep the memory alive.
#[repr(C)]
struct ManagedVersioned {
    version: Version,
    context: *mut c_void,
    delete: Option<unsafe extern "C" fn(*mut ManagedVersioned)>,
    flags: u64,
    tensor: Tensor,
    buffers: TensorBuffers,
}

const _: () = {
    assert!(size_of::<Tensor>() == 48);
    assert!(std::mem::offset_of!(Managed, buffers) == 64);
    assert!(std::mem::offset_of!(ManagedVersioned, tensor) == 32);
};

/// Deletes the tensor of a capsule or of its consumer.
///
/// # Safety
/// The pointer is that of a box of this type, which is not used any more.
unsafe extern "C" fn delete<T>(managed: *mut T) {
    if !managed.is_null() {
        // SAFETY: the caller promises that the pointer is to a box of this type.
        drop(unsafe { Box::from_raw(managed) });
    }
}

/// The names of capsules that were not consumed, without and with a version.
const NAME: &CStr = c"dltensor";
const NAME_VERSIONED: &CStr = c"dltensor_versioned";

/// The destructor of a capsule. A consumer has renamed it, and deletes the tensor itself.
///
/// # Safety
/// Called by Python with a capsule that `capsule` made.
unsafe extern "C" fn destroy(capsule: *mut ffi::PyObject) {
    // SAFETY: promised by the caller; a pointer under one of the names is to a box of that name's type.
    unsafe {
        if ffi::PyCapsule_IsValid(capsule, NAME.as_ptr()) == 1 {
            delete::<Managed>(ffi::PyCapsule_GetPointer(capsule, NAME.as_ptr()).cast());
        } else if ffi::PyCapsule_IsValid(capsule, NAME_VERSIONED.as_ptr()) == 1 {
            let managed = ffi::PyCapsule_GetPointer(capsule, NAME_VERSIONED.as_ptr());
            delete::<ManagedVersioned>(managed.cast());
        }
    }
}

/// A capsule of an array that begins at a byte of a memory, in C order, in the form with a version or the older one. The memory lives for as
/// long as the capsule or its consumer has it.
pub(crate) fn capsule<'py>(
    py: Python<'py>,
    (memory, start): (&Arc<ArrayMemory>, usize),
    shape: &[usize],
    component: ComponentType,
    is_versioned: bool,
) -> PyResult<Bound<'py, PyAny>> {
    let mut strides = vec![1; shape.len()];
    for axis in (1..shape.len()).rev() {
        strides[axis - 1] = strides[axis] * shape[axis].max(1) as i64;
    }
    let mut buffers = TensorBuffers {
        shape: shape.iter().map(|&length| length as i64).collect(),
        strides: strides.into_boxed_slice(),
        _memory: Arc::clone(memory),
    };
    let (kind, ordinal) = memory.device();
    let tensor = Tensor {
        data: std::ptr::with_exposed_provenance_mut(memory.address() + start),
        device: Device { kind, ordinal },
        axes: shape.len() as i32,
        kind: DataType::of(component),
        shape: buffers.shape.as_mut_ptr(),
        strides: buffers.strides.as_mut_ptr(),
        offset: 0,
    };
    let (managed, name): (*mut c_void, _) = match is_versioned {
        true => {
            let managed = Box::new(ManagedVersioned {
                version: VERSION,
                context: null_mut(),
                delete: Some(delete),
                flags: 0,
                tensor,
                buffers,
            });
            (Box::into_raw(managed).cast(), NAME_VERSIONED)
        }
        false => {
            let managed = Box::new(Managed {
                tensor,
                context: null_mut(),
                delete: Some(delete),
                buffers,
            });
            (Box::into_raw(managed).cast(), NAME)
        }
    };
    // SAFETY: the pointer is not null, the name is static, and the destructor is that of the pointer's type.
    let capsule = unsafe { ffi::PyCapsule_New(managed, name.as_ptr(), Some(destroy)) };
    if capsule.is_null() {
        // SAFETY: the box was made just now, and has no other owner.
        unsafe {
            match is_versioned {
                true => delete::<ManagedVersioned>(managed.cast()),
                false => delete::<Managed>(managed.cast()),
            }
        }
    }
    // SAFETY: a new reference, or null with an exception set.
    unsafe { Bound::from_owned_ptr_or_err(py, capsule) }
}
