// The camera: it orbits a point, pans, zooms, and animates between views.
import { add, clamp, cross, lookAt, mix, multiplied, perspective, sub, times, unit } from "./maths.mjs";

const FOV = (32 * Math.PI) / 180;
const GLIDE_MS = 350;
const LOWEST = -5;
const HIGHEST = 89.9;

export class Camera {
  constructor(still) {
    this.still = still;
    this.azimuth = 300;
    this.elevation = 28;
    this.target = [0, 0, 0];
    this.distance = 50;
    this.aspect = 1.6;
    this.glide = null;
  }

  get direction() {
    const a = (this.azimuth * Math.PI) / 180;
    const e = (this.elevation * Math.PI) / 180;
    return [Math.cos(e) * Math.cos(a), Math.cos(e) * Math.sin(a), Math.sin(e)];
  }

  get eye() {
    return add(this.target, times(this.direction, this.distance));
  }

  get focal() {
    return 1 / Math.tan(FOV / 2);
  }

  /** The matrix from the site's frame to clip space. */
  matrix(radius) {
    const near = Math.max(0.02 * this.distance, 0.2);
    const far = this.distance + 4 * radius + 50;
    return multiplied(perspective(FOV, this.aspect, near, far), lookAt(this.eye, this.target, [0, 0, 1]));
  }

  orbit(dx, dy) {
    this.glide = null;
    this.azimuth -= dx * 0.35;
    this.elevation = clamp(this.elevation + dy * 0.3, LOWEST, HIGHEST);
  }

  /** @param dx, dy As shares of the view's height. */
  pan(dx, dy) {
    this.glide = null;
    const back = this.direction;
    const right = unit(cross([0, 0, 1], back));
    const up = cross(back, right);
    const scale = (2 * this.distance) / this.focal;
    this.target = add(this.target, add(times(right, -dx * scale), times(up, dy * scale)));
  }

  /** @param x, y Point to zoom in on, -1..1 each. */
  zoom(factor, x = 0, y = 0) {
    this.glide = null;
    const before = this.distance;
    this.distance = clamp(this.distance * factor, 1, 5000);
    const moved = before - this.distance;
    const back = this.direction;
    const right = unit(cross([0, 0, 1], back));
    const up = cross(back, right);
    const shift = add(times(right, (x * this.aspect * moved) / this.focal), times(up, (y * moved) / this.focal));
    this.target = add(this.target, shift);
  }

  /** Animates to a view; jumps if the user prefers reduced motion. */
  go(view, now) {
    const to = { azimuth: this.azimuth, elevation: this.elevation, target: this.target, distance: this.distance, ...view };
    const turn = ((((to.azimuth - this.azimuth) % 360) + 540) % 360) - 180;
    to.azimuth = this.azimuth + turn;
    if (this.still) Object.assign(this, to, { glide: null });
    else {
      const from = { azimuth: this.azimuth, elevation: this.elevation, target: this.target, distance: this.distance };
      this.glide = { from, to, start: now };
    }
  }

  /** Advances the animation; returns whether it is still running. */
  step(now) {
    if (!this.glide) return false;
    const { from, to, start } = this.glide;
    const share = clamp((now - start) / GLIDE_MS, 0, 1);
    const eased = share * share * (3 - 2 * share);
    this.azimuth = mix(from.azimuth, to.azimuth, eased);
    this.elevation = mix(from.elevation, to.elevation, eased);
    this.distance = mix(from.distance, to.distance, eased);
    this.target = from.target.map((value, n) => mix(value, to.target[n], eased));
    if (share === 1) this.glide = null;
    return true;
  }

  /** The target and distance at which a box is fully visible, from a direction. */
  fitting(low, high, azimuth, elevation) {
    const probe = new Camera(true);
    Object.assign(probe, { azimuth, elevation, aspect: this.aspect });
    const back = probe.direction;
    const right = unit(cross([0, 0, 1], back));
    const up = cross(back, right);
    const middle = times(add(low, high), 0.5);
    let distance = 0;
    for (let n = 0; n < 8; n++) {
      const corner = sub([n & 1 ? high[0] : low[0], n & 2 ? high[1] : low[1], n & 4 ? high[2] : low[2]], middle);
      const across = (axis, extent) => Math.abs(corner[0] * axis[0] + corner[1] * axis[1] + corner[2] * axis[2]) * extent;
      const nearer = corner[0] * back[0] + corner[1] * back[1] + corner[2] * back[2];
      distance = Math.max(distance, nearer + across(right, probe.focal / this.aspect), nearer + across(up, probe.focal));
    }
    return { azimuth, elevation, target: middle, distance: distance * 1.04 };
  }
}
