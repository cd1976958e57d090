// Validates glTF files: `node validate.mjs FOLDER FILE…`, where FOLDER has gltf-validator in its
// node_modules. Prints a line of JSON for each file: the texts of its errors and of its warnings.
import { readFileSync } from "node:fs";
import { createRequire } from "node:module";
import { basename, dirname, resolve } from "node:path";

const [folder, ...files] = process.argv.slice(2);
const require = createRequire(resolve(folder, "package.json"));
const validator = require("gltf-validator");

for (const file of files) {
  let messages;
  try {
    const report = await validator.validateBytes(new Uint8Array(readFileSync(file)), {
      uri: basename(file),
      maxIssues: 0,
      externalResourceFunction: async (uri) =>
        new Uint8Array(readFileSync(resolve(dirname(file), decodeURIComponent(uri)))),
    });
    messages = report.issues.messages;
  } catch (reason) {
    // A file that is neither GLB nor JSON has no report.
    messages = [{ severity: 0, code: "UNREADABLE", message: String(reason) }];
  }
  const texts = (severity) =>
    messages
      .filter((issue) => issue.severity === severity)
      .map(({ code, pointer = "", message }) => `${code} ${pointer}: ${message}`);
  console.log(JSON.stringify({ errors: texts(0), warnings: texts(1) }));
}
