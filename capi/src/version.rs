//! The version of the library and of its header.

/// The version of this header: major, minor and patch, as `TUMBLE_VERSION_MAJOR` and the others say.
pub const TUMBLE_VERSION: u32 = 1000;

/// Versions with another major number are made for other headers.
pub const TUMBLE_VERSION_MAJOR: u32 = 0;
/// Versions with a greater minor number have more functions; before 1.0 they may change some.
pub const TUMBLE_VERSION_MINOR: u32 = 1;
/// Versions with another patch number have the same interface.
pub const TUMBLE_VERSION_PATCH: u32 = 0;

/// The version of the library: 1 000 000 for each major, 1 000 for each minor and 1 for each patch
/// version. It equals `TUMBLE_VERSION` where header and library belong together.
#[unsafe(no_mangle)]
pub extern "C" fn tumble_version() -> u32 {
    TUMBLE_VERSION_MAJOR * 1_000_000 + TUMBLE_VERSION_MINOR * 1_000 + TUMBLE_VERSION_PATCH
}
