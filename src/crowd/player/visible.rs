//! Which instances of a crowd are evaluated.

use crate::crowd::player::Crowd;
use crate::crowd_error::CrowdError;
use crate::memory::{reserved, zeroed};

impl Crowd {
    /// From now on evaluates the instances of a list alone, as a camera sees them: a result has their rows and no
    /// others, in the list's order, with the bits that they have among all. The others go on meanwhile; they cost
    /// nothing. The list is in any order, names no instance twice, and may be empty. It goes to a device with the next
    /// evaluation, 4 bytes for each, and not again while it stays.
    ///
    /// ```
    /// use tumble::glam::{Quat, Vec3};
    /// use tumble::crowd::{CrowdLibrary, CrowdValues};
    /// use tumble::{Device, Engine, Skeleton, TrackSet, VectorMethod, method};
    /// let mut door = TrackSet::new();
    /// door.push("door", &[0.0, 2.0], &[Quat::IDENTITY, Quat::from_rotation_y(1.0)])?;
    /// let mut library = CrowdLibrary::new(&Skeleton::new(vec![None], vec![Vec3::X])?)?;
    /// library.push(&door, method::SLERP, VectorMethod::Linear)?;
    /// let mut crowd = Engine::new(Device::Cpu)?.crowd(&library, 10_000, 1)?;
    /// crowd.set_visible(&[17, 4_711, 3])?;
    /// let mut three = [[0.0; 4]; 3];
    /// crowd.evaluate_into(CrowdValues::Rotations, &mut three)?;
    /// crowd.set_all_visible();
    /// assert_eq!(crowd.visible_count(), 10_000);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// When an instance is not there or is named twice, or there is not the memory; then everything stays.
    pub fn set_visible(&mut self, instances: &[u32]) -> Result<(), CrowdError> {
        let count = self.instance_count();
        if self.instances.visible.as_deref() == Some(instances) {
            return Ok(());
        }
        if self.seen.is_empty() {
            self.seen = zeroed(count.div_ceil(64), "a crowd's list of instances")?;
        }
        self.seen.fill(0);
        for (position, &instance) in instances.iter().enumerate() {
            let index = instance as usize;
            if index >= count {
                return Err(CrowdError::Missing {
                    subject: "instance",
                    index,
                    count,
                });
            }
            let (word, bit) = (&mut self.seen[index / 64], 1 << (index % 64));
            if *word & bit != 0 {
                return Err(CrowdError::Repeated {
                    instance: index,
                    position,
                });
            }
            *word |= bit;
        }
        let mut list = match self.instances.visible.take() {
            Some(list) => list, // which has room for all
            None => reserved(count, "a crowd's list of instances")?,
        };
        list.clear();
        list.extend_from_slice(instances);
        self.instances.set_visible(Some(list));
        Ok(())
    }

    /// From now on evaluates all instances again.
    pub fn set_all_visible(&mut self) {
        self.instances.set_visible(None);
    }

    /// The instances that are evaluated, in the order of results; `None`: all of them.
    #[must_use]
    pub fn visible(&self) -> Option<&[u32]> {
        self.instances.visible.as_deref()
    }

    /// How many instances are evaluated.
    #[must_use]
    pub fn visible_count(&self) -> usize {
        self.instances.visible_count(self.layer_count())
    }
}
