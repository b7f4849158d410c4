// SPDX-License-Identifier: MIT
// Buttons, sliders and keys: each changes the player's state through `actions`.
import { find } from "./dom.js";

export const kSpeeds = [0.1, 0.25, 0.5, 1, 1.5, 2];

export class Controls {
  constructor(playback, actions) {
    this.playback = playback;
    this.actions = actions;
    this.bindTransport();
    this.bindChoices();
    this.bindKeys();
    playback.addEventListener("seek", () => this.showFrame());
    playback.addEventListener("state", () => this.showState());
  }

  bindTransport() {
    const { playback } = this;
    find("play").addEventListener("click", () => playback.toggle());
    find("scrub").addEventListener("input", () => {
      playback.pause();
      playback.seek(Number(find("scrub").value));
    });
    find("speed").addEventListener("change", () => (playback.speed = Number(find("speed").value)));
    find("loop").addEventListener("click", () => this.actions.toggleLoop());
    find("help-open").addEventListener("click", () => this.toggleHelp());
  }

  bindChoices() {
    for (const button of document.querySelectorAll("[data-view]")) {
      button.addEventListener("click", () => this.actions.setView(button.dataset.view));
    }
    for (const button of document.querySelectorAll("[data-colors]")) {
      button.addEventListener("click", () => this.actions.setColors(button.dataset.colors));
    }
    for (const name of ["follow", "wireframe", "object", "ghost"]) {
      find(name).addEventListener("click", () => this.actions[`toggle_${name}`]());
    }
  }

  bindKeys() {
    const { playback, actions } = this;
    const step = (event, sign) => {
      playback.pause();
      playback.seek(playback.frame + sign * (event.shiftKey ? 10 : 1));
    };
    const keys = {
      " ": () => playback.toggle(),
      ArrowLeft: (event) => step(event, -1),
      ArrowRight: (event) => step(event, 1),
      Home: () => playback.seek(0),
      End: () => playback.seek(playback.frames - 1),
      ",": () => this.changeSpeed(-1),
      ".": () => this.changeSpeed(1),
      1: () => actions.setView("front"),
      2: () => actions.setView("side"),
      3: () => actions.setView("right"),
      4: () => actions.setView("left"),
      w: () => actions.toggle_wireframe(),
      c: () => actions.nextColors(),
      o: () => actions.toggle_object(),
      g: () => actions.toggle_ghost(),
      f: () => actions.toggle_follow(),
      l: () => actions.toggleLoop(),
      "?": () => this.toggleHelp(),
    };
    // After a click of the mouse or a finger (detail counts them) the keys are the player's again.
    document.addEventListener("click", (event) => {
      if (event.detail > 0) event.target.closest("button")?.blur();
    });
    window.addEventListener("keydown", (event) => {
      if (event.ctrlKey || event.metaKey || event.altKey || find("help").open) return;
      const target = event.target;
      const key = event.key.length === 1 ? event.key.toLowerCase() : event.key;
      if (target.matches("select, input:not([type=range]), textarea")) return;
      // A button or link reached by keyboard takes its own space, a slider its own arrows.
      if (key === " " && target.matches("button, summary, a")) return;
      if (target.matches("input[type=range]") && key !== " " && key.length > 1) return;
      if (!keys[key]) return;
      event.preventDefault();
      keys[key](event);
    });
  }

  changeSpeed(by) {
    const at = kSpeeds.indexOf(this.playback.speed);
    const next = kSpeeds[Math.max(0, Math.min(kSpeeds.length - 1, at + by))];
    this.playback.speed = next;
    find("speed").value = String(next);
  }

  toggleHelp() {
    const help = find("help");
    if (help.open) help.close();
    else help.showModal();
  }

  showFrame() {
    const { frame, frames, rate } = this.playback;
    const seconds = (frame / rate).toFixed(2);
    const scrub = find("scrub");
    scrub.max = String(frames - 1);
    scrub.value = String(frame);
    scrub.style.setProperty("--share", frames > 1 ? String(frame / (frames - 1)) : "0");
    scrub.setAttribute("aria-valuetext", `${seconds} s, frame ${frame + 1} of ${frames}`);
    find("time").textContent = `${seconds} s`;
    find("frame").textContent = `${frame + 1} / ${frames}`;
  }

  showState() {
    const { playing } = this.playback;
    find("play").setAttribute("aria-label", playing ? "Pause" : "Play");
    find("play").classList.toggle("playing", playing);
  }
}

export function press(button, pressed) {
  button.setAttribute("aria-pressed", String(pressed));
}
