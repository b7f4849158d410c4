// SPDX-License-Identifier: MIT
// The clock: time in seconds, whole frames out.

export class Playback extends EventTarget {
  constructor(frames, rate) {
    super();
    this.speed = 1;
    this.loop = true;
    this.playing = false;
    this.setClip(frames, rate);
  }

  setClip(frames, rate) {
    this.frames = frames;
    this.rate = rate;
    this.time = 0;
    this.emit("seek");
  }

  get frame() {
    return Math.max(0, Math.min(this.frames - 1, Math.floor(this.time * this.rate + 1e-6)));
  }

  emit(name) {
    this.dispatchEvent(new Event(name));
  }

  seek(frame) {
    const bounded = Math.max(0, Math.min(this.frames - 1, Math.round(frame)));
    this.time = bounded / this.rate;
    this.emit("seek");
  }

  play() {
    if (this.playing || this.frames < 2) return;
    if (this.frame === this.frames - 1) this.time = 0;
    this.playing = true;
    this.last = null;
    this.emit("state");
  }

  pause() {
    if (!this.playing) return;
    this.playing = false;
    this.seek(this.frame);
    this.emit("state");
  }

  toggle() {
    if (this.playing) this.pause();
    else this.play();
  }

  // Advances to `now` (ms); true when the frame changed.
  tick(now) {
    if (!this.playing) return false;
    const before = this.frame;
    // A tab in the background gets no ticks: do not leap when it comes back.
    if (this.last !== null) this.time += (this.speed * Math.min(now - this.last, 250)) / 1000;
    this.last = now;
    const length = this.frames / this.rate;
    if (this.time >= length) {
      if (this.loop) {
        this.time %= length;
      } else {
        this.time = (this.frames - 1) / this.rate;
        this.playing = false;
        this.emit("state");
      }
    }
    if (this.frame === before) return false;
    this.emit("seek");
    return true;
  }
}
