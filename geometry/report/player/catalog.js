// SPDX-License-Identifier: MIT
// What the curves are called and how they are drawn, by the names that metrics files use.
import { sentence, wordsOf } from "./words.js";

const kRight = "right";
const kLeft = "left";

function energy(title, about, name) {
  return { title, about, unit: name.endsWith("_m2") ? "m\u00b2" : "", energy: true, series: [[name, "", "a"]] };
}

// One chart each, in this order; a chart without data is left out. `series`: [name, label, hue].
const kCharts = [
  {
    title: "Skin in contact",
    about: "Fraction of the hand's skin that touches the object",
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
    about: "Penetration of hand and object: deepest vertex of both, and mean of the hand vertices inside",
    unit: "mm",
    series: [
      ["penetration_depth_mm", "deepest", "c"],
      ["penetration_depth_before_mm", "before", "b"],
      ["mean_penetration_depth_mm", "mean", "d"],
      ["hand_in_object_mm", "hand in object", "c"],
      ["right_hand_in_object_mm", kRight, "c"],
      ["left_hand_in_object_mm", kLeft, "d"],
    ],
  },
  {
    title: "Intersection volume",
    about: "Volume of the intersection of hand and object",
    unit: "cm\u00b3",
    series: [["intersection_volume_cm3", "", "c"]],
  },
  {
    title: "Distance to the goal",
    about: "From the reaching wrist to the current goal",
    unit: "cm",
    factor: 100,
    series: [["goal_distance_m", "", "a"]],
  },
  energy("Total energy", "Weighted sum of the terms that the fit minimizes", "energy_total"),
  energy("Distance term E_d", "Keeps the distances between hand and object of the first frame", "energy_distance_m2"),
  energy("Contact term E_c", "Keeps the contacts of the first frame", "energy_contact_m2"),
  energy("Temporal term E_t", "Penalizes changes from frame to frame", "energy_temporal"),
  energy("Slip term", "Contacts may slide along the surface, but not leave it", "energy_slip_m2"),
  energy("Penetration term", "Squared depth of skin inside the object, beyond the allowance for soft tissue", "energy_penetration_m2"),
  energy("Object-in-hand term", "Squared depth of the object inside the hand, beyond the allowance for soft tissue", "energy_object_in_hand_m2"),
  {
    title: "Wrist offset",
    about: "Displacement of the wrist from its position in the input clip",
    unit: "mm",
    series: [["wrist_offset_mm", "", "a"]],
  },
  {
    title: "Distance to the data",
    about: "Displacement of the object from its position in the input clip",
    unit: "mm",
    series: [["distance_to_data_mm", "", "a"]],
  },
  {
    title: "Rotation from the data",
    about: "Rotation of the object from its orientation in the input clip",
    unit: "\u00b0",
    series: [["distance_to_data_deg", "", "a"]],
  },
  {
    title: "Distance to the object",
    about: "From the hand's nearest vertex; negative inside",
    unit: "mm",
    series: [["min_distance_mm", "", "a"]],
  },
  {
    title: "Iterations",
    about: "Number of solver iterations",
    unit: "",
    series: [["iterations", "", "b"]],
  },
  {
    title: "Speed",
    about: "Speed of wrists, hips and object",
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
    about: "Height of wrists, hips and object above the ground",
    unit: "m",
    series: [
      ["right_wrist_height_m", kRight, "a"],
      ["left_wrist_height_m", kLeft, "b"],
      ["hips_height_m", "hips", "c"],
      ["object_height_m", "object", "d"],
    ],
  },
];

// contact_ratio and penetration_depth_mm say more.
const kLeftOut = new Set(["in_contact", "holding_hand", "max_penetration_mm"]);

// A chart for a name that nobody listed: its words, and the unit at its end.
function chartOf(name) {
  const { words, unit, factor } = wordsOf(name);
  const title = sentence(words);
  const energy = name.startsWith("energy");
  return { title, about: title, unit, factor, energy, series: [[name, "", "a"]] };
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
