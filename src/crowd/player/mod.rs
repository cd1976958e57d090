//! Crowds: instances that play a library's clips.

#[cfg(feature = "vulkan")]
mod application_device;
mod events;
mod visible;
mod weights;

use bytemuck::Pod;

use crate::crowd::instances::Instances;
use crate::crowd::layer::{CrowdLayer, tick};
use crate::crowd::library::CrowdLibrary;
use crate::crowd::on_cpu::{self, CrowdScene};
use crate::crowd_error::{CrowdError, MAX_INSTANCES, MAX_LAYERS};
use crate::engine::Engine;
use crate::machine::crowd::{CrowdSource, MachineCrowd};
use crate::memory::{reserved, zeroed};
use crate::output::crowd::{CrowdOutput, CrowdValues};
use crate::shader::{CrowdDispatch, CrowdEntry};
use crate::twin::crowd_entries::gather;
use crate::twin::crowd_layers::Layers;
use crate::twin::crowd_matrices::to_any_half;

/// The clock's limit in ticks: below it, f64 represents all whole numbers.
const FARTHEST: f64 = (1u64 << 52) as f64;

/// Many instances of a library's skeleton, each of which plays clips at its time and speed.
///
/// All instances follow one clock, which counts whole ticks. An instance's time in its clip is computed in whole
/// numbers, so a clip in a loop has the same bits in the first second and a day later. A layer is [set](Crowd::set)
/// when the instance starts to play something else; until then it costs no calls.
///
/// The CPU and every Vulkan device give the same bits.
pub struct Crowd {
    engine: Engine,
    pub(crate) library: CrowdLibrary,
    cells: Vec<[f32; 4]>,
    pub(crate) instances: Instances,
    /// The push constants that all dispatches share.
    arguments: CrowdDispatch,
    /// The crowd on the engine's machine; `None` if the host evaluates it.
    pub(crate) device: Option<Box<dyn MachineCrowd>>,
    /// The submission whose result was not taken yet.
    submitted: Option<Submitted>,
    /// Memory for the CPU: the entries of the visible instances, if these are not all instances.
    gathered: Vec<CrowdEntry>,
    /// A bit for each instance.
    seen: Vec<u64>,
}

/// A submission that was not taken yet.
struct Submitted {
    output: CrowdOutput,
    /// Vectors of four numbers of its result.
    len: usize,
    /// The result, if it exists already: on the CPU, and if no instance is visible.
    values: Option<Vec<[f32; 4]>>,
}

impl Engine {
    /// Makes a crowd of 1 to 1 000 000 instances with 1 to 4 layers each.
    ///
    /// All instances stand still at the start of the library's first clip until they are [set](Crowd::set). The
    /// library is copied, also to the device.
    ///
    /// # Errors
    /// When the library has no clips, the number of instances or layers is out of range, there is not enough memory,
    /// or the device fails.
    pub fn crowd(
        &self,
        library: &CrowdLibrary,
        instances: usize,
        layers: usize,
    ) -> Result<Crowd, CrowdError> {
        if library.clip_count() == 0 {
            return Err(CrowdError::NoClips);
        }
        if !(1..=MAX_INSTANCES).contains(&instances) {
            return Err(CrowdError::Instances {
                requested: instances,
            });
        }
        if !(1..=MAX_LAYERS).contains(&layers) {
            return Err(CrowdError::Layers { requested: layers });
        }
        let cells = library.cells()?;
        let still = CrowdLayer {
            speed: 0.0,
            ..CrowdLayer::new(0)
        };
        let still = still.packed(&library.tables.clips, 0, 0)?;
        let mut crowd = Crowd {
            engine: self.clone(),
            library: library.clone(),
            instances: Instances::new(instances, layers, still)?,
            arguments: library.arguments(layers),
            device: None,
            submitted: None,
            gathered: Vec::new(),
            seen: Vec::new(),
            cells,
        };
        crowd.device = crowd.uploaded()?;
        Ok(crowd)
    }
}

