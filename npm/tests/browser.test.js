// In Chromium the package gives the bits that it gives here.

import assert from "node:assert/strict";
import { spawn } from "node:child_process";
import { mkdtempSync, readFileSync, rmSync } from "node:fs";
import { createServer } from "node:http";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { test } from "node:test";
import { load } from "../package/node.js";
import { FILES, root, sha256 } from "./support.js";

const PAGE = `<!doctype html><script type="module">
const answer = (result) => fetch("/result", { method: "POST", body: JSON.stringify(result) });
try {
  const { load } = await import("/npm/package/index.js");
  const engine = await load();
  const hex = (bytes) => [...new Uint8Array(bytes)].map((byte) => byte.toString(16).padStart(2, "0")).join("");
  const hashes = {};
  for (const file of ${JSON.stringify(FILES)}) {
    const bytes = await (await fetch("/" + file)).arrayBuffer();
    const [clip] = engine.read(bytes, { name: file }).clips;
    for (const { name: method } of engine.methods) {
      const { rotations } = clip.sample({ fps: 50 }, { method });
      hashes[file + " " + method] = hex(await crypto.subtle.digest("SHA-256", rotations));
    }
  }
  await answer({ version: engine.version, hashes });
} catch (error) {
  await answer({ error: String(error.stack ?? error) });
}
</script>`;

const TYPES = { js: "text/javascript", wasm: "application/wasm" };

/** Starts a browser with a new profile, and returns the JSON that the page posts to `/result`. */
async function shown(browser) {
  let finish;
  const result = new Promise((resolve) => (finish = resolve));
  const server = createServer((request, response) => {
    if (request.method === "POST") {
      let body = "";
      request.on("data", (part) => (body += part));
      request.on("end", () => (response.end(), finish(JSON.parse(body))));
      return;
    }
    const path = new URL(request.url, "http://x").pathname;
    if (path === "/") return response.setHeader("content-type", "text/html").end(PAGE);
    if (path === "/favicon.ico") return response.writeHead(204).end();
    try {
      const bytes = readFileSync(join(root, path));
      response.setHeader("content-type", TYPES[path.split(".").pop()] ?? "application/octet-stream").end(bytes);
    } catch {
      response.writeHead(404).end();
    }
  });
  await new Promise((done) => server.listen(0, "127.0.0.1", done));
  const profile = mkdtempSync(join(tmpdir(), "tumble-chromium-"));
  const flags = [
    "--headless", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run",
    "--disable-background-networking", "--disable-component-update", "--disable-sync", `--user-data-dir=${profile}`,
  ];
  const child = spawn(browser, [...flags, "--remote-debugging-port=0", `http://127.0.0.1:${server.address().port}/`], { stdio: "ignore" });
  const late = setTimeout(() => finish({ error: "the browser says nothing for 60 s" }), 60_000);
  child.on("error", (error) => finish({ error: String(error) }));
  try {
    return await result;
  } finally {
    clearTimeout(late);
    const isOver = new Promise((done) => child.once("exit", done));
    if (child.kill()) await isOver;
    server.closeAllConnections();
    server.close();
    rmSync(profile, { recursive: true, force: true, maxRetries: 5 });
  }
}

test("Chromium gives the same bits", async () => {
  const found = await shown(process.env.CHROMIUM ?? "chromium");
  assert.equal(found.error, undefined);
  const engine = await load();
  assert.equal(found.version, engine.version);
  let compared = 0;
  for (const file of FILES) {
    const [clip] = engine.read(readFileSync(join(root, file)), { name: file }).clips;
    for (const { name: method } of engine.methods) {
      const { rotations } = clip.sample({ fps: 50 }, { method });
      assert.equal(found.hashes[`${file} ${method}`], sha256(rotations), `${file} ${method}`);
      compared += 1;
    }
  }
  assert.ok(compared >= 75);
  console.log(`${compared} results of Chromium compared with Node's`);
});
