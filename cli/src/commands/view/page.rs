//! The page that was built from `web/`, and the results in it.

use std::collections::BTreeMap;

use glam::{DVec3, Quat, Vec3};
use serde::Serialize;
use tumble::Channel;
use tumble_formats::carried_mesh::CarriedMesh;
use tumble_formats::packed;
use tumble_routes::mesh::Mesh;

use crate::arguments::interpolation::InterpolationArguments;
use crate::commands::travel::Scenery;
use crate::commands::view::pack::{bytes, differences, doubles, shorts, text, words};
use crate::commands::view::result::{StoredResult, short};
use crate::commands::view::shown::{Ghost, ResultChoice, ShownClip};
use crate::messages::colours::{BOXES, Colour};
use tumble_formats::sample::MethodChoice;

/// Built from `web/src` by `npm run build` in `web/`; it is stored here so that the package is complete.
const HTML: &str = include_str!("page.html");
const PLACEHOLDER: &str = "/* DATA */";

/// The module of the npm package, packed by gzip: `scripts/npm.sh --page` puts it here.
const ENGINE: &[u8] = include_bytes!("tumble.wasm.gz");

/// The data of the page, which its scripts read as JSON.
#[derive(Serialize)]
#[serde(rename_all = "camelCase")]
pub(crate) struct Page<'a> {
    version: &'static str,
    device: &'a str,
    /// The label of the menu of sets.
    menu: &'static str,
    box_colours: Vec<String>,
    methods: Vec<StoredMethod>,
    sets: Vec<StoredSet>,
    /// The ground first, then what stands on it.
    meshes: Vec<StoredMesh>,
    skins: Vec<StoredSkin>,
    /// The engine, packed by gzip, if the page evaluates a set.
    engine: Option<String>,
    /// The options of interpolation, by their names in the npm package.
    options: BTreeMap<&'static str, String>,
}

/// Triangles of a mesh that does not move (`--mesh`).
#[derive(Serialize)]
struct StoredMesh {
    /// x y z of each vertex, f32.
    #[serde(rename = "places")]
    positions: String,
    /// Three vertices each, u32.
    triangles: String,
}

impl StoredMesh {
    fn new(mesh: &Mesh) -> Self {
        let coordinates = mesh.positions().iter().flat_map(DVec3::to_array);
        Self {
            positions: words(coordinates.map(|number| (number as f32).to_bits())),
            triangles: words(mesh.triangles().iter().flatten().copied()),
        }
    }
}

/// Triangles that follow joints.
#[derive(Serialize)]
#[serde(rename_all = "camelCase")]
struct StoredSkin {
    /// x y z of each vertex, f32.
    #[serde(rename = "places")]
    positions: String,
    /// Three vertices each, u32.
    triangles: String,
    /// Four bones of each vertex, u16.
    bones_of: String,
    /// The weight of each of these bones, to be divided by 65535.
    weights: String,
    /// The joint of each bone.
    joints: Vec<usize>,
    /// The matrix from vertices to each bone's joint, 16 f32, column-major.
    to_joints: String,
}

impl StoredSkin {
    fn new(mesh: &CarriedMesh) -> Self {
        let bits = |numbers: &[f32]| words(numbers.iter().map(|number| number.to_bits()));
        let weights = mesh.weights.as_flattened().iter();
        let to_joints: Vec<f32> = mesh.bones.iter().flat_map(|bone| bone.to_joint).collect();
        Self {
            positions: bits(mesh.positions.as_flattened()),
            triangles: words(mesh.triangles.as_flattened().iter().copied()),
            bones_of: shorts(mesh.bones_of.as_flattened().iter().copied()),
            weights: shorts(weights.map(|weight| (weight * 65535.0).round() as u16)),
            joints: mesh.bones.iter().map(|bone| bone.track).collect(),
            to_joints: bits(&to_joints),
        }
    }
}

/// A clip that the page evaluates.
#[derive(Serialize)]
struct StoredClip {
    /// As `tumble_formats::packed` has it.
    bytes: String,
    /// The methods that the page can evaluate.
    methods: Vec<&'static str>,
}

impl StoredClip {
    /// `None` for paths, and for clips whose keys would make a large page.
    fn new(shown: &ShownClip) -> Option<Self> {
        let keys = packed::to_bytes(&shown.clip);
        if shown.path.is_some() || keys.len() > MAX_KEY_BYTES {
            return None;
        }
        let all: Vec<MethodChoice> = MethodChoice::all().collect();
        Some(Self {
            bytes: bytes(&keys),
            methods: shown
                .methods(&all)
                .into_iter()
                .map(ResultChoice::name)
                .collect(),
        })
    }
}

/// Bytes of a clip's keys that the page carries for its engine, before they are packed.
const MAX_KEY_BYTES: usize = 32_000_000;

/// How bodies on paths are drawn.
#[derive(Serialize)]
struct StoredBodies {
    /// The length of a body, along z before `rotation`.
    length: f32,
    /// `x y z w`.
    #[serde(rename = "turn")]
    rotation: [f32; 4],
    /// Whether they stand on their paths, instead of about them.
    stand: bool,
    /// How many frames are drawn as axes along each path.
    axes: usize,
}

#[derive(Serialize)]
struct StoredMethod {
    name: &'static str,
    summary: &'static str,
    colour: String,
}

