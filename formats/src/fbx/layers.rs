//! The animation that `ufbx` evaluates for a stack, corrected where Autodesk's SDK differs from `ufbx`. Muted layers
//! have no effect. A layer that overrides others scales its translations by its weight. Nodes with the spheric rotation
//! order rotate as those of the order XYZ.

use std::collections::HashMap;

use glam::DVec3;
use ufbx::{
    Anim, AnimLayer, AnimOpts, AnimRoot, AnimStack, ElementType, Node, PropOverrideDesc,
    RotationOrder, Scene,
};

use crate::budget::{Budget, OverBudget};
use crate::fbx::times::inherits_scale;

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
    /// The animations of some of these layers, for nodes that the others do not move: each layer of an animation costs
    /// time at every evaluation.
    partial: Vec<LayerAnim>,
    /// The index in `partial` of a node's animation, by the index of the node.
    partial_of: HashMap<usize, usize>,
    /// The layers with curves of a node's translation, by the index of the node. Contains only nodes that a layer
    /// overrides with a weight below 1.
    weighted: HashMap<usize, Vec<WeightedLayer>>,
}

/// The animation of some layers.
struct LayerAnim {
    anim: AnimRoot,
    layers: usize,
}

/// A layer with curves of the translation of a node.
struct WeightedLayer {
    /// Index in the stack.
    layer: usize,
    /// Index of the translation among the animated properties of the layer.
    translation: usize,
    /// The same of the layer's weight, if that is animated.
    weight: Option<usize>,
}

/// Why the layers of a stack cannot be evaluated.
pub(super) enum LayerFault {
    /// The library refuses them.
    Ufbx(Box<ufbx::Error>),
    Memory(OverBudget),
}

impl From<Box<ufbx::Error>> for LayerFault {
    fn from(error: Box<ufbx::Error>) -> Self {
        Self::Ufbx(error)
    }
}

