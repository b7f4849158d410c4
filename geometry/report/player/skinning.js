// SPDX-License-Identifier: MIT
// The body's surface in one frame: pose correctives, then linear blend skinning, as
// geometry/body_model.h has it.

const kJoints = 55;

export class Skin {
  constructor(arrays) {
    this.arrays = arrays;
    this.numVertices = arrays.rest.length / 3;
    this.frame = -1;
    this.posed = new Float32Array(arrays.rest.length);
    this.positions = new Float32Array(arrays.rest.length);
    this.normals = new Float32Array(arrays.rest.length);
    this.matrices = new Float64Array(12 * kJoints);
  }

  // Fills positions and normals.
  pose(frame) {
    if (frame === this.frame) return;
    this.frame = frame;
    this.correct(frame);
    this.loadMatrices(frame);
    this.blend();
    this.computeNormals();
  }

  // v_p = rest + sum_k c_k d_k
  correct(frame) {
    const { rest, directions, direction_scale: scale, coefficients } = this.arrays;
    const posed = this.posed;
    const size = rest.length;
    posed.set(rest);
    for (let k = 0; k < scale.length; ++k) {
      const weight = coefficients[frame * scale.length + k] * scale[k];
      if (weight === 0) continue;
      const begin = k * size;
      for (let i = 0; i < size; ++i) posed[i] += weight * directions[begin + i];
    }
  }

  loadMatrices(frame) {
    const { joint_rotation: q, joint_offset: t } = this.arrays;
    for (let j = 0; j < kJoints; ++j) {
      const m = 12 * j;
      quaternionToRows(q, 4 * (frame * kJoints + j), this.matrices, m);
      const from = 3 * (frame * kJoints + j);
      for (let r = 0; r < 3; ++r) this.matrices[m + 4 * r + 3] = t[from + r];
    }
  }

  // v = sum_j w_j (R_j v_p + t_j)
  blend() {
    const { weight_count: counts, weight_joint: joints, weight_value: values } = this.arrays;
    const { posed, positions, matrices } = this;
    for (let i = 0, w = 0; i < this.numVertices; ++i) {
      const x = posed[3 * i];
      const y = posed[3 * i + 1];
      const z = posed[3 * i + 2];
      let sx = 0;
      let sy = 0;
      let sz = 0;
      for (const end = w + counts[i]; w < end; ++w) {
        const m = 12 * joints[w];
        const weight = values[w];
        sx += weight * (matrices[m] * x + matrices[m + 1] * y + matrices[m + 2] * z + matrices[m + 3]);
        sy += weight * (matrices[m + 4] * x + matrices[m + 5] * y + matrices[m + 6] * z + matrices[m + 7]);
        sz += weight * (matrices[m + 8] * x + matrices[m + 9] * y + matrices[m + 10] * z + matrices[m + 11]);
      }
      positions[3 * i] = sx;
      positions[3 * i + 1] = sy;
      positions[3 * i + 2] = sz;
    }
  }

  // Faces' normals weighted by area.
  computeNormals() {
    const { positions: p, normals: n } = this;
    const faces = this.arrays.faces;
    n.fill(0);
    for (let f = 0; f < faces.length; f += 3) {
      const a = 3 * faces[f];
      const b = 3 * faces[f + 1];
      const c = 3 * faces[f + 2];
      const ux = p[b] - p[a];
      const uy = p[b + 1] - p[a + 1];
      const uz = p[b + 2] - p[a + 2];
      const vx = p[c] - p[a];
      const vy = p[c + 1] - p[a + 1];
      const vz = p[c + 2] - p[a + 2];
      const x = uy * vz - uz * vy;
      const y = uz * vx - ux * vz;
      const z = ux * vy - uy * vx;
      for (const i of [a, b, c]) {
        n[i] += x;
        n[i + 1] += y;
        n[i + 2] += z;
      }
    }
    for (let i = 0; i < n.length; i += 3) {
      const length = Math.hypot(n[i], n[i + 1], n[i + 2]) || 1;
      n[i] /= length;
      n[i + 1] /= length;
      n[i + 2] /= length;
    }
  }

  // World position of a joint, without posing the surface.
  joint(frame, j) {
    const { joint_rotation: q, joint_offset: t, joint_rest: rest } = this.arrays;
    const m = new Float64Array(12);
    quaternionToRows(q, 4 * (frame * kJoints + j), m, 0);
    const from = 3 * (frame * kJoints + j);
    return [0, 1, 2].map(
      (r) =>
        m[4 * r] * rest[3 * j] +
        m[4 * r + 1] * rest[3 * j + 1] +
        m[4 * r + 2] * rest[3 * j + 2] +
        t[from + r],
    );
  }

  // Where the body faces, on the ground: the pelvis's +z of the rest pose.
  heading(frame) {
    const m = new Float64Array(12);
    quaternionToRows(this.arrays.joint_rotation, 4 * frame * kJoints, m, 0);
    const length = Math.hypot(m[2], m[6]);
    return length > 1e-3 ? [m[2] / length, m[6] / length] : [0, -1];
  }
}

// Rotation of a unit quaternion (x y z w) into the left 3 x 3 of a row-major 3 x 4.
function quaternionToRows(q, at, out, m) {
  const x = q[at];
  const y = q[at + 1];
  const z = q[at + 2];
  const w = q[at + 3];
  out[m] = 1 - 2 * (y * y + z * z);
  out[m + 1] = 2 * (x * y - z * w);
  out[m + 2] = 2 * (x * z + y * w);
  out[m + 4] = 2 * (x * y + z * w);
  out[m + 5] = 1 - 2 * (x * x + z * z);
  out[m + 6] = 2 * (y * z - x * w);
  out[m + 8] = 2 * (x * z - y * w);
  out[m + 9] = 2 * (y * z + x * w);
  out[m + 10] = 1 - 2 * (x * x + y * y);
}
