//! The key times of the curves of each node, as plain numbers that threads can share.

use std::collections::{HashMap, HashSet};

use tumble::FrameRate;
use ufbx::{
    AnimCurve, AnimLayer, AnimProp, AnimStack, ElementType, ExtrapolationMode, Interpolation, Node,
    Scene,
};

use crate::budget::{Budget, OverBudget};
use crate::rate::Precision;

/// Times closer than this are one, seconds: FBX counts in ticks of 2.2e-11 s.
pub(super) const SAME: f64 = 1e-9;

/// How many keys an extrapolated curve may repeat, in addition to its keys.
const REPEATED: f64 = 1e6;

/// If an angle changes by more degrees than this between two keys, the curve is also evaluated between them, in up to
/// [`MAX_PARTS`] parts.
const LARGEST_STEP: f64 = 120.0;
const MAX_PARTS: f64 = 4096.0;

/// The key times of one channel of a node.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct ChannelTimes {
    /// Seconds in the file, in any order.
    list: Vec<f64>,
    /// Whether a curve may jump at one of these times.
    pub(super) jump: bool,
}

/// The key times of all channels of a node.
#[derive(Debug, Clone, Default)]
pub(super) struct NodeTimes {
    pub(super) translation: ChannelTimes,
    pub(super) rotation: ChannelTimes,
    pub(super) scale: ChannelTimes,
}

impl NodeTimes {
    /// Whether the node has no curve.
    pub(super) fn is_empty(&self) -> bool {
        let channels = [&self.translation, &self.rotation, &self.scale];
        channels.iter().all(|times| times.list.is_empty())
    }
}

/// The properties of the first layer that determine a node's transform.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Properties {
    pub(super) translation: Option<usize>,
    pub(super) rotation: Option<usize>,
    pub(super) scale: Option<usize>,
    /// Whether no other property and no other layer changes it.
    pub(super) are_plain: bool,
}

/// The curves of an animation stack.
#[derive(Debug, Default)]
pub(super) struct Takes {
    /// The first and the last time of the clip.
    pub(super) span: [f64; 2],
    /// By index of the node.
    pub(super) nodes: HashMap<usize, NodeTimes>,
    /// Whether a node has a curve, also one of a single key, which has no times.
    pub(super) has_curves: bool,
    pub(super) properties: HashMap<usize, Properties>,
    /// Number of keys outside the span.
    pub(super) outside: usize,
    /// Names of properties with curves that are not transforms.
    pub(super) others: Vec<String>,
    /// The key times of all curves, a list for each, unless it is that of the curve before.
    pub(super) keys: Vec<Vec<f64>>,
    /// The rate of the key times, found as in every format. The rate that the file states is not used.
    pub(super) rate: Option<FrameRate>,
    /// The frames to which key times belong: those of the file's rate if all keys lie on them.
    pub(super) grid: Option<FrameRate>,
    pub(super) disorder: Option<TimeDisorder>,
}

/// A curve whose key times do not increase.
#[derive(Debug)]
pub(super) struct TimeDisorder {
    /// The name of its property.
    pub(super) property: String,
    /// The name of its node.
    pub(super) node: String,
    /// The time of a key, and that of the next.
    pub(super) times: [f64; 2],
}

/// The part of a node's transform that a property determines.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum TransformPart {
    Translation,
    Rotation,
    Scale,
}

fn part_of(property: &str) -> Option<TransformPart> {
    Some(match property {
        "Lcl Translation" | "RotationOffset" | "ScalingOffset" | "RotationPivot"
        | "ScalingPivot" => TransformPart::Translation,
        "Lcl Rotation" | "PreRotation" | "PostRotation" | "RotationOrder" => {
            TransformPart::Rotation
        }
        "Lcl Scaling" => TransformPart::Scale,
        _ => return None,
    })
}

