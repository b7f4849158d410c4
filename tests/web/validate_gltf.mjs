// SPDX-License-Identifier: MIT
// node validate_gltf.mjs FILE...: the Khronos validator's verdict; fails on any error or warning.
import { readFileSync } from 'node:fs';
import validator from 'gltf-validator';

let sound = process.argv.length > 2;
for (const file of process.argv.slice(2)) {
  const report = await validator.validateBytes(new Uint8Array(readFileSync(file)));
  const { numErrors, numWarnings, numInfos, numHints, messages } = report.issues;
  console.log(`${file}: ${numErrors} errors, ${numWarnings} warnings, ${numInfos} infos, ` +
    `${numHints} hints; ${report.info.totalTriangleCount} triangles, ` +
    `${report.info.animationCount} animation`);
  for (const m of messages) console.log(`  ${m.code} ${m.pointer ?? ''}: ${m.message}`);
  sound = sound && numErrors === 0 && numWarnings === 0 && report.info.animationCount === 1;
}
process.exit(sound ? 0 : 1);
