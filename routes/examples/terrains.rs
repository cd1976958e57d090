//! The cost of a route across a rough terrain: time, and the memory at its peak.
//!
//! `cargo run --release -p tumble-routes --example terrains [-- TRIANGLES BY ROUGHNESS]`

#![allow(clippy::disallowed_methods)] // a terrain to time

use std::time::Instant;

use glam::{DVec3, dvec3};
use tumble_routes::mesh::Mesh;
use tumble_routes::route::By;

/// Hills on hills and some noise, about so many triangles.
fn terrain(triangles: usize, roughness: f64) -> (Vec<DVec3>, Vec<[u32; 3]>) {
    let width = ((triangles as f64 / 2.0).sqrt().ceil() as u32).max(1) + 1;
    let mut random = fastrand::Rng::with_seed(1);
    let mut positions = Vec::new();
    for y in 0..width {
        for x in 0..width {
            let (u, v) = (f64::from(x), f64::from(y));
            let hills =
                9.0 * (u / 17.0).sin() * (v / 23.0).cos() + (u / 3.0).sin() * (v / 5.0).sin();
            positions.push(dvec3(u, v, hills + roughness * random.f64()));
        }
    }
    let mut faces = Vec::new();
    for y in 0..width - 1 {
        for x in 0..width - 1 {
            let at = |dx, dy| (y + dy) * width + x + dx;
            faces.extend([
                [at(0, 0), at(1, 0), at(1, 1)],
                [at(0, 0), at(1, 1), at(0, 1)],
            ]);
        }
    }
    (positions, faces)
}

/// The peak memory of the process, in bytes, where the system reports it.
fn peak() -> Option<f64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status
        .lines()
        .find_map(|line| line.strip_prefix("VmHWM:"))?;
    let kibibytes: f64 = line.trim().strip_suffix(" kB")?.parse().ok()?;
    Some(kibibytes * 1024.0)
}

fn main() {
    let mut arguments = std::env::args().skip(1);
    let requested: Option<usize> = arguments.next().and_then(|text| text.parse().ok());
    let by: By = arguments
        .next()
        .and_then(|text| text.parse().ok())
        .unwrap_or_default();
    let roughness: f64 = arguments
        .next()
        .and_then(|text| text.parse().ok())
        .unwrap_or(0.3);
    let sizes = requested.map_or(vec![10_000, 100_000], |count| vec![count]);
    for size in sizes {
        let (positions, faces) = terrain(size, roughness);
        let started = Instant::now();
        let mesh = match Mesh::new(&positions, &faces) {
            Ok(mesh) => mesh,
            Err(error) => return eprintln!("{error}"),
        };
        let built = started.elapsed();
        println!(
            "{} triangles, made in {:.3} s",
            faces.len(),
            built.as_secs_f64()
        );
        let width = positions.len().isqrt();
        let last = positions.len() - 1;
        // Along the diagonals of the squares, across them, and from side to side.
        let sides = (width / 5 * width, (width - width / 5) * width - 1);
        for (from, to) in [(0, last), (width - 1, last + 1 - width), sides] {
            let started = Instant::now();
            match mesh.route(positions[from], positions[to], by) {
                Ok(route) => println!(
                    "  vertex {from} to {to} by {by}: {:.3} s, length {:.12}, {} points, peak {:.0} MB",
                    started.elapsed().as_secs_f64(),
                    route.length,
                    route.points.len(),
                    peak().unwrap_or(f64::NAN) / 1e6,
                ),
                Err(error) => println!("  vertex {from} to {to} by {by}: {error}"),
            }
        }
    }
}
