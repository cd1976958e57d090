//! A Vulkan driver that ends the process when it is loaded, as a broken one may.
//! Only the names that a loader looks for need `unsafe`.
#![allow(unsafe_code, missing_docs)]

/// Ends the process with the status in the environment variable, which may be 0.
fn end() -> ! {
    match std::env::var("CRASH_STATUS") {
        // Destructors would wait for the loader's lock, and the loader for this function.
        Ok(status) if status == "exit" => std::process::exit(0),
        // Ends without running destructors.
        Ok(status) => signal_hook::low_level::exit(status.parse().unwrap_or(1)),
        Err(_) => std::process::abort(),
    }
}

/// The first function that every loader calls.
// SAFETY: no other function of this library has the name.
#[unsafe(no_mangle)]
pub extern "system" fn vk_icdNegotiateLoaderICDInterfaceVersion(_version: *mut u32) -> i32 {
    end()
}

/// For loaders that do not negotiate.
// SAFETY: likewise.
#[unsafe(no_mangle)]
pub extern "system" fn vk_icdGetInstanceProcAddr(
    _instance: u64,
    _name: *const std::ffi::c_char,
) -> *const std::ffi::c_void {
    end()
}
