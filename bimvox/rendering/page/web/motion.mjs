// Crane and load at a time: linear interpolation between keyframes, in the crane's axes.
import { columnsOf } from "./container.mjs";
import { mix } from "./maths.mjs";

/** Decodes a motion's keyframes. Times are seconds from the lift's start. */
export function motionOf(record, numbers, scales) {
  const axis = record.kind === "crane" ? scales.angle : scales.length;
  const [time, ...axes] = columnsOf(numbers(record.keys), [scales.time, axis, scales.length, scales.length]);
  let tip = null;
  if (record.tip) {
    const columns = columnsOf(numbers(record.tip.keys), [scales.time, scales.length, scales.angle, ...(record.tip.two_hooks ? [scales.length] : [])]);
    tip = { ...record.tip, time: columns[0], columns: columns.slice(1) };
  }
  let second = null;
  if (record.second) {
    const [at, ...own] = columnsOf(numbers(record.second.keys), [scales.time, axis, scales.length, scales.length]);
    second = { ...record.second, kind: record.kind, time: at, axes: own };
  }
  return { ...record, time, axes, tip, second };
}

/** Values of columns at a time, interpolated between keyframes, constant before the first and after the last. */
export function valuesAt(time, columns, at) {
  let low = 0;
  let high = time.length - 1;
  if (at <= time[0]) return columns.map((column) => column[0]);
  if (at >= time[high]) return columns.map((column) => column[high]);
  while (high - low > 1) {
    const middle = (low + high) >> 1;
    if (time[middle] <= at) low = middle;
    else high = middle;
  }
  const share = (at - time[low]) / (time[high] - time[low]);
  return columns.map((column) => mix(column[low], column[high], share));
}

/** Slew, radius and height of the crane at a time within a lift. */
export const axesAt = (motion, at) => valuesAt(motion.time, motion.axes, at);

/** The position of the hook. */
export function hookOf(baseM, [slew, radius, height]) {
  return [baseM[0] + radius * Math.cos(slew), baseM[1] + radius * Math.sin(slew), height];
}

/** The rotation of a part stored lying, from its angle to upright. */
export function tiltOf(stored, angle) {
  const sine = Math.sin(angle / 2);
  const cosine = Math.cos(angle / 2);
  if (stored === "lying_x") return [0, sine, 0, cosine];
  if (stored === "lying_y") return [-sine, 0, 0, cosine];
  return [0, 0, 0, 1];
}

/** The frame of a part that was turned about z, then tipped: `offset` leads from its box's lowest corner to its own. */
function tipped(box, offset, stored, angle, yaw) {
  const [x, y] = offset;
  const cosine = Math.cos(angle);
  const sine = Math.sin(angle);
  const along = stored === "lying_x" ? [x * cosine, y, -x * sine] : [x, y * cosine, -y * sine];
  const [a, b, , w] = tiltOf(stored, angle);
  const c = Math.cos(yaw / 2);
  const s = Math.sin(yaw / 2);
  return { corner: box.map((value, n) => value + along[n]), tilt: [a * c + b * s, b * c - a * s, w * s, w * c] };
}

/** The frame of a hanging load: lowest corner of its reference cell, and its rotation. */
export function loadAt(motion, baseM, stored, at) {
  if (motion.tip && at < motion.tip.end_s) {
    const [z, angle, along = 0] = valuesAt(motion.tip.time, motion.tip.columns, at);
    const box = [motion.tip.corner_m[0], motion.tip.corner_m[1], z];
    box[stored === "lying_x" ? 0 : 1] += along;
    return tipped(box, motion.tip.offset_m, stored, angle, motion.yaw ? motion.yaw.rad : 0);
  }
  const values = axesAt(motion, at);
  if (motion.kind === "carried") return { corner: values, tilt: [0, 0, 0, 1] };
  const hook = hookOf(baseM, values);
  const angle = yawOf(motion, at, values[0]);
  const below = yawed(motion.below_m, angle);
  const guided = motion.guide && guidedAt(motion.guide, hook, below);
  if (guided) return guided;
  return { corner: hook.map((value, n) => value + below[n]), tilt: yawTilt(angle) };
}

