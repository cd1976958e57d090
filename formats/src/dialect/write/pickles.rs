//! Pickles of GMR, of the motion libraries of PHC, ASAP and GR00T, and of `MimicKit`.
//!
//! They are in protocol 2 and name `numpy.core.multiarray`, which every version of Python 3 and of `NumPy` reads;
//! `numpy._core` would shut out `NumPy` 1.

use std::io::Write;

use glam::DQuat;
use tumble::trees::BodyOrder;

use super::{RobotMotion, WrittenDialect};
use crate::format::WriteError;
use crate::npz::rotation_vector;
use crate::quaternion::ComponentOrder;
use crate::robot::VelocityPoint;

pub(super) static GMR: WrittenDialect = WrittenDialect {
    name: "gmr",
    summary: "pickle of GMR: root and joints in f8, x y z w",
    format: "pickle",
    order: BodyOrder::DepthFirst,
    has_bodies: false,
    names_joints: false,
    has_degrees: false,
    merges_links: false,
    velocity_at: VelocityPoint::Origin,
    quaternions: Some(ComponentOrder::Xyzw),
    assumed_rate: None,
    has_whole_rate: false,
    other_endings: None,
    takes_descriptions: false,
    write: write_gmr,
};

pub(super) static MOTION_LIB: WrittenDialect = WrittenDialect {
    name: "motion-lib",
    summary: "pickle of PHC, ASAP and GR00T: {clip: root, joints and pose_aa}, x y z w",
    write: write_motion_lib,
    ..GMR
};

pub(super) static MIMICKIT: WrittenDialect = WrittenDialect {
    name: "mimickit",
    summary: "pickle of MimicKit: a list of numbers for each frame",
    quaternions: None,
    write: write_mimickit,
    ..GMR
};

fn write_gmr(motion: &RobotMotion<'_>, out: &mut dyn Write) -> Result<(), WriteError> {
    let mut pickle = Pickle::new();
    let values = motion.all(|sample| motion.values(sample).map(f64::from).collect());
    pickle.dict(|pickle| {
        pickle.key("fps").number(motion.rate.per_second());
        pickle
            .key("root_pos")
            .array(b"f8", &[motion.samples(), 3], &motion.positions());
        pickle
            .key("root_rot")
            .array(b"f8", &[motion.samples(), 4], &motion.rotations());
        let shape = [motion.samples(), motion.joints.len()];
        pickle.key("dof_pos").array(b"f8", &shape, &values);
        pickle.key("local_body_pos").none();
        pickle.key("link_body_list").none();
    });
    pickle.finish(out)
}

/// `pose_aa` has the root's rotation vector, and for each joint its axis times its angle.
fn write_motion_lib(motion: &RobotMotion<'_>, out: &mut dyn Write) -> Result<(), WriteError> {
    let mut pickle = Pickle::new();
    let (samples, joints, axes) = (motion.samples(), motion.joints.len(), motion.axes());
    let values = motion.all(|sample| motion.values(sample).map(f64::from).collect());
    let vectors = motion.root_vectors();
    let angles = motion.all(|sample| {
        let of_joints = axes.iter().zip(motion.values(sample));
        let of_joints = of_joints.flat_map(|(&axis, angle)| (axis * f64::from(angle)).to_array());
        vectors[3 * sample..][..3]
            .iter()
            .copied()
            .chain(of_joints)
            .collect()
    });
    pickle.dict(|pickle| {
        pickle.key(motion.name).dict(|pickle| {
            let shape = [samples, 3];
            pickle
                .key("root_trans_offset")
                .array(b"f4", &shape, &motion.positions());
            pickle
                .key("pose_aa")
                .array(b"f4", &[samples, 1 + joints, 3], &angles);
            pickle.key("dof").array(b"f4", &[samples, joints], &values);
            pickle
                .key("root_rot")
                .array(b"f4", &[samples, 4], &motion.rotations());
            pickle.key("fps").number(motion.rate.per_second());
        });
    });
    pickle.finish(out)
}

