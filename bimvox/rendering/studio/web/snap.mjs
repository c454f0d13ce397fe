// Where a dragged point comes to lie.
import { distance, nearestOfAll } from "./geometry.mjs";

export const GRID_M = 0.5;
export const STEP_M = 0.5;
export const FINE_M = 0.1;

/** A length without the digits that nobody sets out: whole millimetres. */
export const tidy = (value) => {
  const whole = Math.round(value * 1000) / 1000;
  return whole === 0 ? 0 : whole;
};

/**
 * The place for a dragged point: on a part's corner or edge within reach, otherwise on the grid; `off`: as dragged.
 * @param edges Segments of the parts near the point.
 * @param reach How far an edge pulls, in metres.
 * @returns {at, on}; on: "corner", "edge", "grid" or null.
 */
export function snapped(at, edges, reach, off = false) {
  if (off) return { at: at.map(tidy), on: null };
  const corners = edges.flat();
  let [best, least] = [null, reach];
  for (const corner of corners) {
    const far = distance(corner, at);
    if (far <= least) [best, least] = [corner, far];
  }
  if (best) return { at: best.map(tidy), on: "corner" };
  const edge = nearestOfAll(edges, at);
  if (edge && distance(edge, at) <= reach) return { at: edge.map(tidy), on: "edge" };
  return { at: at.map((value) => tidy(Math.round(value / GRID_M) * GRID_M)), on: "grid" };
}

/** A step by an arrow key: [x, y] in metres; null for another key. */
export function stepOf(key, fine) {
  const step = fine ? FINE_M : STEP_M;
  return { ArrowLeft: [-step, 0], ArrowRight: [step, 0], ArrowUp: [0, step], ArrowDown: [0, -step] }[key] ?? null;
}
