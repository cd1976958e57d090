//! A library of clips for one skeleton, prepared for crowds.

use std::borrow::Cow;

use bytemuck::Zeroable as _;
use glam::Vec3;
use rayon::prelude::*;

use crate::crowd::clip_keys::KeyPrecision;
use crate::crowd::clip_tables::{ClipStorage, ClipTables, MAX_ENTRIES};
use crate::crowd::compact::CrowdStorage;
use crate::crowd::events::ClipEvent;
use crate::crowd::stages;
use crate::crowd::states::MotionTables;
use crate::crowd_error::{CrowdError, MAX_CLIPS, MAX_MASKS, MAX_TICKS};
use crate::engine::Engine;
use crate::math::canonical::canonical;
use crate::memory::reserved;
use crate::method::interpolation::Interpolation;
use crate::method::vector_method::VectorMethod;
use crate::pose::affine::AffineMatrix;
use crate::pose::skeleton::Skeleton;
use crate::shader::{CHANNELS, CrowdDispatch, CrowdLink, ROOT};
use crate::threads::stop;
use crate::tracks::joints::Joints;
use crate::tracks::set::TrackSet;
use crate::twin::crowd_matrices::Rows;

/// The default number of ticks in a second. With it, a frame of 24, 25, 30, 48, 50, 60, 90, 100, 120, 144, 240 or 360
/// Hz lasts a whole number of ticks, and so does a sample of 44.1 kHz.
const TICKS_PER_SECOND: u32 = 705_600;

/// The clips, masks and inverse bind matrices of one skeleton, prepared for crowds.
///
/// ```
/// use tumble::glam::{Quat, Vec3};
/// use tumble::crowd::{CrowdLayer, CrowdLibrary, CrowdValues};
/// use tumble::{Device, Engine, Skeleton, TrackSet, VectorMethod, method};
/// let mut walk = TrackSet::new();
/// walk.push("hip", &[0.0, 1.0], &[Quat::IDENTITY, Quat::from_rotation_y(1.0)])?;
/// walk.push("knee", &[0.0, 1.0], &[Quat::IDENTITY, Quat::from_rotation_x(0.5)])?;
/// let skeleton = Skeleton::new(vec![None, Some(0)], vec![Vec3::ZERO, Vec3::new(0.0, -0.5, 0.0)])?;
/// let mut library = CrowdLibrary::new(&skeleton)?;
/// let walk = library.push(&walk, method::SLERP, VectorMethod::Linear)?;
///
/// let engine = Engine::new(Device::Cpu)?;
/// let mut crowd = engine.crowd(&library, 1000, 1)?;
/// for instance in 0..1000 {
///     crowd.set(instance, 0, CrowdLayer::new(walk).at(instance as i64 * 700))?;
/// }
/// let mut matrices = vec![[0.0; 4]; 1000 * 2 * 3];
/// crowd.advance(1.0 / 60.0)?;
/// crowd.evaluate_into(CrowdValues::Model, &mut matrices)?;
/// assert!((matrices[3 * 3][3] - 0.0).abs() < 1e-6); // knees hang below hips
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone)]
pub struct CrowdLibrary {
    pub(crate) tables: ClipTables,
    offsets: Vec<Vec3>,
    /// The joints that have a parent, level by level: parents before their children.
    pub(crate) links: Vec<CrowdLink>,
    /// The index of each level's first link, then the number of links.
    pub(crate) levels: Vec<u32>,
    /// A weight for each joint of each mask; in the first mask all weights are 1.
    masks: Vec<f32>,
    /// The rows of each joint's inverse bind matrix; empty if none were set.
    pub(crate) bind: Vec<Rows>,
    /// The reference poses, `[clip][joint]`: a rotation, a translation and the reciprocals of a scale.
    references: Vec<[f32; 4]>,
    ticks_per_second: u32,
    /// Moments of clips, in the order in which they were added.
    pub(crate) events: Vec<ClipEvent>,
    /// The names of the joints: those of the skeleton, else those of the first clip; `None` until one is known.
    joints: Option<Joints>,
}

impl CrowdLibrary {
    /// An empty library for a skeleton, with 705 600 ticks a second. A clip may last up to 50 minutes.
    ///
    /// # Errors
    /// When the skeleton has no joints.
    pub fn new(skeleton: &Skeleton) -> Result<Self, CrowdError> {
        Self::with_ticks(skeleton, TICKS_PER_SECOND)
    }