impl Takes {
    /// # Errors
    /// When extrapolated curves have more keys than the budget allows.
    pub(super) fn of(
        scene: &Scene,
        stack: &AnimStack,
        audible: &[usize],
        budget: &Budget,
    ) -> Result<Self, OverBudget> {
        let layers = || audible.iter().map(|&index| &stack.layers[index]);
        let mut takes = Self {
            span: span(stack, layers()),
            ..Self::default()
        };
        let mut others = HashSet::new();
        for (index, layer) in layers().enumerate() {
            let weight = takes.weight(layer, budget)?;
            for (position, property) in layer.anim_props.iter().enumerate() {
                let curves = || property.anim_value.curves.iter().flatten();
                let part = part_of(&property.prop_name);
                let is_node = property.element.type_ == ElementType::Node;
                let Some(part) = part.filter(|_| is_node) else {
                    let moves = curves().any(|curve| curve.keyframes.len() > 1);
                    let is_weight = property.element.type_ == ElementType::AnimLayer;
                    if moves && !is_weight && others.insert(property.prop_name.to_string()) {
                        takes.others.push(property.prop_name.to_string());
                    }
                    continue;
                };
                let mut times = ChannelTimes::default();
                for curve in curves() {
                    takes.note_keys(property, curve, budget)?;
                    takes.has_curves = true;
                    takes.outside +=
                        times.add(curve, takes.span, part == TransformPart::Rotation, budget)?;
                }
                times.append(&weight, budget)?;
                let node = property.element.typed_id as usize;
                let properties = takes.properties.entry(node).or_insert(Properties {
                    are_plain: true,
                    ..Properties::default()
                });
                let known = match &*property.prop_name {
                    "Lcl Translation" => Some(&mut properties.translation),
                    "Lcl Rotation" => Some(&mut properties.rotation),
                    "Lcl Scaling" => Some(&mut properties.scale),
                    _ => None,
                };
                match known {
                    Some(known) if index == 0 && known.is_none() => *known = Some(position),
                    _ => properties.are_plain = false,
                }
                let moved = takes.nodes.entry(node).or_default();
                match part {
                    TransformPart::Translation => moved.translation.append(&times, budget)?,
                    TransformPart::Rotation => moved.rotation.append(&times, budget)?,
                    TransformPart::Scale => moved.scale.append(&times, budget)?,
                }
            }
        }
        for node in &scene.nodes {
            takes.carry(node, budget)?;
        }
        Ok(takes)
    }

    /// Keeps the key times of a property's curve, and notes whether they decrease.
    fn note_keys(
        &mut self,
        property: &AnimProp,
        curve: &AnimCurve,
        budget: &Budget,
    ) -> Result<(), OverBudget> {
        let keys = curve.keyframes.as_ref();
        let mut pairs = keys.windows(2);
        if let Some(pair) = pairs.find(|pair| pair[1].time < pair[0].time) {
            let times = [pair[0].time, pair[1].time];
            self.disorder.get_or_insert_with(|| TimeDisorder {
                property: property.prop_name.to_string(),
                node: property.element.name.to_string(),
                times,
            });
        }
        let times = || keys.iter().map(|key| key.time);
        let is_known = |last: &Vec<f64>| times().eq(last.iter().copied());
        if keys.len() > 1 && !self.keys.last().is_some_and(is_known) {
            budget.take(keys.len(), size_of::<f64>())?;
            self.keys.push(times().collect());
        }
        Ok(())
    }

    /// The key times of a layer's weight.
    fn weight(&mut self, layer: &AnimLayer, budget: &Budget) -> Result<ChannelTimes, OverBudget> {
        let mut times = ChannelTimes::default();
        let weights = layer.anim_props.iter().filter(|property| {
            let element = &property.element;
            &*property.prop_name == "Weight" && element.element_id == layer.element.element_id
        });
        for weight in weights {
            for curve in weight.anim_value.curves.iter().flatten() {
                self.outside += times.add(curve, self.span, false, budget)?;
            }
        }
        Ok(times)
    }

