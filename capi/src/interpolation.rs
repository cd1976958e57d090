//! Interpolations: methods with their options.

use std::ffi::{CString, c_char};
use std::sync::LazyLock;

use glam::DVec3;
use tumble::{
    Ends, Interpolation, InterpolationOptions, KeySigns, METHODS, Method, Quantity, Speed, Tcb,
    WrapMode, method,
};

use crate::arguments::{SizedStructure, option, sized, text};
use crate::result::Failure;

/// Which sign of each key is used: `q` and `-q` are the same rotation. The method "gltf-cubic" ignores
/// this option in tracks with tangents, whose keys keep their signs.
#[repr(u32)]
#[derive(Debug, Clone, Copy)]
pub enum TumbleKeySigns {
    /// Each key has the sign that is nearer to the key before it, so rotations between keys are at most 180°.
    Shortest = 0,
    /// Keys keep their signs. Where the dot product of neighbouring keys is negative, the rotation between them is
    /// more than 180°.
    AsAuthored = 1,
}

/// The boundary condition: the curve in the first and in the last interval, where a neighbouring key is missing.
#[repr(u32)]
#[derive(Debug, Clone, Copy)]
pub enum TumbleEnds {
    /// The default of the method.
    OfMethod = 0,
    /// The parabola through the last three keys at each end.
    Parabolic = 1,
    /// The angular acceleration is 0 at the ends.
    Natural = 2,
    /// The angular velocities at the ends are `start_velocity` and `end_velocity`.
    Clamped = 3,
    /// The angular velocity at an end is that of slerp between the last two keys there.
    Secant = 4,
    /// The curve is closed and smooth there. The last key must equal the first, within 0.002 rad.
    Loop = 5,
    /// The first and the last interval are constant: each has the value of its first key.
    Frozen = 6,
}

/// The quantity that is evaluated: four numbers for each sample.
#[repr(u32)]
#[derive(Debug, Clone, Copy)]
pub enum TumbleQuantity {
    /// The rotation relative to the parent, a unit quaternion `x y z w`.
    Rotation = 0,
    /// The angular velocity in the axes of the rotating body in rad/s: `x y z 0`.
    VelocityInBody = 1,
    /// The angular velocity in the axes of the parent in rad/s: `x y z 0`.
    VelocityInParent = 2,
    /// The angular acceleration in the axes of the rotating body in rad/s²: `x y z 0`.
    AccelerationInBody = 3,
    /// The angular acceleration in the axes of the parent in rad/s²: `x y z 0`.
    AccelerationInParent = 4,
}

/// The speed on the curve of a track.
#[repr(u32)]
#[derive(Debug, Clone, Copy)]
pub enum TumbleSpeed {
    /// According to the key times.
    AsKeyed = 0,
    /// The same angular speed from the first key to the last. The path is the same, but inner keys are reached at
    /// other times.
    Constant = 1,
}

/// The motion before the first key of a track, or after the last.
#[repr(u32)]
#[derive(Debug, Clone, Copy)]
pub enum TumbleWrap {
    /// The value of the first or the last key stays.
    Hold = 0,
    /// The track repeats.
    Loop = 1,
    /// The track runs backwards, then forwards again, and so on. Quantities other than the rotation are refused.
    Mirror = 2,
    /// The rotation continues at the angular velocity at that end.
    Extrapolate = 3,
}

/// A method with its options. If all members except `size` are 0, they have their defaults.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct TumbleInterpolation {
    /// `sizeof(TumbleInterpolation)`.
    pub size: usize,
    /// The name of the method, such as "slerp", from `tumble_method_name`; null: "bessel-overhauser".
    pub method: *const c_char,
    /// A `TumbleKeySigns`.
    pub signs: u32,
    /// A `TumbleEnds`.
    pub ends: u32,
    /// A `TumbleQuantity`.
    pub quantity: u32,
    /// A `TumbleSpeed`.
    pub speed: u32,
    /// The motion before the first key: a `TumbleWrap`.
    pub before: u32,
    /// The motion after the last key: a `TumbleWrap`.
    pub after: u32,
    /// The angular velocity at the first key of every track for `TUMBLE_ENDS_CLAMPED`: `x y z` in the body's axes,
    /// rad/s.
    pub start_velocity: [f64; 3],
    /// The angular velocity at the last key of every track, likewise.
    pub end_velocity: [f64; 3],
    /// The tension of "kochanek-bartels"; 0 is neutral, usual values are from -1 to 1. With 1 the velocity at a key
    /// is 0, with -1 it is doubled.
    pub tension: f64,
    /// The continuity of "kochanek-bartels", likewise. With -1 the curve has a corner at a key; with 1 the corner
    /// points the other way, because the curve overshoots on both sides of the key.
    pub continuity: f64,
    /// The bias of "kochanek-bartels", likewise. With 1 the tangent at a key follows the interval before it, with -1
    /// the interval after it.
    pub bias: f64,
}

