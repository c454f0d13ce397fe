// The crane's own cameras: from the trolley or the jib's tip down the hook, and from the cab to the hook.
import { hookOf } from "./motion.mjs";
import { lengthOf, sub } from "./maths.mjs";

const BELOW_M = 1;
const BACK_M = 0.8;
const AHEAD_M = 2.5;
const ASIDE_M = 1.5;
const CAB_BELOW_M = 2;
const MOBILE_CAB_M = 3;
const DEG = 180 / Math.PI;

export const SEATS = ["trolley", "cab"];

/**
 * The view from a crane's seat, for a camera.
 * @param crane {record, ends: of jib and counter-jib for a pose}
 * @param pose Slew, radius and height of the hook.
 * @param groundM Height of the ground.
 */
export function seatOf(crane, pose, groundM, seat) {
  const [slew, radius, height] = pose;
  const { record } = crane;
  const [x, y, z] = record.base_m;
  const [ahead, aside] = [[Math.cos(slew), Math.sin(slew)], [Math.sin(slew), -Math.cos(slew)]];
  if (seat === "trolley") {
    const exit = record.luffing ? crane.ends(pose)[0][2] : record.jib_height_m;
    const at = hookOf(record.base_m, [slew, Math.max(radius - BACK_M, 0), 0]);
    return { target: [at[0], at[1], groundM], distance: Math.max(exit - BELOW_M - groundM, 1), azimuth: slew * DEG + 180, elevation: 89.9 };
  }
  const out = record.mast_size_m / 2 + AHEAD_M;
  const top = record.kind === "mobile" ? z + MOBILE_CAB_M : (record.luffing?.pivot_height_m ?? record.jib_height_m) - CAB_BELOW_M;
  const eye = [x + out * ahead[0] + ASIDE_M * aside[0], y + out * ahead[1] + ASIDE_M * aside[1], top];
  const target = hookOf(record.base_m, [slew, radius, height]);
  const back = sub(eye, target);
  const distance = Math.max(lengthOf(back), 1);
  return { target, distance, azimuth: Math.atan2(back[1], back[0]) * DEG, elevation: Math.asin(back[2] / distance) * DEG };
}