    /// Adds the times of a node's pivots and of the scales of its ancestors, which also determine its transform.
    fn carry(&mut self, node: &Node, budget: &Budget) -> Result<(), OverBudget> {
        let index = node.element.typed_id as usize;
        let pivot = |name| {
            let found = ufbx::find_prop(&node.element.props, name);
            found.is_some_and(|found| {
                let at = &found.value_vec4;
                [at.x, at.y, at.z] != [0.0; 3]
            })
        };
        if let Some(moved) = self.nodes.get_mut(&index)
            && (pivot("RotationPivot") || pivot("ScalingPivot"))
        {
            let NodeTimes {
                translation,
                rotation,
                scale,
            } = moved;
            translation.append(rotation, budget)?;
            translation.append(scale, budget)?;
        }
        if !inherits_scale(node) {
            return Ok(());
        }
        let mut scales = ChannelTimes::default();
        let mut next = node.parent.as_deref();
        while let Some(above) = next {
            let helper = above.scale_helper.as_deref().into_iter();
            for carrier in helper.chain([above]) {
                if let Some(moved) = self.nodes.get(&(carrier.element.typed_id as usize)) {
                    scales.append(&moved.scale, budget)?;
                }
            }
            next = above.parent.as_deref();
        }
        if !scales.list.is_empty() {
            let moved = self.nodes.entry(index).or_default();
            moved.translation.append(&scales, budget)?;
            moved.scale.append(&scales, budget)?;
        }
        Ok(())
    }
}

/// Whether the scales of other nodes determine the transform of a node.
pub(super) fn inherits_scale(node: &Node) -> bool {
    node.is_scale_helper
        || node.parent.as_deref().is_some_and(|parent| {
            parent.inherit_scale_node.is_some()
                || parent.scale_helper.is_some()
                || parent.is_scale_compensate_parent
        })
}

/// The first and the last time of a stack, or of its keys if the stack does not contain them. Programs write ends that
/// were rounded to f32, for example 2e-8 s after the last key; such an end counts as the time of the key.
fn span<'a>(stack: &AnimStack, layers: impl Iterator<Item = &'a AnimLayer>) -> [f64; 2] {
    let curves = layers.flat_map(|layer| layer.anim_values.iter());
    let curves = curves.flat_map(|value| value.curves.iter().flatten());
    let times = curves.flat_map(|curve| curve.keyframes.iter().map(|key| key.time));
    let each = times.filter(|time| time.is_finite()).map(|time| [time; 2]);
    let keys = each.reduce(|a, b| [a[0].min(b[0]), a[1].max(b[1])]);
    let (begin, end) = (stack.time_begin, stack.time_end);
    if begin.is_finite() && end.is_finite() && begin < end {
        let Some([first, last]) = keys.filter(|[first, last]| first < last) else {
            return [begin, end];
        };
        let near = |time: f64, key: f64| match was_rounded(time, key) {
            true => key,
            false => time,
        };
        return [near(begin, first), near(end, last)];
    }
    keys.unwrap_or(if begin.is_finite() {
        [begin; 2]
    } else {
        [0.0; 2]
    })
}

/// Whether a time is another one after rounding to f32.
pub(super) fn was_rounded(time: f64, exact: f64) -> bool {
    (time - exact).abs() <= Precision::F32.rounding(exact)
}

