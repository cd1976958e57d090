//! Models of SMPL, SMPL-H and SMPL-X bodies: the joint positions of a shape. The models have separate licences, and
//! users supply the files.

use std::path::{Path, PathBuf};

use crate::diagnostic::{Code, Diagnostic};
use crate::format::Format;
use crate::limits::Limits;
use crate::motion::{Motion, Shape};
use crate::npz::archive::Archive;
use crate::npz::plan::read_numbers;
use crate::pickle;
use crate::source::Source;

/// The arrays of a motion that contain the shape of the body.
pub(crate) const SHAPE: [&str; 2] = ["betas", "gender"];

/// The body shape that a motion file contains; empty if it is stored neither as numbers nor as text.
pub(crate) fn shape_of(archive: &Archive) -> Result<Shape, Diagnostic> {
    let mut shape = Shape::default();
    if let Some(member) = archive.find("betas") {
        let axes = archive.header(member)?.shape.clone();
        let betas = read_numbers(archive, member).unwrap_or_default();
        // If there is a row for each frame, all rows are equal, and the first is used.
        let count = axes.last().copied().unwrap_or(0).min(betas.len());
        shape.betas = betas[..count].to_vec();
    }
    if let Some(member) = archive.find("gender")
        && let Ok(array) = archive.array(member)
        && let Ok(texts) = array.texts()
    {
        let text = texts.concat().to_lowercase();
        shape.gender = text.trim_matches(['b', '\'', '"', ' ']).to_owned();
    }
    Ok(shape)
}

/// The offsets of the joints of a clip's SMPL body from their parents, as a model defines them: x, y, z of each
/// joint, in the order of the tracks. For the first joint it is the position when `trans` is 0. The positions of
/// joints are `J_regressor (v_template + shapedirs betas)`. If `path` is a folder, the model for the gender of the
/// body is used.
///
/// # Errors
/// When the clip is not an SMPL body, when there is not exactly one such model, or when the model has other joints or
/// fewer betas.
pub fn body_offsets(path: &Path, clip: &Motion, limits: Limits) -> Result<Vec<f64>, Diagnostic> {
    let refuse =
        |message: String| Diagnostic::new(path.display().to_string(), Code::BodyModel, message);
    let shape = match &clip.body {
        Some(body) => &body.shape,
        None => {
            return Err(refuse(
                "the motion is of no SMPL body, whose joints a model has".to_owned(),
            ));
        }
    };
    let file = match path.is_dir() {
        true => of_gender(path, &shape.gender)?,
        false => path.to_owned(),
    };
    let source = Source::open(&file, false)?;
    let name = source.name.clone();
    let bytes = source.into_bytes(limits.file)?;
    let is_pickle = pickle::is_pickle(Format::detect(&file, &bytes));
    let archive = match is_pickle {
        true => pickle::Contents::read(&name, bytes, limits)?.into_parts().0,
        false => Archive::open(&name, bytes, limits)?,
    };
    let model = Model::read(&archive)?;
    let joints = model.joints(&archive, &shape.betas)?;
    let tracks = clip.skeleton.len();
    // Models number their joints instead of naming them, and all models begin with the same joints.
    let differs = |track: &usize| model.parents.get(*track) != Some(&clip.skeleton[*track].parent);
    if let Some(track) = (0..tracks).find(differs) {
        let called = |parent: Option<usize>| match parent {
            None => "is a root".to_owned(),
            Some(parent) => {
                let name = clip.set.track_name(parent);
                format!("has the parent {parent} (`{name}`)")
            }
        };
        let in_model = model.parents.get(track).copied();
        let message = format!(
            "the model has other joints than the motion: {} joints, not {tracks} or more with the same parents; joint \
             {track} (`{}`) of the motion {}, {}",
            joints.len(),
            clip.set.track_name(track),
            called(clip.skeleton[track].parent),
            in_model.map_or_else(
                || "which the model does not have".to_owned(),
                |parent| format!("that of the model {}", called(parent))
            )
        );
        return Err(Diagnostic::new(&name, Code::BodyModel, message));
    }
    let offset = |track: usize| {
        let [x, y, z] = joints[track];
        match clip.skeleton[track].parent {
            None => [x, y, z],
            Some(parent) => {
                let [px, py, pz] = joints[parent];
                [x - px, y - py, z - pz]
            }
        }
    };
    Ok((0..tracks).flat_map(offset).collect())
}

/// The only model for a gender in a folder: `SMPLH_FEMALE.npz`, `female/model.npz`.
fn of_gender(folder: &Path, gender: &str) -> Result<PathBuf, Diagnostic> {
    let refuse =
        |message: String| Diagnostic::new(folder.display().to_string(), Code::BodyModel, message);
    let gender = if gender.is_empty() { "neutral" } else { gender };
    let found = ["npz", "pkl"].map(|ending| files_of_gender(folder, gender, ending));
    // If a folder has a model in both formats, the first format is used.
    let found = found.into_iter().find(|found| !found.is_empty());
    match &found.unwrap_or_default()[..] {
        [only] => Ok(only.clone()),
        [] => Err(refuse(format!(
            "no model of gender `{gender}` is in the folder, as `…_{}.npz`, `{gender}/….npz` or the same as `.pkl`; \
             name the file",
            gender.to_uppercase()
        ))),
        [first, second, ..] => Err(refuse(format!(
            "{} and {} are both of gender `{gender}`; name the file",
            first.display(),
            second.display()
        ))),
    }
}