    /// An empty library for a skeleton, with the number of ticks in a second. With fewer ticks, clips may be longer:
    /// a clip has up to 2 147 221 504 ticks.
    ///
    /// # Errors
    /// When the skeleton has no joints, or the number of ticks is 0 or above 2 147 221 504.
    pub fn with_ticks(skeleton: &Skeleton, ticks_per_second: u32) -> Result<Self, CrowdError> {
        if !(1..=MAX_TICKS).contains(&ticks_per_second) {
            return Err(CrowdError::TicksPerSecond { ticks_per_second });
        }
        let joints = skeleton.len();
        if joints == 0 {
            return Err(CrowdError::NoJoints);
        }
        let mut offsets = vec![Vec3::ZERO; joints];
        let mut depths = vec![0u32; joints];
        let (mut links, mut levels) = (Vec::new(), vec![0]);
        // In this order, parents come before their children, and each level before the next.
        for link in skeleton.links() {
            let joint = link.track as usize;
            offsets[joint] = Vec3::from_array(link.offset.map(canonical));
            if link.parent == ROOT {
                continue;
            }
            depths[joint] = depths[link.parent as usize] + 1;
            if depths[joint] as usize > levels.len() {
                levels.push(links.len() as u32);
            }
            links.push(CrowdLink {
                joint: link.track,
                parent: link.parent,
            });
        }
        levels.push(links.len() as u32);
        Ok(Self {
            tables: ClipTables::default(),
            offsets,
            links,
            levels,
            masks: vec![1.0; joints],
            bind: Vec::new(),
            references: Vec::new(),
            ticks_per_second,
            events: Vec::new(),
            joints: match skeleton.names() {
                [] => None,
                names => Some(Joints::named(names)),
            },
        })
    }

    /// Sets how clips are stored that are added from now on. Poses have the same bits; compact clips take less memory and
    /// more time.
    ///
    /// ```
    /// # use tumble::glam::{Quat, Vec3};
    /// # use tumble::crowd::{CrowdLibrary, CrowdStorage};
    /// # use tumble::{Skeleton, TrackSet, VectorMethod, method};
    /// let mut spin = TrackSet::new();
    /// let times: Vec<f64> = (0..300).map(|key| f64::from(key) / 30.0).collect();
    /// let keys: Vec<Quat> = times.iter().map(|time| Quat::from_rotation_y(*time as f32)).collect();
    /// spin.push("hip", &times, &keys)?;
    /// let skeleton = Skeleton::new(vec![None], vec![Vec3::ZERO])?;
    /// let mut library = CrowdLibrary::new(&skeleton)?;
    /// library.set_storage(CrowdStorage::Compact);
    /// library.push(&spin, method::BESSEL_OVERHAUSER, VectorMethod::Linear)?;
    /// assert!(library.bytes_per_key() < 70.0); // as segments 209; other joints share the times and weights, 32 bytes of it
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn set_storage(&mut self, storage: CrowdStorage) {
        self.tables.storage = ClipStorage::Crowd(storage);
    }

    /// How clips are stored that are added next.
    #[must_use]
    pub fn storage(&self) -> CrowdStorage {
        match self.tables.storage {
            ClipStorage::Crowd(storage) => storage,
            ClipStorage::Motion(_) => CrowdStorage::Segments,
        }
    }

    /// Bytes of the clips divided by the number of their keys (of rotations, translations and scales), on the CPU and on
    /// devices: curves, times and reference poses.
    #[must_use]
    pub fn bytes_per_key(&self) -> f64 {
        let bytes = self.tables.bytes() + size_of_val(&*self.references);
        bytes as f64 / self.tables.key_count.max(1) as f64
    }

    /// Number of ticks in a second.
    #[must_use]
    pub fn ticks_per_second(&self) -> u32 {
        self.ticks_per_second
    }

    /// Number of joints of the skeleton.
    #[must_use]
    pub fn joint_count(&self) -> usize {
        self.offsets.len()
    }

    /// The name of each joint; empty until the skeleton or the first clip determines them. A joint without a name is
    /// `box1`, `box2` … by its index.
    #[must_use]
    pub fn joint_names(&self) -> &[String] {
        self.joints.as_ref().map_or(&[], Joints::names)
    }

    /// Number of clips.
    #[must_use]
    pub fn clip_count(&self) -> usize {
        self.tables.clips.len()
    }

    /// Number of masks.
    #[must_use]
    pub fn mask_count(&self) -> usize {
        self.masks.len() / self.joint_count() - 1
    }

