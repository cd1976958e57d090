//! The choice of a device by measured time.

use std::collections::HashSet;
use std::time::{Duration, Instant};

use glam::Quat;

use crate::device::Device;
use crate::engine::Engine;
use crate::error::Error;
use crate::machine::cache::{self, Cache};
use crate::machine::options::EngineOptions;
use crate::method::slerp::SLERP;
use crate::output::buffer::OutputBuffer;
use crate::output::rotations::Layout;
use crate::time::frames::SampleTimes;
use crate::tracks::set::TrackSet;

/// The CPU evaluates fewer rotations than this in 1 to 3 ms, while opening a device alone takes 50 ms. See
/// [`Engine::auto`].
const MIN_ROTATIONS_FOR_DEVICE: usize = 1 << 20;

const PROBE_TRACKS: usize = 512;
const PROBE_FRAMES: usize = 1024;

/// A set for measuring a device: 2^19 rotations are evaluated from it.
#[allow(clippy::disallowed_methods)] // only times are measured; the results are discarded, so their last bits do not matter
fn probe() -> Result<TrackSet, Error> {
    let last = (PROBE_FRAMES - 1) as f64;
    let times = (0..18u8).map(|i| last * f64::from(i) / 17.0).collect();
    let keys = (0..18u8).map(|i| Quat::from_rotation_y(f32::from(i) * 0.7));
    let keys = keys.collect::<Vec<_>>().repeat(PROBE_TRACKS);
    Ok(TrackSet::from_shared_times(times, keys)?)
}

/// The name under which the probe time of a device's model is cached. It depends on the driver and on the version of
/// the engine. `None` for the CPU.
fn model(device: &Device) -> Option<String> {
    let Device::Vulkan(device) = device else {
        return None;
    };
    let info = device.info();
    let (vendor, number) = (info.vendor_id, info.device_id);
    let software = format!(
        "{} {} {}",
        info.driver,
        info.api_version,
        env!("CARGO_PKG_VERSION")
    );
    let software = cache::sum("probe", software.as_bytes());
    Some(format!("probe-{vendor:x}-{number:x}-{software:016x}"))
}

/// The cached probe time of a model.
fn remembered(cache: &Cache, model: &str) -> Option<Duration> {
    let nanoseconds = cache.read(model, size_of::<u64>())?.try_into().ok()?;
    Some(Duration::from_nanos(u64::from_le_bytes(nanoseconds)))
}

impl Engine {
    /// Opens the device that evaluates large results fastest. It is the default when there is no reason for a certain
    /// device, and the same as [`Engine::auto_for`] with a very large number of rotations.
    ///
    /// ```
    /// let engine = tumble::Engine::auto()?;
    /// println!("evaluating on {}", engine.device_name());
    /// # Ok::<(), tumble::Error>(())
    /// ```
    ///
    /// # Errors
    /// When the system refuses the resources of the CPU engine.
    pub fn auto() -> Result<Self, Error> {
        Self::auto_for(usize::MAX)
    }

    /// Opens the device that is fastest if each call evaluates `rotations` rotations into the host's memory. All
    /// devices give the same bits, so only the time depends on the choice. The rule:
    ///
    /// * For fewer than 2^20 rotations: the CPU, which evaluates them before a device is even open.
    /// * Software devices (drivers such as Mesa's lavapipe and `SwiftShader`) are never chosen: they compute on the
    ///   CPU too, and are slower.
    /// * Otherwise every exact device and the CPU evaluate a probe of 2^19 rotations, and the shortest of three times
    ///   counts. The time of a card's model with its driver is stored ([`CacheFiles`](crate::CacheFiles)), so that
    ///   later processes open only the fastest device.
    ///
    /// # Errors
    /// When the system refuses the resources of the CPU engine.
    pub fn auto_for(rotations: usize) -> Result<Self, Error> {
        Self::auto_with(rotations, &EngineOptions::default())
    }

    /// As [`Engine::auto_for`], and opens the chosen device with options. Devices are compared without them, except
    /// for [`EngineOptions::cache_files`]; one that fails the self-test is not chosen.
    ///
    /// # Errors
    /// When an option is out of range, or the system refuses the resources of the CPU engine.
    pub fn auto_with(rotations: usize, options: &EngineOptions) -> Result<Self, Error> {
        let cpu = Self::with_options(Device::Cpu, options)?;
        let compared = EngineOptions {
            cache_files: options.cache_files.clone(),
            ..EngineOptions::default()
        };
        if rotations < MIN_ROTATIONS_FOR_DEVICE {
            return Ok(cpu);
        }
        let cache = Cache::new(&options.cache_files);
        let (mut models, mut timed) = (HashSet::new(), Vec::new());
        for device in Device::list().unwrap_or_default() {
            // Cards of one model are equally fast, so only the first one is measured.
            let Some(model) = model(&device).filter(|_| !device.is_software()) else {
                continue;
            };
            if models.contains(&model) {
                continue;
            }
            if let Some(time) = remembered(&cache, &model) {
                timed.push((time, device, None));
            } else if let Ok(engine) = Self::with_options(device.clone(), &compared)
                && let Ok(time) = engine.probe_time()
            {
                cache.write(&model, &(time.as_nanos() as u64).to_le_bytes());
                timed.push((time, device, Some(engine).filter(|_| compared == *options)));
            } else {
                continue; // one that fails is not chosen
            }
            models.insert(model);
        }
        if timed.is_empty() {
            return Ok(cpu);
        }
        let of_cpu = cpu.probe_time()?;
        timed.retain(|(time, ..)| *time < of_cpu);
        timed.sort_by_key(|(time, ..)| *time);
        let mut engines = timed
            .into_iter()
            .filter_map(|(_, device, opened)| match opened {
                Some(engine) => Some(engine),
                None => Self::with_options(device, options).ok(),
            });
        Ok(engines.next().unwrap_or(cpu))
    }

    /// Measures how long this engine takes to evaluate a probe of 2^19 rotations: the shortest of three times, after
    /// one that is ignored.
    ///
    /// Making and uploading the probe is not timed. [`Engine::auto_for`] compares devices by this time. The four
    /// evaluations are included in [`Engine::take_timings`].
    ///
    /// # Errors
    /// When the device fails, or there is not enough memory for the probe.
    pub fn probe_time(&self) -> Result<Duration, Error> {
        let clip = self.upload(&probe()?, SLERP)?;
        let mut output = OutputBuffer::new(PROBE_TRACKS * PROBE_FRAMES)?;
        let mut time = || {
            let started = Instant::now();
            clip.evaluate_into(&SampleTimes::fps(1), Layout::TrackMajor, &mut output)?;
            Ok::<_, Error>(started.elapsed())
        };
        // The first run does not count, because caches are cold and some drivers compile then.
        time()?;
        Ok(time()?.min(time()?).min(time()?))
    }
}
