//! Bodies that follow the paths of a set.

use crate::engine::Engine;
use crate::error::Error;
use crate::output::rotations::{Layout, Rotations, Vectors};
use crate::path::options::{Follow, FollowError, FollowWarning};
use crate::path::prepare::PreparedPaths;
use crate::threads::{on_threads, stop};
use crate::time::frames::SampleTimes;
use crate::tracks::set::TrackSet;

/// The positions and rotations of the bodies on a set's paths at every sample.
#[derive(Debug)]
#[non_exhaustive]
pub struct Followed {
    /// Positions.
    pub positions: Vectors,
    /// Rotations from the body's axes to the world's.
    pub rotations: Rotations,
    /// Warnings about some paths.
    pub warnings: Vec<FollowWarning>,
}

impl Engine {
    /// Moves a body along the path of every track of a set. The path is the track's translations
    /// ([`TrackSet::push_path`]). Every device gives the same bits.
    ///
    /// ```
    /// use glam::Vec3;
    /// use tumble::paths::Follow;
    /// use tumble::{Device, Engine, SampleTimes, Layout, TrackSet};
    /// let mut set = TrackSet::new();
    /// let points = [Vec3::ZERO, Vec3::new(1.0, 2.0, 0.0), Vec3::new(3.0, 3.0, 1.0)];
    /// set.push_path("car", &[0.0, 1.0, 2.5], &points, &[])?;
    /// let engine = Engine::new(Device::Cpu)?;
    /// let frames = SampleTimes::fps(60);
    /// let found = engine.follow(&set, &Follow::default(), &frames, Layout::TrackMajor)?;
    /// assert_eq!(found.positions.get(0, 60), Some(points[1]));
    /// let forward = found.rotations.get(0, 60).unwrap() * Vec3::Z;
    /// assert!((forward.length() - 1.0).abs() < 1e-6);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// When a track has no path or cannot be followed as requested, the sample times do not fit the set
    /// ([`SampleTimes::resolve`]), or the device fails.
    pub fn follow(
        &self,
        set: &TrackSet,
        follow: &Follow,
        times: &SampleTimes,
        layout: Layout,
    ) -> Result<Followed, Error> {
        let group_bytes = self.machine.limits().group_bytes;
        let stop = stop::current();
        let prepare = || PreparedPaths::new(set, follow, group_bytes);
        let prepared = on_threads(|| stop::during(stop, prepare))?;
        let prepared = prepared.map_err(|error| match error {
            FollowError::Stopped(stopped) => Error::Stopped(stopped),
            error => Error::Follow(error),
        })?;
        Ok(Followed {
            positions: self.samples_of(prepared.positions, times, layout)?,
            rotations: self.samples_of(prepared.rotations, times, layout)?,
            warnings: prepared.warnings,
        })
    }
}
