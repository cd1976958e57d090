//! Files of other programs that are mistaken for motion files: their kinds, and the remedies.

use std::path::Path;

use crate::source::ZSTD;

/// A kind of file that is not read.
struct Foreign {
    /// Extensions of its files. They count only where the text does not begin as numbers do.
    extensions: &'static [&'static str],
    /// First bytes of its files; any of them.
    begins: &'static [&'static [u8]],
    /// The kind in words, and how to get a motion file instead.
    description: &'static str,
}

/// The description of a format of markers, which a program must solve to a skeleton.
macro_rules! of_markers {
    ($format:literal) => {
        concat!(
            $format,
            ": positions of markers, without rotations; solve a skeleton in the program that recorded it, and export BVH, FBX or GLB"
        )
    };
}

/// The first row whose signature or extension fits.
const ALL: [Foreign; 26] = [
    Foreign {
        extensions: &[],
        begins: &[b"version https://git-lfs"],
        description: "a pointer of Git LFS; the file itself is not here (`git lfs pull` fetches it)",
    },
    Foreign {
        extensions: &["gz"],
        begins: &[b"\x1f\x8b"],
        description: "gzip; unpack it first",
    },
    Foreign {
        extensions: &["zst"],
        begins: &[&ZSTD],
        description: "Zstandard; unpack it first (zstd -d)",
    },
    Foreign {
        extensions: &[],
        begins: &[b"\x93NUMPY"],
        description: "NPY; save its keys and their times as NPZ (numpy.savez)",
    },
    Foreign {
        extensions: &[],
        begins: &[b"HIERARCHY"],
        description: "BVH motion capture; read it with --from bvh",
    },
    Foreign {
        extensions: &["xml", "urdf", "mjcf", "xacro", "dae"],
        begins: &[b"<?xml", b"<mujoco", b"<robot", b"<COLLADA"],
        description: "XML, which is not read as motion; export an animation of Collada as GLB, FBX or BVH; for robots (MJCF, \
                      URDF), `tumble info` lists bodies and joints, and the motion is in another file",
    },
    Foreign {
        extensions: &[],
        begins: &[b"glTF"],
        description: "binary glTF; read it with --from glb",
    },
    Foreign {
        extensions: &["usd", "usda", "usdc", "usdz"],
        begins: &[b"#usda", b"PXR-USDC"],
        description: "a scene of OpenUSD; export it as GLB from Blender or the program that made it",
    },
    Foreign {
        extensions: &["vrma", "vrm"],
        begins: &[],
        description: "damaged: VRM files are binary glTF and begin with `glTF`; export it again",
    },
    Foreign {
        extensions: &["zip"],
        begins: &[b"PK\x03\x04"],
        description: "a ZIP archive; unpack it first",
    },
    Foreign {
        extensions: &["json"],
        begins: &[b"{"],
        description: "JSON; if it is glTF, read it with --from glb",
    },
    Foreign {
        extensions: &["trc"],
        begins: &[b"PathFileType"],
        description: of_markers!("TRC of OpenSim or Cortex"),
    },
    Foreign {
        extensions: &["c3d"],
        begins: &[b"\x02\x50", b"\x03\x50", b"\x04\x50", b"\x05\x50"],
        description: of_markers!("C3D"),
    },
    Foreign {
        extensions: &["sto", "mot"],
        begins: &[],
        description: "a table of OpenSim, whose columns are coordinates of its model; export the bodies' rotations as CSV with quaternions",
    },
    Foreign {
        extensions: &[],
        begins: &[b"NO_OF_FRAMES"],
        description: "an export of Qualisys QTM; delete the rows before the names of the columns, replace tabs by commas, and name it .csv",
    },
    Foreign {
        extensions: &[],
        begins: &[b"// Start Time", b"// General information"],
        description: "an export of Xsens; delete the rows before the names of the columns, replace tabs by commas, and name it .csv",
    },
    Foreign {
        extensions: &["tsv"],
        begins: &[],
        description: "a table with tabs; replace them by commas, and name it .csv",
    },
    Foreign {
        extensions: &[],
        begins: &[b"\x80\x02", b"\x80\x03", b"\x80\x04", b"\x80\x05"],
        description: "a pickle of Python; name it .pkl, and its numbers and arrays are read (nothing in it is run)",
    },
    Foreign {
        extensions: &["mat", "h5", "hdf5"],
        begins: &[b"MATLAB 5.0", b"\x89HDF"],
        description: "arrays of MATLAB or HDF5; load them in Python (scipy.io.loadmat, h5py), and save them by numpy.savez",
    },
    Foreign {
        extensions: &["bag"],
        begins: &[b"#ROSBAG V"],
        description: "a log of ROS 1; convert it first: mcap convert LOG.bag LOG.mcap",
    },
    Foreign {
        extensions: &["db3"],
        begins: &[b"SQLite format 3"],
        description: "a log of ROS 2 in SQLite; convert it first: mcap convert LOG.db3 LOG.mcap",
    },
    Foreign {
        extensions: &["asf", "amc"],
        begins: &[],
        description: "Acclaim motion capture; convert it to BVH first",
    },
    Foreign {
        extensions: &[
            "gif", "png", "jpg", "jpeg", "webp", "bmp", "tif", "tiff", "svg",
        ],
        begins: &[b"GIF8", b"\x89PNG", b"\xff\xd8\xff"],
        description: "a picture, which has no keyframes",
    },
    Foreign {
        extensions: &["mp4", "mov", "avi", "mkv", "webm"],
        begins: &[b"\x1aE\xdf\xa3", b"RIFF"],
        description: "a film, which has no keyframes; programs that estimate poses from films write NPZ or pickles, which are read",
    },
    Foreign {
        extensions: &["md", "rst", "html", "htm", "pdf", "toml", "yaml", "yml"],
        begins: &[b"%PDF", b"<!DOCTYPE"],
        description: "a document, which has no keyframes",
    },
    Foreign {
        extensions: &["blend", "ma", "mb", "max", "c4d"],
        begins: &[b"BLENDER"],
        description: "a scene of a 3D program; export its animation as GLB, FBX or BVH",
    },
];