fn write_mimickit(motion: &RobotMotion<'_>, out: &mut dyn Write) -> Result<(), WriteError> {
    let mut pickle = Pickle::new();
    let vectors = motion.root_vectors();
    pickle.dict(|pickle| {
        pickle.key("loop_mode").number(0.0);
        pickle.key("fps").number(motion.rate.per_second());
        pickle.key("frames").list(|pickle| {
            for sample in 0..motion.samples() {
                let root = motion.root_position(sample).to_array().into_iter();
                let root = root.chain(vectors[3 * sample..][..3].iter().copied());
                let joints = motion.values(sample).map(f64::from);
                pickle.list(|pickle| root.chain(joints).for_each(|number| pickle.float(number)));
            }
        });
    });
    pickle.finish(out)
}

impl RobotMotion<'_> {
    /// The numbers of all samples.
    fn all(&self, of_sample: impl FnMut(usize) -> Vec<f64>) -> Vec<f64> {
        (0..self.samples()).flat_map(of_sample).collect()
    }

    fn positions(&self) -> Vec<f64> {
        self.all(|sample| self.root_position(sample).to_array().to_vec())
    }

    fn rotations(&self) -> Vec<f64> {
        self.all(|sample| self.root_rotation(sample).to_vec())
    }

    /// The rotation vectors of the root, each near the one before.
    fn root_vectors(&self) -> Vec<f64> {
        let mut before = None;
        self.all(|sample| {
            let rotation = DQuat::from_array(self.root_rotation(sample));
            let vector = rotation_vector::log_of(rotation, before);
            before = Some(vector);
            vector.to_array().to_vec()
        })
    }
}

/// A pickle that is being written.
pub(super) struct Pickle(Vec<u8>);

/// Opcodes of protocol 2.
mod op {
    pub(super) const PROTO: &[u8] = b"\x80\x02";
    pub(super) const MARK: u8 = b'(';
    pub(super) const EMPTY_DICT: u8 = b'}';
    pub(super) const SETITEMS: u8 = b'u';
    pub(super) const EMPTY_LIST: u8 = b']';
    pub(super) const APPENDS: u8 = b'e';
    pub(super) const NONE: u8 = b'N';
    pub(super) const FALSE: u8 = 0x89;
    pub(super) const TRUE: u8 = 0x88;
    pub(super) const INT: u8 = b'J';
    pub(super) const LONG: u8 = 0x8a;
    pub(super) const FLOAT: u8 = b'G';
    pub(super) const TEXT: u8 = b'X';
    pub(super) const TUPLE: u8 = b't';
    pub(super) const EMPTY_TUPLE: u8 = b')';
    pub(super) const GLOBAL: u8 = b'c';
    pub(super) const REDUCE: u8 = b'R';
    pub(super) const BUILD: u8 = b'b';
    pub(super) const PERSISTENT: u8 = b'Q';
    pub(super) const STOP: u8 = b'.';
}

impl Pickle {
    pub(super) fn new() -> Self {
        Self(op::PROTO.to_vec())
    }

    pub(super) fn into_bytes(mut self) -> Vec<u8> {
        self.0.push(op::STOP);
        self.0
    }

    fn finish(self, out: &mut dyn Write) -> Result<(), WriteError> {
        Ok(out.write_all(&self.into_bytes())?)
    }

    pub(super) fn dict(&mut self, entries: impl FnOnce(&mut Self)) {
        self.0.extend([op::EMPTY_DICT, op::MARK]);
        entries(self);
        self.0.push(op::SETITEMS);
    }

    fn list(&mut self, items: impl FnOnce(&mut Self)) {
        self.0.extend([op::EMPTY_LIST, op::MARK]);
        items(self);
        self.0.push(op::APPENDS);
    }

    fn tuple(&mut self, items: impl FnOnce(&mut Self)) {
        self.0.push(op::MARK);
        items(self);
        self.0.push(op::TUPLE);
    }

    /// The key of the entry that follows.
    pub(super) fn key(&mut self, name: &str) -> &mut Self {
        self.text(name);
        self
    }

    fn text(&mut self, text: &str) {
        self.0.push(op::TEXT);
        self.0.extend((text.len() as u32).to_le_bytes());
        self.0.extend(text.as_bytes());
    }

