//! Tumble for Python: the extension module behind the package `tumble`.
//!
//! Arguments become values of the engine's (`arrays`, `build`, `options`), results are written by
//! the engine into NumPy's memory (`evaluate`, `output`, `run`), and what went wrong becomes an
//! exception (`errors`). The interpreter's lock is released while the engine works. Results that stay on a card
//! (`device_array`) are handed on by CUDA's driver (`cuda`) and DLPack (`dlpack`), the only ones with `unsafe`.

mod array_memory;
mod arrays;
mod build;
mod clip;
mod clip_shape;
mod compare;
mod crowd;
mod cuda;
mod device_array;
mod device_motions;
mod dlpack;
mod engine;
mod errors;
mod evaluate;
mod events;
mod features;
mod file;
mod follow;
mod function;
mod motions;
mod names;
mod options;
mod output;
mod pickle;
mod poses;
mod program;
mod reduce;
mod retarget;
mod robot;
mod route;
mod run;
mod sampler;
mod samples;
mod save;
mod scalars;
mod shards;
mod stream;
mod unpickle;
mod values;
mod verify;

use pyo3::pymodule;

/// The extension module; its public names are those of the package `tumble`.
#[pymodule(gil_used = false)]
mod _tumble {
    #[pymodule_export]
    use crate::clip::Clip;
    #[pymodule_export]
    use crate::clip_shape::shaped;
    #[pymodule_export]
    use crate::compare::{
        ArrayDifference, ChannelDifference, ClipDifference, JointDifference, PathErrors,
        PathStatistics, Spread, compare, path_errors,
    };
    #[pymodule_export]
    use crate::crowd::Crowd;
    #[pymodule_export]
    use crate::device_array::DeviceArray;
    #[pymodule_export]
    use crate::device_motions::DeviceMotions;
    #[pymodule_export]
    use crate::engine::Engine;
    #[pymodule_export]
    use crate::events::{ClipEvent, PassedEvent};
    #[pymodule_export]
    use crate::features::{
        contacts, heading, humanml3d, mirror_pairs, mirrored_positions, mirrored_rotations,
        positions_of_humanml3d, root_after_loops, root_motion, rotations_of_six, six,
    };
    #[pymodule_export]
    use crate::file::file_of_state;
    #[pymodule_export]
    use crate::file::{File, load, load_all};
    #[pymodule_export]
    use crate::function::evaluate;
    #[pymodule_export]
    use crate::motions::frames::{joint_partners, reframe};
    #[pymodule_export]
    use crate::motions::robots::{robot_motions, sample_bodies};
    #[pymodule_export]
    use crate::motions::scalars::scalar_motions;
    #[pymodule_export]
    use crate::motions::{Motions, put_w_first, represent};
    #[pymodule_export]
    use crate::pickle::clip_of_state;
    #[pymodule_export]
    use crate::program::{devices, encodings, load_drivers, methods, page, panic, run, set_probe};
    #[pymodule_export]
    use crate::reduce::{Reduction, reduce};
    #[pymodule_export]
    use crate::retarget::retarget;
    #[pymodule_export]
    use crate::robot::Robot;
    #[pymodule_export]
    use crate::route::{Route, Surface, Walk, walk};
    #[pymodule_export]
    use crate::sampler::Sampler;
    #[pymodule_export]
    use crate::save::save;
    #[pymodule_export]
    use crate::shards::{
        Plan, Record, Worker, input_sha256, inputs_of, kernels_sha256, manifest_by_input,
        manifest_results, manifest_unfinished, merge, referred_files,
    };
    #[pymodule_export]
    use crate::stream::{Chunk, Chunks};
    #[pymodule_export]
    use crate::unpickle::value_of_state;
    #[pymodule_export]
    use crate::verify::Verification;

    /// The version of the package.
    #[pymodule_export]
    #[allow(non_upper_case_globals, reason = "Python's name")]
    const __version__: &str = env!("CARGO_PKG_VERSION");
}