impl From<OverBudget> for LayerFault {
    fn from(error: OverBudget) -> Self {
        Self::Memory(error)
    }
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
    /// # Errors When the library cannot allocate memory, or when the budget is exhausted.
    pub(super) fn of(
        scene: &Scene,
        stack: &AnimStack,
        budget: &Budget,
    ) -> Result<Self, LayerFault> {
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
            found.audible_anim = Some(anim_of(scene, ids())?);
        }
        if scene.nodes.iter().any(|node| is_spheric(node)) {
            found.spheric_anim = Some(without_spheric_orders(scene, ids())?);
        }
        found.audible = audible;
        found.find_partial(scene, stack, budget)?;
        found.find_weighted(stack);
        Ok(found)
    }

    /// Finds the nodes that some of the layers do not move, and makes their animations.
    fn find_partial(
        &mut self,
        scene: &Scene,
        stack: &AnimStack,
        budget: &Budget,
    ) -> Result<(), LayerFault> {
        if self.audible.len() < 2 {
            return Ok(());
        }
        let mut layers_of: Vec<Vec<u32>> = vec![Vec::new(); scene.nodes.len()];
        budget.take(layers_of.len(), size_of::<Vec<u32>>())?;
        for &index in &self.audible {
            let layer = &stack.layers[index];
            for property in &layer.anim_props {
                let id = layer.element.typed_id;
                if property.element.type_ == ElementType::Node
                    && let Some(layers) = layers_of.get_mut(property.element.typed_id as usize)
                    && layers.last() != Some(&id)
                {
                    // Memory for an entry of the list, a key of the map, and an entry of the animation.
                    budget.take(1, 4 * size_of::<usize>())?;
                    layers.push(id);
                }
            }
        }
        let mut known: HashMap<Vec<u32>, usize> = HashMap::new();
        for (index, layers) in layers_of.into_iter().enumerate() {
            let node = &scene.nodes[index];
            // The scales of other nodes influence the transform of such a node, too.
            if layers.len() == self.audible.len() || inherits_scale(node) || is_spheric(node) {
                continue;
            }
            let partial = match known.get(&layers) {
                Some(&partial) => partial,
                None => {
                    budget.take(1, size_of::<Anim>() + size_of::<LayerAnim>())?;
                    self.partial.push(LayerAnim {
                        anim: anim_of(scene, layers.clone())?,
                        layers: layers.len(),
                    });
                    known.insert(layers, self.partial.len() - 1);
                    self.partial.len() - 1
                }
            };
            self.partial_of.insert(index, partial);
        }
        Ok(())
    }

    fn find_weighted(&mut self, stack: &AnimStack) {
        let mut translations: HashMap<usize, Vec<WeightedLayer>> = HashMap::new();
        for &index in &self.audible {
            let layer = &stack.layers[index];
            let weight = weight_of(layer).filter(|_| layer.weight_is_animated);
            for (position, property) in layer.anim_props.iter().enumerate() {
                let is_node = property.element.type_ == ElementType::Node;
                if is_node && &*property.prop_name == TRANSLATION {
                    let node = property.element.typed_id as usize;
                    translations.entry(node).or_default().push(WeightedLayer {
                        layer: index,
                        translation: position,
                        weight,
                    });
                }
            }
        }
        // The lowest layer overrides no other layer.
        let lowest = self.audible.first().copied();
        let is_weighted = |weighted: &WeightedLayer| {
            let layer = &stack.layers[weighted.layer];
            let has_weight = layer.weight != 1.0 || layer.weight_is_animated;
            Some(weighted.layer) != lowest && overrides(layer) && has_weight
        };
        translations.retain(|_, layers| layers.iter().any(is_weighted));
        self.weighted = translations;
    }

    /// How many layers are evaluated for each transform of a node.
    pub(super) fn count(&self, node: &Node) -> usize {
        let index = node.element.typed_id as usize;
        let partial = self.partial_of.get(&index);
        let layers = partial.map_or(self.audible.len(), |&partial| self.partial[partial].layers);
        layers + self.weighted.get(&index).map_or(0, Vec::len)
    }

    /// The animation to evaluate for a node.
    pub(super) fn anim<'a>(&'a self, stack: &'a AnimStack, node: &Node) -> &'a Anim {
        let partial = self.partial_of.get(&(node.element.typed_id as usize));
        match (&self.spheric_anim, partial) {
            (Some(anim), _) if is_spheric(node) => anim,
            (_, Some(&partial)) => &self.partial[partial].anim,
            _ => self.audible_anim.as_deref().unwrap_or(&stack.anim),
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
        for weighted in layers {
            let layer = &stack.layers[weighted.layer];
            if Some(weighted.layer) == lowest || layer.additive {
                continue;
            }
            let weight = weighted.weight(layer, time);
            off = match overrides(layer) {
                true => {
                    let value = &layer.anim_props[weighted.translation].anim_value;
                    let value = ufbx::evaluate_anim_value_vec3(value, time);
                    (weight - 1.0) * DVec3::new(value.x, value.y, value.z)
                }
                false => (1.0 - weight) * off,
            };
        }
        Some(off)
    }
}

impl WeightedLayer {
    /// The weight of the layer at a time, from 0 to 1.
    fn weight(&self, layer: &AnimLayer, time: f64) -> f64 {
        match self.weight {
            Some(weight) => {
                let curve = &layer.anim_props[weight].anim_value;
                let percent = ufbx::evaluate_anim_value_real(curve, time);
                (percent / 100.0).clamp(0.0, 1.0)
            }
            None => layer.weight,
        }
    }
}

/// The index of a layer's weight among its animated properties.
fn weight_of(layer: &AnimLayer) -> Option<usize> {
    layer.anim_props.iter().position(|property| {
        let of_layer = property.element.element_id == layer.element.element_id;
        of_layer && &*property.prop_name == "Weight"
    })
}

/// The animation of some layers.
fn anim_of(scene: &Scene, layer_ids: Vec<u32>) -> Result<AnimRoot, Box<ufbx::Error>> {
    let options = AnimOpts {
        layer_ids: layer_ids.into(),
        ..AnimOpts::default()
    };
    ufbx::create_anim(scene, options).map_err(Box::new)
}
