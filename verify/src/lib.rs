//! Proof that a device gives Tumble's bits: the parts of `tumble prove` and `tumble lab`, for programs that check devices
//! themselves. `tumble::verify` compares an application's results with the CPU; this crate checks the engine.
//!
//! * [`golden`]: the recorded hashes of several hundred results, which must never change.
//! * [`random`]: random sets, scalars and crowds, evaluated on a device and on the CPU.
//! * `renderer` (feature `vulkan`): a renderer's uses of the engine, on a device that is made as an application makes it.
//! * `figures` (feature `vulkan`): the speed of a device by its clock.
//! * `lab` (feature `vulkan`): other variants of the engine's kernels, measured and compared; details of a device, and the
//!   engine's choices for it.
//!
//! Except for `lab`, it uses only the engine's public interface. The feature `vulkan`, on by default, enables the feature
//! `lab` of `tumble`.
//!
//! ```
//! use tumble::{Device, Engine};
//! use tumble_verify::golden::Golden;
//! let golden = Golden::new();
//! let engine = Engine::new(Device::Cpu)?;
//! let (case, name) = (0, golden.name(0));
//! assert_eq!(Some(&*golden.evaluate(case, &engine)?.hash), Golden::recorded(name));
//!
//! let found = tumble_verify::random::round(&engine, &engine, 1, 0)?;
//! assert_eq!(found.differing, 0);
//! let found = tumble_verify::random::scalars_round(&engine, &engine, 1)?;
//! assert!(found.values >= 1 << 20 && found.differing == 0);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

#[cfg(feature = "vulkan")]
mod application;
mod differences;
#[cfg(feature = "vulkan")]
pub mod figures;
pub mod golden;
#[cfg(feature = "vulkan")]
mod instance;
pub mod random;
#[cfg(feature = "vulkan")]
pub mod renderer;
mod sets;

#[cfg(feature = "vulkan")]
pub mod lab {
    //! Measurements with the engine's private parts, which therefore are in the engine: the lab of `tumble lab`, results
    //! that stay on a device (`Clip::resident`), the rate at which a device writes its memory (`Engine::write_rates`),
    //! details of a device (`Engine::device_details`), and the engine's choices for it (`Engine::choices`).

    #[doc(inline)]
    pub use tumble::lab::{
        Ceiling, Decision, DeviceDetails, EngineChoices, FloatControlsReport, HalfConversion,
        KernelVariant, LabOptions, LabReport, LabRow, Limits, MemoryHeap, MemoryType, QueueFamily,
        RejectedVariant, Resident, ResidentTime, RunList, StoreCaching, Timed, VariantTime,
        WriteRates, lab,
    };
}
