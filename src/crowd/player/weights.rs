//! Weights of layers, set at once or faded by the clock.

use crate::crowd::fade::{CrowdFade, weight_units};
use crate::crowd::player::Crowd;
use crate::crowd_error::CrowdError;

impl Crowd {
    /// Sets the weight of a layer above the first, 0 to 1, in units of 2^-15. The rest of what it plays goes on, and
    /// a fade of it ends. With the weight 1, a layer that is neither additive nor masked has the bits of its clip.
    ///
    /// # Errors
    /// When there is no such instance or layer, the layer is the first, or the weight is out of range; then
    /// everything stays.
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

    /// Lets the weight of a layer above the first go from what it is now to another one, in equal parts for equal
    /// ticks of the clock, within so many ticks; 0 is at once. From then on it stays. Another fade of the layer,
    /// [`Crowd::set`] and [`Crowd::set_weight`] end it.
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
    /// crowd.set(7, 1, CrowdLayer { weight: 0.0, ..CrowdLayer::new(1) })?;
    /// let half_a_second = crowd.ticks_of(0.5)? as u64;
    /// crowd.fade(7, 1, 1.0, half_a_second)?;
    /// crowd.advance(0.25)?;
    /// assert_eq!(crowd.get(7, 1)?.weight, 0.5);
    /// crowd.advance(0.25)?;
    /// assert_eq!(crowd.get(7, 1)?.weight, 1.0);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// As [`Crowd::set_weight`], or when there is not the memory.
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

    /// Sets the weight of a layer above the first as a function of the clock: as [`Crowd::fade`], from any weight,
    /// and from any time, before now or later. What [`Crowd::get_fade`] reports, set in another crowd whose clock
    /// stands at the same time, gives the same weights at all times.
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

    /// The fade that the weight of a layer follows, with its weights as they were rounded; one that has ended too,
    /// for the clock may go back. `None` where the weight does not change with the clock.
    ///
    /// # Errors
    /// When there is no such instance or layer.
    pub fn get_fade(&self, instance: usize, layer: usize) -> Result<Option<CrowdFade>, CrowdError> {
        let index = self.entry_index(instance, layer)?;
        Ok(self.instances.fades.get(index))
    }

    /// The index of the entry of a layer that has a weight.
    fn weighted_index(&self, instance: usize, layer: usize) -> Result<usize, CrowdError> {
        let index = self.entry_index(instance, layer)?;
        match layer {
            0 => Err(CrowdError::FirstLayer),
            _ => Ok(index),
        }
    }
}
