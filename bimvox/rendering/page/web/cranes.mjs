// The crane: lines and boxes on joints, posed by slew, radius and height.
import { aboutZ } from "./maths.mjs";
import { SHOWN, WHOLE } from "./shaders.mjs";

const BLOCK_STEP_M = 0.002;

export const [FIXED, SLEWING, TROLLEY, HOOK, LUFFING] = [0, 1, 2, 3, 4];
export const JOINTS = 5;

/** Records of all cranes; empty on a site without. */
export function cranesOf(document) {
  return document.crane ? [document.crane, ...(document.other_cranes ?? [])] : [];
}

const MOST_RINGS = 7;

/** Rings of a crane: its least radius, up to MOST_RINGS radii of its load chart with their capacity, and its jib. */
export function ringsOf({ chart, min_radius_m: least, jib_length_m: jib }) {
  const listed = chart.radius_m.map((radius, n) => ({ radius, capacity: chart.capacity_kg[n] })).filter(({ radius }) => radius >= least && radius <= jib + 1e-6);
  const step = (jib - least) / MOST_RINGS;
  const kept = [];
  for (const ring of listed.slice().reverse()) if (!kept.length || kept.at(-1).radius - ring.radius >= step - 1e-6) kept.push(ring);
  const rings = kept.reverse();
  if (!rings.length || jib - rings.at(-1).radius > 0.05) rings.push({ radius: jib, capacity: null });
  return least > 0.05 && rings[0].radius - least > 0.05 ? [{ radius: least, capacity: null }, ...rings] : rings;
}

export class Crane {
  /**
   * @param record The crane's record.
   * @param first Row of its first joint; its boxes have the rows after the joints.
   */
  constructor(record, numbers, rows, first) {
    this.record = record;
    this.rows = rows;
    this.first = first;
    this.points = numbers(record.lines.points);
    this.joints = numbers(record.lines.joints);
    this.styles = numbers(record.lines.styles);
    for (let joint = 0; joint < JOINTS; joint++) rows.shape(first + joint, 1, [0, 0, 0]);
    record.blocks.forEach((block, n) => {
      const half = this.halfOf(block);
      rows.shape(this.rowOf(n), BLOCK_STEP_M, block.centre_m.map((value, axis) => value - half[axis]));
    });
  }

  static rowsOf(record) {
    return JOINTS + record.blocks.length;
  }

  /** At slewing angle 0 the boxes are aligned with the jib, so that their half edges lie along the axes. */
  halfOf(block) {
    return [0, 1, 2].map((axis) => Math.abs(block.half_m[0][axis]) + Math.abs(block.half_m[1][axis]) + Math.abs(block.half_m[2][axis]));
  }

  rowOf(block) {
    return this.first + JOINTS + block;
  }

  addTo(solids, lines) {
    this.record.blocks.forEach((block, n) => {
      const top = this.halfOf(block).map((value) => Math.round((2 * value) / BLOCK_STEP_M));
      solids.addBoxes(this.rowOf(n), new Uint16Array([0, 0, 0, ...top]));
    });
    for (let n = 0; n < this.joints.length; n += 2) {
      const [red, green, blue, width, metres] = this.styles.subarray((n / 2) * 5, (n / 2) * 5 + 5);
      const point = (at) => this.points.subarray(at * 3, at * 3 + 3);
      const rgba = [red * 0.82, green * 0.82, blue * 0.82, 255].map(Math.round);
      lines.add(point(n), point(n + 1), this.first + this.joints[n], this.first + this.joints[n + 1], { rgba, width, metres });
    }
  }

  pose([slew, radius, height], shown) {
    const [x, y] = this.record.base_m;
    const out = [x + radius * Math.cos(slew), y + radius * Math.sin(slew)];
    const turn = aboutZ(slew);
    const { pivot, raised } = this.jibAt(slew, radius, turn);
    const places = [[0, 0, 0], [x, y, 0], [...out, 0], [...out, height], pivot];
    const flags = WHOLE | (shown ? SHOWN : 0);
    const set = (row, joint, rgb) => {
      this.rows.place(row, places[joint], joint === FIXED ? [0, 0, 0, 1] : joint === LUFFING ? raised : turn);
      this.rows.look(row, rgb, flags);
    };
    for (let joint = 0; joint < JOINTS; joint++) set(this.first + joint, joint, [0, 0, 0]);
    this.record.blocks.forEach((block, n) => set(this.rowOf(n), block.joint, block.rgb));
  }

  /** The ends of jib and counter-jib. */
  ends([slew, radius]) {
    const { base_m, jib_height_m, jib_length_m, luffing, blocks } = this.record;
    const [x, y] = base_m;
    const at = (along, height) => [x + along * Math.cos(slew), y + along * Math.sin(slew), height];
    let tail = Math.min(0, ...blocks.filter((block) => block.joint === SLEWING).map((block) => block.centre_m[0]));
    for (let n = 0; n < this.joints.length; n++) if (this.joints[n] === SLEWING) tail = Math.min(tail, this.points[3 * n]);
    if (!luffing) return [at(jib_length_m, jib_height_m), at(tail, jib_height_m)];
    const rise = Math.sqrt(Math.max(0, luffing.length_m ** 2 - (radius - luffing.pivot_offset_m) ** 2));
    return [at(radius, luffing.pivot_height_m + rise), at(tail, luffing.pivot_height_m)];
  }

  /** Pivot and attitude of a luffing jib: slewing after luffing, about -y by the luff angle. */
  jibAt(slew, radius, turn) {
    const jib = this.record.luffing;
    if (!jib) return { pivot: [0, 0, 0], raised: turn };
    const [x, y] = this.record.base_m;
    const share = Math.min(1, Math.max(-1, (radius - jib.pivot_offset_m) / jib.length_m));
    const [sine, cosine] = [-Math.sin(Math.acos(share) / 2), Math.cos(Math.acos(share) / 2)];
    const [, , z, w] = turn;
    return {
      pivot: [x + jib.pivot_offset_m * Math.cos(slew), y + jib.pivot_offset_m * Math.sin(slew), jib.pivot_height_m],
      raised: [-z * sine, w * sine, z * cosine, w * cosine],
    };
  }

  /** The pose of the idle crane if no lift is timed. */
  get parked() {
    return [0, this.record.jib_length_m / 2, this.record.jib_height_m * (this.record.luffing ? 0.5 : 0.8)];
  }
}
