// SPDX-License-Identifier: MIT
// Object, hand and contacts in 3D. Positions are in the object's frame, in meters.
import {
  BufferAttribute,
  BufferGeometry,
  Color,
  CylinderGeometry,
  DoubleSide,
  Group,
  Mesh,
  MeshBasicMaterial,
  MeshStandardMaterial,
  Raycaster,
  SphereGeometry,
  Vector2,
  Vector3,
} from "three";

import { kPalette } from "./colors.js";
import { Stage } from "./stage.js";

const kRadius = 0.0035; // of a sphere
const kBall = new SphereGeometry(kRadius, 24, 16);
const kRod = new CylinderGeometry(kRadius / 5, kRadius / 5, 1, 8);
const kAlongRod = new Vector3(0, 1, 0);
const kOnObject = new MeshStandardMaterial({ color: kPalette.touching, roughness: 0.5 });
const kInHand = new MeshStandardMaterial({ color: "#6a4bd8", roughness: 0.5 });
const kMissing = "#4a4f58"; // parts that the robot does not have
const kDirections = Array.from({ length: 100 }, (_, k) =>
  new Vector3().setFromSphericalCoords(1, Math.acos(1 - (2 * k + 1) / 100), 2.4 * k),
);

function makeMesh(vertices, faces, look) {
  const geometry = new BufferGeometry();
  geometry.setIndex(new BufferAttribute(faces, 1));
  geometry.setAttribute("position", new BufferAttribute(vertices, 3));
  geometry.computeVertexNormals();
  return new Mesh(geometry, new MeshStandardMaterial(look));
}

export class ContactView {
  constructor(canvas, header, arrays) {
    this.canvas = canvas;
    this.header = header;
    this.arrays = arrays;
    this.stage = new Stage(canvas, { ground: false, up: header.up });
    this.ray = new Raycaster();
    this.marks = new Group();
    const look = { color: kPalette.object, flatShading: true, side: DoubleSide };
    this.object = makeMesh(arrays.object_vertices, arrays.object_faces, look);
    this.stage.scene.add(this.object, this.marks);
    this.addHand();
    this.addLight();
  }

  // Translucent, but without its own far side: depth is drawn before it, and after the spheres.
  addHand() {
    const { hand_vertices: vertices, hand_faces: faces } = this.arrays;
    this.stride = vertices.length / this.header.frames.length;
    const look = { vertexColors: true, transparent: true, opacity: 0.5, depthWrite: false };
    this.hand = makeMesh(vertices.slice(0, this.stride), faces, look);
    this.colors = new BufferAttribute(new Float32Array(this.stride), 3);
    this.hand.geometry.setAttribute("color", this.colors);
    const depth = new Mesh(this.hand.geometry, new MeshBasicMaterial({ colorWrite: false }));
    [depth.renderOrder, this.hand.renderOrder] = [1, 2];
    this.stage.scene.add(depth, this.hand);
  }

  // From above the viewer.
  addLight() {
    const { camera, controls, key, rim, sky } = this.stage;
    key.castShadow = rim.visible = false;
    sky.position.copy(camera.up);
    this.stage.before = () => {
      key.target.position.copy(controls.target);
      key.position.copy(camera.position).addScaledVector(camera.up, 0.4);
    };
  }

  showFrame(frame) {
    const { hand_part: part_of, hand_vertices: vertices } = this.arrays;
    const { geometry } = this.hand;
    const { position } = geometry.attributes;
    const from = this.stride * this.header.frames.indexOf(frame);
    position.copyArray(vertices.subarray(from, from + this.stride)).needsUpdate = true;
    geometry.computeVertexNormals();
    geometry.computeBoundingSphere();
    this.frame = frame;
    this.centers = {}; // of the skin of each part
    this.header.parts.forEach(({ name }, part) => {
      const skin = [...part_of.keys()].filter((vertex) => part_of[vertex] === part);
      const sum = new Vector3();
      for (const vertex of skin) sum.add(new Vector3().fromBufferAttribute(position, vertex));
      this.centers[name] = sum.divideScalar(skin.length);
    });
  }

