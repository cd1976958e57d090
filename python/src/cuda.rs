//! The functions of CUDA's driver that results on a card need. Its library is opened for the first such result. The
//! Vulkan driver exports memory and semaphores as file descriptors. A device of CUDA and a device of Vulkan are the
//! same if their UUIDs are equal.
//!
//! `unsafe`: functions of a C library.
#![allow(unsafe_code)]
#![cfg_attr(
    not(unix),
    allow(dead_code, reason = "memory leaves Vulkan as a file on Unix alone")
)]

use std::ffi::{CStr, c_char, c_int, c_uint, c_void};
use std::fmt;
use std::ptr::null_mut;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, OnceLock, PoisonError};

use libloading::Library;
use tumble::vulkan::{ExportedResult, VulkanError};

/// The driver's library.
const LIBRARY: &str = match cfg!(windows) {
    true => "nvcuda.dll",
    false => "libcuda.so.1",
};

/// The reason why a result cannot be used by CUDA.
#[derive(Debug)]
pub(crate) enum CudaError {
    /// There is no driver.
    NoLibrary(String),
    /// The driver is older than timeline semaphores (CUDA 11.2).
    NoFunction(&'static str),
    /// A call failed.
    Call {
        call: &'static str,
        code: c_int,
        name: String,
    },
    /// CUDA does not have the Vulkan device.
    NoDevice {
        device: String,
        uuid: String,
        seen: Vec<String>,
    },
    /// The Vulkan device does not export memory in a form that CUDA imports.
    #[cfg(not(unix))]
    NoFiles,
    /// The Vulkan device failed.
    Vulkan(VulkanError),
}

impl fmt::Display for CudaError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NoLibrary(reason) => write!(
                f,
                "no CUDA driver: {reason}; arrays on a card need NVIDIA's driver ({LIBRARY})"
            ),
            Self::NoFunction(name) => write!(
                f,
                "the CUDA driver has no function {name}; arrays on a card need one of CUDA 11.2 or newer"
            ),
            Self::Call { call, code, name } => write!(f, "{call} failed: {name} ({code})"),
            Self::NoDevice { device, uuid, seen } => {
                write!(f, "CUDA has no device that is {device} (UUID {uuid}); ")?;
                match &seen[..] {
                    [] => write!(f, "it sees none"),
                    seen => write!(f, "it sees {}", seen.join(", ")),
                }?;
                write!(
                    f,
                    ": open a Vulkan device that is one of them (tumble.devices()), or make it visible \
                     (CUDA_VISIBLE_DEVICES)"
                )
            }
            #[cfg(not(unix))]
            Self::NoFiles => write!(f, "arrays in a card's memory are supported only on Linux"),
            Self::Vulkan(error) => error.fmt(f),
        }
    }
}

impl From<VulkanError> for CudaError {
    fn from(error: VulkanError) -> Self {
        Self::Vulkan(error)
    }
}

type CuDevice = c_int;
type Context = *mut c_void;
type Memory = *mut c_void;
type Semaphore = *mut c_void;
type Stream = *mut c_void;
type Address = u64;

/// `CUexternalMemoryHandleType`, and `CUexternalSemaphoreHandleType` for timelines of Vulkan's.
const OPAQUE_FILE: c_int = 1;
const TIMELINE_FILE: c_int = 9;

/// The memory belongs to one buffer alone.
const DEDICATED: c_uint = 1;

/// `CUDA_EXTERNAL_MEMORY_HANDLE_DESC`.
#[repr(C)]
#[derive(Default)]
struct MemoryHandle {
    kind: c_int,
    file: FileHandle,
    size: u64,
    flags: c_uint,
    reserved: [c_uint; 16],
}

/// The union of the handles: a file, or two pointers.
#[repr(C, align(8))]
#[derive(Default)]
struct FileHandle {
    number: c_int,
    unused: [c_uint; 3],
}

/// `CUDA_EXTERNAL_MEMORY_BUFFER_DESC`.
#[repr(C)]
#[derive(Default)]
struct BufferRange {
    offset: u64,
    size: u64,
    flags: c_uint,
    reserved: [c_uint; 16],
}

