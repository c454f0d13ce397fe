// Vectors [x, y, z], quaternions [x, y, z, w] and 4x4 matrices (column by column), as WebGL needs them.

export const add = (a, b) => [a[0] + b[0], a[1] + b[1], a[2] + b[2]];
export const sub = (a, b) => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
export const times = (a, s) => [a[0] * s, a[1] * s, a[2] * s];
export const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
export const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
export const lengthOf = (a) => Math.hypot(a[0], a[1], a[2]);
export const unit = (a) => times(a, 1 / (lengthOf(a) || 1));
export const mix = (a, b, s) => a + (b - a) * s;
export const clamp = (value, low, high) => Math.min(Math.max(value, low), high);

/** Rotates a vector by a unit quaternion. */
export function turned([x, y, z, w], v) {
  const u = [x, y, z];
  const t = times(cross(u, v), 2);
  return add(add(v, times(t, w)), cross(u, t));
}

/** The quaternion of a rotation about +z. */
export const aboutZ = (angle) => [0, 0, Math.sin(angle / 2), Math.cos(angle / 2)];

export function multiplied(a, b) {
  const out = new Float32Array(16);
  for (let column = 0; column < 4; column++)
    for (let row = 0; row < 4; row++) {
      let sum = 0;
      for (let n = 0; n < 4; n++) sum += a[n * 4 + row] * b[column * 4 + n];
      out[column * 4 + row] = sum;
    }
  return out;
}

export function perspective(fovY, aspect, near, far) {
  const f = 1 / Math.tan(fovY / 2);
  const depth = near - far;
  return new Float32Array([f / aspect, 0, 0, 0, 0, f, 0, 0, 0, 0, (far + near) / depth, -1, 0, 0, (2 * far * near) / depth, 0]);
}

export function orthographic(half, near, far) {
  const depth = near - far;
  return new Float32Array([1 / half, 0, 0, 0, 0, 1 / half, 0, 0, 0, 0, 2 / depth, 0, 0, 0, (far + near) / depth, 1]);
}

export function lookAt(eye, target, up) {
  const back = unit(sub(eye, target));
  const right = unit(cross(up, back));
  const above = cross(back, right);
  return new Float32Array([
    right[0], above[0], back[0], 0,
    right[1], above[1], back[1], 0,
    right[2], above[2], back[2], 0,
    -dot(right, eye), -dot(above, eye), -dot(back, eye), 1,
  ]); // prettier-ignore
}
