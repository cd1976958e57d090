// Bundles page, style, scripts and libraries into the one HTML file that is compiled into the program.
// Run `npm ci && npm run build` after any change in src/.

import { createHash } from "node:crypto";
import { readFileSync, readdirSync, writeFileSync } from "node:fs";
import { build } from "esbuild";

const read = (path) => readFileSync(path, "utf8");

// The page contains the hash of its sources. A test compares it, so that a page older than its sources is noticed.
const sources = [...readdirSync("src").sort().map((name) => `src/${name}`), "build.mjs", "package-lock.json", "../npm/package/core.js"];
const hash = createHash("sha1");
for (const path of sources) hash.update(read(path));

const bundled = await build({
  entryPoints: ["src/main.js"],
  bundle: true,
  minify: true,
  write: false,
  format: "iife",
  target: "es2022",
  legalComments: "none",
});
const script = bundled.outputFiles[0].text.replaceAll("</script", "<\\/script");
const styled = await build({
  entryPoints: ["src/style.css"],
  bundle: true,
  minify: true,
  write: false,
});
const style = styled.outputFiles[0].text;

const licences = ["three", "uplot"]
  .map((name) => {
    const { version } = JSON.parse(read(`node_modules/${name}/package.json`));
    return `${name} ${version}\n\n${read(`node_modules/${name}/LICENSE`).trim()}`;
  })
  .join("\n\n");

const page = read("src/page.html")
  .replace("/* STYLE */", () => style)
  .replace("/* SCRIPT */", () => script)
  .replace("LICENCES", () => licences)
  .replace("SOURCES", () => hash.digest("hex"));
const built = "../cli/src/commands/view/page.html";
writeFileSync(built, page);
console.log(`${built}: ${(page.length / 1e3).toFixed(0)} kB`);
