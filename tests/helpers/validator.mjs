// Usage: node validator.mjs NODE_MODULES FILE...
// Prints one JSON object: file -> {errors: [message], warnings: [message]} by the Khronos glTF-Validator.
// External resources are read from the file's own folder.
import { createRequire } from "node:module";
import { readFile } from "node:fs/promises";
import { basename, dirname, join, resolve } from "node:path";

const [modules, ...files] = process.argv.slice(2);
const validator = createRequire(join(resolve(modules), "index.js"))("gltf-validator");
const SEVERITIES = ["errors", "warnings"];

async function validate(file) {
  const { issues } = await validator.validateBytes(new Uint8Array(await readFile(file)), {
    uri: basename(file),
    maxIssues: 100,
    externalResourceFunction: async (uri) => new Uint8Array(await readFile(join(dirname(file), decodeURIComponent(uri)))),
  });
  return Object.fromEntries(SEVERITIES.map((name, severity) =>
    [name, issues.messages.filter((m) => m.severity === severity).map((m) => `${m.code} ${m.pointer ?? ""} ${m.message}`)]));
}

const report = {};
for (const file of files) {
  report[file] = await validate(file).catch((error) => ({ errors: [`UNREADABLE ${error}`], warnings: [] }));
}
console.log(JSON.stringify(report));
