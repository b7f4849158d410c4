// SPDX-License-Identifier: MIT
// node show_gltf_three.mjs FILE.glb: what three.js makes of an exported clip against frame_%04d.ply
// and frame_object_%04d.ply beside it (meters, z up). Fails beyond 0.1 mm in any frame.
import { readFileSync, readdirSync } from 'node:fs';
import { AnimationMixer, LoopOnce, Vector3 } from 'three';
import { GLTFLoader } from 'three/addons/loaders/GLTFLoader.js';

const LIMIT_MM = 0.1;
globalThis.self ??= globalThis;  // a worker's, which the loader takes for granted

function plyVertices(path) {
  const bytes = readFileSync(path);
  const mark = 'end_header\n';
  const begin = bytes.indexOf(mark) + mark.length;
  const header = bytes.toString('latin1', 0, begin);
  if (!header.includes('format binary_little_endian 1.0')) throw new Error(`${path}: not binary`);
  const count = Number(header.match(/element vertex (\d+)/)[1]);
  return Array.from({ length: count }, (_, v) => {
    const at = (c) => bytes.readFloatLE(begin + 12 * v + 4 * c);
    return new Vector3(at(0), at(2), -at(1));  // y up
  });
}

const bytes = readFileSync(process.argv[2]);
const gltf = await new GLTFLoader().parseAsync(
  bytes.buffer.slice(bytes.byteOffset, bytes.byteOffset + bytes.length), '');
const mixer = new AnimationMixer(gltf.scene);
const action = mixer.clipAction(gltf.animations[0]).setLoop(LoopOnce);
action.clampWhenFinished = true;  // at the last frame, not back at the first
action.play();
const times = gltf.animations[0].tracks[0].times;

function shown(name) {
  const mesh = gltf.scene.getObjectByName(name);
  const count = mesh.geometry.attributes.position.count;
  return Array.from({ length: count }, (_, v) =>
    mesh.localToWorld(mesh.getVertexPosition(v, new Vector3())));
}

function nearest(point, among) {
  let best = 0;
  among.forEach((other, k) => {
    if (point.distanceToSquared(other) < point.distanceToSquared(among[best])) best = k;
  });
  return best;
}

const worst = (a, b) => 1e3 * Math.max(0, ...a.map((p, k) => p.distanceTo(b[k])));
const frames = readdirSync('.').filter((name) => /^frame_\d+\.ply$/.test(name)).sort();
let corners;  // which of the object's vertices each of those split at creases is
let [skin, mug] = [0, 0];
frames.forEach((name, frame) => {
  mixer.setTime(times[frame]);
  gltf.scene.updateMatrixWorld(true);
  skin = Math.max(skin, worst(shown('body'), plyVertices(name)));
  const object = plyVertices(name.replace('frame_', 'frame_object_'));
  corners ??= shown('mug').map((point) => nearest(point, object));
  mug = Math.max(mug, worst(shown('mug'), corners.map((k) => object[k])));
});
console.log(`${frames.length} frames, largest distance: skin ${skin.toFixed(4)} mm, ` +
  `mug ${mug.toFixed(4)} mm`);
process.exit(frames.length === times.length && skin < LIMIT_MM && mug < LIMIT_MM ? 0 : 1);
