// In Node.js, where the module is a file.

import { readFile } from "node:fs/promises";
import { load as loadAnywhere } from "./index.js";

export { Clip, Tumble, TumbleError, sample } from "./core.js";

/** The engine. `source`: the module's bytes, its address or the answer to a request for it. */
export async function load(source = new URL("./tumble.wasm", import.meta.url)) {
  const isFile = source instanceof URL && source.protocol === "file:";
  return loadAnywhere(isFile ? await readFile(source) : source);
}
