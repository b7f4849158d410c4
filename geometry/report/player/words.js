// SPDX-License-Identifier: MIT
// From the keys of metrics files to words, and numbers as text.

// Endings of keys: [ending, unit, factor]; the longer ones first.
const kUnits = [
  ["_rad_s2", "rad/s\u00b2"],
  ["_m_s3", "m/s\u00b3"],
  ["_m_s2", "m/s\u00b2"],
  ["_m_s", "m/s"],
  ["_cm3", "cm\u00b3"],
  ["_m2", "m\u00b2"],
  ["_mm", "mm"],
  ["_cm", "cm"],
  ["_ms", "ms"],
  ["_deg", "\u00b0"],
  ["_rad", "rad"],
  ["_hz", "Hz"],
  ["_m", "m"],
  ["_s", "s"],
  ["_ratio", "%", 100],
];

// Keys, with their unit or without, whose own words are not enough.
const kWords = {
  arm_lacked_before_leaning: "arm shortfall before leaning",
  arm_lacks: "arm shortfall",
  carry_arm_lacked: "arm shortfall while carrying",
  carry_hand_error: "hand orientation error while carrying",
  closest_sum: "sum of the least distances",
  closing_penetration: "penetration while the hand closes",
  coming_penetration: "penetration while the hand approaches",
  contact_ratio: "skin in contact",
  from_frame_30fps: "from frame (30 Hz)",
  hand_error: "hand orientation error",
  goal_index: "number of the goal",
  holding_penetration: "penetration while holding",
  inside_by: "inside decided by",
  made: "found by search",
  moved_before_take: "object moved before it is taken",
  object_wanders_in_hand: "object drift in the hand",
  take_hand_error: "hand orientation error when taking",
  take_jump: "object's jump when taken",
  take_wrist_error: "wrist error when taking",
};

// {words, unit, factor} of a key: "lambda_slip", "iterations_median", "take_wrist_error_mm".
export function wordsOf(key) {
  const base = key.replace(/_median$/, "");
  const [ending, unit, factor = 1] = kUnits.find(([end]) => base.endsWith(end)) ?? ["", ""];
  const stem = base.slice(0, base.length - ending.length);
  const plain = stem.replace(/^lambda_/, "weight:_").replaceAll("_", " ");
  const words = kWords[base] ?? kWords[stem] ?? plain;
  return { words: base === key ? words : `${words}, median`, unit, factor };
}

export const sentence = (words) => words.charAt(0).toUpperCase() + words.slice(1);

// A number in few characters: "0.63", "12.4", "1.2e-6".
export function short(value) {
  if (value === null || value === undefined || !Number.isFinite(value)) return "\u2013";
  const size = Math.abs(value);
  if (size === 0) return "0";
  if (size >= 1e5 || size < 1e-3) return value.toExponential(1).replace("e+", "e");
  if (size >= 100) return value.toFixed(0);
  if (size >= 10) return value.toFixed(1);
  return String(Number(value.toPrecision(2)));
}

// "5 mm", "40 %", "12°".
export const withUnit = (text, unit) => (unit === "\u00b0" ? `${text}\u00b0` : `${text} ${unit}`.trim());