    fn none(&mut self) {
        self.0.push(op::NONE);
    }

    fn int(&mut self, number: i32) {
        self.0.push(op::INT);
        self.0.extend(number.to_le_bytes());
    }

    fn float(&mut self, number: f64) {
        self.0.push(op::FLOAT);
        self.0.extend(number.to_be_bytes());
    }

    /// An `int` if it is one.
    pub(super) fn number(&mut self, number: f64) {
        match number as i32 {
            int if f64::from(int) == number => self.int(int),
            _ => self.float(number),
        }
    }

    fn global(&mut self, module: &str, name: &str) {
        self.0.push(op::GLOBAL);
        self.0.extend(format!("{module}\n{name}\n").bytes());
    }

    /// A length, which may be larger than an `int`.
    fn length(&mut self, length: usize) {
        match i32::try_from(length) {
            Ok(length) => self.int(length),
            Err(_) => {
                self.0.extend([op::LONG, 8]);
                self.0.extend((length as u64).to_le_bytes());
            }
        }
    }

    fn lengths(&mut self, lengths: &[usize]) {
        self.tuple(|pickle| lengths.iter().for_each(|&length| pickle.length(length)));
    }

    /// A tensor of `PyTorch` in C order, whose numbers are the file `key` of an archive.
    pub(super) fn tensor(&mut self, key: &str, shape: &[usize]) {
        let mut strides = vec![1; shape.len()];
        for axis in (1..shape.len()).rev() {
            strides[axis - 1] = strides[axis] * shape[axis];
        }
        self.global("torch._utils", "_rebuild_tensor_v2");
        self.tuple(|pickle| {
            pickle.tuple(|pickle| {
                pickle.text("storage");
                pickle.global("torch", "FloatStorage");
                pickle.text(key);
                pickle.text("cpu");
                pickle.length(shape.iter().product());
            });
            pickle.0.push(op::PERSISTENT);
            pickle.int(0);
            pickle.lengths(shape);
            pickle.lengths(&strides);
            pickle.0.push(op::FALSE);
            pickle.global("collections", "OrderedDict");
            pickle.0.extend([op::EMPTY_TUPLE, op::REDUCE]);
        });
        self.0.push(op::REDUCE);
    }

    /// Bytes, which protocol 2 has as text of which `_codecs.encode` makes them.
    fn bytes(&mut self, bytes: &[u8]) {
        self.global("_codecs", "encode");
        let text: String = bytes.iter().copied().map(char::from).collect();
        self.tuple(|pickle| {
            pickle.text(&text);
            pickle.text("latin1");
        });
        self.0.push(op::REDUCE);
    }

    /// An array of `f4` or `f8` in C order.
    fn array(&mut self, element: &[u8; 2], shape: &[usize], numbers: &[f64]) {
        self.global("numpy.core.multiarray", "_reconstruct");
        self.tuple(|pickle| {
            pickle.global("numpy", "ndarray");
            pickle.tuple(|pickle| pickle.int(0));
            pickle.bytes(b"b");
        });
        self.0.extend([op::REDUCE, op::MARK]);
        self.int(1);
        self.lengths(shape);
        self.global("numpy", "dtype");
        self.tuple(|pickle| {
            pickle.text(&String::from_utf8_lossy(element));
            pickle.0.extend([op::FALSE, op::TRUE]);
        });
        self.0.push(op::REDUCE);
        self.tuple(|pickle| {
            pickle.int(3);
            pickle.text("<");
            pickle.0.extend([op::NONE; 3]);
            [-1, -1, 0]
                .into_iter()
                .for_each(|number| pickle.int(number));
        });
        self.0.extend([op::BUILD, op::FALSE]);
        let bytes: Vec<u8> = match element {
            b"f4" => numbers
                .iter()
                .flat_map(|&number| (number as f32).to_le_bytes())
                .collect(),
            _ => numbers
                .iter()
                .flat_map(|number| number.to_le_bytes())
                .collect(),
        };
        self.bytes(&bytes);
        self.0.extend([op::TUPLE, op::BUILD]);
    }
}
