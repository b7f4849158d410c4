// SPDX-License-Identifier: MIT
// Small multiples of the values per frame: a cursor tied to the player, hover to read, click or drag
// to seek.
import { chartsFor } from "./catalog.js";
import { element } from "./dom.js";
import { short, withUnit } from "./words.js";

const kPad = { left: 44, right: 10, top: 8, bottom: 18 };
const kFont = 11; // px
const kLogSpan = 100; // energies that span more than this are drawn on a log scale
const kNoise = 1e-6; // in a chart's unit: less is rounding
const kConstant = 1e-3; // of a line's size: digits that are shown do not change by less
const kEnergyNoise = 1e-12; // squared micrometers

// `container` takes the charts, `constants` (a dl) the values of those that do not change.
export class Curves {
  constructor(container, constants, playback) {
    this.container = container;
    this.constants = constants;
    this.playback = playback;
    this.charts = [];
    this.hovered = null;
    new ResizeObserver(() => this.draw()).observe(container);
  }

  // `ghost` may be null.
  setClips(primary, ghost) {
    this.primary = primary;
    this.ghost = ghost;
    this.duration = primary.frames / primary.frame_rate;
    const shown = ghost ? [primary, ghost] : [primary];
    const charts = chartsFor(shown).map((spec) => new Chart(this, spec));
    this.charts = charts.filter((chart) => !chart.constant);
    const constant = charts.filter((chart) => chart.constant);
    this.constants.replaceChildren(
      ...constant.map(({ spec, constant: text }) =>
        element("div", {}, element("dt", {}, spec.title), element("dd", {}, text)),
      ),
    );
    this.constants.hidden = constant.length === 0;
    this.container.replaceChildren(...this.charts.map((chart) => chart.figure));
    this.draw();
    this.update();
  }

  draw() {
    for (const chart of this.charts) chart.draw();
    this.update();
  }

  hover(frame) {
    this.hovered = frame;
    this.container.classList.toggle("hovering", frame !== null);
    this.update();
  }

  update() {
    const frame = this.hovered ?? this.playback.frame;
    for (const chart of this.charts) chart.update(frame, this.playback.frame);
  }
}

class Chart {
  constructor(curves, spec) {
    this.curves = curves;
    this.spec = spec;
    this.factor = spec.factor ?? 1;
    const { primary, ghost } = curves;
    this.lines = [];
    for (const [clip, dashed] of [
      [ghost, true],
      [primary, false],
    ]) {
      for (const [name, label, hue] of spec.series) {
        const values = clip?.series[name];
        if (!values) continue;
        this.lines.push({
          values: values.map((v) => (v === null ? NaN : Number(v) * this.factor)),
          rate: clip.frame_rate,
          name,
          label,
          hue,
          dashed,
        });
      }
    }
    this.constant = this.constantText();
    if (this.constant) return;
    this.scale();
    this.build();
  }

  // "zero throughout" where no line changes by more than rounding; else nothing.
  constantText() {
    const noise = this.spec.energy ? kEnergyNoise : kNoise;
    const texts = [];
    for (const { values, label, dashed } of this.lines) {
      const { low, high } = extent(values);
      const size = Math.max(Math.abs(low), Math.abs(high));
      if (high - low > Math.max(noise, kConstant * size)) return "";
      const value = low > high ? "not measured" : size <= noise ? "zero" : short(0.5 * (low + high));
      const known = low <= high && size > noise;
      const text = known ? withUnit(value, this.spec.unit) : value;
      texts.push([dashed ? "ghost" : "", label, text].filter(Boolean).join(" "));
    }
    return `${texts.reverse().join(", ")} throughout`;
  }

  scale() {
    const all = this.lines.flatMap((line) => line.values).filter(Number.isFinite);
    const positive = all.filter((v) => v > 0);
    const low = positive.reduce((a, b) => Math.min(a, b), Infinity);
    const high = all.reduce((a, b) => Math.max(a, b), -Infinity);
    this.log = Boolean(this.spec.energy) && positive.length > 1 && high / low > kLogSpan;
    if (this.log) {
      // Twelve decades below the top there is only rounding.
      this.low = Math.max(Math.floor(Math.log10(low)), Math.ceil(Math.log10(high)) - 12);
      this.high = Math.max(Math.ceil(Math.log10(high)), this.low + 1);
      return;
    }
    const least = all.reduce((a, b) => Math.min(a, b), 0);
    const step = niceStep((Math.max(high, 0) - least || 1) / 3);
    this.step = step;
    this.low = Math.floor(least / step + 1e-9) * step;
    this.high = Math.max(Math.ceil(high / step - 1e-9) * step, this.low + step);
  }