/// `CUDA_EXTERNAL_SEMAPHORE_HANDLE_DESC`.
#[repr(C)]
#[derive(Default)]
struct SemaphoreHandle {
    kind: c_int,
    file: FileHandle,
    flags: c_uint,
    reserved: [c_uint; 16],
}

/// `CUDA_EXTERNAL_SEMAPHORE_WAIT_PARAMS`.
#[repr(C)]
#[derive(Default)]
struct Wait {
    value: u64,
    /// Parameters for semaphores of other kinds.
    others: [u64; 3],
    other: [c_uint; 10],
    flags: c_uint,
    reserved: [c_uint; 16],
}

const _: () = {
    assert!(size_of::<MemoryHandle>() == 104);
    assert!(size_of::<BufferRange>() == 88);
    assert!(size_of::<SemaphoreHandle>() == 96);
    assert!(size_of::<Wait>() == 144);
};

/// The functions of the driver, with their names in its library.
macro_rules! functions {
    ($($field:ident: $name:literal ($($argument:ty),*);)*) => {
        struct Functions {
            $($field: unsafe extern "system" fn($($argument),*) -> c_int,)*
        }

        impl Functions {
            fn of(library: &Library) -> Result<Self, CudaError> {
                Ok(Self {$(
                    $field: {
                        // SAFETY: so the driver's header (cuda.h) declares the function of this name.
                        let found = unsafe { library.get(concat!($name, "\0").as_bytes()) };
                        *found.map_err(|_| CudaError::NoFunction($name))?
                    },
                )*})
            }
        }
    };
}

functions! {
    init: "cuInit" (c_uint);
    error_name: "cuGetErrorName" (c_int, *mut *const c_char);
    device_count: "cuDeviceGetCount" (*mut c_int);
    device: "cuDeviceGet" (*mut CuDevice, c_int);
    device_uuid: "cuDeviceGetUuid" (*mut [u8; 16], CuDevice);
    retain: "cuDevicePrimaryCtxRetain" (*mut Context, CuDevice);
    push: "cuCtxPushCurrent_v2" (Context);
    pop: "cuCtxPopCurrent_v2" (*mut Context);
    synchronize: "cuCtxSynchronize" ();
    import_memory: "cuImportExternalMemory" (*mut Memory, *const MemoryHandle);
    map: "cuExternalMemoryGetMappedBuffer" (*mut Address, Memory, *const BufferRange);
    destroy_memory: "cuDestroyExternalMemory" (Memory);
    import_semaphore: "cuImportExternalSemaphore" (*mut Semaphore, *const SemaphoreHandle);
    wait: "cuWaitExternalSemaphoresAsync" (*const Semaphore, *const Wait, c_uint, Stream);
    destroy_semaphore: "cuDestroyExternalSemaphore" (Semaphore);
    free: "cuMemFree_v2" (Address);
    copy_to_host: "cuMemcpyDtoH_v2" (*mut c_void, Address, usize);
}

/// The driver.
pub(crate) struct Cuda {
    functions: Functions,
    /// The contexts that all users of a device share (the primary ones), of the devices that were used. They stay, as
    /// those of CUDA's runtime do: making one takes a tenth of a second.
    contexts: Mutex<Vec<(CuDevice, Context)>>,
    /// The loaded library; dropping it would invalidate the functions.
    _library: Library,
}

// SAFETY: the driver's functions may be called by any thread, and a context belongs to no thread.
unsafe impl Send for Cuda {}
// SAFETY: the driver's functions may be called by any thread; the list of contexts is behind a lock.
unsafe impl Sync for Cuda {}

