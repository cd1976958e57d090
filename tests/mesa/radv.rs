//! Compiles every kernel for six families of AMD's cards, without a card: with `RADV_FORCE_FAMILY`, Mesa's RADV creates
//! a device for which it can compile but not compute. Since Mesa 26.2, a layer that replaces the driver in the kernel
//! of Linux does this, with `AMDGPU_GPU_ID`. The test reads the listing; every instruction on floats must round as the
//! shader requires.
//!
//! The system's RADV and a newer one are asked, and the newest one where it is unpacked. Catches a driver that fuses in spite of the
//! decorations, a kernel that lacks one, spilled registers, and a kernel that got dearer.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::Command;

use super::compile::{divisions, listings, this_program};
use super::listing::{Generation, Listing, is_exact_half};
use super::table::{self, Cost};
use super::{Driver, newer, unpacked_if_there, with_driver};
use crate::support::is_due;
use rayon::prelude::*;

/// A family of processors.
struct Family {
    /// As Mesa 25 calls it, and the table.
    name: &'static str,
    /// As Mesa 22 calls it, where that knows it.
    older: Option<&'static str>,
    generation: Generation,
}

const fn family(name: &'static str, older: Option<&'static str>, generation: Generation) -> Family {
    Family {
        name,
        older,
        generation,
    }
}

/// From cards of 2016 to those of 2025.
const FAMILIES: [Family; 6] = [
    family("polaris10", Some("polaris10"), Generation::Gcn),
    family("vega10", Some("vega10"), Generation::Gcn),
    family("renoir", Some("renoir"), Generation::Gcn),
    family("navi21", Some("navi21"), Generation::Rdna),
    family("navi31", Some("gfx1100"), Generation::Rdna),
    family("gfx1201", None, Generation::Rdna),
];

/// The head of the table of docs/gpu-compilers.md with the cost of a rotation on AMD's processors, kernel by kernel.
const TABLE: &str = "| kernel | polaris10 |";

/// A processor with so many vector registers for an invocation keeps at least a quarter of the
/// waves that fit (polaris10 to navi31, waves of 64).
const MAX_REGISTERS: u64 = 128;

/// RADV as the system has it.
fn system() -> Option<PathBuf> {
    let manifests = std::fs::read_dir("/usr/share/vulkan/icd.d").into_iter();
    let mut paths = manifests.flatten().map(|entry| entry.unwrap().path());
    let found = paths.find(|path| path.to_string_lossy().contains("/radeon_icd"));
    assert!(
        found.is_some() || std::env::var_os("CI").is_none(),
        "CI must have RADV (Debian: mesa-vulkan-drivers)"
    );
    if found.is_none() {
        eprintln!("NO RADV: this test compiled nothing");
    }
    found
}

/// The Mesa whose RADV makes a device of its own for a family no more, major and minor.
const BY_LAYER: (u32, u32) = (26, 2);

/// This program with a driver that compiles for a family.
fn program(manifest: &Path, family: &str) -> Command {
    let driver = Driver::of(manifest);
    if driver.version < BY_LAYER {
        let mut program = this_program();
        with_driver(&mut program, manifest).env("RADV_FORCE_FAMILY", family);
        return program;
    }
    let mut program = driver.this_program("libamdgpu_noop_drm_shim.so");
    with_driver(&mut program, manifest).env("AMDGPU_GPU_ID", family);
    program
}

/// The listings of kernels as a driver compiles them for a family (all kernels where none is named).
fn compiled(
    manifest: &Path,
    family: &str,
    kernels: &[&str],
    is_bare: bool,
) -> Vec<(String, Listing)> {
    let (major, minor) = Driver::of(manifest).version;
    let label = format!("{major}.{minor}-{family}-{}", kernels.len());
    let mut program = program(manifest, family);
    let texts = listings(&mut program, &label, kernels, is_bare).into_iter();
    texts
        .map(|(name, text)| (name, Listing::read(&text)))
        .collect()
}