impl ChannelTimes {
    /// Adds the times of a curve and of its repetitions within a span. Returns how many of its keys are outside the
    /// span.
    fn add(
        &mut self,
        curve: &AnimCurve,
        span: [f64; 2],
        is_angle: bool,
        budget: &Budget,
    ) -> Result<usize, OverBudget> {
        let keys = curve.keyframes.as_ref();
        let [Some(first), Some(last)] =
            [keys.first(), keys.last()].map(|key| key.map(|key| key.time))
        else {
            return Ok(0);
        };
        if keys.len() < 2 {
            return Ok(0);
        }
        // The curves of a property usually have keys at the same times.
        let is_known = self.list.len() == keys.len()
            && self
                .list
                .iter()
                .zip(keys)
                .all(|(time, key)| *time == key.time);
        if !is_known {
            budget.take(keys.len(), size_of::<f64>())?;
            self.list.extend(keys.iter().map(|key| key.time));
        }
        self.jump |= keys.windows(2).any(|pair| {
            let is_constant = |key: &ufbx::Keyframe| {
                matches!(
                    key.interpolation,
                    Interpolation::ConstantPrev | Interpolation::ConstantNext
                )
            };
            is_constant(&pair[0]) || pair[1].time - pair[0].time < 2.0 * SAME
        });
        // If an angle changes by whole turns between two keys, a few samples between them would not show it. So there
        // is a sample for each LARGEST_STEP.
        for pair in keys.windows(2).filter(|_| is_angle) {
            let parts = ((pair[1].value - pair[0].value).abs() / LARGEST_STEP).ceil();
            let parts = parts.min(MAX_PARTS) as usize;
            budget.take(parts, size_of::<f64>())?;
            let length = pair[1].time - pair[0].time;
            let part = |index: usize| pair[0].time + length * index as f64 / parts as f64;
            self.list.extend((1..parts).map(part));
        }
        let duration = last - first;
        for (extrapolation, is_before) in [
            (&curve.pre_extrapolation, true),
            (&curve.post_extrapolation, false),
        ] {
            let mirrors = match extrapolation.mode {
                ExtrapolationMode::Repeat | ExtrapolationMode::RepeatRelative => false,
                ExtrapolationMode::Mirror => true,
                ExtrapolationMode::Constant | ExtrapolationMode::Slope => continue,
            };
            let overflow = if is_before {
                first - span[0]
            } else {
                span[1] - last
            };
            if overflow <= 0.0 || duration <= SAME || extrapolation.repeat_count == 0 {
                continue;
            }
            self.jump |= extrapolation.mode == ExtrapolationMode::Repeat;
            let max_periods = match extrapolation.repeat_count {
                count if count > 0 => f64::from(count),
                _ => f64::INFINITY,
            };
            let periods = (overflow / duration).ceil().min(max_periods);
            let count = periods * keys.len() as f64;
            // Check the number of bytes before anything is allocated.
            let bytes = if count > REPEATED {
                usize::MAX
            } else {
                size_of::<f64>()
            };
            budget.take(count as usize, bytes)?;
            for period in 1..=periods as u64 {
                let shift = period as f64 * duration;
                for key in keys {
                    let time = match mirrors && period % 2 == 1 {
                        true => first + last - key.time,
                        false => key.time,
                    };
                    self.list.push(if is_before {
                        time - shift
                    } else {
                        time + shift
                    });
                }
            }
        }
        let is_outside = |time: f64| time < span[0] - SAME || time > span[1] + SAME;
        Ok(keys.iter().filter(|key| is_outside(key.time)).count())
    }

    fn append(&mut self, other: &Self, budget: &Budget) -> Result<(), OverBudget> {
        // The curves of a node usually have keys at the same times.
        if self.list != other.list {
            budget.take(other.list.len(), size_of::<f64>())?;
            self.list.extend_from_slice(&other.list);
        }
        self.jump |= other.jump;
        Ok(())
    }

    /// The times within a span in increasing order, each once, and its ends; only the first if there are no keys.
    pub(super) fn within(&self, [begin, end]: [f64; 2]) -> Vec<f64> {
        let is_inside = |time: &f64| *time > begin + SAME && *time < end - SAME;
        let mut list = vec![begin];
        if self.list.is_empty() || begin == end {
            return list;
        }
        let mut inner: Vec<f64> = self.list.iter().copied().filter(is_inside).collect();
        inner.sort_by(f64::total_cmp);
        inner.dedup_by(|later, earlier| *later - *earlier < SAME);
        list.append(&mut inner);
        list.push(end);
        list
    }
}
