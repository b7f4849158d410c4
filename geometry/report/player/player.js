// SPDX-License-Identifier: MIT
// Puts the page together: data, stage, curves, tables and controls around one state.
import { Actor } from "./actor.js";
import { depthScale, legend } from "./colors.js";
import { Controls, press } from "./controls.js";
import { Curves } from "./curves.js";
import { readHeader, readPayload } from "./decode.js";
import { element, find } from "./dom.js";
import { showCards, showNotes, showTables, threshold } from "./facts.js";
import { Playback } from "./playback.js";
import { Stage } from "./stage.js";
import { ViewPoint } from "./views.js";

const kColors = ["off", "contact", "penetration"];
const kObjectLooks = ["solid", "clear", "hidden"];

class Player {
  constructor(header) {
    this.header = header;
    this.still = matchMedia("(prefers-reduced-motion: reduce)").matches;
    this.primary = 0;
    this.ghost = header.clips.length === 2 ? 1 : null;
    this.ghostShown = this.ghost !== null;
    this.colors = "off";
    this.wireframe = false;
    this.objectLook = "solid";
    this.actors = [];
    const first = header.clips[0];
    this.playback = new Playback(first.frames, first.frame_rate);
    this.curves = new Curves(find("curves"), find("constants"), this.playback);
    this.controls = new Controls(this.playback, this);
    this.playback.addEventListener("seek", () => this.curves.update());
    find("title").textContent = header.title;
    showTables(header);
    this.showTexts();
    this.curves.setClips(this.clip, this.ghostClip);
    this.playback.emit("seek");
  }

  async load() {
    this.stage = new Stage(find("canvas"));
    this.viewpoint = new ViewPoint(this.stage, this.still);
    await this.actor(this.primary);
    if (this.ghost !== null) await this.actor(this.ghost);
    const dark = matchMedia("(prefers-color-scheme: dark)");
    const theme = () => {
      this.stage.setTheme(dark.matches);
      this.curves.draw();
    };
    dark.addEventListener("change", theme);
    this.fillPickers();
    this.cast();
    theme();
    this.setColors(this.clip.has_object ? "contact" : "off");
    this.stage.before = (now) => this.beforePicture(now);
    find("stage").classList.add("loaded");
    find("stage").removeAttribute("aria-busy");
    if (!this.still) this.playback.play();
  }

  get clip() {
    return this.header.clips[this.primary];
  }

  get ghostClip() {
    return this.ghost !== null && this.ghostShown ? this.header.clips[this.ghost] : null;
  }

  // Decoded when first needed.
  async actor(index) {
    if (!this.actors[index]) {
      const header = this.header.clips[index];
      this.actors[index] = new Actor(header, await readPayload(index, header.arrays));
    }
    return this.actors[index];
  }

  // Who is on stage, and how they look.
  cast() {
    for (const actor of this.actors) if (actor) this.stage.scene.remove(actor.group);
    const shown = [this.primary, this.ghostClip ? this.ghost : null].filter((k) => k !== null);
    for (const index of shown) {
      const actor = this.actors[index];
      actor.setGhost(index !== this.primary);
      actor.setObjectLook(this.objectLook);
      actor.setWireframe(this.wireframe);
      this.stage.scene.add(actor.group);
    }
    this.scales = {
      threshold: threshold(this.clip),
      depth: depthScale(this.actors.filter(Boolean)),
    };
    this.actors[this.primary].setColors(this.colors, this.scales);
    this.pose();
    this.curves.setClips(this.clip, this.ghostClip);
    this.viewpoint.set(this.viewpoint.view, this.actors[this.primary], true);
    this.showTexts();
  }

  // Every actor at the player's time; a ghost that has ended is gone.
  pose() {
    const actor = this.actors[this.primary];
    const { frame } = this.playback;
    actor.show(frame);
    if (this.ghostClip) {
      const ghost = this.actors[this.ghost];
      const at = Math.floor((frame / this.playback.rate) * ghost.header.frame_rate + 1e-6);
      ghost.group.visible = at < ghost.header.frames;
      if (ghost.group.visible) ghost.show(at);
    }
    this.stage.light(actor.skin.heading(0), actor.skin.joint(frame, 0));
    this.showReadout();
    this.stage.invalidate();
  }

  beforePicture(now) {
    this.playback.tick(now);
    const actor = this.actors[this.primary];
    const moved = actor.frame !== this.playback.frame;
    if (moved) this.pose();
    return this.viewpoint.update(actor, now) || moved;
  }

  setView(view) {
    this.viewpoint.set(view, this.actors[this.primary]);
    this.showChoices();
  }

  setColors(mode) {
    this.colors = this.clip.has_object ? mode : "off";
    this.actors[this.primary].setColors(this.colors, this.scales);
    this.pose();
    this.showChoices();
  }

  nextColors() {
    this.setColors(kColors[(kColors.indexOf(this.colors) + 1) % kColors.length]);
  }

  toggle_follow() {
    this.viewpoint.follow = !this.viewpoint.follow;
    if (!this.viewpoint.follow) this.viewpoint.set(this.viewpoint.view, this.actors[this.primary]);
    this.showChoices();
  }

  toggle_wireframe() {
    this.wireframe = !this.wireframe;
    for (const actor of this.actors) actor?.setWireframe(this.wireframe);
    this.stage.invalidate();
    this.showChoices();
  }