// SAFETY: `repr(C)`, the size is the first member, and zero bits are valid numbers and null pointers.
unsafe impl SizedStructure for TumbleInterpolation {
    const FIRST_SIZE: usize = size_of::<Self>();
}

impl TumbleInterpolation {
    /// The interpolation of a structure; for null the default method with its defaults.
    ///
    /// # Safety
    /// As [`TumbleInterpolation::read_or`].
    pub(crate) unsafe fn read(pointer: *const Self) -> Result<Interpolation, Failure> {
        // SAFETY: as the caller promises.
        unsafe { Self::read_or(pointer, || Ok(method::BESSEL_OVERHAUSER)) }
    }

    /// The interpolation of a structure; for null the method `other` with its defaults.
    ///
    /// # Safety
    /// The pointer must be null or point to such a structure, whose `method` is null or a text that ends with a zero
    /// byte.
    pub(crate) unsafe fn read_or(
        pointer: *const Self,
        other: impl FnOnce() -> Result<Method, Failure>,
    ) -> Result<Interpolation, Failure> {
        // SAFETY: as the caller promises.
        let structure = unsafe { sized(pointer, "interpolation")? };
        let Some(structure) = structure else {
            return Ok(other()?.into());
        };
        // SAFETY: as the caller promises.
        let name = unsafe { text(structure.method, "interpolation->method")? };
        let method = match name {
            None => method::BESSEL_OVERHAUSER,
            Some(name) => name
                .parse::<Method>()
                .map_err(|error| Failure::argument(error.to_string()))?,
        };
        structure.with(method)
    }

    fn with(&self, method: Method) -> Result<Interpolation, Failure> {
        let signs = option(self.signs, &KeySigns::ALL, "interpolation->signs")?;
        let clamped = Ends::Clamped {
            start: DVec3::from_array(self.start_velocity),
            end: DVec3::from_array(self.end_velocity),
        };
        let named = Ends::ALL.map(|ends| match ends {
            Ends::Clamped { .. } => clamped,
            ends => ends,
        });
        let ends = [&[method.ends], &named[..]].concat();
        let options = InterpolationOptions::default()
            .with_signs(Some(signs))
            .with_ends(Some(option(self.ends, &ends, "interpolation->ends")?))
            .with_tcb(Tcb {
                tension: self.tension,
                continuity: self.continuity,
                bias: self.bias,
            })
            .with_quantity(option(
                self.quantity,
                &Quantity::ALL,
                "interpolation->quantity",
            )?)
            .with_speed(option(self.speed, &Speed::ALL, "interpolation->speed")?)
            .with_before(option(
                self.before,
                &WrapMode::ALL,
                "interpolation->before",
            )?)
            .with_after(option(self.after, &WrapMode::ALL, "interpolation->after")?);
        Ok(options.with(method))
    }
}

static METHOD_NAMES: LazyLock<Vec<CString>> = LazyLock::new(|| {
    let names = METHODS.iter().map(|method| CString::new(method.name));
    names.map(Result::unwrap_or_default).collect()
});

/// Returns the number of methods.
#[unsafe(no_mangle)]
pub extern "C" fn tumble_method_count() -> usize {
    METHODS.len()
}

/// Returns the name of the method `index`, counted from 0: a text that is never freed; null, without an error
/// message, if there is no such method.
#[unsafe(no_mangle)]
pub extern "C" fn tumble_method_name(index: usize) -> *const c_char {
    let name = METHOD_NAMES.get(index);
    name.map_or(std::ptr::null(), |name| name.as_ptr())
}