/// The description of a file that was taken for text of numbers, by its first bytes or its name; `None` if it
/// may be such text.
pub(crate) fn description(name: &str, start: &[u8]) -> Option<&'static str> {
    let begins = |kind: &&Foreign| kind.begins.iter().any(|bytes| start.starts_with(bytes));
    let of_start = ALL.iter().find(begins);
    let first = start.trim_ascii_start().first();
    let is_like_numbers =
        first.is_none_or(|first| first.is_ascii_digit() || b"#+-.".contains(first));
    let extension = Path::new(name).extension().and_then(|text| text.to_str());
    let extension = extension.filter(|_| !is_like_numbers).unwrap_or_default();
    let is_named = |kind: &&Foreign| {
        let mut known = kind.extensions.iter();
        known.any(|known| known.eq_ignore_ascii_case(extension))
    };
    let found = of_start.or_else(|| ALL.iter().find(is_named));
    found.map(|kind| kind.description)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_read_whatever_the_name() {
        for start in [
            &b"# 4 3.0\n"[..],
            b"0 1 0 0 0\n",
            b"  -1 0\n",
            b".5 1\n",
            b"",
        ] {
            assert_eq!(description("walk.mot", start), None);
        }
        assert!(
            description("walk.MOT", b"walk\nversion=1\n")
                .unwrap()
                .contains("OpenSim")
        );
        assert!(
            description("walk.txt", b"PathFileType\t4")
                .unwrap()
                .contains("TRC")
        );
        assert_eq!(description("walk.txt", b"walk\n"), None);
    }

    /// The errors of reading whole files name their kinds and the remedies.
    #[test]
    fn files_of_others_are_told_by_what_they_are() {
        for (name, bytes, program, remedy) in [
            (
                "x.trc",
                &b"PathFileType\t4\t(X/Y/Z)\tx.trc\n"[..],
                "TRC",
                "export BVH",
            ),
            (
                "x.sto",
                b"x\nversion=1\nendheader\ntime\ta\n0\t1\n",
                "OpenSim",
                "quaternions",
            ),
            (
                "q.tsv",
                b"NO_OF_FRAMES\t31\n",
                "Qualisys",
                "delete the rows",
            ),
            ("t.tsv", b"time\tx\n0\t1\n", "tabs", "commas"),
            (
                "mti.txt",
                b"// Start Time: Unknown\n// Sample rate: 100.0Hz\n",
                "Xsens",
                "delete",
            ),
            ("x.c3d", b"\x02\x50\x01\x00", "C3D", "export BVH"),
            ("x.bag", b"#ROSBAG V2.0\n", "ROS 1", "mcap convert"),
            ("x.db3", b"SQLite format 3\0", "ROS 2", "mcap convert"),
            ("x.usda", b"#usda 1.0\n", "OpenUSD", "GLB"),
            ("x.usd", b"PXR-USDC\0", "OpenUSD", "GLB"),
            ("x.vrma", b"\0\0\0\0", "VRM", "export it again"),
            ("x.gif", b"GIF89a\xc9\0", "a picture", "no keyframes"),
            ("x.glb", b"\x89PNG\r\n\x1a\n\0", "a picture", "no keyframes"),
            (
                "y.glb",
                b"version https://git-lfs.github.com/spec/v1\n",
                "a pointer of Git LFS",
                "git lfs pull",
            ),
            ("x.mp4", b"\0\0\0\x20ftypisom", "a film", "estimate poses"),
            (
                "guide.html",
                b"<!DOCTYPE html>\n",
                "a document",
                "no keyframes",
            ),
        ] {
            let options = crate::ReadOptions::default();
            let read = crate::Format::read_detected(name, bytes.to_vec(), &options);
            let error = read.unwrap_err().to_string();
            for words in ["error[E004]: this looks like ", program, remedy] {
                assert!(error.contains(words), "{error}");
            }
        }
    }
}
