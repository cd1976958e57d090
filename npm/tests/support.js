// Code that the tests share: the package, the program, and the arrays of NumPy's files.

import { execFileSync } from "node:child_process";
import { createHash } from "node:crypto";
import { mkdtempSync, readFileSync, rmSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { fileURLToPath } from "node:url";

export const root = fileURLToPath(new URL("../..", import.meta.url));

/** The program that the package is compared with. */
export const program = process.env.TUMBLE ?? join(root, process.env.CARGO_TARGET_DIR ?? "target", "debug/tumble");

/** A folder that is gone when the process ends. */
export function folder() {
  const made = mkdtempSync(join(tmpdir(), "tumble-npm-"));
  process.on("exit", () => rmSync(made, { recursive: true, force: true }));
  return made;
}

/** Runs the program in a folder. */
export function tumble(place, ...line) {
  return execFileSync(program, line, { cwd: place, stdio: ["ignore", "pipe", "pipe"], timeout: 60_000 });
}

/** An array of an NPY file: its shape and its numbers. */
export function npy(path) {
  const bytes = readFileSync(path);
  const length = bytes.readUInt16LE(8);
  const header = bytes.toString("latin1", 10, 10 + length);
  const shape = /'shape': \(([^)]*)\)/.exec(header)[1].split(",").filter((part) => part.trim()).map(Number);
  const numbers = bytes.buffer.slice(bytes.byteOffset + 10 + length, bytes.byteOffset + bytes.length);
  const kind = /'descr': '([^']*)'/.exec(header)[1];
  return { shape, numbers: kind === "<f8" ? new Float64Array(numbers) : new Float32Array(numbers) };
}

/** The first place at which two arrays have other bits; -1 where they have the same. */
export function differs(one, other) {
  if (one.length !== other.length) return Math.min(one.length, other.length);
  const bits = (array) => new Uint32Array(array.buffer, array.byteOffset, array.length);
  const [a, b] = [bits(one), bits(other)];
  return a.findIndex((word, i) => word !== b[i]);
}

export const sha256 = (array) => createHash("sha256").update(new Uint8Array(array.buffer)).digest("hex");

/** Files of every kind: chains, a skeleton, channels with samplers of their own. */
export const FILES = [
  "data/pendulum.dat",
  "data/pendulum-random.dat",
  "formats/tests/fixtures/bvh/good.bvh",
  "formats/tests/fixtures/glb/whole.glb",
  "formats/tests/fixtures/glb/cubic.gltf",
];
