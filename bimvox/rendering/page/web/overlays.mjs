// Temporary lines: slings, props, start and target boxes, paths of loads, outlines of the part under way and the chosen one.
import { Lines } from "./batches.mjs";
import { HOOK, ringsOf } from "./cranes.mjs";
import { wayOf } from "./motion.mjs";
import { SEEN } from "./visibility.mjs";

const MOST_EDGES = 6000;
const INK = { path: [0, 100, 190, 255], other: [0, 100, 190, 90], start: [190, 100, 0, 255], target: [196, 40, 120, 255], waiting: [196, 40, 120, 90], bad: [200, 30, 20, 255], active: [0, 45, 110, 255], chosen: [10, 10, 14, 255], rope: [60, 60, 64, 255], ring: [90, 60, 0, 255], measured: [150, 0, 120, 255], prop: [168, 20, 8, 255] };
const RING_PIECES = 96;

export class Overlays {
  /** @param scene Holds parts, shapes and rows. */
  constructor(scene) {
    this.scene = scene;
    this.made = {};
  }

  /** The batches to draw, by name. */
  get batches() {
    return Object.fromEntries(Object.entries(this.made).map(([name, { batch }]) => [name, batch]));
  }

  /** Shows the lines of a moment: slings, boxes, paths and outlines; each kind is rebuilt only when it changes. */
  show(moment, lift, motion, since) {
    if (this.looks !== this.scene.looks) this.made = this._freed();
    this.looks = this.scene.looks;
    const { plan, layers, chosen, obstruction } = moment;
    const held = this._held(plan, moment.time);
    this._overlay("slings", [held.map((own) => own.order), layers.voxels, layers.crane], (lines) => {
      if (!layers.crane) return;
      for (const own of held)
        if (own.tandem) for (const crane of own.tandem.cranes) this._addSling(lines, crane);
        else this._addSlings(lines, own.part, layers.voxels, plan.motionOf(own).crane ?? 0);
    });
    const about = [plan.revision.number, lift?.order, chosen, layers.targets, layers.boxes];
    this._overlay("boxes", about, (lines) => this._addBoxes(lines, moment, lift));
    this._overlay("paths", [plan.revision.number, lift?.order, chosen, layers.paths], (lines) => this._addPaths(lines, moment, lift));
    const standing = layers.props ? (plan.revision.props ?? []).filter((one) => one.from_s <= moment.time && (one.until_s ?? Infinity) > moment.time) : [];
    this._overlay("props", [plan.revision.number, standing.map((one) => one.part)], (lines) => {
      for (const one of standing) for (const ends of one.ends_m) lines.addPolyline(ends, 0, { rgba: INK.prop, width: 2.2 });
    });
    this._overlay("rings", [layers.rings], (lines) => {
      if (layers.rings) this._addRings(lines);
    });
    this._overlay("measured", [moment.measured], (lines) => {
      if (moment.measured) lines.addPolyline(moment.measured, 0, { rgba: INK.measured, width: 2.4 });
    });
    this._overlay("active", [lift?.part, layers.voxels], (lines) => {
      if (lift) this._addOutline(lines, lift.part, layers.voxels, { rgba: INK.active, width: 2 });
    });
    this._overlay("chosen", [plan.revision.number, chosen, layers.voxels, obstruction?.id], (lines) => {
      if (chosen !== null) this._addOutline(lines, chosen, layers.voxels, { rgba: INK.chosen, width: 2.2 });
      if (obstruction) this._addObstruction(lines, obstruction, { rgba: INK.bad, width: 2.4 });
    });
  }

  /** Frees all lines: what is seen has changed. */
  _freed() {
    for (const { batch } of Object.values(this.made)) batch.free();
    return {};
  }

  _seen(lift) {
    return this.looks[lift.part] === SEEN;
  }

  /** The lifts whose part hangs on a hook. */
  _held(plan, time) {
    const own = this.scene.cranes.map((_, n) => plan.liftOf(n, time));
    return [...new Set(own)].filter((lift) => {
      const motion = lift && plan.motionOf(lift);
      const since = lift ? time - lift.begins_s : 0;
      return motion && this._seen(lift) && motion.kind === "crane" && since >= motion.lifted_s && since < motion.assembled_s;
    });
  }

  /** Rebuilds lines if their inputs changed. */
  _overlay(name, about, fill) {
    const key = JSON.stringify(about);
    if (this.made[name]?.key === key) return;
    this.made[name]?.batch.free();
    const lines = new Lines();
    fill(lines);
    this.made[name] = { key, batch: lines.upload(this.scene.gl) };
  }

  /** A sling straight down from the hook of one of two cranes that hold a part. */
  _addSling(lines, crane) {
    const { first, record } = this.scene.cranes[crane];
    lines.add([0, 0, 0], [0, 0, -record.sling_m], first + HOOK, first + HOOK, { rgba: INK.rope, width: 1.3, metres: 0.03 });
  }

