//! The visible instances of a crowd, which alone are evaluated.

use crate::crowd::player::Crowd;
use crate::crowd_error::CrowdError;
use crate::memory::{reserved, zeroed};

impl Crowd {
    /// Limits evaluations to a list of instances, for example those that a camera sees.
    ///
    /// The result has the rows of these instances only, in the list's order, with the same bits as among all
    /// instances. The clips of the other instances continue without any work. The list may be in any order and may be
    /// empty; no instance may be in it twice. A device gets it with the next evaluation, 4 bytes for each instance,
    /// and only when it changed.
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
    /// When an instance does not exist or is in the list twice, or there is not enough memory; then nothing changes.
    pub fn set_visible(&mut self, instances: &[usize]) -> Result<(), CrowdError> {
        let count = self.instance_count();
        if (self.visible()).is_some_and(|visible| visible.eq(instances.iter().copied())) {
            return Ok(());
        }
        if self.seen.is_empty() {
            self.seen = zeroed(count.div_ceil(64), "a crowd's list of instances")?;
        }
        self.seen.fill(0);
        for (position, &index) in instances.iter().enumerate() {
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
        // A crowd has fewer than 2^32 instances.
        list.extend(instances.iter().map(|&index| index as u32));
        self.instances.set_visible(Some(list));
        Ok(())
    }

    /// Makes all instances visible again.
    pub fn set_all_visible(&mut self) {
        self.instances.set_visible(None);
    }

    /// The visible instances, in the order of results; `None`: all of them.
    #[must_use]
    pub fn visible(&self) -> Option<impl ExactSizeIterator<Item = usize>> {
        let visible = self.instances.visible.as_ref()?.iter();
        Some(visible.map(|&index| index as usize))
    }

    /// Number of visible instances.
    #[must_use]
    pub fn visible_count(&self) -> usize {
        self.instances.visible_count(self.layer_count())
    }
}
