//! Weights of layers: set at once, or changed by the clock.

use crate::crowd::fade::{CrowdFade, weight_units};
use crate::crowd::player::Crowd;
use crate::crowd_error::CrowdError;

impl Crowd {
    /// Sets the weight of a layer above the first, 0 to 1, rounded to a multiple of 2^-15.
    ///
    /// The layer's clip, time and speed stay, and its fade ends. With the weight 1, a layer that is neither additive
    /// nor masked has the bits of its clip.
    ///
    /// # Errors
    /// When there is no such instance or layer, the layer is the first, or the weight is out of range; then nothing
    /// changes.
    pub fn set_weight(
        &mut self,
        instance: usize,
        layer: usize,
        weight: f32,
    ) -> Result<(), CrowdError> {
        let index = self.weighted_index(instance, layer)?;
        let units = weight_units(weight)?;
        self.instances.fades.remove(index);
        self.instances.set_weight(index, units);
        Ok(())
    }

    /// Fades the weight of a layer above the first from its current value to `weight`, linearly within `ticks` of the
    /// clock ([`Crowd::clock_ticks`]); with 0 ticks it changes at once.
    ///
    /// Afterwards the weight stays. [`Crowd::set`], [`Crowd::set_weight`] and another fade of the layer end the fade.
    ///
    /// ```
    /// use tumble::glam::{Quat, Vec3};
    /// use tumble::crowd::{CrowdLayer, CrowdLibrary};
    /// use tumble::{Device, Engine, Skeleton, TrackSet, VectorMethod, method};
    /// let mut library = CrowdLibrary::new(&Skeleton::new(vec![None], vec![Vec3::X])?)?;
    /// for angle in [1.0, 2.0] {
    ///     let mut door = TrackSet::new();
    ///     door.push("door", &[0.0, 2.0], &[Quat::IDENTITY, Quat::from_rotation_y(angle)])?;
    ///     library.push(&door, method::SLERP, VectorMethod::Linear)?;
    /// }
    /// let mut crowd = Engine::new(Device::Cpu)?.crowd(&library, 100, 2)?;
    /// crowd.set(7, 1, CrowdLayer::new(1).with_weight(0.0))?;
    /// let half_a_second = crowd.clock_ticks(0.5)?;
    /// crowd.fade(7, 1, 1.0, half_a_second)?;
    /// crowd.advance(0.25)?;
    /// assert_eq!(crowd.get(7, 1)?.weight, 0.5);
    /// crowd.advance(0.25)?;
    /// assert_eq!(crowd.get(7, 1)?.weight, 1.0);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// As [`Crowd::set_weight`], or when there is not enough memory.
    pub fn fade(
        &mut self,
        instance: usize,
        layer: usize,
        weight: f32,
        ticks: u64,
    ) -> Result<(), CrowdError> {
        let fade = CrowdFade {
            from: self.get(instance, layer)?.weight,
            to: weight,
            start: self.clock(),
            ticks,
        };
        self.set_fade(instance, layer, fade)
    }

    /// Sets the weight of a layer above the first as a function of the clock. Unlike [`Crowd::fade`], it starts at
    /// any weight and at any time, past or future.
    ///
    /// The fade that [`Crowd::get_fade`] returns, set in another crowd at the same time of the clock, gives the same
    /// weights at all times.
    ///
    /// # Errors
    /// As [`Crowd::fade`].
    pub fn set_fade(
        &mut self,
        instance: usize,
        layer: usize,
        fade: CrowdFade,
    ) -> Result<(), CrowdError> {
        let index = self.weighted_index(instance, layer)?;
        let (entries, clock) = (self.instances.entries.len(), self.clock());
        let fades = &mut self.instances.fades;
        let units = fades.insert((index, entries), &fade, clock)?;
        self.instances.set_weight(index, units);
        Ok(())
    }

    /// The fade of a layer's weight, with its rounded weights; also a fade that has ended, because the clock may go
    /// back. `None` if the weight does not change with the clock.
    ///
    /// # Errors
    /// When there is no such instance or layer.
    pub fn get_fade(&self, instance: usize, layer: usize) -> Result<Option<CrowdFade>, CrowdError> {
        let index = self.entry_index(instance, layer)?;
        Ok(self.instances.fades.get(index))
    }

    /// The index of the entry of a layer above the first.
    fn weighted_index(&self, instance: usize, layer: usize) -> Result<usize, CrowdError> {
        let index = self.entry_index(instance, layer)?;
        match layer {
            0 => Err(CrowdError::FirstLayer),
            _ => Ok(index),
        }
    }
}
