// SPDX-License-Identifier: MIT
// Skin colors by distance to the object, and the legend that explains them.
import { Color } from "three";

export const kPalette = {
  body: "#b3bdcc",
  object: "#5c85ad",
  table: "#a58b6f",
  marker: "#d1495b",
  ghostBody: "#8c7fe0",
  ghostObject: "#5aa6a0",
  touching: "#ff8a00",
  shallow: "#f6c0a8",
  inside: "#e5484d",
  deep: "#7d0c1c",
};

const kStep = 0.1; // mm per unit of `distance`
const kLimit = 127;
const kEdgeShare = 0.25; // of the contact color, at the threshold

const linear = (style) => new Color(style).toArray();
const mix = (a, b, share) => a.map((value, i) => value + share * (b[i] - value));

// Depth that the penetration colors reach their end at: the first of these that holds all.
const kDepthScales = [0.5, 1, 2, 5, 10];

export function depthScale(clips) {
  let deepest = 0;
  for (const { arrays } of clips) {
    if (!arrays.distance) continue;
    for (const d of arrays.distance) deepest = Math.max(deepest, -d);
  }
  return kDepthScales.find((scale) => scale >= deepest * kStep) ?? kDepthScales.at(-1);
}

// Color of each of the 255 distances, as a table of linear RGB.
export function ramp(mode, { threshold, depth }) {
  const table = new Float32Array(3 * 256);
  const base = linear(kPalette.body);
  const touching = linear(kPalette.touching);
  const stops = [kPalette.shallow, kPalette.inside, kPalette.deep].map(linear);
  for (let d = -kLimit; d <= kLimit; ++d) {
    const mm = d * kStep;
    let color = base;
    if (mode === "contact" && Math.abs(mm) < threshold) {
      color = mix(base, touching, 1 - (1 - kEdgeShare) * (Math.abs(mm) / threshold));
    } else if (mode === "penetration" && d < 0) {
      const share = 2 * Math.min(1, -mm / depth);
      color = share < 1 ? mix(stops[0], stops[1], share) : mix(stops[1], stops[2], share - 1);
    }
    table.set(color, 3 * (d + kLimit));
  }
  return table;
}

// Writes the colors of the hands' vertices of one frame; all others keep the body's.
export function paintHands(colors, arrays, frame, table) {
  const hands = arrays.hand_vertices;
  const begin = frame * hands.length;
  for (let i = 0; i < hands.length; ++i) {
    const from = 3 * (arrays.distance[begin + i] + kLimit);
    const to = 3 * hands[i];
    colors[to] = table[from];
    colors[to + 1] = table[from + 1];
    colors[to + 2] = table[from + 2];
  }
}

export function paintAll(colors, style) {
  const [r, g, b] = linear(style);
  for (let i = 0; i < colors.length; i += 3) {
    colors[i] = r;
    colors[i + 1] = g;
    colors[i + 2] = b;
  }
}

// What the colors mean: title, CSS gradient, and the labels of its two ends.
export function legend(mode, { threshold, depth }) {
  if (mode === "contact") {
    const edge = new Color(kPalette.body).lerp(new Color(kPalette.touching), kEdgeShare);
    return {
      title: "Skin to object",
      gradient: `linear-gradient(90deg, ${kPalette.touching}, ${edge.getStyle()})`,
      low: "touching",
      high: `${threshold} mm`,
    };
  }
  return {
    title: "Skin inside object",
    gradient: `linear-gradient(90deg, ${kPalette.shallow}, ${kPalette.inside}, ${kPalette.deep})`,
    low: "surface",
    high: `${depth} mm`,
  };
}
