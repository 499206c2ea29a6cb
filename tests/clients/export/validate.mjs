// Khronos' own validator on binary glTF files: node validate.mjs FILE...
// Needs the npm package gltf-validator. Errors and warnings fail, but one: it does not know
// EXT_mesh_gpu_instancing.
import { readFileSync } from "node:fs";
import { createRequire } from "node:module";

const validator = createRequire(process.cwd() + "/")("gltf-validator");
const KNOWN = new Set(["UNSUPPORTED_EXTENSION"]);
const codes = new Set();
let triangles = 0;
for (const path of process.argv.slice(2)) {
  const bytes = new Uint8Array(readFileSync(path));
  const { issues, info } = await validator.validateBytes(bytes, { maxIssues: 1000 });
  const wrong = issues.messages.filter((m) => m.severity <= 1 && !KNOWN.has(m.code));
  if (wrong.length > 0) {
    console.error(path, wrong.slice(0, 5));
    process.exit(1);
  }
  issues.messages.forEach((m) => codes.add(m.code));
  triangles += info.totalTriangleCount;
}
console.log(
  `gltf-validator ${validator.version()}: ${process.argv.length - 2} files, ${triangles} triangles, ` +
    `0 errors, 0 warnings; notes: ${[...codes].join(", ") || "none"}`,
);
