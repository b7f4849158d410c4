// SPDX-License-Identifier: MIT
// What the curves are called and how they are drawn, by the names that metrics files use.

const kRight = "right";
const kLeft = "left";

// One chart each, in this order; a chart without data is left out. `series`: [name, label, hue].
const kCharts = [
  {
    title: "Skin in contact",
    about: "Share of the hand's skin that touches the object",
    unit: "%",
    factor: 100,
    series: [
      ["contact_ratio", "", "a"],
      ["right_hand_contact_ratio", kRight, "a"],
      ["left_hand_contact_ratio", kLeft, "b"],
    ],
  },
  {
    title: "Penetration depth",
    about: "How deep skin lies inside the object: the deepest vertex, and the mean of those inside",
    unit: "mm",
    series: [
      ["penetration_depth_mm", "deepest", "c"],
      ["mean_penetration_depth_mm", "mean", "d"],
      ["right_hand_penetration_depth_mm", kRight, "c"],
      ["left_hand_penetration_depth_mm", kLeft, "d"],
    ],
  },
  {
    title: "Intersection volume",
    about: "Volume that hand and object share",
    unit: "cm\u00b3",
    series: [["intersection_volume_cm3", "", "c"]],
  },
  {
    title: "Distance to the goal",
    about: "From the wrist that reaches to the goal in mind",
    unit: "cm",
    factor: 100,
    series: [["goal_distance_m", "", "a"]],
  },
  {
    title: "Solve time",
    about: "Time to solve the frame",
    unit: "ms",
    series: [["solve_ms", "", "b"]],
  },
  {
    title: "Total energy",
    about: "Weighted sum of the terms that the fit minimises",
    unit: "",
    energy: true,
    series: [["energy_total", "", "a"]],
  },
  {
    title: "Distance term E_d",
    about: "Hand and object keep the distances of the first frame",
    unit: "m\u00b2",
    energy: true,
    series: [["energy_distance_m2", "", "a"]],
  },
  {
    title: "Contact term E_c",
    about: "What touched in the first frame stays together",
    unit: "m\u00b2",
    energy: true,
    series: [["energy_contact_m2", "", "a"]],
  },
  {
    title: "Temporal term E_t",
    about: "Little change from frame to frame",
    unit: "",
    energy: true,
    series: [["energy_temporal", "", "a"]],
  },
  {
    title: "Iterations",
    about: "Steps of the solver",
    unit: "",
    series: [["iterations", "", "b"]],
  },
  {
    title: "Speed",
    about: "How fast wrists, hips and object move",
    unit: "m/s",
    series: [
      ["right_wrist_speed_m_s", kRight, "a"],
      ["left_wrist_speed_m_s", kLeft, "b"],
      ["hips_speed_m_s", "hips", "c"],
      ["object_speed_m_s", "object", "d"],
    ],
  },
  {
    title: "Height",
    about: "Wrists, hips and object above the ground",
    unit: "m",
    series: [
      ["right_wrist_height_m", kRight, "a"],
      ["left_wrist_height_m", kLeft, "b"],
      ["hips_height_m", "hips", "c"],
      ["object_height_m", "object", "d"],
    ],
  },
];

const kLeftOut = new Set(["in_contact", "holding_hand"]); // contact_ratio says more

const kUnits = [
  ["_m_s2", "m/s\u00b2"],
  ["_m_s", "m/s"],
  ["_cm3", "cm\u00b3"],
  ["_m2", "m\u00b2"],
  ["_mm", "mm"],
  ["_cm", "cm"],
  ["_ms", "ms"],
  ["_deg", "\u00b0"],
  ["_rad", "rad"],
  ["_m", "m"],
  ["_s", "s"],
];

// A chart for a name that nobody listed: its words, and the unit at its end.
function chartOf(name) {
  const found = kUnits.find(([ending]) => name.endsWith(ending));
  const ratio = !found && name.endsWith("_ratio");
  const words = (found ? name.slice(0, -found[0].length) : name).replaceAll("_", " ");
  return {
    title: words.charAt(0).toUpperCase() + words.slice(1),
    about: name,
    unit: ratio ? "%" : (found?.[1] ?? ""),
    factor: ratio ? 100 : 1,
    energy: name.startsWith("energy"),
    series: [[name, "", "a"]],
  };
}

// Charts that any of the clips has data for.
export function chartsFor(clips) {
  const names = new Set(clips.flatMap((clip) => Object.keys(clip.series)));
  const charts = kCharts
    .map((chart) => ({ ...chart, series: chart.series.filter(([name]) => names.has(name)) }))
    .filter((chart) => chart.series.length > 0);
  const listed = new Set(kCharts.flatMap((chart) => chart.series.map(([name]) => name)));
  for (const name of [...names].sort()) {
    if (!listed.has(name) && !kLeftOut.has(name)) charts.push(chartOf(name));
  }
  return charts;
}

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