const IN_LINE_M = 0.01;

/** The frame of a load that a crew tilts and holds aside above its place; null elsewhere. */
function guidedAt(guide, hook, below) {
  const height = hook[2] - guide.hook_m[2];
  const away = Math.max(Math.abs(hook[0] - guide.hook_m[0]), Math.abs(hook[1] - guide.hook_m[1]));
  if (away > IN_LINE_M || height >= guide.height_m[guide.height_m.length - 1]) return null;
  const [aside, tilt] = valuesAt(guide.height_m, [guide.aside_m, guide.tilt_rad], height);
  const [x, y] = guide.ahead;
  const arm = guide.hook_m.map((value, n) => value + below[n] - guide.centre_m[n]);
  // The tilt turns what is ahead upward; what is across stays.
  const ahead = arm[0] * x + arm[1] * y;
  const turned = ahead * Math.cos(tilt) - arm[2] * Math.sin(tilt) + aside;
  const up = ahead * Math.sin(tilt) + arm[2] * Math.cos(tilt) + height;
  const moved = [arm[0] + (turned - ahead) * x, arm[1] + (turned - ahead) * y, up];
  const sine = Math.sin(tilt / 2);
  return { corner: moved.map((value, n) => value + guide.centre_m[n]), tilt: [y * sine, -x * sine, 0, Math.cos(tilt / 2)] };
}

/**
 * The angle about z of a hanging part that was stored turned, or turns with the jib: the rest goes to 0 at a constant
 * rate while it is turned to its final heading.
 */
function yawOf(motion, at, slew) {
  const jib = motion.with_jib;
  if (jib && at >= jib.from_s) {
    return jib.turn && at >= jib.turn.start_s ? restOf(jib.turn, at) : slew - jib.slew_rad;
  }
  return motion.yaw ? restOf(motion.yaw, at) : 0;
}

function restOf(turn, at) {
  if (at >= turn.end_s) return 0;
  return at <= turn.start_s ? turn.rad : (turn.rad * (turn.end_s - at)) / (turn.end_s - turn.start_s);
}

const yawTilt = (angle) => [0, 0, Math.sin(angle / 2), Math.cos(angle / 2)];

function yawed([x, y, z], angle) {
  const cosine = Math.cos(angle);
  const sine = Math.sin(angle);
  return [cosine * x - sine * y, sine * x + cosine * y, z];
}

/** The frame of a part in the yard. */
export function storedAt(lift, part) {
  const [x, y] = lift.turn % 2 ? [part.size_m[1], part.size_m[0]] : part.size_m;
  const offset = [lift.turn === 1 || lift.turn === 2 ? x : 0, lift.turn > 1 ? y : 0];
  const yaw = (lift.turn * Math.PI) / 2;
  const corner = lift.start_m.slice();
  if (lift.stored === "as_built") {
    return { corner: [corner[0] + offset[0], corner[1] + offset[1], corner[2]], tilt: yawTilt(yaw) };
  }
  corner[2] += lift.stored === "lying_x" ? x : y;
  return tipped(corner, offset, lift.stored, Math.PI / 2, yaw);
}

/** Points on the path of a part's centre from pick to set, dense enough for a smooth line. */
export function wayOf(motion, baseM, part) {
  const middle = part.size_m.map((size) => size / 2);
  const points = [];
  const from = motion.tip ? motion.tip.end_s : motion.lifted_s;
  const add = (at) => points.push(loadAt(motion, baseM, "as_built", at).corner.map((value, n) => value + middle[n]));
  for (let n = 0; n < motion.time.length; n++) {
    const at = motion.time[n];
    if (at < from || at > motion.arrived_s + 1e-6) continue;
    if (motion.kind === "crane" && n > 0 && motion.time[n - 1] >= from) {
      const pieces = Math.ceil(Math.abs(motion.axes[0][n] - motion.axes[0][n - 1]) / 0.05);
      for (let piece = 1; piece < pieces; piece++) add(mix(motion.time[n - 1], at, piece / pieces));
    }
    add(at);
  }
  return points;
}