    /// The length of a clip in ticks: from its first key (of a rotation, translation or scale) to its last, and at
    /// least 1. This is also the period of a loop. `None` if there is no such clip.
    #[must_use]
    pub fn ticks(&self, clip: usize) -> Option<u32> {
        self.tables.clips.get(clip).map(|clip| clip.period)
    }

    /// Adds a clip and returns its index.
    ///
    /// The set has one track for each joint, of the same name, in any order. The joints have the names of the skeleton
    /// ([`Skeleton::with_names`]), else those of the first clip, whose tracks are then in the order of the skeleton. Sets
    /// without names are matched by index. Rotations are interpolated by `interpolation`, translations and scales
    /// by `vectors`. Joints without translations stay at their offsets in the skeleton. The wrap modes of
    /// `interpolation` are ignored, because each layer of an instance has its wrap mode. The reference pose of the
    /// clip, for additive layers, is its pose at its start ([`CrowdLibrary::set_reference`]).
    ///
    /// # Errors
    /// * When the set does not have exactly one track for each joint, or a track has the name of no joint.
    /// * When a track cannot be interpolated as requested, or the interpolation computes velocities or accelerations.
    /// * When a curve rotates so fast that no polynomial fits it.
    /// * When the clip has too many ticks, or the library is full.
    /// * When there is not enough memory.
    pub fn push(
        &mut self,
        set: &TrackSet,
        interpolation: impl Into<Interpolation>,
        vectors: VectorMethod,
    ) -> Result<usize, CrowdError> {
        if self.clip_count() == MAX_CLIPS {
            return Err(CrowdError::TooManyClips);
        }
        let clip = self.push_tables(set, interpolation.into(), vectors)?;
        let reference = self.tables.reference(self.joint_count(), clip, 0);
        self.references.extend(reference);
        Ok(clip)
    }

    fn push_clip(&mut self, clip: &MotionClip<'_>) -> Result<usize, CrowdError> {
        self.push_tables(&clip.set, clip.interpolation, clip.vectors)
    }

    /// The same skeleton without clips.
    fn clone_without_tables(&self) -> Self {
        Self {
            tables: ClipTables {
                storage: self.tables.storage,
                ..ClipTables::default()
            },
            offsets: self.offsets.clone(),
            links: self.links.clone(),
            levels: self.levels.clone(),
            masks: self.masks.clone(),
            bind: self.bind.clone(),
            references: Vec::new(),
            ticks_per_second: self.ticks_per_second,
            events: Vec::new(),
            joints: self.joints.clone(),
        }
    }

    /// Adds the tables of a clip, which has no reference pose yet.
    fn push_tables(
        &mut self,
        set: &TrackSet,
        interpolation: Interpolation,
        vectors: VectorMethod,
    ) -> Result<usize, CrowdError> {
        let (tracks, joints) = (set.track_count(), self.joint_count());
        let named = Joints::of(set);
        let order = match &self.joints {
            // If both have names, the message names the missing joint instead of the numbers of joints.
            Some(known) if tracks == joints || (known.is_named() && named.is_named()) => {
                known.order_of(&named, ["the library", "the clip"])?
            }
            None if tracks == joints => (0..joints).collect(),
            _ => return Err(CrowdError::Tracks { tracks, joints }),
        };
        let is_shuffled = !set.is_in_order(&order);
        let selected = is_shuffled.then(|| set.select(order)).transpose();
        // Only an index that is out of range is an error.
        let selected = selected.map_err(|_| CrowdError::Tracks { tracks, joints })?;
        let set = selected.as_ref().unwrap_or(set);
        let clip = self.clip_count();
        let (ticks, offsets) = (self.ticks_per_second, &self.offsets);
        self.tables
            .push(set, interpolation, vectors, ticks, offsets)?;
        self.joints.get_or_insert(named);
        Ok(clip)
    }

    /// Sets the reference pose of `clip`, from which its additive layers differ: the pose of the clip `from` at `tick`;
    /// for ticks after the end of `from`, its last pose. A reference scale of 0 counts as 1.
    ///
    /// # Errors
    /// When one of the two clips does not exist.
    pub fn set_reference(&mut self, clip: usize, from: usize, tick: u32) -> Result<(), CrowdError> {
        let (joints, count) = (self.joint_count(), self.clip_count());
        if let Some(index) = [clip, from].into_iter().find(|&index| index >= count) {
            let subject = "clip";
            return Err(CrowdError::Missing {
                subject,
                index,
                count,
            });
        }
        let references = &mut self.references[clip * joints * CHANNELS as usize..];
        for (reference, value) in references
            .iter_mut()
            .zip(self.tables.reference(joints, from, tick))
        {
            *reference = value;
        }
        Ok(())
    }

