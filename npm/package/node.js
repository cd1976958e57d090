// Entry point for Node.js, which reads the module from a file.

import { readFile } from "node:fs/promises";
import { load as loadAnywhere } from "./index.js";

export { Clip, Tumble, TumbleError, sample } from "./core.js";

/** Loads the engine. `source`: the module's bytes, its URL, or a response with it. */
export async function load(source = new URL("./tumble.wasm", import.meta.url)) {
  const isFile = source instanceof URL && source.protocol === "file:";
  return loadAnywhere(isFile ? await readFile(source) : source);
}