impl Cuda {
    /// The driver of this machine, opened at the first call.
    fn of_this_machine() -> Result<&'static Self, CudaError> {
        static CUDA: OnceLock<Cuda> = OnceLock::new();
        if let Some(cuda) = CUDA.get() {
            return Ok(cuda);
        }
        // SAFETY: loading a library runs its initialisers, which is intended.
        let library = unsafe { Library::new(LIBRARY) }
            .map_err(|error| CudaError::NoLibrary(error.to_string()))?;
        let cuda = Self {
            functions: Functions::of(&library)?,
            contexts: Mutex::default(),
            _library: library,
        };
        Ok(CUDA.get_or_init(|| cuda))
    }

    /// The context of a device.
    fn context(&self, device: CuDevice) -> Result<Context, CudaError> {
        let mut contexts = self.contexts.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some((_, context)) = contexts.iter().find(|(of, _)| *of == device) {
            return Ok(*context);
        }
        let mut context = null_mut();
        // SAFETY: a device that CUDA listed, and a pointer to a context.
        let code = unsafe { (self.functions.retain)(&raw mut context, device) };
        self.checked("cuDevicePrimaryCtxRetain", code)?;
        contexts.push((device, context));
        Ok(context)
    }

    /// Converts a result code to an error with the name of the call.
    fn checked(&self, call: &'static str, code: c_int) -> Result<(), CudaError> {
        if code == 0 {
            return Ok(());
        }
        let mut name = std::ptr::null();
        // SAFETY: the function sets the pointer to a static string, or leaves it null.
        let named = unsafe { (self.functions.error_name)(code, &raw mut name) } == 0;
        let name = match named && !name.is_null() {
            // SAFETY: the pointer is not null, and the driver's string is static.
            true => unsafe { CStr::from_ptr(name) }
                .to_string_lossy()
                .into_owned(),
            false => "an unknown error".to_owned(),
        };
        Err(CudaError::Call { call, code, name })
    }

    /// The device with that UUID, and its index among those that CUDA sees.
    fn device(&self, result: &ExportedResult) -> Result<(CuDevice, c_int), CudaError> {
        let functions = &self.functions;
        // SAFETY: plain arguments, and pointers to values of the declared types, here and below.
        self.checked("cuInit", unsafe { (functions.init)(0) })?;
        let mut count = 0;
        // SAFETY: plain arguments, and pointers to values of the declared types.
        let code = unsafe { (functions.device_count)(&raw mut count) };
        self.checked("cuDeviceGetCount", code)?;
        let mut seen = Vec::new();
        for ordinal in 0..count {
            let (mut device, mut uuid) = (0, [0; 16]);
            // SAFETY: plain arguments, and pointers to values of the declared types.
            let code = unsafe { (functions.device)(&raw mut device, ordinal) };
            self.checked("cuDeviceGet", code)?;
            // SAFETY: the device is one that the driver listed; the pointer is to a value of the declared type.
            let code = unsafe { (functions.device_uuid)(&raw mut uuid, device) };
            self.checked("cuDeviceGetUuid", code)?;
            let uuid = spelt(uuid);
            if uuid == result.device_uuid() {
                return Ok((device, ordinal));
            }
            seen.push(uuid);
        }
        Err(CudaError::NoDevice {
            device: result.device_name().to_owned(),
            uuid: result.device_uuid().to_owned(),
            seen,
        })
    }
}

/// A UUID as text, in the form of RFC 9562.
fn spelt(uuid: [u8; 16]) -> String {
    let digits: String = uuid.iter().map(|byte| format!("{byte:02x}")).collect();
    let parts = [0..8, 8..12, 12..16, 16..20, 20..32];
    parts.map(|part| &digits[part]).join("-")
}

/// A result of a Vulkan device in the memory that CUDA sees. CUDA's objects are freed when this is dropped,
/// and then the memory.
pub(crate) struct Mapping {
    cuda: &'static Cuda,
    result: ExportedResult,
    /// The index of the device among those that CUDA sees.
    pub(crate) ordinal: c_int,
    context: Context,
    memory: Option<Memory>,
    address: Option<Address>,
    /// The semaphore, and the value that says that the result is written.
    semaphore: Option<(Semaphore, u64)>,
    /// Whether the memory's address was exported. Work that other libraries have queued may then still use it.
    is_known: AtomicBool,
    /// The process that imported the memory: a process forked from it cannot use CUDA.
    process: u32,
}

// SAFETY: the driver's functions may be called by any thread, and its handles belong to no thread; the context is
// made a thread's for the length of a call.
unsafe impl Send for Mapping {}
// SAFETY: the driver's handles belong to no thread, and only atomic numbers change behind a shared reference.
unsafe impl Sync for Mapping {}

