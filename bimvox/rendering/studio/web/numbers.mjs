// Typed numbers, read and written.
import { fromMap, toMap } from "./geometry.mjs";
import { tidy } from "./snap.mjs";

/** A typed number; a comma counts as the decimal sign. Null if it is not a number. */
export function numberOf(text) {
  const clean = text.trim().replace(/^(-?\d+),(\d+)$/, "$1.$2").replace(/\s*m$/, "");
  return /^[-+]?(\d+\.?\d*|\.\d+)$/.test(clean) ? Number(clean) : null;
}

/** A coordinate as it is typed: at most millimetres, without needless zeros. */
export const written = (value) => String(tidy(value));

/** The two numbers that are shown for a point: site metres, or map coordinates if there is a map and it is asked for. */
export const shownPair = (at, map) => (map ? toMap(at, map) : at).map(tidy);

/** The point of two typed numbers, in the same coordinates. */
export const pointOf = (pair, map) => (map ? fromMap(pair, map) : pair).map(tidy);

/** The names of the two coordinates. */
export const axisNames = (map) => (map ? ["E", "N"] : ["x", "y"]);