impl Crowd {
    /// The tables on the engine's machine; `None` if the host evaluates.
    fn uploaded(&self) -> Result<Option<Box<dyn MachineCrowd>>, CrowdError> {
        let (library, tables) = (&self.library, &self.library.tables);
        Ok(self.engine.machine.crowd(&CrowdSource {
            instances: self.instance_count() as u32,
            clips: &tables.clips,
            bases: &tables.bases,
            spans: &tables.spans,
            channels: &tables.channels,
            cells: &self.cells,
            links: &library.links,
            levels: &library.levels,
            bind: &library.bind,
            forms: tables.forms(),
            arguments: self.arguments,
        })?)
    }

    /// Number of instances.
    #[must_use]
    pub fn instance_count(&self) -> usize {
        self.instances.entries.len() / self.layer_count()
    }

    /// Number of layers of an instance.
    #[must_use]
    pub fn layer_count(&self) -> usize {
        self.arguments.layers as usize
    }

    /// The library from which the crowd was made.
    #[must_use]
    pub fn library(&self) -> &CrowdLibrary {
        &self.library
    }

    /// Sets the clip that a layer of an instance plays from now on. Its 16 bytes reach the device with the next
    /// evaluation. A fade of the layer ends.
    ///
    /// # Errors
    /// When there is no such instance, layer, clip or mask, or a number is out of range; then nothing changes.
    pub fn set(
        &mut self,
        instance: usize,
        layer: usize,
        plays: CrowdLayer,
    ) -> Result<(), CrowdError> {
        let (index, entry) = self.packed(instance, layer, plays)?;
        self.instances.fades.remove(index);
        self.instances.set(index, entry);
        Ok(())
    }

    /// Sets many layers. Each change is an instance, a layer and the clip that it plays. If two changes are for one
    /// layer, the later one counts.
    ///
    /// # Errors
    /// As [`Crowd::set`], with the index of the first change that is refused; then nothing changes.
    pub fn set_all(&mut self, changes: &[(usize, usize, CrowdLayer)]) -> Result<(), CrowdError> {
        for (change, &(instance, layer, plays)) in changes.iter().enumerate() {
            if let Err(reason) = self.packed(instance, layer, plays) {
                let reason = Box::new(reason);
                return Err(CrowdError::Change { change, reason });
            }
        }
        for &(instance, layer, plays) in changes {
            self.set(instance, layer, plays)?;
        }
        Ok(())
    }

    /// The index of a layer's entry, and the new entry.
    fn packed(
        &self,
        instance: usize,
        layer: usize,
        plays: CrowdLayer,
    ) -> Result<(usize, CrowdEntry), CrowdError> {
        let index = self.entry_index(instance, layer)?;
        let (clips, masks) = (&self.library.tables.clips, self.library.mask_count());
        let weight = if layer == 0 { 1.0 } else { plays.weight };
        let entry = CrowdLayer { weight, ..plays }.packed(clips, masks, self.clock())?;
        Ok((index, entry))
    }

    /// The clip that a layer of an instance plays, with its current time. Speed and weight are the rounded ones.
    ///
    /// # Errors
    /// When there is no such instance or layer.
    pub fn get(&self, instance: usize, layer: usize) -> Result<CrowdLayer, CrowdError> {
        let entry = &self.instances.entries[self.entry_index(instance, layer)?];
        let (clips, clock) = (&self.library.tables.clips, self.clock());
        Ok(CrowdLayer::moved(entry, clips, clock, clock))
    }

    /// The tick of its clip at which a layer of an instance is evaluated now, from 0 to the clip's length.
    ///
    /// # Errors
    /// When there is no such instance or layer.
    pub fn tick(&self, instance: usize, layer: usize) -> Result<u32, CrowdError> {
        let entry = &self.instances.entries[self.entry_index(instance, layer)?];
        Ok(tick(entry, &self.library.tables.clips, self.clock()))
    }

