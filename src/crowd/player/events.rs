//! The events that the instances of a crowd pass.

use crate::crowd::events::{Passages, PassedEvent};
use crate::crowd::player::Crowd;
use crate::crowd_error::CrowdError;
use crate::memory::reserved;
use crate::shader::WEIGHT_UNIT;

impl Crowd {
    /// The events that the layers of all instances passed after the time `since` of the clock, up to its current time.
    /// They are in the order of the times at which they were passed; at the same time, in the order of instances,
    /// layers and events.
    ///
    /// A layer passes an event when its time in the clip reaches the event's tick, in either direction, and in a loop
    /// once in each round. Times are whole ticks, so that one large step passes the same events as many small ones. The
    /// clips that the layers play now count, so call this function after the clock was moved and before layers get
    /// other clips. Layers with weight 0 pass events, too; look at [`PassedEvent::weight`].
    ///
    /// ```
    /// use tumble::crowd::{CrowdLayer, CrowdLibrary};
    /// use tumble::glam::{Quat, Vec3};
    /// use tumble::{Device, Engine, Skeleton, TrackSet, VectorMethod, method};
    /// # let mut walk = TrackSet::new();
    /// # walk.push("hip", &[0.0, 1.0], &[Quat::IDENTITY, Quat::from_rotation_y(1.0)])?;
    /// # let skeleton = Skeleton::new(vec![None], vec![Vec3::ZERO])?;
    /// let mut library = CrowdLibrary::new(&skeleton)?;
    /// let walk = library.push(&walk, method::SLERP, VectorMethod::Linear)?;
    /// let step = library.push_event(walk, 352_800, "left foot down")?; // half a second after the clip's start
    ///
    /// let mut crowd = Engine::new(Device::Cpu)?.crowd(&library, 2, 1)?;
    /// crowd.set(1, 0, CrowdLayer::new(walk))?;
    /// let before = crowd.clock();
    /// crowd.advance(3.0)?;
    /// let passed = crowd.passed_events(before)?;
    /// assert_eq!(passed.len(), 3); // instance 0 stands still
    /// assert_eq!((passed[0].instance, passed[0].event, passed[0].clock), (1, step, 352_800));
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// When `since` is later than the clock, or there is not enough memory for the list.
    pub fn passed_events(&self, since: u64) -> Result<Vec<PassedEvent>, CrowdError> {
        let clock = self.clock();
        if since > clock {
            return Err(CrowdError::EventsSince { since, clock });
        }
        let library = self.library();
        // The events of each clip, with their indices.
        let mut of_clip = vec![Vec::new(); library.clip_count()];
        for (index, event) in library.events.iter().enumerate() {
            of_clip[event.clip].push((index, event.tick));
        }
        let passages = || {
            let entries = self.instances.entries.iter().enumerate();
            entries.flat_map(|(index, entry)| {
                let clip = (entry.clip_and_weight & 0xffff) as usize;
                let period = library.tables.clips[clip].period;
                let events = of_clip[clip].iter();
                events.flat_map(move |&(event, tick)| {
                    let all = Passages::of(entry, period, tick, [since, clock]);
                    all.map(move |passages| (index, event, passages))
                })
            })
        };
        let counts = passages().map(|(.., passages)| passages.count);
        let count = counts.fold(0, u64::saturating_add);
        let mut passed = reserved(usize::try_from(count).unwrap_or(usize::MAX), "events")?;
        for (index, event, passages) in passages() {
            let weight = (self.instances.entries[index].clip_and_weight >> 16) as f32 * WEIGHT_UNIT;
            passed.extend((0..passages.count).map(|round| PassedEvent {
                clock: passages.clock(round),
                instance: index / self.layer_count(),
                layer: index % self.layer_count(),
                event,
                weight,
            }));
        }
        passed.sort_by_key(|event| (event.clock, event.instance, event.layer, event.event));
        Ok(passed)
    }
}
