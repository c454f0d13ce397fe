// A set-up: cranes, yard, construction area, zones and means; and the handles by which people move them. Every change makes a new set-up.
import { centreOf, boundsOf } from "./geometry.mjs";
import { tidy } from "./snap.mjs";

export const ZONE_KINDS = {
  prohibited: "no hook over it",
  no_load: "no load over it",
  public: "public: neither hook nor load over it",
  slow: "slow crane over it",
  limiter: "hook height limited over it",
  assembly: "built together",
};
export const MEANS = { crane: "lifted by the crane", in_situ: "cast in place", built: "built in place", by_hand: "set by hand", pinned: "stays where it is" };
export const CHOICES = ["crane", "in_situ", "built", "by_hand"];

/** All areas: {id, what, name, polygon}; the ids are `yard/0`, `access/0`, `zones/1`, `construction/0`. */
export function areasOf(setup) {
  const numbered = (what, name) => (setup[what] ?? []).map((polygon, n, all) => ({ id: `${what}/${n}`, what, name: all.length > 1 ? `${name} ${n + 1}` : name, polygon }));
  const areas = [...numbered("yard", "Yard"), ...numbered("access", "Access of trucks")];
  (setup.boxes ?? []).forEach((box, n) => areas.push({ id: `boxes/${n}`, what: "boxes", name: box.id, polygon: cornersOf(box) }));
  if (setup.construction?.length) areas.push({ id: "construction/0", what: "construction", name: "Construction area", polygon: setup.construction });
  setup.zones.forEach((zone, n) => areas.push({ id: `zones/${n}`, what: "zones", kind: zone.kind, name: zone.name ? `Zone ${zone.name}` : `Zone ${n + 1}`, polygon: zone.polygon }));
  return areas;
}

/** The corners of an obstruction {id, min, max} on plan, counter-clockwise from the lowest. */
export const cornersOf = ({ min, max }) => [[min[0], min[1]], [max[0], min[1]], [max[0], max[1]], [min[0], max[1]]]; // prettier-ignore

/** The set-up without what is not in the site file: obstructions have a file of their own. */
export const saved = ({ boxes, ...rest }) => rest;

/** The name of a crane for people. */
export const craneName = (crane, n, several) => crane.name || (several ? `Crane ${n + 1}` : "Crane");

/**
 * All handles, in the order of the Tab key: cranes, then each area and its corners.
 * @returns {id, kind, label, at}; kind: "crane", "area" or "corner"; an area's handle is at its centre and moves its corners together.
 */
export function handlesOf(setup) {
  const several = setup.cranes.length > 1;
  const handles = setup.cranes.map((crane, n) => ({ id: `cranes/${n}`, kind: "crane", label: craneName(crane, n, several), at: crane.base_m }));
  for (const { id, what, name, polygon } of areasOf(setup)) {
    handles.push({ id, kind: "area", what, label: name, at: centreOf(polygon) });
    polygon.forEach((at, n) => handles.push({ id: `${id}/${n}`, kind: "corner", what, label: `${name}, corner ${n + 1}`, at }));
  }
  return handles;
}

export const handleOf = (setup, id) => handlesOf(setup).find((handle) => handle.id === id) ?? null;

const replaced = (list, n, value) => list.map((old, m) => (m === n ? value : old));

/** The set-up with another polygon for an area. */
export function withPolygon(setup, id, polygon) {
  const [what, n] = parsed(id);
  if (what === "yard" || what === "access") return { ...setup, [what]: replaced(setup[what], n, polygon) };
  if (what === "construction") return { ...setup, construction: polygon };
  if (what === "boxes") {
    const [x0, y0, x1, y1] = boundsOf(polygon);
    const { min, max } = setup.boxes[n];
    return withBox(setup, n, { min: [x0, y0, min[2]], max: [x1, y1, max[2]] });
  }
  return { ...setup, zones: replaced(setup.zones, n, { ...setup.zones[n], polygon }) };
}

export const polygonOf = (setup, id) => {
  const [what, n] = parsed(id);
  return what === "zones" ? setup.zones[n].polygon : what === "construction" ? setup.construction : what === "boxes" ? cornersOf(setup.boxes[n]) : setup[what][n];
};

/** The set-up with a handle moved by [x, y] metres. */
export function moved(setup, id, [dx, dy]) {
  const [what, n, corner] = parsed(id);
  const shift = ([x, y]) => [tidy(x + dx), tidy(y + dy)];
  if (what === "cranes") return withCrane(setup, n, { base_m: shift(setup.cranes[n].base_m) });
  const polygon = polygonOf(setup, id);
  if (what === "boxes" && corner !== undefined) return withBoxCorner(setup, n, corner, shift(polygon[corner]));
  return withPolygon(setup, id, corner === undefined ? polygon.map(shift) : replaced(polygon, corner, shift(polygon[corner])));
}

/** The point of a handle that comes to lie on the grid: an area's first corner stands for all. */
export function anchorOf(setup, id) {
  const [what, n, corner] = parsed(id);
  return what === "cranes" ? setup.cranes[n].base_m : polygonOf(setup, id)[corner ?? 0];
}

export const withCrane = (setup, n, values) => ({ ...setup, cranes: replaced(setup.cranes, n, { ...setup.cranes[n], ...values }) });