  // Spheres at the ends of contacts ({object, hand, large}), and the selected part of the hand.
  draw(contacts, selected) {
    this.marks.clear();
    for (const { object, hand, large } of contacts) {
      const add = (shape, material, place) => {
        const mesh = new Mesh(shape, material);
        mesh.scale.setScalar(large ? 1.5 : 1);
        mesh.position.copy(place);
        this.marks.add(mesh);
        return mesh;
      };
      add(kBall, kOnObject, object);
      add(kBall, kInHand, hand);
      const along = hand.clone().sub(object);
      const rod = add(kRod, kOnObject, object.clone().addScaledVector(along, 0.5));
      rod.scale.y = along.length();
      rod.quaternion.setFromUnitVectors(kAlongRod, along.normalize());
    }
    const colors = this.header.parts.map(({ name, on_robot }) => {
      const shown = name === selected ? kPalette.touching : kPalette.body;
      return new Color(on_robot ? shown : kMissing).toArray();
    });
    this.arrays.hand_part.forEach((part, vertex) => this.colors.set(colors[part], 3 * vertex));
    this.colors.needsUpdate = true;
    this.stage.invalidate();
  }

  // The hand, from a direction.
  lookFrom(direction) {
    const { camera, controls } = this.stage;
    const { center, radius } = this.hand.geometry.boundingSphere;
    const outward = direction.normalize().addScaledVector(camera.up, 0.3);
    controls.maxPolarAngle = Math.PI;
    controls.target.copy(center);
    camera.position.copy(center).add(outward.setLength(4.2 * radius));
  }

  // Turns if the object hides a point.
  turnTo(point, normal) {
    if (this.seen(point)) return;
    const { camera, controls } = this.stage;
    const view = camera.position.clone().sub(controls.target);
    const distance = view.length();
    const wanted = normal.clone().addScaledVector(view, 0.5 / distance);
    const places = [...kDirections]
      .sort((a, b) => b.dot(wanted) - a.dot(wanted))
      .map((direction) => controls.target.clone().addScaledVector(direction, distance));
    camera.position.copy(places.find((place) => this.seen(point, place)) ?? camera.position);
  }

  // Whether the object does not hide a point.
  seen(point, from = this.stage.camera.position) {
    this.ray.set(from, point.clone().sub(from).normalize());
    const hit = this.ray.intersectObject(this.object)[0];
    return !hit || hit.distance > point.distanceTo(from) - kRadius;
  }

  // Position in the window, pixels.
  pixel(point) {
    const { left, top, width, height } = this.canvas.getBoundingClientRect();
    const { x, y } = point.clone().project(this.stage.camera);
    return [left + (width * (1 + x)) / 2, top + (height * (1 - y)) / 2];
  }

  // What a position in the window shows of a mesh.
  hit([x, y], mesh) {
    const { left, top, width, height } = this.canvas.getBoundingClientRect();
    const at = new Vector2((2 * (x - left)) / width - 1, 1 - (2 * (y - top)) / height);
    this.ray.setFromCamera(at, this.stage.camera);
    return this.ray.intersectObject(mesh)[0];
  }

  // Point and normal of the object in the middle of the view, or those of the vertex nearest to it.
  middle() {
    this.ray.setFromCamera(new Vector2(), this.stage.camera);
    const hit = this.ray.intersectObject(this.object)[0];
    if (hit) return { point: hit.point, normal: hit.face.normal };
    const { position, normal } = this.object.geometry.attributes;
    const of = (attribute, vertex) => new Vector3().fromBufferAttribute(attribute, vertex);
    const away = (vertex) => this.ray.ray.distanceSqToPoint(of(position, vertex));
    let nearest = 0;
    for (let k = 0; k < position.count; ++k) if (away(k) < away(nearest)) nearest = k;
    return { point: of(position, nearest), normal: of(normal, nearest) };
  }
}