  _addSlings(lines, n, voxels, crane) {
    const part = this.scene.parts[n];
    const scale = voxels ? this.scene.site.voxel_size_m : this.scene.shapes[part.geometry].step;
    const offset = voxels ? [0, 0, 0] : part.low_m;
    const [sx, sy, sz] = part.size_m;
    for (const a of [0.1, 0.9])
      for (const b of [0.1, 0.9]) {
        const at = [a * sx, b * sy, sz].map((value, axis) => (value - offset[axis]) / scale);
        lines.add([0, 0, 0], at, this.scene.cranes[crane].first + HOOK, this.scene.partRow(n), { rgba: INK.rope, width: 1.3, metres: 0.03 });
      }
  }

  _addOutline(lines, n, voxels, style) {
    const part = this.scene.parts[n];
    const shape = this.scene.shapes[part.geometry];
    if (!voxels && shape.edges.length / 2 <= MOST_EDGES) {
      lines.addEdges(shape.points, shape.edges, this.scene.partRow(n), style);
      return;
    }
    const scale = voxels ? this.scene.site.voxel_size_m : shape.step;
    const offset = voxels ? [0, 0, 0] : part.low_m;
    const at = (point) => point.map((value, axis) => (value - offset[axis]) / scale);
    lines.addBox(at([0, 0, 0]), at(part.size_m), this.scene.partRow(n), style);
  }

  _addRings(lines) {
    const height = this.scene.slab.high[2] + 0.03;
    for (const { record } of this.scene.cranes)
      for (const { radius, capacity } of ringsOf(record)) {
        const at = (n) => {
          const angle = (2 * Math.PI * n) / RING_PIECES;
          return [record.base_m[0] + radius * Math.cos(angle), record.base_m[1] + radius * Math.sin(angle), height];
        };
        lines.addPolyline(Array.from({ length: RING_PIECES + 1 }, (_, n) => at(n)), 0, { rgba: INK.ring, width: 1.6, dash: capacity === null ? 8 : 0 });
      }
  }

  _addObstruction(lines, record, style) {
    const { boxes } = this.scene.obstructionOf(record);
    const cell = this.scene.site.voxel_size_m;
    const [low, high] = extent(boxes);
    const at = (point, grow) => point.map((value, axis) => this.scene.site.origin_m[axis] + value * cell + grow);
    if (boxes.length) lines.addBox(at(low, -0.06), at(high, 0.06), 0, style);
  }

  _addBoxes(lines, { plan, chosen, layers }, lift) {
    const grow = Math.min(0.12 * this.scene.site.voxel_size_m, 0.05);
    const box = (low, size, style) => lines.addBox(low.map((v) => v - grow), low.map((v, axis) => v + size[axis] + grow), 0, style);
    const blockers = new Set();
    for (const other of plan.lifts) {
      const part = this.scene.parts[other.part];
      const near = other === lift || other.part === chosen;
      const bad = other.status === "infeasible";
      if (!this._seen(other)) continue;
      if (bad && layers.boxes) box(part.target_m, part.size_m, { rgba: INK.bad, width: near ? 2.6 : 1.6, dash: 9 });
      else if (layers.targets && !near) box(part.target_m, part.size_m, { rgba: INK.waiting, width: 1 });
      if (!near || !layers.boxes) continue;
      if (other.start_m) box(other.start_m, other.start_size_m, { rgba: INK.start, width: 2 });
      if (!bad) box(part.target_m, part.size_m, { rgba: INK.target, width: 2 });
      if (bad && other.part === chosen) other.blocked_by.forEach((id) => blockers.add(id));
    }
    for (const record of plan.revision.obstructions)
      if (blockers.has(record.id)) this._addObstruction(lines, record, { rgba: INK.bad, width: 3 });
    this.scene.parts.forEach((part) => {
      if (blockers.has(part.id)) box(part.target_m, part.size_m, { rgba: INK.bad, width: 3 });
    });
  }

  _addPaths(lines, { plan, chosen, layers }, lift) {
    for (const other of plan.timed) {
      const near = other === lift && layers.paths !== "chosen" && layers.paths !== "none";
      const own = other.part === chosen && layers.paths !== "none";
      if (!this._seen(other) || (!near && !own && layers.paths !== "all")) continue;
      const style = near || own ? { rgba: INK.path, width: 3 } : { rgba: INK.other, width: 1.2 };
      lines.addPolyline(wayOf(plan.motionOf(other), this.scene.baseOf(plan.motionOf(other)), this.scene.parts[other.part]), 0, style);
    }
  }
}

/** The bounding box of boxes, in cells. */
export function extent(boxes) {
  const low = [Infinity, Infinity, Infinity];
  const high = [0, 0, 0];
  for (let n = 0; n < boxes.length; n += 6)
    for (let axis = 0; axis < 3; axis++) {
      low[axis] = Math.min(low[axis], boxes[n + axis]);
      high[axis] = Math.max(high[axis], boxes[n + axis + 3]);
    }
  return [low, high];
}