  build() {
    const { spec } = this;
    const solid = this.lines.filter((line) => !line.dashed);
    const dashed = this.lines.filter((line) => line.dashed);
    this.readouts = (solid.length > 0 ? solid : dashed).map((line) => ({
      line,
      ghost: dashed.find(({ name }) => name === line.name),
      node: element("span", { class: `hue-${line.hue}` }),
    }));
    this.canvas = element("canvas", { role: "img", "aria-label": this.describe() });
    this.cursor = element("div", { class: "cursor" });
    this.hoverLine = element("div", { class: "cursor hover" });
    const plot = element("div", { class: "plot" }, this.canvas, this.cursor, this.hoverLine);
    this.figure = element(
      "figure",
      { class: "chart", title: spec.about },
      element(
        "figcaption",
        {},
        element("span", { class: "name" }, spec.title),
        spec.unit ? element("span", { class: "unit" }, spec.unit) : "",
        this.log ? element("span", { class: "tag" }, "log") : "",
        element("span", { class: "values" }, ...this.readouts.map(({ node }) => node)),
      ),
      plot,
    );
    const frameAt = (event) => {
      const box = plot.getBoundingClientRect();
      const share = (event.clientX - box.left - this.left) / (box.width - this.left - kPad.right);
      const { frames } = this.curves.primary;
      return Math.max(0, Math.min(frames - 1, Math.round(share * (frames - 1))));
    };
    plot.addEventListener("pointerdown", (event) => {
      if (event.button !== 0) return;
      if (event.pointerType === "mouse") plot.setPointerCapture(event.pointerId);
      this.curves.playback.pause();
      this.curves.playback.seek(frameAt(event));
    });
    plot.addEventListener("pointermove", (event) => {
      if (event.buttons & 1) this.curves.playback.seek(frameAt(event));
      this.curves.hover(event.pointerType === "mouse" ? frameAt(event) : null);
    });
    plot.addEventListener("pointerleave", () => this.curves.hover(null));
  }

  // For those who cannot see the curve.
  describe() {
    const parts = this.lines
      .filter((line) => !line.dashed)
      .map(({ label, values }) => {
        const { low, high } = extent(values);
        const range = withUnit(`${short(low)} to ${short(high)}`, this.spec.unit);
        return `${label} from ${range}`.trim();
      });
    return `${this.spec.title} over time: ${parts.join("; ")}`;
  }

  x(time) {
    const { frames, frame_rate: rate } = this.curves.primary;
    const end = Math.max(frames - 1, 1) / rate;
    return this.left + (time / end) * (this.width - this.left - kPad.right);
  }

  y(value) {
    const at = this.log ? Math.log10(value) : value;
    const share = (at - this.low) / (this.high - this.low);
    return this.height - kPad.bottom - share * (this.height - kPad.top - kPad.bottom);
  }

  draw() {
    const { canvas } = this;
    const box = canvas.parentElement.getBoundingClientRect();
    if (box.width === 0) return;
    const ratio = window.devicePixelRatio || 1;
    this.width = box.width;
    this.height = box.height;
    canvas.width = Math.round(box.width * ratio);
    canvas.height = Math.round(box.height * ratio);
    const pen = canvas.getContext("2d");
    pen.scale(ratio, ratio);
    pen.font = `${kFont}px ${getComputedStyle(document.body).fontFamily}`;
    const labels = this.ticks().map((value) => pen.measureText(this.tickText(value)).width);
    this.left = Math.max(kPad.left, ...labels.map((width) => Math.ceil(width) + 10));
    const style = getComputedStyle(this.figure);
    const color = (name) => style.getPropertyValue(name).trim();
    this.drawAxes(pen, color);
    pen.save();
    pen.beginPath();
    const plotWidth = this.width - this.left - kPad.right;
    pen.rect(this.left, 0, plotWidth + 2, this.height - kPad.bottom + 2);
    pen.clip();
    for (const line of this.lines) this.drawLine(pen, line, color(`--hue-${line.hue}`));
    pen.restore();
  }

