// SPDX-License-Identifier: MIT
// The numbers beside the player, and the tables of what made the clips.
import { element, find } from "./dom.js";
import { sentence, short, withUnit, wordsOf } from "./words.js";

const kShortNote = 90; // characters
const kRounding = 1e-12; // of what has a unit: less is zero

const mean = (values) => values.reduce((sum, v) => sum + v, 0) / values.length;
const max = (values) => values.reduce((a, b) => Math.max(a, b), -Infinity);

// The value of a clip's metrics, else of its curves.
const kCards = [
  {
    title: "In contact",
    about: (clip) =>
      Number.isFinite(clip.metrics?.summary?.frames_in_contact_ratio)
        ? "of the frames held"
        : "of all frames",
    unit: "%",
    value: (clip) => {
      const told = clip.metrics?.summary?.frames_in_contact_ratio;
      if (Number.isFinite(told)) return 100 * told;
      const hands = series(clip, /contact_ratio$/);
      if (hands.length === 0) return undefined;
      return 100 * mean(hands[0].map((_, t) => (hands.some((hand) => hand[t] > 0) ? 1 : 0)));
    },
  },
  {
    title: "Skin touching",
    about: (clip) => `of the hand within ${short(threshold(clip))} mm, mean`,
    unit: "%",
    value: (clip) => {
      const told = clip.metrics?.summary?.contact_ratio;
      if (Number.isFinite(told)) return 100 * told;
      const hands = series(clip, /contact_ratio$/);
      return hands.length > 0 ? 100 * max(hands.map(mean)) : undefined;
    },
  },
  {
    title: "Deepest penetration",
    about: (clip) =>
      clip.series.penetration_depth_mm
        ? "hand and object, both ways"
        : "of the hand's skin into the object",
    unit: "mm",
    lower: true,
    value: (clip) => {
      const told = clip.metrics?.summary?.max_penetration_depth_mm;
      if (Number.isFinite(told)) return told;
      const both = series(clip, /^penetration_depth_mm$/);
      const hands = both.length > 0 ? both : series(clip, /hand_in_object_mm$/);
      return hands.length > 0 ? max(hands.map(max)) : undefined;
    },
  },
  {
    title: "Shared volume",
    about: "hand and object, mean",
    unit: "cm\u00b3",
    lower: true,
    value: (clip) => clip.metrics?.summary?.mean_intersection_volume_cm3,
  },
  {
    title: "Fastest wrist",
    about: "of both hands",
    unit: "m/s",
    motionOnly: true,
    value: (clip) => {
      const wrists = series(clip, /wrist_speed_m_s$/);
      return wrists.length > 0 ? max(wrists.map(max)) : undefined;
    },
  },
  {
    title: "Path length",
    about: "of the hips",
    unit: "m",
    motionOnly: true,
    value: (clip) => {
      const hips = clip.series.hips_speed_m_s;
      return hips ? mean(hips) * (clip.frames / clip.frame_rate) : undefined;
    },
  },
  {
    title: "Length",
    about: (clip) => `${clip.frames} frames at ${short(clip.frame_rate)} Hz`,
    unit: "s",
    value: (clip) => clip.frames / clip.frame_rate,
  },
];

function series(clip, pattern) {
  return Object.entries(clip.series)
    .filter(([name]) => pattern.test(name))
    .map(([, values]) => values.map((v) => v ?? 0));
}

export function threshold(clip) {
  const told = clip.metrics?.protocol?.contact_threshold_mm;
  return Number.isFinite(told) ? told : clip.contact_threshold_mm;
}

export function showCards(clip, ghost) {
  const cards = kCards
    .filter((card) => !(card.motionOnly && clip.has_object))
    .map((card) => [card, card.value(clip), ghost ? card.value(ghost) : undefined])
    .filter(([, value]) => Number.isFinite(value))
    .map(([card, value, other]) =>
      element(
        "div",
        { class: "card" },
        element("dt", {}, card.title),
        element(
          "dd",
          {},
          element("span", { class: "number" }, short(value)),
          element("span", { class: "unit" }, card.unit),
          Number.isFinite(other)
            ? element("span", { class: "versus" }, `ghost ${short(other)} ${card.unit}`)
            : "",
          element(
            "span",
            { class: "about" },
            typeof card.about === "function" ? card.about(clip) : card.about,
          ),
        ),
      ),
    );
  find("cards").replaceChildren(...cards);
}

