//! The version of the library and of its header.

/// The version of this header as one number: 1 000 000 × major + 1 000 × minor + patch.
pub const TUMBLE_VERSION: u32 = 1000;

/// The major version. Header and library must have the same one.
pub const TUMBLE_VERSION_MAJOR: u32 = 0;
/// The minor version. A greater one has more functions; before version 1.0 it may also change functions.
pub const TUMBLE_VERSION_MINOR: u32 = 1;
/// The patch version. It does not change the interface.
pub const TUMBLE_VERSION_PATCH: u32 = 0;

/// Returns the version of the library as one number: 1 000 000 × major + 1 000 × minor + patch. It equals
/// `TUMBLE_VERSION` if the library belongs to this header.
#[unsafe(no_mangle)]
pub extern "C" fn tumble_version() -> u32 {
    TUMBLE_VERSION_MAJOR * 1_000_000 + TUMBLE_VERSION_MINOR * 1_000 + TUMBLE_VERSION_PATCH
}
