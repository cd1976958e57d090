// Entry point for browsers, and for other environments in which `fetch` can load a file next to the script.

import { TumbleError, loadFrom } from "./core.js";

export { Clip, Tumble, TumbleError, sample } from "./core.js";

/** Loads the engine. `source`: the module's bytes, its URL, or a response with it. */
export async function load(source = new URL("./tumble.wasm", import.meta.url)) {
  if (source instanceof WebAssembly.Module || source instanceof ArrayBuffer || ArrayBuffer.isView(source)) {
    return loadFrom(source);
  }
  const response = await (source instanceof Response ? source : fetch(source));
  if (!response.ok) throw new TumbleError(`${response.url}: ${response.status} ${response.statusText}`);
  return loadFrom(await response.arrayBuffer());
}
