//! A Vulkan driver that ends the process when it is loaded, as a broken one may.
#![allow(unsafe_code, missing_docs)]

/// What every loader calls first.
#[unsafe(no_mangle)]
pub extern "system" fn vk_icdNegotiateLoaderICDInterfaceVersion(_version: *mut u32) -> i32 {
    std::process::abort()
}

/// For loaders that do not negotiate.
#[unsafe(no_mangle)]
pub extern "system" fn vk_icdGetInstanceProcAddr(
    _instance: u64,
    _name: *const std::ffi::c_char,
) -> *const std::ffi::c_void {
    std::process::abort()
}