  toggle_object() {
    const next = kObjectLooks.indexOf(this.objectLook) + 1;
    this.objectLook = kObjectLooks[next % kObjectLooks.length];
    for (const actor of this.actors) actor?.setObjectLook(this.objectLook);
    for (const actor of this.actors) actor?.setWireframe(this.wireframe);
    this.stage.invalidate();
    this.showChoices();
  }

  toggle_ghost() {
    if (this.ghost === null) return;
    this.ghostShown = !this.ghostShown;
    const { camera, controls } = this.stage;
    const kept = [camera.position.clone(), controls.target.clone()];
    this.cast();
    camera.position.copy(kept[0]);
    controls.target.copy(kept[1]);
    this.showChoices();
  }

  toggleLoop() {
    this.playback.loop = !this.playback.loop;
    this.showChoices();
  }

  // Which clip, and which ghost, where there is a choice.
  fillPickers() {
    const { clips } = this.header;
    find("pickers").hidden = clips.length < 2;
    const fill = (select, withNone) => {
      const options = clips.map((clip, k) => element("option", { value: String(k) }, clip.name));
      if (withNone) options.unshift(element("option", { value: "" }, "none"));
      select.replaceChildren(...options);
    };
    fill(find("pick-clip"), false);
    fill(find("pick-ghost"), true);
    const choose = async () => {
      const before = this.primary;
      const picked = Number(find("pick-clip").value);
      const ghost = find("pick-ghost").value;
      // Pictures go on while a clip is unpacked: it comes on stage when it is there.
      await this.actor(picked);
      if (ghost !== "") await this.actor(Number(ghost));
      this.primary = picked;
      this.ghost = ghost === "" ? null : Number(ghost);
      // Choosing the ghost as the clip swaps them; a clip is no ghost of itself.
      if (this.ghost === this.primary) this.ghost = before === this.primary ? null : before;
      this.ghostShown = this.ghost !== null;
      if (before !== this.primary) {
        const { playing } = this.playback;
        this.playback.pause();
        this.playback.setClip(this.clip.frames, this.clip.frame_rate);
        if (playing) this.playback.play();
      }
      if (!this.clip.has_object) this.colors = "off";
      this.cast();
      this.showChoices();
    };
    find("pick-clip").addEventListener("change", choose);
    find("pick-ghost").addEventListener("change", choose);
    this.showChoices();
  }

  showTexts() {
    showCards(this.clip, this.ghostClip);
    showNotes(this.header.clips);
    find("ghost-key").hidden = !this.ghostClip;
    if (this.ghostClip) {
      find("key-clip").textContent = this.clip.name;
      find("key-ghost").textContent = this.ghostClip.name;
    }
  }

  // What the colors show, in numbers.
  showReadout() {
    const { frame } = this.playback;
    const value = (name) => this.clip.series[name]?.[frame];
    const depth = value("penetration_depth_mm") ?? value("hand_in_object_mm");
    const ratio = value("contact_ratio");
    find("read-contact").textContent = Number.isFinite(ratio)
      ? `${(100 * ratio).toFixed(1)} % touching`
      : "";
    find("read-depth").textContent = Number.isFinite(depth) ? `${depth.toFixed(2)} mm deep` : "";
  }

  showChoices() {
    const { view, follow } = this.viewpoint;
    for (const button of document.querySelectorAll("[data-view]")) {
      press(button, button.dataset.view === view);
    }
    for (const button of document.querySelectorAll("[data-colors]")) {
      press(button, button.dataset.colors === this.colors);
    }
    find("color-group").hidden = !this.clip.has_object;
    find("object").hidden = !this.clip.has_object;
    find("ghost").hidden = this.ghost === null;
    press(find("follow"), follow);
    press(find("wireframe"), this.wireframe);
    press(find("object"), this.objectLook !== "solid");
    find("object-look").textContent = { solid: "Object", clear: "See-through", hidden: "Hidden" }[
      this.objectLook
    ];
    press(find("ghost"), this.ghostShown);
    press(find("loop"), this.playback.loop);
    find("pick-clip").value = String(this.primary);
    find("pick-ghost").value = this.ghost === null ? "" : String(this.ghost);
    const box = find("legend");
    box.hidden = this.colors === "off";
    if (this.colors === "off") return;
    const { title, gradient, low, high } = legend(this.colors, this.scales);
    find("legend-title").textContent = title;
    find("legend-bar").style.background = gradient;
    find("legend-low").textContent = low;
    find("legend-high").textContent = high;
  }

  // Position of a body vertex of the clip shown, meters: for checks.
  vertex(frame, index) {
    const { skin } = this.actors[this.primary];
    skin.pose(frame);
    const at = [...skin.positions.subarray(3 * index, 3 * index + 3)];
    skin.pose(this.playback.frame);
    return at;
  }
}

const player = new Player(readHeader());
// The curves are drawn before megabytes are decoded.
const ready = new Promise((resolve) => requestAnimationFrame(resolve))
  .then(() => player.load())
  .catch((error) => {
    find("stage").classList.add("failed");
    find("failure").textContent =
      `The 3D view is not available here (${error.message}). The curves and tables below are.`;
    player.curves.setClips(player.clip, player.ghostClip);
    throw error;
  });
window.holdfast = { player, ready, header: player.header };
