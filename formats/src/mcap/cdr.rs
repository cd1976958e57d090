//! Parses messages of ROS 2 as DDS encodes them: plain CDR of version 1 or 2, in either byte order.

use glam::{DQuat, DVec3};

use crate::source::ZSTD;

/// A message that is being parsed. Errors are texts that follow the message's name.
pub(super) struct Cdr<'a> {
    bytes: &'a [u8],
    /// Offset in the message; numbers are aligned to their sizes from its beginning.
    at: usize,
    is_little: bool,
    /// The largest alignment.
    max_alignment: usize,
}

/// Seconds and nanoseconds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Stamp {
    seconds: i32,
    nanoseconds: u32,
}

impl Stamp {
    pub(super) fn nanoseconds(self) -> i64 {
        i64::from(self.seconds) * 1_000_000_000 + i64::from(self.nanoseconds)
    }
}

/// Bytes of the shortest pose in a list: a stamp, the length of a text, seven numbers.
const SHORTEST: usize = 8 + 4 + 56;

impl<'a> Cdr<'a> {
    pub(super) fn new(bytes: &'a [u8]) -> Result<Self, String> {
        let Some((&[zero, kind, _, _], bytes)) = bytes.split_first_chunk::<4>() else {
            return Err("is shorter than its header".to_owned());
        };
        let (is_little, max_alignment) = match (zero, kind) {
            (0, 0) => (false, 8),
            (0, 1) => (true, 8),
            (0, 6) => (false, 4),
            (0, 7) => (true, 4),
            _ if [zero, kind] == ZSTD[..2] => {
                return Err(
                    "is compressed by zstd, as `ros2 bag record --compression-mode message` writes \
                     messages; decompress the log by `ros2 bag convert`"
                        .to_owned(),
                );
            }
            _ => {
                return Err(format!(
                    "begins with {zero:#04x} {kind:#04x}; only plain CDR is supported"
                ));
            }
        };
        Ok(Self {
            bytes,
            at: 0,
            is_little,
            max_alignment,
        })
    }

    fn take(&mut self, count: usize) -> Result<&'a [u8], String> {
        let bytes = self.bytes.get(self.at..).and_then(|rest| rest.get(..count));
        let bytes =
            bytes.ok_or_else(|| format!("ends within a value at its byte {}", self.at + 4))?;
        self.at += count;
        Ok(bytes)
    }

    fn number<const N: usize>(&mut self) -> Result<[u8; N], String> {
        self.at = self.at.next_multiple_of(N.min(self.max_alignment));
        let mut bytes = [0; N];
        bytes.copy_from_slice(self.take(N)?);
        if !self.is_little {
            bytes.reverse();
        }
        Ok(bytes)
    }

    fn whole(&mut self) -> Result<u32, String> {
        Ok(u32::from_le_bytes(self.number()?))
    }

    /// Reads an f64.
    pub(super) fn real(&mut self) -> Result<f64, String> {
        Ok(f64::from_le_bytes(self.number()?))
    }

    /// Reads a text, which ends with a zero.
    pub(super) fn text(&mut self) -> Result<String, String> {
        let length = self.whole()? as usize;
        let bytes = self.take(length)?;
        let bytes = bytes.strip_suffix(&[0]).unwrap_or(bytes);
        let text =
            std::str::from_utf8(bytes).map_err(|_| "has a text that is not UTF-8".to_owned());
        Ok(text?.to_owned())
    }

    /// Reads the number of entries of a list of poses.
    pub(super) fn count(&mut self) -> Result<usize, String> {
        let count = self.whole()? as usize;
        let left = self.bytes.len().saturating_sub(self.at);
        match count <= left / SHORTEST {
            true => Ok(count),
            false => Err(format!(
                "says that it has {count} poses, and is too short for them"
            )),
        }
    }

    /// Reads the stamp and the frame of a header.
    pub(super) fn header(&mut self) -> Result<(Stamp, String), String> {
        let stamp = Stamp {
            seconds: self.whole()?.cast_signed(),
            nanoseconds: self.whole()?,
        };
        Ok((stamp, self.text()?))
    }

    /// Reads a position, then a quaternion x y z w.
    pub(super) fn pose(&mut self) -> Result<(DVec3, DQuat), String> {
        let position = DVec3::new(self.real()?, self.real()?, self.real()?);
        Ok((position, self.rotation()?))
    }

    /// Reads a quaternion x y z w.
    pub(super) fn rotation(&mut self) -> Result<DQuat, String> {
        let [x, y, z, w] = [self.real()?, self.real()?, self.real()?, self.real()?];
        Ok(DQuat::from_xyzw(x, y, z, w))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A header and a pose by the rules of each kind of CDR. Numbers of eight bytes are at multiples of 8 after the
    /// first four bytes; in version 2, at multiples of 4.
    #[test]
    fn both_versions_and_both_orders_of_bytes_are_read() {
        for (kind, is_little, max_alignment) in
            [(0u8, false, 8), (1, true, 8), (6, false, 4), (7, true, 4)]
        {
            let mut bytes = Vec::new();
            let put = |number: &[u8], bytes: &mut Vec<u8>| {
                bytes.resize(
                    bytes
                        .len()
                        .next_multiple_of(number.len().min(max_alignment)),
                    0,
                );
                match is_little {
                    true => bytes.extend(number),
                    false => bytes.extend(number.iter().rev()),
                }
            };
            put(&(-3i32).to_le_bytes(), &mut bytes);
            put(&250_000_000u32.to_le_bytes(), &mut bytes);
            put(&4u32.to_le_bytes(), &mut bytes);
            bytes.extend(b"map\0");
            bytes.push(7); // so that padding counts
            let mut message = vec![0, kind, 0, 0];
            let mut body = bytes;
            body.pop();
            for number in [1.0f64, -2.0, 3.5, 0.0, 0.6, 0.0, 0.8] {
                put(&number.to_le_bytes(), &mut body);
            }
            message.extend(&body);
            let mut cdr = Cdr::new(&message).unwrap();
            let (stamp, frame) = cdr.header().unwrap();
            assert_eq!((stamp.nanoseconds(), &*frame), (-2_750_000_000, "map"));
            let (position, rotation) = cdr.pose().unwrap();
            assert_eq!(position, DVec3::new(1.0, -2.0, 3.5), "{kind}");
            assert_eq!(rotation, DQuat::from_xyzw(0.0, 0.6, 0.0, 0.8));
            assert!(cdr.text().is_err());
            for cut in 0..message.len() {
                let read = Cdr::new(&message[..cut]).and_then(|mut cdr| {
                    cdr.header()?;
                    cdr.pose()
                });
                assert!(read.is_err(), "{cut}");
            }
        }
        assert!(Cdr::new(&[0, 3, 0, 0]).is_err());
    }
}