/// One clip.
#[derive(Serialize)]
#[serde(rename_all = "camelCase")]
pub(crate) struct StoredSet {
    name: String,
    boxes: usize,
    length: f64,
    /// The parent of each joint, -1 for roots; empty where tracks are the boxes of a chain.
    parents: Vec<i64>,
    /// The names of the joints.
    names: Vec<String>,
    /// Whether rotations are relative to the world instead of the parent.
    is_world: bool,
    /// How tracks are drawn that are bodies on paths; `None` for other tracks.
    bodies: Option<StoredBodies>,
    /// Whether results are named after frames, not after methods.
    has_frames: bool,
    times: String,
    /// Where positions count from.
    origin: [f64; 3],
    /// Clips of later inputs that are shown with it.
    ghosts: Vec<Ghost>,
    /// Whether all boxes have the same key times, which are stored once then.
    shared_keys: bool,
    key_counts: Vec<usize>,
    key_times: String,
    keys: String,
    /// The first of them is shown first.
    results: Vec<StoredResult>,
    /// The clip that the page's engine evaluates; `None` if the page only shows the stored results.
    clip: Option<StoredClip>,
    /// Whether joints have scales: meshes that follow them are then drawn by the engine's matrices alone.
    has_scales: bool,
    /// The index of the skin that its joints move, among the page's.
    pub(crate) skin: Option<usize>,
}

impl StoredSet {
    pub(crate) fn new(
        shown: &ShownClip,
        results: Vec<StoredResult>,
        scenery: &Scenery,
        has_engine: bool,
    ) -> Self {
        let (set, skeleton) = (&shown.clip.set, &shown.clip.skeleton);
        let joints = if shown.has_positions() {
            set.track_count()
        } else {
            0
        };
        let parent = |track: usize| skeleton.get(track).and_then(|joint| joint.parent);
        let first = set.track(0).times;
        let shared_keys = set.tracks().all(|track| track.times == first);
        let key_times: Vec<f64> = if shared_keys {
            first.to_vec()
        } else {
            set.tracks()
                .flat_map(|track| track.times.iter().copied())
                .collect()
        };
        let keys: Vec<Quat> = set
            .tracks()
            .flat_map(|track| track.keys.iter().copied())
            .collect();
        let bodies = shown.is_travel().then(|| StoredBodies {
            length: scenery.length(&shown.key_positions()),
            rotation: shown.body_rotation().to_array(),
            stand: !scenery.meshes.is_empty(),
            axes: scenery.drawn_frames,
        });
        let scales = (0..set.track_count()).any(|track| {
            let rest = shown.clip.rest(Channel::Scale, track);
            rest != Vec3::ONE || set.vector_keys(Channel::Scale, track).is_some()
        });
        Self {
            name: shown.title.clone(),
            clip: has_engine.then(|| StoredClip::new(shown)).flatten(),
            has_scales: scales,
            skin: None,
            bodies,
            has_frames: shown.path.is_some(),
            boxes: set.track_count(),
            length: shown.box_length,
            parents: (0..joints)
                .map(|track| parent(track).map_or(-1, |parent| parent as i64))
                .collect(),
            names: (0..joints).map(|track| set.track_name(track)).collect(),
            is_world: shown.clip.is_world,
            times: doubles(&shown.times),
            origin: shown.origin().to_array(),
            ghosts: shown.ghosts.clone(),
            shared_keys,
            key_counts: if shared_keys {
                Vec::new()
            } else {
                set.tracks().map(|track| track.keys.len()).collect()
            },
            key_times: doubles(&key_times),
            keys: differences(&short(&keys), 4),
            results,
        }
    }
}

impl<'a> Page<'a> {
    /// The page of clips by these methods.
    pub(crate) fn new(
        methods: &[ResultChoice],
        sets: Vec<StoredSet>,
        meshes: &[Mesh],
        skins: &[&CarriedMesh],
        menu: &'static str,
        device: &'a str,
        interpolation: InterpolationArguments,
    ) -> Self {
        let live: Vec<&str> = (sets.iter().filter_map(|set| set.clip.as_ref()))
            .flat_map(|clip| clip.methods.iter().copied())
            .collect();
        let stored = |method: ResultChoice| StoredMethod {
            name: method.name(),
            summary: method.summary(),
            colour: css(method.colour()),
        };
        let is_shown =
            |choice: &ResultChoice| methods.contains(choice) || live.contains(&choice.name());
        let all = ResultChoice::all().filter(is_shown);
        Self {
            version: env!("CARGO_PKG_VERSION"),
            device,
            menu,
            box_colours: BOXES.map(css).to_vec(),
            methods: all.map(stored).collect(),
            meshes: meshes.iter().map(StoredMesh::new).collect(),
            skins: skins.iter().map(|skin| StoredSkin::new(skin)).collect(),
            engine: (!live.is_empty()).then(|| text(ENGINE)),
            options: interpolation.named(),
            sets,
        }
    }

    pub(crate) fn html(&self) -> String {
        let data = serde_json::to_string(self).expect("names are strings and numbers are numbers");
        // The data must not contain the end tag of its HTML element.
        HTML.replacen(PLACEHOLDER, &data.replace('<', "\\u003c"), 1)
    }
}

fn css([r, g, b]: Colour) -> String {
    format!("#{r:02x}{g:02x}{b:02x}")
}