/// The faults of a kernel: instructions that do not round as the shader, spilled registers, and too many registers.
fn faults(kernel: &str, listing: &Listing, generation: Generation) -> Vec<String> {
    let mut faults = Vec::new();
    let mut left = [divisions(kernel); 2];
    for instruction in listing.inexact(generation) {
        let of_division = ["rcp_", "cvt_u32_f32"].map(|part| instruction.contains(part));
        let of_division = of_division.into_iter().position(|is_found| is_found);
        match of_division.map(|part| &mut left[part]) {
            Some(left) if *left > 0 => *left -= 1,
            // Mesa 26 computes half of a product in this way, and subtracts it from 1.5.
            None if kernel == "poses_smooth" && is_exact_half(instruction, generation) => {}
            _ => faults.push(format!("`{instruction}` is not exact")),
        }
    }
    for none in ["Scratch size", "Spilled VGPRs", "Spilled SGPRs"] {
        let found = listing.statistic(none);
        if found > 0 {
            faults.push(format!("{none}: {found}"));
        }
    }
    let registers = listing.statistic("VGPRs");
    if registers > MAX_REGISTERS {
        faults.push(format!("{registers} vector registers"));
    }
    faults
}

/// Each kernel is due on every third family: the newer compiler compiles it for a
/// processor of the older kind and for one of the newer, the system's for one or two. Those of the table
/// are compiled for all.
#[test]
fn every_kernel_is_exact_on_families_in_turn() {
    let newer = newer("radeon");
    let newer_families = FAMILIES
        .iter()
        .map(|family| (family, Some(family.name), &newer));
    let system = system();
    let older_families = FAMILIES
        .iter()
        .map(|family| (family, family.older, &system));
    let newest = unpacked_if_there("newest/radeon_icd.json");
    let newest_families = FAMILIES
        .iter()
        .map(|family| (family, Some(family.name), &newest));
    let asked: Vec<(&Family, &str, &Path)> = newer_families
        .chain(older_families)
        .chain(newest_families)
        .filter_map(|(family, name, manifest)| Some((family, name?, manifest.as_deref()?)))
        .collect();
    let in_table = table::kernels(TABLE);
    let of_all: Vec<_> = asked
        .into_par_iter()
        .enumerate()
        .map(|(round, (family, name, manifest))| {
            let is_next = |i: usize, kernel: &str| {
                is_due(round, i, 3) || in_table.iter().any(|listed| listed == kernel)
            };
            let kernels = tumble::vulkan::kernels()
                .map(|(kernel, _)| kernel)
                .enumerate();
            let kernels = kernels.filter(|(i, kernel)| is_next(*i, kernel));
            let kernels: Vec<&str> = kernels.map(|(_, kernel)| kernel).collect();
            (family, manifest, compiled(manifest, name, &kernels, false))
        })
        .collect();
    let mut wrong = Vec::new();
    let mut costs = BTreeMap::new();
    for (family, manifest, listings) in &of_all {
        assert!(listings.len() > 50, "{}: {}", family.name, listings.len());
        for (kernel, listing) in listings {
            for fault in faults(kernel, listing, family.generation) {
                let manifest = manifest.display();
                wrong.push(format!("{} ({manifest}), {kernel}: {fault}", family.name));
            }
            if newer.as_deref() == Some(manifest) {
                let cost = Cost {
                    instructions: listing.vector_instructions_a_sample() as u64,
                    registers: listing.statistic("VGPRs"),
                };
                costs.insert((kernel.clone(), family.name), cost);
            }
        }
    }
    if newer.is_some() {
        wrong.extend(table::check(TABLE, &costs));
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// The negative control: without the exactness pass, the same compilers fuse operations, and the check
/// finds it.
#[test]
fn without_the_pass_products_and_sums_are_fused() {
    let kernels = ["arc_frames_f32", "polynomial_frames_f32"];
    let newer = newer("radeon").map(|manifest| (manifest, "gfx1201"));
    let system = system().map(|manifest| (manifest, "navi21"));
    let newest = unpacked_if_there("newest/radeon_icd.json").map(|manifest| (manifest, "gfx1201"));
    for (manifest, family) in newer.into_iter().chain(system).chain(newest) {
        for (kernel, listing) in compiled(&manifest, family, &kernels, true) {
            let fused = listing.inexact(Generation::Rdna);
            let is_fused = |line: &&&str| line.contains("_fma");
            let fused = fused.iter().filter(is_fused).count();
            assert!(fused > 10, "{family}, {kernel}: {fused} fused");
        }
    }
}