/// The models for a gender in a folder, in files with this ending.
fn files_of_gender(folder: &Path, gender: &str, ending: &str) -> Vec<PathBuf> {
    let files = |folder: &Path| -> Vec<PathBuf> {
        let entries = std::fs::read_dir(folder).into_iter().flatten();
        let paths = entries.flatten().map(|entry| entry.path());
        let has_ending = |path: &PathBuf| {
            let extension = path.extension();
            extension.is_some_and(|extension| extension.eq_ignore_ascii_case(ending))
        };
        paths.filter(has_ending).collect()
    };
    let stem = |path: &Path| {
        path.file_stem()
            .unwrap_or_default()
            .to_string_lossy()
            .to_lowercase()
    };
    let is_of = |path: &PathBuf| {
        stem(path)
            .split(['_', '-', '.', ' '])
            .any(|word| word == gender)
    };
    let mut found: Vec<PathBuf> = files(folder).into_iter().filter(is_of).collect();
    let inner = std::fs::read_dir(folder).into_iter().flatten().flatten();
    for entry in inner {
        let name = entry.file_name().to_string_lossy().to_lowercase();
        if name == gender && entry.path().is_dir() {
            found.extend(files(&entry.path()));
        }
    }
    found.sort();
    found
}

/// The arrays that determine joint positions.
struct Model {
    vertices: usize,
    betas: usize,
    parents: Vec<Option<usize>>,
}

impl Model {
    fn read(archive: &Archive) -> Result<Self, Diagnostic> {
        let shape = |name: &str| {
            archive.shape(name).ok_or_else(|| {
                let message = format!(
                    "there is no array `{name}`; a model has v_template, shapedirs, J_regressor and kintree_table, and \
                     there are {}",
                    archive.listing()
                );
                Diagnostic::new(&archive.file, Code::BodyModel, message)
            })
        };
        let (template, directions) = (shape("v_template")?, shape("shapedirs")?);
        let (regressor, tree) = (shape("J_regressor")?, shape("kintree_table")?);
        let (&[vertices, 3], &[of, 3, betas], &[joints, to], &[2, all]) =
            (template, directions, regressor, tree)
        else {
            return Err(Self::unlike(archive));
        };
        if of != vertices || to != vertices || all != joints {
            return Err(Self::unlike(archive));
        }
        let tree = Self::numbers(archive, "kintree_table")?;
        let parents = tree[..joints].iter().enumerate();
        // The parent of the root is -1 or 4294967295.
        let parent = |(joint, &parent): (usize, &f64)| match parent {
            _ if joint == 0 => Some(None),
            parent if (0.0..joint as f64).contains(&parent) => Some(Some(parent as usize)),
            _ => None,
        };
        let parents: Option<Vec<_>> = parents.map(parent).collect();
        Ok(Self {
            vertices,
            betas,
            parents: parents.ok_or_else(|| Self::unlike(archive))?,
        })
    }

    fn unlike(archive: &Archive) -> Diagnostic {
        let message = "v_template (V, 3), shapedirs (V, 3, B), J_regressor (J, V) and kintree_table (2, J), parents before \
                       children, do not fit each other";
        Diagnostic::new(&archive.file, Code::BodyModel, message)
    }

    fn numbers(archive: &Archive, name: &str) -> Result<Vec<f64>, Diagnostic> {
        let member = archive.find(name).ok_or_else(|| Self::unlike(archive))?;
        read_numbers(archive, member)
    }

    /// The joint positions of a shape.
    fn joints(&self, archive: &Archive, betas: &[f64]) -> Result<Vec<[f64; 3]>, Diagnostic> {
        if betas.len() > self.betas {
            let message = format!(
                "the motion has {} betas and the model {}; take the model with more",
                betas.len(),
                self.betas
            );
            return Err(Diagnostic::new(&archive.file, Code::BodyModel, message));
        }
        let mut vertices = Self::numbers(archive, "v_template")?;
        let directions = Self::numbers(archive, "shapedirs")?;
        for (number, weights) in vertices
            .iter_mut()
            .zip(directions.chunks_exact(self.betas.max(1)))
        {
            *number += betas
                .iter()
                .zip(weights)
                .map(|(beta, weight)| beta * weight)
                .sum::<f64>();
        }
        let regressor = Self::numbers(archive, "J_regressor")?;
        let (vertices, _) = vertices.as_chunks::<3>();
        let joint = |weights: &[f64]| {
            weights
                .iter()
                .zip(vertices)
                .fold([0.0; 3], |sum, (weight, vertex)| {
                    [0, 1, 2].map(|axis| sum[axis] + weight * vertex[axis])
                })
        };
        let joints: Vec<[f64; 3]> = regressor
            .chunks_exact(self.vertices.max(1))
            .map(joint)
            .collect();
        match joints
            .as_flattened()
            .iter()
            .all(|number| number.is_finite())
        {
            true => Ok(joints),
            false => Err(Self::unlike(archive)),
        }
    }
}