// {"a": {"b_mm": 1}} to [["A: b", "1 mm"]].
function rows(value, path = []) {
  if (value === null || value === undefined || value === "") return [];
  const list = Array.isArray(value);
  if (typeof value === "object" && !(list && value.every((v) => typeof v !== "object"))) {
    return Object.entries(value).flatMap(([key, inner]) =>
      rows(inner, [...path, list ? String(Number(key) + 1) : key]),
    );
  }
  if (list && value.length === 0) return [];
  const { unit, factor } = wordsOf(path.findLast((key) => Number.isNaN(Number(key))));
  const exact = (v) => (unit && Math.abs(v) < kRounding ? 0 : v * factor);
  const one = (v) => (typeof v === "number" ? show(exact(v)) : String(v));
  const text = [value].flat().map(one).join(", ");
  const words = path.map((key) => wordsOf(key).words);
  return [[sentence(words.join(": ")), withUnit(text, unit)]];
}

// Measured numbers to five digits; whole ones and what was typed in are shorter anyway.
const show = (value) => String(Number(value.toPrecision(Number.isInteger(value) ? 15 : 5)));

// Rows of several clips side by side; where they differ is marked.
function table(title, clips, rowsOf) {
  const columns = clips.map((clip) => new Map(rowsOf(clip)));
  const names = [...new Set(columns.flatMap((column) => [...column.keys()]))];
  if (names.length === 0) return "";
  const body = element("tbody");
  for (const name of names) {
    const cells = columns.map((column) => column.get(name) ?? "\u2013");
    const differs = cells.some((cell) => cell !== cells[0]);
    body.append(
      element(
        "tr",
        differs ? { class: "differs" } : {},
        element("th", { scope: "row" }, name),
        ...cells.map((cell) => element("td", {}, cell)),
      ),
    );
  }
  const head =
    clips.length > 1
      ? element(
          "thead",
          {},
          element(
            "tr",
            {},
            element("td"),
            ...clips.map((clip) => element("th", { scope: "col" }, clip.name)),
          ),
        )
      : "";
  return element(
    "section",
    { class: "table" },
    element("h2", {}, title),
    element("div", { class: "scroll", tabindex: "0" }, element("table", {}, head, body)),
  );
}

export function showTables(header) {
  const { clips } = header;
  const made = (clip) => {
    const m = clip.metrics;
    if (!m) return [];
    return [
      ...rows({ holdfast_version: m.holdfast_version, seed: m.seed, format: m.schema }),
      ...rows(m.options),
      ...rows({ grasp: m.grasp }),
    ];
  };
  find("tables").classList.toggle("several", clips.length > 1);
  find("tables").replaceChildren(
    ...[
      table("Clip", clips, (clip) => clip.facts),
      table("Provenance", clips, made),
      table("How it was measured", clips, (clip) =>
        clip.metrics?.protocol
          ? rows(clip.metrics.protocol)
          : clip.has_object
            ? [
                ["Contact", `a hand vertex closer than ${clip.contact_threshold_mm} mm to the object`],
                ["Penetration", "depth of hand vertices inside the object, exact signed distance"],
              ]
            : [],
      ),
      table("Summary", clips, (clip) => rows(clip.metrics?.summary)),
    ].filter((section) => section !== ""),
  );
  find("made-by").textContent = `holdfast ${header.holdfast_version}`;
}

// A short note as it is; of a long one its first words, and the whole on request.
function noteItem(note) {
  if (note.length <= kShortNote) return element("li", {}, note);
  const head = note.slice(0, note.lastIndexOf(" ", kShortNote));
  const rest = note.slice(head.length);
  return element(
    "li",
    {},
    element("details", {}, element("summary", {}, head), element("span", {}, rest)),
  );
}

export function showNotes(clips) {
  const notes = clips.flatMap((clip) =>
    clip.notes.map((note) => (clips.length > 1 ? `${clip.name}: ${note}` : note)),
  );
  find("notes").replaceChildren(...[...new Set(notes)].map(noteItem));
  find("notes").hidden = notes.length === 0;
}
