//! Meshes that follow the joints of a clip.

use std::fs;

use glam::{DAffine3, DMat4, DVec3};
use tumble::{Device, Engine, SampleTimes};
use tumble_formats::carried_mesh::CarriedMesh;
use tumble_formats::gltf::read_gltf;
use tumble_formats::motion::Motion;
use tumble_formats::sample::ChannelMethods;
use tumble_formats::world::world_matrices;
use tumble_formats::{Loaded, ReadOptions};

fn fixture() -> String {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/fixtures/skinned.gltf");
    fs::read_to_string(path).unwrap()
}

fn read(text: &str) -> Loaded {
    let options = ReadOptions::default();
    read_gltf("skinned.gltf", text.as_bytes().to_vec(), None, &options).unwrap()
}

fn mesh(loaded: &Loaded) -> Result<Option<CarriedMesh>, String> {
    let document = loaded.document.as_ref().unwrap();
    let found = document.carried_mesh(&loaded.clips[0]);
    found.map_err(|fault| fault.to_string())
}

/// Where a vertex is, by glTF's formula (3.7.3.3).
fn vertex_position(mesh: &CarriedMesh, joints: &[DAffine3], vertex: usize) -> DVec3 {
    let at = DVec3::from(glam::Vec3::from(mesh.positions[vertex]));
    let parts = mesh.bones_of[vertex].iter().zip(mesh.weights[vertex]);
    parts
        .map(|(&bone, weight)| {
            let bone = mesh.bones[bone as usize];
            let to_joint = DMat4::from_cols_array(&bone.to_joint.map(f64::from));
            let moved = joints[bone.track].transform_point3(to_joint.transform_point3(at));
            moved * f64::from(weight)
        })
        .sum()
}

#[test]
fn vertices_follow_their_joints_and_what_is_fixed_to_one() {
    let loaded = read(&fixture());
    let mesh = mesh(&loaded).unwrap().unwrap();
    assert_eq!(mesh.positions.len(), 4 + 3);
    assert_eq!(mesh.triangles, [[0, 1, 2], [1, 3, 2], [4, 5, 6]]);
    let clip = &loaded.clips[0];
    let engine = Engine::new(Device::Cpu).unwrap();
    let frames = SampleTimes::at(vec![0.0, 1.0]);
    let samples = ChannelMethods::AUTHORED
        .sample(&engine, clip, &frames)
        .unwrap();
    let matrices = world_matrices(clip, &samples).unwrap();
    let joints = clip.set.track_count();
    // At rest, the vertices are those of the mesh, with the pin on top of both bones. Then the upper
    // bone, which begins at the height 1, is rotated by 90°.
    let at_rest = [[0.0, 0.0], [1.0, 0.0], [0.0, 2.0], [1.0, 2.0], [0.0, 2.0]];
    let bent = [[0.0, 0.0], [1.0, 0.0], [-1.0, 1.0], [0.0, 2.0], [-1.0, 1.0]];
    for (sample, expected) in [at_rest, bent].into_iter().enumerate() {
        let matrices = &matrices[sample * joints..][..joints];
        for (vertex, [x, y]) in expected.into_iter().enumerate() {
            let found = vertex_position(&mesh, matrices, vertex);
            let off = found.distance(DVec3::new(x, y, 0.0));
            assert!(off < 1e-6, "vertex {vertex} of sample {sample}: {found}");
        }
    }
}

#[test]
fn files_without_meshes_have_none_and_broken_ones_say_why() {
    let none = fixture()
        .replace(r#""mesh": 0,"#, "")
        .replace(r#""mesh": 1"#, r#""extras": 1"#);
    assert_eq!(mesh(&read(&none)), Ok(None));
    for (from, to, words) in [
        (
            "\"joints\": [\n    1,",
            "\"joints\": [\n    9,",
            "index 9 of nodes does not exist",
        ),
        (
            "\"joints\": [\n    1,\n    2\n",
            "\"joints\": [\n    1\n",
            "index 1 of the skin's joints does not exist: the list has length 1",
        ),
        (
            "\"skin\": 0",
            "\"skin\": 3",
            "index 3 of skins does not exist",
        ),
        (
            "\"JOINTS_0\": 1",
            "\"JOINTS_0\": 2",
            "indices are unsigned integers",
        ),
        ("\"WEIGHTS_0\": 2", "\"WEIGHTS_0\": 0", "this needs VEC4"),
        (
            "\"inverseBindMatrices\": 4",
            "\"inverseBindMatrices\": 2",
            "this needs MAT4",
        ),
    ] {
        let text = fixture();
        assert!(text.contains(from), "{from}");
        let error = mesh(&read(&text.replace(from, to))).unwrap_err();
        assert!(error.contains(words), "{to}: {error}");
    }
    // The tracks of the clip were selected without the joints of the skin.
    let document = read(&fixture()).document.unwrap();
    let error = document.carried_mesh(&Motion::default()).unwrap_err();
    let words = "the joint root of the skin is not a track of the clip";
    assert!(error.to_string().contains(words), "{error}");
}