    pub(crate) fn entry_index(&self, instance: usize, layer: usize) -> Result<usize, CrowdError> {
        for (subject, index, count) in [
            ("instance", instance, self.instance_count()),
            ("layer", layer, self.layer_count()),
        ] {
            if index >= count {
                return Err(CrowdError::Missing {
                    subject,
                    index,
                    count,
                });
            }
        }
        Ok(instance * self.layer_count() + layer)
    }

    /// The length of a result for the [visible](Crowd::set_visible) instances, `[instance][joint]`, in vectors of
    /// four numbers.
    #[must_use]
    pub fn output_len(&self, output: impl Into<CrowdOutput>) -> usize {
        self.visible_count() * self.library.joint_count() * output.into().vector_count()
    }

    /// The length of a result for the [visible](Crowd::set_visible) instances in bytes: the size of a buffer for
    /// [`Crowd::target`](crate::crowd::player::Crowd). A rotation has 16 bytes and a matrix 48; in 16 bits, half as many.
    #[must_use]
    pub fn output_bytes(&self, output: impl Into<CrowdOutput>) -> u64 {
        let output = output.into();
        (self.visible_count() * self.library.joint_count() * output.bytes()) as u64
    }

    /// Evaluates all [visible](Crowd::set_visible) instances at the clock's time, and waits for the result.
    ///
    /// The result is `[instance][joint]`: a rotation, or the three rows of a matrix.
    ///
    /// # Errors
    /// * When `output` is not exactly as long as the result ([`Crowd::output_len`]).
    /// * When skinning matrices are requested, and the library has no inverse bind matrices.
    /// * When the result of [`Crowd::submit`] was not taken yet.
    /// * When the device fails.
    pub fn evaluate_into(
        &mut self,
        values: CrowdValues,
        output: &mut [[f32; 4]],
    ) -> Result<(), CrowdError> {
        check_len(output.len(), self.output_len(values))?;
        if self.device.is_some() {
            self.submit(values)?;
            return self.wait_into(output);
        }
        self.check_idle(values.into())?;
        self.on_cpu(values, output)
    }

    /// As [`Crowd::evaluate_into`], in 16 bits: `[u16; 4]` are the bits of four half-precision floats.
    ///
    /// # Errors
    /// As [`Crowd::evaluate_into`].
    pub fn evaluate_half_into(
        &mut self,
        values: CrowdValues,
        output: &mut [[u16; 4]],
    ) -> Result<(), CrowdError> {
        check_len(output.len(), self.output_len(values))?;
        self.submit(CrowdOutput::half(values))?;
        self.wait_half_into(output)
    }

    /// Starts an evaluation at the clock's time and returns at once. A Vulkan device evaluates while instances and
    /// the clock are changed for the next frame. The CPU evaluates before this function returns.
    ///
    /// # Errors
    /// As [`Crowd::evaluate_into`], and when the result of the previous submission was not taken.
    pub fn submit(&mut self, output: impl Into<CrowdOutput>) -> Result<(), CrowdError> {
        let output = output.into();
        self.check_idle(output)?;
        let len = self.output_len(output);
        let mut values = None;
        match &mut self.device {
            Some(device) if len > 0 => {
                let layers = self.arguments.layers as usize;
                if let Err(error) = device.submit(output, &self.instances.take_frame(layers)) {
                    // The recorded commands may never have been executed, so the entries on the device are unknown.
                    self.instances.forget();
                    return Err(error.into());
                }
            }
            _ => {
                let found = values.insert(zeroed(len, "a crowd's poses")?);
                self.on_cpu(output.values, found)?;
            }
        }
        self.submitted = Some(Submitted {
            output,
            len,
            values,
        });
        Ok(())
    }

