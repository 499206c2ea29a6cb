// Khronos' own validator on binary glTF files: node validate.mjs FILE...
// Needs the npm package gltf-validator. Errors and warnings fail. Notes do not: it does not know
// EXT_mesh_gpu_instancing, and takes its accessors for unused. It must not stop at many notes.
import { readFileSync } from "node:fs";
import { createRequire } from "node:module";

const validator = createRequire(process.cwd() + "/")("gltf-validator");
const codes = new Set();
let triangles = 0;
for (const path of process.argv.slice(2)) {
  const bytes = new Uint8Array(readFileSync(path));
  const { issues, info } = await validator.validateBytes(bytes, { maxIssues: 0 });
  const wrong = issues.messages.filter((m) => m.severity <= 1);
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