  drawAxes(pen, color) {
    pen.fillStyle = color("--ink-3");
    pen.strokeStyle = color("--line");
    pen.lineWidth = 1;
    pen.textAlign = "right";
    pen.textBaseline = "middle";
    for (const value of this.ticks()) {
      const y = Math.round(this.y(value)) + 0.5;
      pen.beginPath();
      pen.moveTo(this.left, y);
      pen.lineTo(this.width - kPad.right, y);
      pen.stroke();
      pen.fillText(this.tickText(value), this.left - 6, y);
    }
    pen.textBaseline = "alphabetic";
    const { frames, frame_rate: rate } = this.curves.primary;
    const end = (frames - 1) / rate;
    const step = niceStep(Math.max(end, 1e-3) / 4);
    for (let k = 0; k * step <= end + 1e-9; ++k) {
      const x = this.x(k * step);
      pen.textAlign = x > this.width - 24 ? "right" : k === 0 ? "left" : "center";
      pen.fillText(`${short(k * step)}${k === 0 ? " s" : ""}`, x, this.height - 4);
    }
  }

  tickText(value) {
    if (this.log) return power(value);
    if (value !== 0 && this.step < 1e-3) return short(value);
    return value.toFixed(Math.max(0, -Math.floor(Math.log10(this.step) + 1e-9)));
  }

  ticks() {
    const ticks = [];
    if (this.log) {
      const step = Math.max(1, Math.ceil((this.high - this.low) / 3));
      for (let p = this.low; p <= this.high; p += step) ticks.push(10 ** p);
      return ticks;
    }
    for (let v = this.low; v <= this.high + 1e-9 * this.step; v += this.step) ticks.push(v);
    return ticks.map((v) => Number(v.toPrecision(9)));
  }

  drawLine(pen, { values, rate, dashed }, stroke) {
    pen.strokeStyle = stroke;
    pen.lineWidth = dashed ? 1.25 : 1.75;
    pen.globalAlpha = dashed ? 0.6 : 1;
    pen.setLineDash(dashed ? [4, 3] : []);
    pen.lineJoin = "round";
    pen.beginPath();
    let drawing = false;
    values.forEach((value, t) => {
      const missing = !Number.isFinite(value) || (this.log && value <= 0);
      if (!missing) {
        const x = this.x(t / rate);
        const y = this.y(this.log ? Math.max(value, 10 ** this.low) : value);
        if (drawing) pen.lineTo(x, y);
        else pen.moveTo(x, y);
      }
      drawing = !missing;
    });
    pen.stroke();
    pen.setLineDash([]);
    pen.globalAlpha = 1;
  }

  // `read`: the frame to show values of; `current`: the player's.
  update(read, current) {
    if (!this.width) return;
    const rate = this.curves.primary.frame_rate;
    const put = (node, frame) =>
      (node.style.transform = `translateX(${this.x(frame / rate).toFixed(2)}px)`);
    put(this.cursor, current);
    put(this.hoverLine, read);
    const noise = this.spec.energy ? kEnergyNoise : kNoise;
    const valueOf = (line) => {
      const value = line.values[Math.floor((read / rate) * line.rate + 1e-6)];
      return short(Math.abs(value) <= noise ? 0 : value);
    };
    for (const { line, ghost, node } of this.readouts) {
      let text = `${line.label ? `${line.label} ` : ""}${valueOf(line)}`;
      if (ghost && ghost !== line) text += ` (${valueOf(ghost)})`;
      if (node.textContent !== text) node.textContent = text;
    }
  }
}

// Least and greatest of the finite values; low > high where there is none.
function extent(values) {
  const known = values.filter(Number.isFinite);
  const least = (a, b) => Math.min(a, b);
  const greatest = (a, b) => Math.max(a, b);
  return { low: known.reduce(least, Infinity), high: known.reduce(greatest, -Infinity) };
}

function niceStep(rough) {
  const power = 10 ** Math.floor(Math.log10(rough));
  const share = rough / power;
  return (share <= 1 ? 1 : share <= 2 ? 2 : share <= 5 ? 5 : 10) * power;
}

const kSuperscripts = "\u2070\u00b9\u00b2\u00b3\u2074\u2075\u2076\u2077\u2078\u2079";

function power(value) {
  const exponent = Math.round(Math.log10(value));
  const digits = String(Math.abs(exponent)).replace(/\d/g, (d) => kSuperscripts[d]);
  return `10${exponent < 0 ? "\u207b" : ""}${digits}`;
}
