//! How tracks are interpolated.

use std::ffi::{CString, c_char};
use std::sync::LazyLock;

use glam::DVec3;
use tumble::{
    Ends, Interpolation, KeySigns, METHODS, Method, Quantity, Speed, Tcb, WrapMode, method,
};

use crate::arguments::{option, sized, text};
use crate::result::Failure;

/// Which of the two quaternions `q` and `-q` of each key is used.
#[repr(u32)]
#[derive(Debug, Clone, Copy)]
pub enum TumblePath {
    /// The one nearer to the previous key, so that every rotation is the shorter one.
    Shortest = 0,
    /// The stored one. Methods that define the path themselves ignore this.
    AsAuthored = 1,
}

/// The boundary condition: the curve in the first and the last segment.
#[repr(u32)]
#[derive(Debug, Clone, Copy)]
pub enum TumbleEnds {
    /// That of the method.
    OfMethod = 0,
    /// The parabola through the last three keys.
    Parabolic = 1,
    /// No angular acceleration.
    Natural = 2,
    /// The angular velocities `start_velocity` and `end_velocity`.
    Clamped = 3,
    /// The angular velocity of slerp between the last two keys.
    Secant = 4,
    /// A closed curve: the last key equals the first.
    Loop = 5,
    /// The first and the last segment hold their first key.
    Frozen = 6,
}

/// What is evaluated: four numbers for each sample.
#[repr(u32)]
#[derive(Debug, Clone, Copy)]
pub enum TumbleQuantity {
    /// The rotation, a unit quaternion `x y z w`.
    Rotation = 0,
    /// The angular velocity in the body's axes, rad/s, `x y z 0`.
    VelocityInBody = 1,
    /// The angular velocity in the parent's axes, rad/s, `x y z 0`.
    VelocityInParent = 2,
    /// The angular acceleration in the body's axes, rad/s², `x y z 0`.
    AccelerationInBody = 3,
    /// The angular acceleration in the parent's axes, rad/s², `x y z 0`.
    AccelerationInParent = 4,
}

/// The speed along the curve of a track.
#[repr(u32)]
#[derive(Debug, Clone, Copy)]
pub enum TumbleSpeed {
    /// As the key times say.
    AsKeyed = 0,
    /// At one angular speed from the first key to the last.
    Constant = 1,
}

/// The values outside the keys.
#[repr(u32)]
#[derive(Debug, Clone, Copy)]
pub enum TumbleWrap {
    /// The end value is held.
    Hold = 0,
    /// The track repeats.
    Loop = 1,
    /// The track runs backwards, then forwards again.
    Mirror = 2,
    /// The rotation continues at the angular velocity at that end.
    Extrapolate = 3,
}

/// A method with its options. All zeros but `size` are the defaults.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct TumbleInterpolation {
    /// `sizeof(TumbleInterpolation)`.
    pub size: usize,
    /// The method's name, such as "slerp" (`tumble_method_name`); null: "bessel-overhauser".
    pub method: *const c_char,
    /// A `TumblePath`.
    pub path: u32,
    /// A `TumbleEnds`.
    pub ends: u32,
    /// A `TumbleQuantity`.
    pub quantity: u32,
    /// A `TumbleSpeed`.
    pub speed: u32,
    /// A `TumbleWrap`: before the first key.
    pub before: u32,
    /// A `TumbleWrap`: after the last key.
    pub after: u32,
    /// The angular velocity at the first key for `TUMBLE_ENDS_CLAMPED`, rad/s, in the body's axes.
    pub start_velocity: [f64; 3],
    /// The same at the last key.
    pub end_velocity: [f64; 3],
    /// The tension of "kochanek-bartels".
    pub tension: f64,
    /// Its continuity.
    pub continuity: f64,
    /// Its bias.
    pub bias: f64,
}

impl TumbleInterpolation {
    /// What the structure says; null is all defaults.
    ///
    /// # Safety
    /// As [`TumbleInterpolation::read_or`].
    pub(crate) unsafe fn read(pointer: *const Self) -> Result<Interpolation, Failure> {
        // SAFETY: as the caller promises.
        unsafe { Self::read_or(pointer, || Ok(method::BESSEL_OVERHAUSER)) }
    }

    /// What the structure says; null is another method with all defaults.
    ///
    /// # Safety
    /// The pointer is null or that of such a structure, whose `method` is null or text that ends with
    /// a zero.
    pub(crate) unsafe fn read_or(
        pointer: *const Self,
        other: impl FnOnce() -> Result<Method, Failure>,
    ) -> Result<Interpolation, Failure> {
        // SAFETY: as the caller promises.
        let structure = unsafe {
            let size = |pointer: *const Self| (&raw const (*pointer).size).cast();
            sized(pointer, size, "interpolation")?
        };
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
        let path = option(self.path, &KeySigns::ALL, "interpolation->path")?;
        let clamped = Ends::Clamped {
            start: DVec3::from_array(self.start_velocity),
            end: DVec3::from_array(self.end_velocity),
        };
        let named = Ends::ALL.map(|ends| match ends {
            Ends::Clamped { .. } => clamped,
            ends => ends,
        });
        let ends = [&[method.ends], &named[..]].concat();
        Ok(Interpolation {
            method,
            signs: method.signs.unwrap_or(path),
            ends: option(self.ends, &ends, "interpolation->ends")?,
            tcb: Tcb {
                tension: self.tension,
                continuity: self.continuity,
                bias: self.bias,
            },
            quantity: option(self.quantity, &Quantity::ALL, "interpolation->quantity")?,
            speed: option(self.speed, &Speed::ALL, "interpolation->speed")?,
            before: option(self.before, &WrapMode::ALL, "interpolation->before")?,
            after: option(self.after, &WrapMode::ALL, "interpolation->after")?,
        })
    }
}

static METHOD_NAMES: LazyLock<Vec<CString>> = LazyLock::new(|| {
    let names = METHODS.iter().map(|method| CString::new(method.name));
    names.map(Result::unwrap_or_default).collect()
});

/// The number of methods.
#[unsafe(no_mangle)]
pub extern "C" fn tumble_method_count() -> usize {
    METHODS.len()
}

/// The name of a method, from 0; null where there is none.
#[unsafe(no_mangle)]
pub extern "C" fn tumble_method_name(index: usize) -> *const c_char {
    let name = METHOD_NAMES.get(index);
    name.map_or(std::ptr::null(), |name| name.as_ptr())
}