    /// The output of the submission whose result was not taken yet.
    #[must_use]
    pub fn submitted(&self) -> Option<CrowdOutput> {
        self.submitted.as_ref().map(|submitted| submitted.output)
    }

    /// The length of that result, in vectors of four numbers.
    #[must_use]
    pub fn submitted_len(&self) -> Option<usize> {
        self.submitted.as_ref().map(|submitted| submitted.len)
    }

    /// Whether the submitted evaluation has ended, so that [`Crowd::wait_into`] does not wait.
    ///
    /// # Errors
    /// When nothing was submitted, or the device fails.
    pub fn poll(&self) -> Result<bool, CrowdError> {
        match (&self.submitted, &self.device) {
            (None, _) => Err(CrowdError::NothingSubmitted),
            (Some(Submitted { values: None, .. }), Some(device)) => Ok(device.is_done()?),
            _ => Ok(true),
        }
    }

    /// Waits for the submitted evaluation, and takes its result.
    ///
    /// # Errors
    /// When nothing was submitted, the result is in 16 bits, `output` is not as long as the result, or the device
    /// fails.
    pub fn wait_into(&mut self, output: &mut [[f32; 4]]) -> Result<(), CrowdError> {
        self.take_into(false, output, |value| value)
    }

    /// Waits for an evaluation that was submitted in 16 bits, and takes its result.
    ///
    /// # Errors
    /// As [`Crowd::wait_into`].
    pub fn wait_half_into(&mut self, output: &mut [[u16; 4]]) -> Result<(), CrowdError> {
        self.take_into(true, output, |value| value.map(to_any_half))
    }

    /// Takes the result of the submission; `stored` converts a value of the CPU to the output's type.
    fn take_into<T: Pod>(
        &mut self,
        is_half: bool,
        output: &mut [T],
        stored: impl Fn([f32; 4]) -> T,
    ) -> Result<(), CrowdError> {
        let submitted = self.submitted.as_ref();
        let submitted = submitted.ok_or(CrowdError::NothingSubmitted)?;
        if submitted.output.is_half != is_half {
            let is_half = submitted.output.is_half;
            return Err(CrowdError::Precision { is_half });
        }
        check_len(output.len(), submitted.len)?;
        let submitted = self.submitted.take();
        if let Some(found) = submitted.and_then(|submitted| submitted.values) {
            for (stored_value, value) in output.iter_mut().zip(found) {
                *stored_value = stored(value);
            }
            return Ok(());
        }
        let Some(device) = &mut self.device else {
            return Err(CrowdError::NothingSubmitted);
        };
        match device.wait_into(bytemuck::cast_slice_mut(output)) {
            Ok(true) => Ok(()),
            Ok(false) => Err(CrowdError::NothingSubmitted),
            Err(error) => {
                self.instances.forget();
                Err(error.into())
            }
        }
    }

    pub(crate) fn check(&self, output: CrowdOutput) -> Result<(), CrowdError> {
        match output.values == CrowdValues::Skinning && self.library.bind.is_empty() {
            true => Err(CrowdError::NoInverseBind),
            false => Ok(()),
        }
    }

    /// Whether an evaluation can start.
    fn check_idle(&self, output: CrowdOutput) -> Result<(), CrowdError> {
        self.check(output)?;
        match self.submitted {
            Some(_) => Err(CrowdError::StillSubmitted),
            None => Ok(()),
        }
    }

