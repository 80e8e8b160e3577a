// Usage: node validator.mjs NODE_MODULES
// Reads lines, each a JSON array of files. Prints a line for each, an object by the Khronos
// glTF-Validator: file -> {errors: [message], warnings: [message]}. External resources are read from
// the file's own folder.

import { readFile } from 'node:fs/promises';
import { createRequire } from 'node:module';
import { basename, dirname, join, resolve } from 'node:path';
import { createInterface } from 'node:readline';

const validator = createRequire(join(resolve(process.argv[2]), 'index.js'))('gltf-validator');
const SEVERITIES = ['errors', 'warnings'];

async function validate(file) {
  const { issues } = await validator.validateBytes(new Uint8Array(await readFile(file)), {
    uri: basename(file),
    maxIssues: 100,
    externalResourceFunction: async (uri) =>
      new Uint8Array(await readFile(join(dirname(file), decodeURIComponent(uri)))),
  });
  const texts = (severity) =>
    issues.messages
      .filter((m) => m.severity === severity)
      .map((m) => `${m.code} ${m.pointer ?? ''} ${m.message}`);
  return Object.fromEntries(SEVERITIES.map((name, severity) => [name, texts(severity)]));
}

for await (const line of createInterface({ input: process.stdin })) {
  const report = {};
  for (const file of JSON.parse(line)) {
    report[file] = await validate(file).catch((error) => ({
      errors: [`UNREADABLE ${error}`],
      warnings: [],
    }));
  }
  console.log(JSON.stringify(report));
}
