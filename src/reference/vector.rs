//! Curves of vectors between keys: Hermite cubics, as in the books.

use glam::DVec3;

use crate::curve::options::Ends;

/// Keys of a vector in f64, and which textbook curve joins them.
#[derive(Debug, Clone)]
pub struct VectorCurve {
    /// `step`, `linear`, `catmull-rom`, `bessel-overhauser` or `gltf-cubic`.
    pub method: &'static str,
    /// The curve at the ends; clamped ends are at rest.
    pub ends: Ends,
    /// Seconds.
    pub times: Vec<f64>,
    /// A vector for each time.
    pub keys: Vec<DVec3>,
    /// Tangents with which the curve arrives at each key and leaves it, units per second; 0 for a
    /// key that has none.
    pub tangents: Vec<[DVec3; 2]>,
}

impl VectorCurve {
    /// The vector at a time; before the first key and after the last the end values.
    #[must_use]
    pub fn value(&self, time: f64) -> DVec3 {
        let last = self.keys.len() - 1;
        if time <= self.times[0] {
            return self.keys[0];
        }
        if time >= self.times[last] {
            return self.keys[last];
        }
        let i = self.times.partition_point(|&key| key <= time) - 1;
        let h = self.times[i + 1] - self.times[i];
        let t = (time - self.times[i]) / h;
        let (p0, p1) = (self.keys[i], self.keys[i + 1]);
        let smooth = matches!(self.method, "catmull-rom" | "bessel-overhauser");
        let frozen = self.ends == Ends::Frozen && last > 1 && (i == 0 || i + 1 == last);
        let (m0, m1) = match self.method {
            "step" => return p0,
            _ if smooth && frozen => return p0,
            "gltf-cubic" => {
                let given = |key: usize, side: usize| {
                    self.tangents
                        .get(key)
                        .map_or(DVec3::ZERO, |both| both[side] * h)
                };
                (given(i, 1), given(i + 1, 0))
            }
            _ if smooth && last > 1 => self.tangents_of(i),
            _ => (p1 - p0, p1 - p0),
        };
        let (t2, t3) = (t * t, t * t * t);
        p0 * (2.0 * t3 - 3.0 * t2 + 1.0)
            + m0 * (t3 - 2.0 * t2 + t)
            + p1 * (3.0 * t2 - 2.0 * t3)
            + m1 * (t3 - t2)
    }

    /// The tangents at both keys of interval `i`, per unit of its parameter.
    fn tangents_of(&self, i: usize) -> (DVec3, DVec3) {
        let last = self.keys.len() - 1;
        let closed = self.ends == Ends::Loop;
        let h = self.times[i + 1] - self.times[i];
        let at_key = |key: usize| -> Option<DVec3> {
            let (before, after) = match key {
                0 if closed => (last - 1, 0),
                key if key == last && closed => (last - 1, 0),
                0 => return None,
                key if key == last => return None,
                key => (key - 1, key),
            };
            let rise = |i: usize| self.keys[i + 1] - self.keys[i];
            let step = |i: usize| self.times[i + 1] - self.times[i];
            let (l, r) = (step(before), step(after));
            Some(if self.method == "catmull-rom" {
                (rise(before) + rise(after)) / 2.0
            } else {
                // The slope of the parabola through three keys.
                (rise(before) / l * r + rise(after) / r * l) / (l + r) * h
            })
        };
        let whole = self.keys[i + 1] - self.keys[i];
        let end = |other: DVec3| match self.ends {
            Ends::Natural => (3.0 * whole - other) / 2.0,
            Ends::Clamped { .. } => DVec3::ZERO,
            Ends::Secant => whole,
            _ => 2.0 * whole - other,
        };
        match (at_key(i), at_key(i + 1)) {
            (Some(m0), Some(m1)) => (m0, m1),
            (None, Some(m1)) => (end(m1), m1),
            (Some(m0), None) => (m0, end(m0)),
            (None, None) => (whole, whole),
        }
    }
}