    fn on_cpu(&mut self, values: CrowdValues, output: &mut [[f32; 4]]) -> Result<(), CrowdError> {
        let arguments = &self.arguments;
        let all = &self.instances.entries;
        let mut entries = &all[..];
        if let Some(list) = &self.instances.visible {
            let layers = arguments.layers as usize;
            self.gathered.clear();
            let count = list.len() * layers;
            if self.gathered.capacity() < count {
                self.gathered = reserved(count, "a crowd's poses")?;
            }
            self.gathered.extend(gather(all, list, layers));
            entries = &self.gathered;
        }
        let scene = CrowdScene {
            library: &self.library,
            values,
            clock: self.clock(),
            context: Layers {
                entries,
                channels: &self.library.tables.channels,
                cells: &self.cells,
                positions: &[],
                joints: arguments.joints,
                layers: arguments.layers,
                bases: arguments.bases,
                masks: arguments.masks,
                references: arguments.references,
            },
        };
        Ok(on_cpu::evaluate(scene, &*self.engine.machine, output)?)
    }

    /// The clock's time in ticks.
    #[must_use]
    pub fn clock(&self) -> u64 {
        self.instances.clock
    }

    /// Sets the clock's time in ticks, forwards or backwards. All instances follow.
    ///
    /// # Errors
    /// When `ticks` is 2^52 or more, two centuries at 705 600 ticks a second.
    pub fn set_clock(&mut self, ticks: u64) -> Result<(), CrowdError> {
        let rounded_ticks = ticks as f64;
        if rounded_ticks >= FARTHEST {
            let seconds = rounded_ticks / f64::from(self.library.ticks_per_second());
            return Err(CrowdError::Seconds { seconds });
        }
        let (clips, masks) = (&self.library.tables.clips, self.library.mask_count());
        self.instances.set_clock(ticks, clips, masks);
        Ok(())
    }

    /// Moves the clock forward by `ticks`.
    ///
    /// # Errors
    /// As [`Crowd::set_clock`].
    pub fn advance_ticks(&mut self, ticks: u64) -> Result<(), CrowdError> {
        self.set_clock(self.clock().saturating_add(ticks))
    }

    /// Moves the clock forward by `seconds`, rounded to ticks. If steps are not whole numbers of ticks, the rounding
    /// errors of many steps add up. If the clock must follow frames exactly, as in a film at 30000/1001 frames a
    /// second, use [`Crowd::set_clock`] with each frame's time.
    ///
    /// # Errors
    /// When `seconds` is negative or NaN, and as [`Crowd::set_clock`].
    pub fn advance(&mut self, seconds: f64) -> Result<(), CrowdError> {
        self.advance_ticks(self.clock_ticks(seconds)?)
    }

    /// Rounds a duration in seconds, or a time of the clock, to ticks: for [`Crowd::fade`], for
    /// [`CrowdFade`](crate::crowd::fade::CrowdFade) and for [`Crowd::set_clock`].
    ///
    /// # Errors
    /// When `seconds` is negative or NaN, or 2^52 ticks or more.
    pub fn clock_ticks(&self, seconds: f64) -> Result<u64, CrowdError> {
        let ticks = self.ticks_of(seconds)?;
        u64::try_from(ticks).map_err(|_| CrowdError::NegativeSeconds { seconds })
    }

    /// Rounds a time in seconds to ticks, for [`CrowdLayer::time`](crate::crowd::layer::CrowdLayer::time), which may be
    /// negative: before the clip's first key.
    ///
    /// # Errors
    /// When `seconds` is NaN, or 2^52 ticks or more in magnitude.
    pub fn ticks_of(&self, seconds: f64) -> Result<i64, CrowdError> {
        let ticks = (seconds * f64::from(self.library.ticks_per_second())).round();
        match ticks.abs() < FARTHEST {
            true => Ok(ticks as i64),
            false => Err(CrowdError::Seconds { seconds }),
        }
    }
}

fn check_len(length: usize, needed: usize) -> Result<(), CrowdError> {
    match length == needed {
        true => Ok(()),
        false => Err(CrowdError::OutputLength { length, needed }),
    }
}

impl std::fmt::Debug for Crowd {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Crowd")
            .field("engine", &self.engine)
            .field("instances", &self.instance_count())
            .field("layers", &self.layer_count())
            .field("clock", &self.clock())
            .finish_non_exhaustive()
    }
}
