//! The animation that `ufbx` evaluates for a stack, and what Autodesk's SDK does otherwise than `ufbx`: muted layers have
//! no effect, a layer that overrides others scales its translations by its weight, and nodes with the spheric rotation
//! order rotate as those of the order XYZ.

use std::collections::HashMap;

use glam::DVec3;
use ufbx::{
    Anim, AnimLayer, AnimOpts, AnimRoot, AnimStack, ElementType, Node, PropOverrideDesc,
    RotationOrder, Scene,
};

/// The property that the weight of a layer scales.
const TRANSLATION: &str = "Lcl Translation";

/// The layers of a stack that have an effect.
#[derive(Default)]
pub(super) struct StackLayers {
    /// Their indices in the stack.
    pub(super) audible: Vec<usize>,
    /// The animation of these layers; `None` if it is that of the stack.
    audible_anim: Option<AnimRoot>,
    /// The same, in which nodes of the spheric order have the order XYZ; `None` if there are no such nodes.
    spheric_anim: Option<AnimRoot>,
    /// By the index of the node: the layers with curves of its translation, and the index of the property in each. Only
    /// nodes that a layer overrides with a weight below 1.
    weighted: HashMap<usize, Vec<(usize, usize)>>,
}

/// Whether a layer is muted.
fn is_muted(layer: &AnimLayer) -> bool {
    flag(layer, "Mute")
}

/// Whether a layer is to be the only one that plays.
pub(super) fn is_solo(layer: &AnimLayer) -> bool {
    flag(layer, "Solo")
}

fn flag(layer: &AnimLayer, name: &str) -> bool {
    let found = ufbx::find_prop(&layer.element.props, name);
    found.is_some_and(|found| found.value_int != 0)
}

/// Whether a layer replaces those below it.
fn overrides(layer: &AnimLayer) -> bool {
    !layer.additive && !layer.blended
}

/// Whether a node has the spheric rotation order and uses it.
pub(super) fn is_spheric(node: &Node) -> bool {
    node.use_rotation_space && node.rotation_order == RotationOrder::Spheric
}

/// The animation of some layers in which nodes of the spheric order have the order XYZ.
///
/// # Errors
/// When the library has no memory.
pub(super) fn without_spheric_orders(
    scene: &Scene,
    layer_ids: Vec<u32>,
) -> Result<AnimRoot, Box<ufbx::Error>> {
    let spheric = scene.nodes.iter().filter(|node| is_spheric(node));
    let order = |node: &Node| PropOverrideDesc {
        element_id: node.element.element_id,
        prop_name: "RotationOrder".into(),
        ..PropOverrideDesc::default()
    };
    let orders: Vec<PropOverrideDesc<'_>> = spheric.map(|node| order(node)).collect();
    let options = AnimOpts {
        layer_ids: layer_ids.into(),
        prop_overrides: orders.into(),
        ..AnimOpts::default()
    };
    ufbx::create_anim(scene, options).map_err(Box::new)
}

impl StackLayers {
    /// # Errors
    /// When the library has no memory.
    pub(super) fn of(scene: &Scene, stack: &AnimStack) -> Result<Self, Box<ufbx::Error>> {
        let layers = || stack.layers.iter().enumerate();
        let audible: Vec<usize> = layers()
            .filter(|(_, layer)| !is_muted(layer))
            .map(|(index, _)| index)
            .collect();
        let ids = || {
            let layers = audible.iter().map(|&index| &stack.layers[index]);
            layers
                .map(|layer| layer.element.typed_id)
                .collect::<Vec<u32>>()
        };
        let mut found = Self::default();
        if audible.len() < stack.layers.len() {
            let options = AnimOpts {
                layer_ids: ids().into(),
                ..AnimOpts::default()
            };
            found.audible_anim = Some(ufbx::create_anim(scene, options)?);
        }
        if scene.nodes.iter().any(|node| is_spheric(node)) {
            found.spheric_anim = Some(without_spheric_orders(scene, ids())?);
        }
        found.audible = audible;
        found.find_weighted(stack);
        Ok(found)
    }

    fn find_weighted(&mut self, stack: &AnimStack) {
        let mut translations: HashMap<usize, Vec<(usize, usize)>> = HashMap::new();
        for &index in &self.audible {
            let properties = stack.layers[index].anim_props.iter().enumerate();
            for (position, property) in properties {
                let is_node = property.element.type_ == ElementType::Node;
                if is_node && &*property.prop_name == TRANSLATION {
                    let node = property.element.typed_id as usize;
                    translations
                        .entry(node)
                        .or_default()
                        .push((index, position));
                }
            }
        }
        // The lowest layer has no others to override.
        let lowest = self.audible.first().copied();
        let is_weighted = |&(index, _): &(usize, usize)| {
            let layer = &stack.layers[index];
            let has_weight = layer.weight != 1.0 || layer.weight_is_animated;
            Some(index) != lowest && overrides(layer) && has_weight
        };
        translations.retain(|_, layers| layers.iter().any(is_weighted));
        self.weighted = translations;
    }

    /// The animation to evaluate for a node.
    pub(super) fn anim<'a>(&'a self, stack: &'a AnimStack, node: &Node) -> &'a Anim {
        let plain = || self.audible_anim.as_deref().unwrap_or(&stack.anim);
        match &self.spheric_anim {
            Some(anim) if is_spheric(node) => anim,
            _ => plain(),
        }
    }

    /// The correction to add to the translation that `ufbx` computes for a node: it evaluates layers that override
    /// others without their weight. `None` if nothing must be added.
    pub(super) fn weight_of_translation(
        &self,
        stack: &AnimStack,
        node: &Node,
        time: f64,
    ) -> Option<DVec3> {
        let layers = self.weighted.get(&(node.element.typed_id as usize))?;
        let lowest = self.audible.first().copied();
        let mut off = DVec3::ZERO;
        for &(index, position) in layers {
            let layer = &stack.layers[index];
            if Some(index) == lowest || layer.additive {
                continue;
            }
            let weight = weight(layer, time);
            off = match overrides(layer) {
                true => {
                    let value = &layer.anim_props[position].anim_value;
                    let value = ufbx::evaluate_anim_value_vec3(value, time);
                    (weight - 1.0) * DVec3::new(value.x, value.y, value.z)
                }
                false => (1.0 - weight) * off,
            };
        }
        Some(off)
    }
}

/// The weight of a layer at a time, from 0 to 1.
fn weight(layer: &AnimLayer, time: f64) -> f64 {
    let curve = layer.anim_props.iter().find(|property| {
        let of_layer = property.element.element_id == layer.element.element_id;
        of_layer && &*property.prop_name == "Weight"
    });
    match curve.filter(|_| layer.weight_is_animated) {
        Some(curve) => {
            let percent = ufbx::evaluate_anim_value_real(&curve.anim_value, time);
            (percent / 100.0).clamp(0.0, 1.0)
        }
        None => layer.weight,
    }
}