impl Mapping {
    /// Imports the memory of a result, and the semaphore that says when it is written.
    pub(crate) fn new(result: ExportedResult) -> Result<Self, CudaError> {
        let cuda = Cuda::of_this_machine()?;
        let (device, ordinal) = cuda.device(&result)?;
        let context = cuda.context(device)?;
        let mut mapping = Self {
            cuda,
            result,
            ordinal,
            context,
            memory: None,
            address: None,
            semaphore: None,
            is_known: AtomicBool::new(false),
            process: std::process::id(),
        };
        // If one step fails, everything that the steps before created is released when it is dropped.
        in_context(cuda, context, || mapping.import())?;
        Ok(mapping)
    }

    #[cfg(not(unix))]
    fn import(&mut self) -> Result<(), CudaError> {
        Err(CudaError::NoFiles)
    }

    #[cfg(unix)]
    fn import(&mut self) -> Result<(), CudaError> {
        use std::os::fd::{AsRawFd, IntoRawFd};
        let (cuda, functions) = (self.cuda, &self.cuda.functions);
        let file = self.result.memory_file()?;
        let size = self.result.memory_bytes();
        let handle = MemoryHandle {
            kind: OPAQUE_FILE,
            file: FileHandle {
                number: file.as_raw_fd(),
                ..FileHandle::default()
            },
            size,
            flags: DEDICATED,
            ..MemoryHandle::default()
        };
        let mut memory = null_mut();
        // SAFETY: the file is that of a dedicated allocation of this size on the device of the current context.
        let code = unsafe { (functions.import_memory)(&raw mut memory, &raw const handle) };
        cuda.checked("cuImportExternalMemory", code)?;
        let _ = file.into_raw_fd(); // the driver's from now on
        self.memory = Some(memory);
        let range = BufferRange {
            size,
            ..BufferRange::default()
        };
        let mut address = 0;
        // SAFETY: memory that was imported just now, and a range within it.
        let code = unsafe { (functions.map)(&raw mut address, memory, &raw const range) };
        cuda.checked("cuExternalMemoryGetMappedBuffer", code)?;
        self.address = Some(address);
        // If the semaphore cannot be imported, the host waits instead, with the same result.
        self.semaphore = self.import_semaphore().unwrap_or_default();
        if self.semaphore.is_none() {
            self.result.wait()?;
        }
        Ok(())
    }

    /// The semaphore that says that the result is written, and its value then; none where the device exports none.
    #[cfg(unix)]
    fn import_semaphore(&self) -> Result<Option<(Semaphore, u64)>, CudaError> {
        use std::os::fd::{AsRawFd, IntoRawFd};
        let Some((file, value)) = self.result.timeline_file()? else {
            return Ok(None);
        };
        let handle = SemaphoreHandle {
            kind: TIMELINE_FILE,
            file: FileHandle {
                number: file.as_raw_fd(),
                ..FileHandle::default()
            },
            ..SemaphoreHandle::default()
        };
        let mut semaphore = null_mut();
        // SAFETY: the file is that of a timeline semaphore of the same device.
        let code = unsafe {
            let import = self.cuda.functions.import_semaphore;
            import(&raw mut semaphore, &raw const handle)
        };
        self.cuda.checked("cuImportExternalSemaphore", code)?;
        let _ = file.into_raw_fd(); // the driver's from now on
        Ok(Some((semaphore, value)))
    }

    /// Whether streams wait for the result; else the host has waited.
    pub(crate) fn is_ordered_by_streams(&self) -> bool {
        self.semaphore.is_some()
    }

    /// The address of the first number, for work that comes after [`Mapping::order`].
    pub(crate) fn address(&self) -> Address {
        self.is_known.store(true, Ordering::Relaxed);
        self.address.unwrap_or(0)
    }

    fn check_process(&self) -> Result<(), CudaError> {
        match self.process == std::process::id() {
            true => Ok(()),
            false => Err(CudaError::Vulkan(VulkanError::Forked)),
        }
    }

