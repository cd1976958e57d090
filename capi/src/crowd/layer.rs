//! What one layer of an instance plays.

use tumble::WrapMode;
use tumble::crowd::CrowdLayer;

use crate::arguments::{flag, option};
use crate::result::Failure;

/// What a layer of an instance plays. If all is zero but `size`, it stands still at the start of the first clip.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct TumbleCrowdLayer {
    /// `sizeof(TumbleCrowdLayer)`.
    pub size: usize,
    /// The instance, from 0.
    pub instance: usize,
    /// Its layer, from 0; higher ones are laid over lower ones.
    pub layer: usize,
    /// The clip, by its number in the library.
    pub clip: usize,
    /// The time in the clip, ticks; `wrap` says what happens outside of the clip.
    pub time: i64,
    /// Ticks of the clip for a tick of the clock: 1 as keyed, 0 to stand still, negative to run
    /// backwards; magnitudes below 128, kept in units of 2^-16.
    pub speed: f32,
    /// The weight with which it is blended over the layers below, 0 to 1, stored in units of 2^-15. The first layer
    /// has no weight.
    pub weight: f32,
    /// A `TumbleWrap`, but not `TUMBLE_WRAP_EXTRAPOLATE`.
    pub wrap: u32,
    /// 1: the clip's difference from its reference pose is added to the layers below; 0: it is blended
    /// over them.
    pub additive: u32,
    /// 0: all joints take part; or a mask, by the number that `tumble_crowd_library_push_mask` gave.
    pub mask: usize,
}

impl TumbleCrowdLayer {
    /// The instance, the layer, and what it is to play; `index` is for messages.
    pub(crate) fn change(&self, index: usize) -> Result<(usize, usize, CrowdLayer), Failure> {
        let size = size_of::<Self>();
        if self.size != size {
            let message = format!(
                "`layers[{index}].size` is {}, and this version's structure has {size} bytes; set it \
                 to `sizeof`, with the header of the library's version",
                self.size
            );
            return Err(Failure::argument(message));
        }
        let plays = CrowdLayer {
            clip: self.clip,
            time: self.time,
            speed: self.speed,
            wrap: option(self.wrap, &WrapMode::ALL, &format!("layers[{index}].wrap"))?,
            weight: self.weight,
            additive: flag(self.additive, &format!("layers[{index}].additive"))?,
            mask: self.mask.checked_sub(1),
        };
        Ok((self.instance, self.layer, plays))
    }

    /// The same for C.
    pub(crate) fn new(instance: usize, layer: usize, plays: CrowdLayer) -> Self {
        let wrap = WrapMode::ALL.iter().position(|&wrap| wrap == plays.wrap);
        Self {
            size: size_of::<Self>(),
            instance,
            layer,
            clip: plays.clip,
            time: plays.time,
            speed: plays.speed,
            weight: plays.weight,
            wrap: wrap.unwrap_or(0) as u32,
            additive: plays.additive.into(),
            mask: plays.mask.map_or(0, |mask| mask + 1),
        }
    }
}