    /// Adds an event to a clip and returns the event's index. Crowds that exist already do not have it.
    ///
    /// # Errors
    /// When there is no such clip, or the tick is after its end.
    pub fn push_event(
        &mut self,
        clip: usize,
        tick: u32,
        name: impl Into<String>,
    ) -> Result<usize, CrowdError> {
        let count = self.clip_count();
        let Some(ticks) = self.ticks(clip) else {
            return Err(CrowdError::Missing {
                subject: "clip",
                index: clip,
                count,
            });
        };
        if tick > ticks {
            return Err(CrowdError::EventTick { tick, ticks });
        }
        let name = name.into();
        self.events.push(ClipEvent { clip, tick, name });
        Ok(self.events.len() - 1)
    }

    /// The events of all clips, in the order in which they were added.
    #[must_use]
    pub fn events(&self) -> &[ClipEvent] {
        &self.events
    }

    /// Adds a mask and returns its index. A mask has a weight from 0 to 1 for each joint, by which the weights of
    /// layers are multiplied.
    ///
    /// # Errors
    /// When the number of weights is not the number of joints, a weight is outside 0 to 1, or the library has 31 masks already.
    pub fn push_mask(&mut self, weights: &[f32]) -> Result<usize, CrowdError> {
        let mask = self.mask_count();
        self.check_joints("weights", weights.len())?;
        if mask == MAX_MASKS {
            return Err(CrowdError::TooManyMasks);
        }
        let outside = |weight: &f32| !(0.0..=1.0).contains(weight);
        if let Some(joint) = weights.iter().position(outside) {
            let weight = weights[joint];
            return Err(CrowdError::MaskWeight { joint, weight });
        }
        self.masks
            .extend(weights.iter().map(|&weight| canonical(weight)));
        Ok(mask)
    }

    /// Converts poses of [`CrowdValues::Local`](crate::crowd::CrowdValues::Local) to
    /// [`CrowdValues::Model`](crate::crowd::CrowdValues::Model), in place, with the same bits as a crowd that evaluates
    /// [`CrowdValues::Model`](crate::crowd::CrowdValues::Model) directly. Before, a program may change the local
    /// transforms, for example by inverse kinematics. `poses` are `[instance][joint]`, three rows of four numbers each,
    /// of any number of instances; several threads may take a part each.
    ///
    /// ```
    /// use tumble::glam::{Quat, Vec3};
    /// use tumble::crowd::{CrowdLibrary, CrowdValues};
    /// use tumble::{Device, Engine, Skeleton, TrackSet, VectorMethod, method};
    /// # let mut walk = TrackSet::new();
    /// # walk.push("hip", &[0.0, 1.0], &[Quat::IDENTITY, Quat::from_rotation_y(1.0)])?;
    /// # walk.push("knee", &[0.0, 1.0], &[Quat::IDENTITY, Quat::from_rotation_x(0.5)])?;
    /// # let skeleton = Skeleton::new(vec![None, Some(0)], vec![Vec3::ZERO, Vec3::new(0.0, -0.5, 0.0)])?;
    /// # let mut library = CrowdLibrary::new(&skeleton)?;
    /// # library.push(&walk, method::SLERP, VectorMethod::Linear)?;
    /// let mut crowd = Engine::new(Device::Cpu)?.crowd(&library, 100, 1)?;
    /// let mut poses = vec![[0.0; 4]; crowd.output_len(CrowdValues::Local)];
    /// crowd.evaluate_into(CrowdValues::Local, &mut poses)?;
    /// for pose in poses.chunks_exact_mut(3 * library.joint_count()) {
    ///     pose[1][3] += 0.25; // the hip is the first joint: its row 1 is y, whose last number is the translation
    /// }
    /// library.local_to_model(&mut poses)?;
    /// assert_eq!(poses[3 + 1][3], -0.5 + 0.25);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// When `poses` is not a whole number of instances.
    pub fn local_to_model(&self, poses: &mut [[f32; 4]]) -> Result<(), CrowdError> {
        for pose in self.poses(poses)? {
            stages::walk(&self.links, pose.as_chunks_mut().0);
        }
        Ok(())
    }

