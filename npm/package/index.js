// For browsers, and for every environment in which `fetch` can load a file next to a script.

import { TumbleError, loadFrom } from "./core.js";

export { Clip, Tumble, TumbleError, sample } from "./core.js";

/** The engine. `source`: the module's bytes, its address or the answer to a request for it. */
export async function load(source = new URL("./tumble.wasm", import.meta.url)) {
  if (source instanceof WebAssembly.Module || source instanceof ArrayBuffer || ArrayBuffer.isView(source)) {
    return loadFrom(source);
  }
  const response = await (source instanceof Response ? source : fetch(source));
  if (!response.ok) throw new TumbleError(`${response.url}: ${response.status} ${response.statusText}`);
  return loadFrom(await response.arrayBuffer());
}
