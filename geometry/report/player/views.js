// SPDX-License-Identifier: MIT
// Where the camera looks from, and how it follows.
import { Vector3 } from "three";

export const kViews = ["front", "side", "right", "left"];
const kHandRadius = 0.14; // meters around a hand's center that a close-up shows
const kFlight = 380; // ms from view to view

export class ViewPoint {
  constructor(stage, still) {
    this.stage = stage;
    this.still = still; // no flights for those who asked for less motion
    this.view = "front";
    this.follow = true;
    this.flight = null;
    this.anchor = null;
    stage.controls.addEventListener("start", () => (this.flight = null));
  }

  // The point that moves along with the clip in this view.
  anchorOf(actor) {
    if (this.view === "right" || this.view === "left") {
      return new Vector3(...actor.handCenter(this.view));
    }
    const pelvis = actor.skin.joint(actor.frame, 0);
    return new Vector3(pelvis[0], pelvis[1], 0);
  }

  // Camera and target for a view of the frame shown.
  place(view, actor) {
    const [hx, hy] = actor.skin.heading(actor.frame);
    const half = Math.tan((this.stage.camera.fov * Math.PI) / 360);
    const narrow = Math.min(1, this.stage.camera.aspect);
    if (view === "right" || view === "left") {
      const target = new Vector3(...actor.handCenter(view));
      const chest = actor.skin.joint(actor.frame, 9);
      // From outside the body, in front and a little above, on the object's side of the hand.
      const out = new Vector3(target.x - chest[0], target.y - chest[1], 0).setLength(0.7);
      out.add(new Vector3(0.6 * hx, 0.6 * hy, 0.45));
      const object = actor.objectCenter();
      if (object) {
        const side = new Vector3(...object).sub(target);
        if (side.length() < 2 * kHandRadius) target.addScaledVector(side, 0.4);
        out.add(side.setLength(0.9));
      }
      out.normalize();
      return { target, camera: out.multiplyScalar(kHandRadius / (half * narrow)).add(target) };
    }
    const { min, max } = this.room(actor);
    const target = new Vector3(...[0, 1, 2].map((k) => 0.5 * (min[k] + max[k])));
    const tall = 0.5 * (max[2] - min[2]);
    const wide = 0.5 * Math.hypot(max[0] - min[0], max[1] - min[1]);
    // Narrow pictures have labels above and below.
    const narrowed = this.stage.camera.aspect < 1.2;
    const room = narrowed ? 1.32 : 1.12;
    if (narrowed) target.z += 0.05;
    const distance = room * Math.max(tall / half, wide / (half * this.stage.camera.aspect)) + 0.3;
    const turn = view === "front" ? -0.35 : -0.5 * Math.PI; // to the body's right
    const from = new Vector3(
      hx * Math.cos(turn) - hy * Math.sin(turn),
      hx * Math.sin(turn) + hy * Math.cos(turn),
      0.14,
    );
    return { target, camera: from.normalize().multiplyScalar(distance).add(target) };
  }

  // The body now when the camera follows, else all of its way.
  room(actor) {
    const { min, max } = actor.bounds();
    if (this.follow) return { min, max };
    for (let t = 0; t < actor.header.frames; t += 5) {
      const pelvis = actor.skin.joint(t, 0);
      for (let k = 0; k < 2; ++k) {
        min[k] = Math.min(min[k], pelvis[k] - 0.4);
        max[k] = Math.max(max[k], pelvis[k] + 0.4);
      }
    }
    return { min, max };
  }

  set(view, actor, atOnce = false) {
    this.view = view;
    this.anchor = this.anchorOf(actor);
    const to = this.place(view, actor);
    const { camera, controls } = this.stage;
    if (atOnce || this.still) {
      camera.position.copy(to.camera);
      controls.target.copy(to.target);
      this.flight = null;
    } else {
      this.flight = {
        to,
        from: { camera: camera.position.clone(), target: controls.target.clone() },
        begin: performance.now(),
      };
    }
    this.stage.invalidate();
  }

  // Moves the camera along with what it follows; true while it is in flight.
  update(actor, now) {
    const { camera, controls } = this.stage;
    const anchor = this.anchorOf(actor);
    const step = this.anchor && this.follow ? anchor.clone().sub(this.anchor) : new Vector3();
    this.anchor = anchor;
    camera.position.add(step);
    controls.target.add(step);
    if (!this.flight) return false;
    const { from, to, begin } = this.flight;
    for (const end of [from, to]) {
      end.camera.add(step);
      end.target.add(step);
    }
    const share = Math.min(1, (now - begin) / kFlight);
    const eased = 1 - (1 - share) ** 3;
    camera.position.lerpVectors(from.camera, to.camera, eased);
    controls.target.lerpVectors(from.target, to.target, eased);
    if (share === 1) this.flight = null;
    return true;
  }
}