    /// Converts poses of [`CrowdValues::Model`](crate::crowd::CrowdValues::Model) to
    /// [`CrowdValues::Skinning`](crate::crowd::CrowdValues::Skinning), in place, as [`CrowdLibrary::local_to_model`].
    ///
    /// # Errors
    /// When `poses` is not a whole number of instances, or the library has no inverse bind matrices.
    pub fn model_to_skinning(&self, poses: &mut [[f32; 4]]) -> Result<(), CrowdError> {
        if self.bind.is_empty() {
            return Err(CrowdError::NoInverseBind);
        }
        for pose in self.poses(poses)? {
            stages::skin(&self.bind, pose.as_chunks_mut().0);
        }
        Ok(())
    }

    /// The instances of poses of three vectors for each joint.
    fn poses<'a>(
        &self,
        poses: &'a mut [[f32; 4]],
    ) -> Result<std::slice::ChunksExactMut<'a, [f32; 4]>, CrowdError> {
        let (length, each) = (poses.len(), 3 * self.joint_count());
        match length.is_multiple_of(each) {
            true => Ok(poses.chunks_exact_mut(each)),
            false => Err(CrowdError::PartOfPose { length, each }),
        }
    }

    /// Sets the inverse bind matrix of every joint: the inverse of the joint's model matrix in the bind pose, as
    /// [`Affine3A`](glam::Affine3A) or as three rows of four numbers.
    ///
    /// # Errors
    /// When there is not one matrix for each joint, or a number is not finite.
    pub fn set_inverse_bind<M: AffineMatrix>(&mut self, matrices: &[M]) -> Result<(), CrowdError> {
        self.check_joints("inverse bind matrices", matrices.len())?;
        let is_finite = |matrix: &M| matrix.rows().as_flattened().iter().all(|x| x.is_finite());
        if let Some(joint) = matrices.iter().position(|matrix| !is_finite(matrix)) {
            return Err(CrowdError::BindNotFinite { joint });
        }
        let rows = |matrix: &M| matrix.rows().map(|row| row.map(canonical));
        self.bind = matrices.iter().map(rows).collect();
        Ok(())
    }

    fn check_joints(&self, subject: &'static str, count: usize) -> Result<(), CrowdError> {
        let joints = self.joint_count();
        match count == joints {
            true => Ok(()),
            false => Err(CrowdError::Joints {
                subject,
                count,
                joints,
            }),
        }
    }

    /// All constants that kernels read: the constants and keys of segments, then the masks, then the reference poses.
    pub(crate) fn cells(&self) -> Result<Vec<[f32; 4]>, CrowdError> {
        let clip_cells = &self.tables.cells;
        let count = clip_cells.len() + self.masks.len() + self.references.len();
        if count > MAX_ENTRIES {
            return Err(CrowdError::TooLarge);
        }
        let mut cells = reserved(count, "a crowd's library")?;
        cells.extend_from_slice(clip_cells);
        cells.extend(self.masks.iter().map(|&weight| [weight, 0.0, 0.0, 0.0]));
        cells.extend_from_slice(&self.references);
        Ok(cells)
    }

    /// The push constants of a crowd with `layers` layers: its sizes, and the indices of the first mask and of the
    /// first reference pose among the cells.
    pub(crate) fn arguments(&self, layers: usize) -> CrowdDispatch {
        let masks = self.tables.cells.len();
        let bases = self.tables.clips.iter().map(|clip| clip.bases).max();
        CrowdDispatch {
            joints: self.joint_count() as u32,
            layers: layers as u32,
            bases: bases.unwrap_or(1),
            masks: masks as u32,
            references: (masks + self.masks.len()) as u32,
            ..CrowdDispatch::zeroed()
        }
    }

    /// Converts the library's clips to tables. Returns the tables, then their two large parts: the spans (intervals in
    /// ticks) and the cells (constants and keys). Masks, reference poses and inverse bind matrices are not included.
    #[must_use]
    pub fn into_tables(self) -> (MotionTables, Vec<[u32; 4]>, Vec<[f32; 4]>) {
        let (ticks_per_second, joints) = (self.ticks_per_second(), self.joint_count());
        let tables = self.tables.with_segments();
        MotionTables::of_library(tables, self.links, joints, ticks_per_second)
    }
}