    /// Lets a stream wait until the result is written: 1 is the default one of all threads, 2 that of each thread,
    /// others are pointers. The host does not wait.
    pub(crate) fn order(&self, stream: usize) -> Result<(), CudaError> {
        self.check_process()?;
        self.result.is_written()?; // an error if the device was lost: nothing was written then
        let Some((semaphore, value)) = self.semaphore else {
            return Ok(());
        };
        let wait = Wait {
            value,
            ..Wait::default()
        };
        let stream = std::ptr::without_provenance_mut(stream);
        in_context(self.cuda, self.context, || {
            // SAFETY: one semaphore and its parameters, and a stream that the caller names.
            let code = unsafe {
                let wait_for = self.cuda.functions.wait;
                wait_for(&raw const semaphore, &raw const wait, 1, stream)
            };
            self.cuda.checked("cuWaitExternalSemaphoresAsync", code)
        })
    }

    /// Copies bytes of the result from `start` on to the host, when it is written.
    pub(crate) fn copy_to_host(&self, start: usize, bytes: &mut [u8]) -> Result<(), CudaError> {
        self.check_process()?;
        self.result.wait()?;
        self.order(DEFAULT_STREAM)?; // the copy runs on this stream, so it comes after the result
        let Some(address) = self.address else {
            return Ok(());
        };
        let size = bytes.len().min(self.result.bytes() as usize - start);
        in_context(self.cuda, self.context, || {
            // SAFETY: source and destination have at least this number of bytes.
            let code = unsafe {
                let copy = self.cuda.functions.copy_to_host;
                copy(bytes.as_mut_ptr().cast(), address + start as Address, size)
            };
            self.cuda.checked("cuMemcpyDtoH", code)
        })
    }

    /// Frees CUDA's objects, after all work that may use them.
    fn give_back(&mut self) -> Result<(), CudaError> {
        let (cuda, functions) = (self.cuda, &self.cuda.functions);
        if let Some(address) = self.address.take() {
            if *self.is_known.get_mut() {
                // The library that imported the memory may have released it while work on it was still queued: wait
                // before the memory is freed. SAFETY: the context of these objects is current.
                cuda.checked("cuCtxSynchronize", unsafe { (functions.synchronize)() })?;
            }
            // SAFETY: `import` mapped the memory once, and nothing uses it any more.
            cuda.checked("cuMemFree", unsafe { (functions.free)(address) })?;
        }
        if let Some((semaphore, _)) = self.semaphore.take() {
            // SAFETY: `import` imported the semaphore, and nothing waits for it any more.
            let code = unsafe { (functions.destroy_semaphore)(semaphore) };
            cuda.checked("cuDestroyExternalSemaphore", code)?;
        }
        if let Some(memory) = self.memory.take() {
            // SAFETY: `import` imported the memory, and no part of it is mapped any more.
            let code = unsafe { (functions.destroy_memory)(memory) };
            cuda.checked("cuDestroyExternalMemory", code)?;
        }
        Ok(())
    }
}

/// The default stream that all threads share.
pub(crate) const DEFAULT_STREAM: usize = 1;

/// Runs work with a context as the thread's current context.
fn in_context<T>(
    cuda: &Cuda,
    context: Context,
    work: impl FnOnce() -> Result<T, CudaError>,
) -> Result<T, CudaError> {
    // SAFETY: primary contexts are kept until the process ends.
    cuda.checked("cuCtxPushCurrent", unsafe {
        (cuda.functions.push)(context)
    })?;
    let done = work();
    let mut popped = null_mut();
    // SAFETY: the context that was pushed is on top, for work pops what it pushes.
    let code = unsafe { (cuda.functions.pop)(&raw mut popped) };
    let popped = cuda.checked("cuCtxPopCurrent", code);
    let done = done?;
    popped.map(|()| done)
}

impl Drop for Mapping {
    fn drop(&mut self) {
        if self.check_process().is_err() {
            return; // there is no driver, so nothing was imported
        }
        // After a lost device, streams may wait forever for its semaphore. Freeing would wait with them, so nothing is freed.
        if self.result.wait().is_err() {
            return;
        }
        // If the driver reports an error, the remaining objects cannot be released.
        let _ = in_context(self.cuda, self.context, || self.give_back());
    }
}