/** The set-up with another crane of a machine at a place. Each of several cranes has a name of its own. */
export function withNewCrane(setup, machine, at) {
  const named = setup.cranes.map((crane, n) => (crane.name || setup.cranes.length > 1 ? crane : { ...crane, name: `Crane ${n + 1}` }));
  let number = named.length + 1;
  while (named.some(({ name }) => name === `Crane ${number}`)) number += 1;
  return { ...setup, cranes: [...named, { name: `Crane ${number}`, machine, base_m: at.map((value) => Math.round(value * 2) / 2), height_m: null, jib_m: null, falls: null }] };
}

/** The set-up without a crane; the last one stays. */
export const withoutCrane = (setup, n) => (setup.cranes.length > 1 ? { ...setup, cranes: setup.cranes.filter((_, m) => m !== n) } : setup);

/** Where another crane stands at first: across the building from the last one. */
export function acrossOf([x, y], outline) {
  const box = boundsOf(outline.flat());
  return box ? [box[0] + box[2] - x, box[1] + box[3] - y] : [x + 10, y];
}

export const withZone = (setup, n, values) => ({ ...setup, zones: replaced(setup.zones, n, { ...setup.zones[n], ...values }) });

export const withBox = (setup, n, values) => ({ ...setup, boxes: replaced(setup.boxes, n, { ...setup.boxes[n], ...values }) });

/** The set-up with a corner of an obstruction at a place; the opposite corner stays, and the sides keep 0.1 m. */
function withBoxCorner(setup, n, corner, [x, y]) {
  const { min, max } = setup.boxes[n];
  const [low, high] = [[...min], [...max]];
  if (corner === 0 || corner === 3) low[0] = Math.min(x, tidy(max[0] - 0.1));
  else high[0] = Math.max(x, tidy(min[0] + 0.1));
  if (corner < 2) low[1] = Math.min(y, tidy(max[1] - 0.1));
  else high[1] = Math.max(y, tidy(min[1] + 0.1));
  return withBox(setup, n, { min: low, max: high });
}

/** The set-up with another obstruction about a place, as large as a truck. */
export function withObstruction(setup, [x, y]) {
  const boxes = setup.boxes ?? [];
  let number = boxes.length + 1;
  while (boxes.some(({ id }) => id === `obstruction ${number}`)) number += 1;
  const [px, py] = [Math.round(x * 2) / 2, Math.round(y * 2) / 2];
  return { ...setup, boxes: [...boxes, { id: `obstruction ${number}`, min: [px - 1.5, py - 4, 0], max: [px + 1, py + 4, 4] }] };
}

/** The set-up with the means of some parts. */
export const withMeans = (setup, ids, means) => ({ ...setup, means: { ...setup.means, ...Object.fromEntries(ids.map((id) => [id, means])) } });

/** The set-up with a corner in the middle of the side after a corner. */
export function withCorner(setup, id, after) {
  if (id.startsWith("boxes/")) return setup;
  const polygon = polygonOf(setup, id);
  const [[ax, ay], [bx, by]] = [polygon[after], polygon[(after + 1) % polygon.length]];
  return withPolygon(setup, id, [...polygon.slice(0, after + 1), [tidy((ax + bx) / 2), tidy((ay + by) / 2)], ...polygon.slice(after + 1)]);
}

/** The set-up without a corner; three always stay. */
export function withoutCorner(setup, id, corner) {
  if (id.startsWith("boxes/")) return setup;
  const polygon = polygonOf(setup, id);
  return polygon.length > 3 ? withPolygon(setup, id, polygon.filter((_, n) => n !== corner)) : setup;
}

/** The set-up with another rectangle, about a place: a yard, an access of trucks, or a zone of a kind. */
export function withArea(setup, what, [x, y], kind = "prohibited", size = [8, 5]) {
  const [w, h] = [size[0] / 2, size[1] / 2];
  const polygon = [[x - w, y - h], [x + w, y - h], [x + w, y + h], [x - w, y + h]].map((corner) => corner.map((value) => Math.round(value * 2) / 2)); // prettier-ignore
  if (what !== "zones") return { ...setup, [what]: [...(setup[what] ?? []), polygon] };
  return { ...setup, zones: [...setup.zones, { name: null, kind, polygon, ...ofKind(kind) }] };
}

/** What a zone of a kind needs besides its polygon. */
export const ofKind = (kind) => (kind === "slow" ? { share: 0.5 } : kind === "limiter" ? { lowest_hook_m: 10 } : {});

/** The set-up with another kind for a zone; what only the earlier kind has is left out. */
export function withKind(setup, n, kind) {
  const { share, lowest_hook_m: lowest, highest_hook_m: highest, ...rest } = setup.zones[n];
  return { ...setup, zones: replaced(setup.zones, n, { ...rest, kind, ...ofKind(kind) }) };
}

/** The set-up without an area; the last yard stays. */
export function withoutArea(setup, id) {
  const [what, n] = parsed(id);
  if (what === "yard") return setup.yard.length > 1 ? { ...setup, yard: setup.yard.filter((_, m) => m !== n) } : setup;
  return what === "construction" ? setup : { ...setup, [what]: setup[what].filter((_, m) => m !== n) };
}

/** The bounds of everything on plan, for the first view. */
export function extentOf(opened, setup) {
  const points = [...opened.building.outline.flat(), ...opened.parts.flatMap((part) => part.hull), ...areasOf(setup).filter(({ what }) => what !== "zones").flatMap(({ polygon }) => polygon), ...setup.cranes.map((crane) => crane.base_m)];
  return boundsOf(points) ?? [-10, -10, 10, 10];
}

const parsed = (id) => {
  const [what, ...numbers] = id.split("/");
  return [what, ...numbers.map(Number)];
};