/// Collects clips of one skeleton for [`MotionTables`]. Rotations on arcs (slerp) and translations on lines are kept as
/// their keys, which takes a third of the memory of a [`CrowdLibrary`] or less, with the same bits.
///
/// ```
/// use tumble::glam::{Quat, Vec3};
/// use tumble::crowd::{KeyPrecision, MotionBuilder};
/// use tumble::{Skeleton, TrackSet, VectorMethod, method};
/// let mut door = TrackSet::new();
/// door.push("door", &[0.0, 2.0], &[Quat::IDENTITY, Quat::from_rotation_y(1.0)])?;
/// let skeleton = Skeleton::new(vec![None], vec![Vec3::X])?;
/// let mut builder = MotionBuilder::new(&skeleton, 705_600, KeyPrecision::Packed)?;
/// builder.push(&door, method::SLERP, VectorMethod::Linear)?;
/// let (tables, spans, cells) = builder.finish();
/// assert_eq!(tables.clip_count(), 1);
/// # let _ = (spans, cells);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone)]
pub struct MotionBuilder(CrowdLibrary);

/// A clip for [`MotionBuilder::push_all`].
#[derive(Debug, Clone)]
pub struct MotionClip<'a> {
    /// The tracks, one for each joint of the skeleton.
    pub set: Cow<'a, TrackSet>,
    /// How rotations are interpolated.
    pub interpolation: Interpolation,
    /// How translations are interpolated.
    pub vectors: VectorMethod,
}

/// The number of clips that are prepared together. Their tables exist twice for a moment.
const CLIPS_AT_ONCE: usize = 128;

impl MotionBuilder {
    /// No clips yet, with a number of ticks in a second.
    ///
    /// # Errors
    /// As [`CrowdLibrary::with_ticks`].
    pub fn new(
        skeleton: &Skeleton,
        ticks_per_second: u32,
        precision: KeyPrecision,
    ) -> Result<Self, CrowdError> {
        let mut library = CrowdLibrary::with_ticks(skeleton, ticks_per_second)?;
        library.tables.storage = ClipStorage::Motion(precision);
        Ok(Self(library))
    }

    /// Adds a clip and returns its index.
    ///
    /// # Errors
    /// As [`CrowdLibrary::push`]; there may be any number of clips.
    pub fn push(
        &mut self,
        set: &TrackSet,
        interpolation: impl Into<Interpolation>,
        vectors: VectorMethod,
    ) -> Result<usize, CrowdError> {
        self.0.push_tables(set, interpolation.into(), vectors)
    }

    /// Adds `count` clips, in the order of their indices. `clip` makes the clip of an index; the clips are prepared on
    /// the threads of `engine`, and each is dropped as soon as it is prepared.
    ///
    /// # Errors
    /// The index of the first clip that cannot be added, and the reason: the error of `clip`, or an error as of
    /// [`MotionBuilder::push`]. The clips before it are added. When the system refuses threads or the work is stopped,
    /// the index is that of the next clip.
    pub fn push_all<'a, E: From<CrowdError> + Send>(
        &mut self,
        engine: &Engine,
        count: usize,
        clip: impl Fn(usize) -> Result<MotionClip<'a>, E> + Sync,
    ) -> Result<(), (usize, E)> {
        let mut next = 0;
        // The first clip may name the joints, so it is added before the others.
        if self.0.clip_count() == 0 && count > 0 {
            let added = clip(0).and_then(|first| Ok(self.0.push_clip(&first)?));
            added.map_err(|error| (0, error))?;
            next = 1;
        }
        let stop = stop::current();
        while next < count {
            let batch = next..count.min(next + CLIPS_AT_ONCE);
            let prepared = |index: usize| -> Result<ClipTables, E> {
                stop::check_of(stop.as_ref()).map_err(CrowdError::from)?;
                let mut part = self.0.clone_without_tables();
                part.push_clip(&clip(index)?)?;
                Ok(part.tables)
            };
            let work = || -> Vec<Result<ClipTables, E>> {
                batch.clone().into_par_iter().map(prepared).collect()
            };
            let parts = engine.machine.threads().run(work);
            let parts = parts.map_err(|error| (next, CrowdError::from(error).into()))?;
            for part in parts {
                let added = part.and_then(|part| Ok(self.0.tables.append(part)?));
                added.map_err(|error| (next, error))?;
                next += 1;
            }
        }
        Ok(())
    }

    /// Returns the tables of the clips, then their two large parts: the spans (intervals in ticks) and the cells
    /// (constants and keys).
    #[must_use]
    pub fn finish(self) -> (MotionTables, Vec<[u32; 4]>, Vec<[f32; 4]>) {
        self.0.into_tables()
    }
}
