// SPDX-License-Identifier: MIT
// One clip in the scene: a body, and its object when it has one. Solid, or translucent as a ghost.
import {
  BufferAttribute,
  BufferGeometry,
  DynamicDrawUsage,
  Group,
  Mesh,
  MeshBasicMaterial,
  MeshStandardMaterial,
} from "three";

import { kPalette, paintAll, paintHands, ramp } from "./colors.js";
import { Skin } from "./skinning.js";

export class Actor {
  constructor(header, arrays) {
    this.header = header;
    this.arrays = arrays;
    this.skin = new Skin(arrays);
    this.group = new Group();
    this.frame = -1;
    this.mode = "off";
    this.body = this.makeBody();
    this.object = header.has_object ? this.makeObject() : null;
    this.furniture = header.has_table ? this.makeTable() : null;
    if (header.has_marker) this.group.add(this.makeMarker());
    this.setGhost(false);
  }

  makeBody() {
    const geometry = new BufferGeometry();
    const dynamic = (array) => {
      const attribute = new BufferAttribute(array, 3);
      attribute.setUsage(DynamicDrawUsage);
      return attribute;
    };
    this.colors = new Float32Array(this.arrays.rest.length);
    geometry.setIndex(new BufferAttribute(this.arrays.faces, 1));
    geometry.setAttribute("position", dynamic(this.skin.positions));
    geometry.setAttribute("normal", dynamic(this.skin.normals));
    geometry.setAttribute("color", dynamic(this.colors));
    return this.addMesh(geometry);
  }

  makeObject() {
    return this.addMesh(this.rigid("object"));
  }

  // A mesh that moves as one, with the normals of its faces and creases.
  rigid(name) {
    const { [`${name}_faces`]: faces, [`${name}_vertices`]: vertices } = this.arrays;
    const geometry = new BufferGeometry();
    geometry.setIndex(new BufferAttribute(faces, 1));
    geometry.setAttribute("position", new BufferAttribute(vertices, 3));
    const normals = new BufferAttribute(this.arrays[`${name}_normals`], 3, true);
    geometry.setAttribute("normal", normals);
    return geometry;
  }

  // What the object rests on. Not part of the clip's looks: never a ghost, never clear.
  makeTable() {
    const table = new Mesh(
      this.rigid("table"),
      new MeshStandardMaterial({ color: kPalette.table, roughness: 0.7 }),
    );
    table.castShadow = true;
    table.receiveShadow = true;
    table.frustumCulled = false;
    this.group.add(table);
    return table;
  }

  // What stands in the world and is neither body nor object: a goal.
  makeMarker() {
    const geometry = new BufferGeometry();
    geometry.setIndex(new BufferAttribute(this.arrays.marker_faces, 1));
    geometry.setAttribute("position", new BufferAttribute(this.arrays.marker_vertices, 3));
    geometry.computeVertexNormals();
    const material = new MeshStandardMaterial({ color: kPalette.marker, roughness: 0.5 });
    const marker = new Mesh(geometry, material);
    marker.castShadow = true;
    return marker;
  }

  // A mesh, and before it the same mesh into the depth buffer only: with it a translucent surface
  // does not show its own far side.
  addMesh(geometry) {
    const depth = new Mesh(geometry, new MeshBasicMaterial({ colorWrite: false }));
    depth.renderOrder = 1;
    const mesh = new Mesh(geometry, new MeshStandardMaterial());
    for (const part of [depth, mesh]) part.frustumCulled = false; // the shape moves, its box does not
    mesh.userData.depth = depth;
    this.group.add(depth, mesh);
    return mesh;
  }

  setGhost(ghost) {
    this.ghost = ghost;
    const body = this.body.material;
    body.vertexColors = !ghost;
    body.color.set(ghost ? kPalette.ghostBody : "#ffffff");
    body.roughness = 0.72;
    if (this.object) {
      const object = this.object.material;
      object.color.set(ghost ? kPalette.ghostObject : kPalette.object);
      object.roughness = 0.5;
    }
    this.body.castShadow = !ghost;
    this.body.receiveShadow = !ghost;
    // Where ghost and clip agree the clip is seen: the ghost stands two millimeters back.
    for (const mesh of [this.body, this.object]) {
      if (!mesh) continue;
      for (const { material } of [mesh, mesh.userData.depth]) {
        material.polygonOffset = ghost;
        material.polygonOffsetFactor = 1;
        material.polygonOffsetUnits = 40;
      }
    }
    this.frame = -1;
    this.setOpacity(this.body, ghost ? 0.34 : 1);
    this.setObjectLook(this.objectLook ?? "solid");
  }

