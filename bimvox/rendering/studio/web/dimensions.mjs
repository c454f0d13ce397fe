// What is measured while something is dragged.
import { areaOf, distance, edgesOf, nearestOfAll } from "./geometry.mjs";
import { polygonOf } from "./setup.mjs";

const length = (value) => `${value.toFixed(2)} m`;

/**
 * Dimensions of a handle: [{from, to, text}] in metres. A crane: to the building and to each yard; a corner: both sides; an area: its sides.
 * @param buildingEdges Segments of the building's outline.
 */
export function dimensionsOf(setup, id, buildingEdges) {
  const [what, n, corner] = id.split("/");
  if (what === "cranes") {
    const base = setup.cranes[Number(n)].base_m;
    const near = [nearestOfAll(buildingEdges, base), ...setup.yard.map((polygon) => nearestOfAll(edgesOf(polygon), base))];
    return near.filter((to) => to && distance(base, to) > 0.005).map((to) => ({ from: base, to, text: length(distance(base, to)) }));
  }
  const polygon = polygonOf(setup, id);
  const count = polygon.length;
  const sides = corner === undefined ? polygon.map((_, m) => m) : [(Number(corner) + count - 1) % count, Number(corner)];
  return sides.map((m) => ({ from: polygon[m], to: polygon[(m + 1) % count], text: length(distance(polygon[m], polygon[(m + 1) % count])) }));
}

/** An area in words: `88.0 m²`. */
export const areaWords = (polygon) => `${areaOf(polygon).toFixed(1)} m²`;
