//! The clock of a crowd, which all of its instances follow.

use crate::crowd::player::Crowd;
use crate::crowd_error::CrowdError;

/// The farthest that a clock goes, ticks: whole numbers of f64.
const FARTHEST: f64 = (1u64 << 52) as f64;

impl Crowd {
    /// The clock, ticks.
    #[must_use]
    pub fn clock(&self) -> u64 {
        self.instances.clock
    }

    /// Sets the clock, ticks; all instances move with it, forwards or backwards.
    ///
    /// # Errors
    /// From 2^52 ticks on, which is two centuries at 705 600 ticks a second.
    pub fn set_clock(&mut self, ticks: u64) -> Result<(), CrowdError> {
        let given = ticks as f64;
        if given >= FARTHEST {
            let seconds = given / f64::from(self.library.ticks_per_second());
            return Err(CrowdError::Seconds { seconds });
        }
        let (clips, masks) = (&self.library.tables.clips, self.library.masks());
        self.instances.set_clock(ticks, clips, masks);
        Ok(())
    }

    /// Moves the clock on by some ticks.
    ///
    /// # Errors
    /// As [`Crowd::set_clock`].
    pub fn advance_ticks(&mut self, ticks: u64) -> Result<(), CrowdError> {
        self.set_clock(self.clock().saturating_add(ticks))
    }

    /// Moves the clock on by the ticks nearest to some seconds. Where the sum must not drift, as in a
    /// film at 30000/1001 frames a second, [`Crowd::set_clock`] to the ticks of each frame's time.
    ///
    /// # Errors
    /// When the seconds are negative or no number, and as [`Crowd::set_clock`].
    pub fn advance(&mut self, seconds: f64) -> Result<(), CrowdError> {
        match u64::try_from(self.ticks_of(seconds)?) {
            Ok(ticks) => self.advance_ticks(ticks),
            Err(_) => Err(CrowdError::Seconds { seconds }),
        }
    }

    /// The ticks nearest to a time in seconds, for [`CrowdLayer::time`](crate::crowd::layer::CrowdLayer::time).
    ///
    /// # Errors
    /// When it is no number, or out of reach.
    pub fn ticks_of(&self, seconds: f64) -> Result<i64, CrowdError> {
        let ticks = (seconds * f64::from(self.library.ticks_per_second())).round();
        match ticks.abs() < FARTHEST {
            true => Ok(ticks as i64),
            false => Err(CrowdError::Seconds { seconds }),
        }
    }
}