  // "solid", "clear" (see what it hides) or "hidden".
  setObjectLook(look) {
    this.objectLook = look;
    if (!this.object) return;
    const opacity = this.ghost ? 0.4 : 1;
    this.setOpacity(this.object, look === "clear" ? 0.2 * opacity : opacity);
    this.object.visible = look !== "hidden";
    this.object.userData.depth.visible = look !== "hidden" && this.object.material.transparent;
    this.object.castShadow = look === "solid" && !this.ghost;
    this.object.receiveShadow = look === "solid" && !this.ghost;
  }

  setOpacity(mesh, opacity) {
    const clear = opacity < 1;
    mesh.material.opacity = opacity;
    mesh.material.transparent = clear;
    mesh.material.depthWrite = !clear;
    mesh.material.needsUpdate = true;
    mesh.renderOrder = clear ? 2 : 0;
    mesh.userData.depth.visible = clear && !mesh.material.wireframe;
  }

  setWireframe(on) {
    for (const mesh of [this.body, this.object]) {
      if (!mesh) continue;
      mesh.material.wireframe = on;
      mesh.userData.depth.visible = mesh.visible && mesh.material.transparent && !on;
    }
  }

  setColors(mode, scales) {
    this.mode = this.header.has_object ? mode : "off";
    this.table = ramp(this.mode, scales);
    paintAll(this.colors, kPalette.body);
    this.frame = -1;
  }

  // Moves everything to a frame; nothing to do when it is there.
  show(frame) {
    if (frame === this.frame) return;
    this.frame = frame;
    this.skin.pose(frame);
    const { position, normal, color } = this.body.geometry.attributes;
    position.needsUpdate = true;
    normal.needsUpdate = true;
    if (!this.ghost) {
      if (this.mode !== "off") paintHands(this.colors, this.arrays, frame, this.table);
      color.needsUpdate = true;
    }
    if (this.object) {
      const pose = this.arrays.object_pose.subarray(7 * frame, 7 * frame + 7);
      for (const mesh of [this.object, this.object.userData.depth]) {
        mesh.quaternion.fromArray(pose, 0);
        mesh.position.fromArray(pose, 4);
      }
    }
    if (this.furniture) {
      const pose = this.arrays.table_pose.subarray(7 * frame, 7 * frame + 7);
      this.furniture.quaternion.fromArray(pose, 0);
      this.furniture.position.fromArray(pose, 4);
    }
  }

  // Box of the body's vertices in the frame shown: {min, max}.
  bounds() {
    const p = this.skin.positions;
    const min = [Infinity, Infinity, Infinity];
    const max = [-Infinity, -Infinity, -Infinity];
    for (let i = 0; i < p.length; ++i) {
      min[i % 3] = Math.min(min[i % 3], p[i]);
      max[i % 3] = Math.max(max[i % 3], p[i]);
    }
    return { min, max };
  }

  // Middle of the object in the frame shown; nothing without one.
  objectCenter() {
    if (!this.object) return null;
    const { geometry } = this.object;
    if (!geometry.boundingSphere) geometry.computeBoundingSphere();
    this.object.updateMatrix();
    return geometry.boundingSphere.center.clone().applyMatrix4(this.object.matrix).toArray();
  }

  // Mean of one hand's vertices in the frame shown.
  handCenter(side) {
    const { hand_vertices: ids } = this.arrays;
    const right = this.header.right_hand_vertices;
    const part = side === "right" ? ids.subarray(0, right) : ids.subarray(right);
    const sum = [0, 0, 0];
    for (const id of part) for (let k = 0; k < 3; ++k) sum[k] += this.skin.positions[3 * id + k];
    return sum.map((value) => value / part.length);
  }
}
