// Plane geometry in metres, site frame: x and y on plan.

/** [lowest x, lowest y, highest x, highest y] of points; null without points. */
export function boundsOf(points) {
  if (!points.length) return null;
  const box = [Infinity, Infinity, -Infinity, -Infinity];
  for (const [x, y] of points) {
    box[0] = Math.min(box[0], x);
    box[1] = Math.min(box[1], y);
    box[2] = Math.max(box[2], x);
    box[3] = Math.max(box[3], y);
  }
  return box;
}

/** The centre of a polygon's area; of its corners if it has no area. */
export function centreOf(polygon) {
  let [area, x, y] = [0, 0, 0];
  for (const [[ax, ay], [bx, by]] of edgesOf(polygon)) {
    const cross = ax * by - bx * ay;
    area += cross;
    x += (ax + bx) * cross;
    y += (ay + by) * cross;
  }
  if (Math.abs(area) > 1e-9) return [x / (3 * area), y / (3 * area)];
  const sum = polygon.reduce(([a, b], [c, d]) => [a + c, b + d], [0, 0]);
  return [sum[0] / polygon.length, sum[1] / polygon.length];
}

/** The area of a polygon in m². */
export const areaOf = (polygon) => Math.abs(edgesOf(polygon).reduce((sum, [[ax, ay], [bx, by]]) => sum + ax * by - bx * ay, 0)) / 2;

/** The sides of a polygon: pairs of corners. */
export const edgesOf = (polygon) => polygon.map((corner, n) => [corner, polygon[(n + 1) % polygon.length]]);

export const distance = ([ax, ay], [bx, by]) => Math.hypot(bx - ax, by - ay);

export const middle = ([ax, ay], [bx, by]) => [(ax + bx) / 2, (ay + by) / 2];

/** The point of a segment that is nearest to a point. */
export function nearestOn([[ax, ay], [bx, by]], [x, y]) {
  const [dx, dy] = [bx - ax, by - ay];
  const square = dx * dx + dy * dy;
  const share = square > 0 ? Math.min(Math.max(((x - ax) * dx + (y - ay) * dy) / square, 0), 1) : 0;
  return [ax + share * dx, ay + share * dy];
}

/** The point of some segments that is nearest to a point; null without segments. */
export function nearestOfAll(edges, at) {
  let [best, least] = [null, Infinity];
  for (const edge of edges) {
    const found = nearestOn(edge, at);
    const far = distance(found, at);
    if (far < least) [best, least] = [found, far];
  }
  return best;
}

/** Whether a point is inside a polygon. */
export function isInside(polygon, [x, y]) {
  let inside = false;
  for (const [[ax, ay], [bx, by]] of edgesOf(polygon)) if (ay > y !== by > y && x < ((bx - ax) * (y - ay)) / (by - ay) + ax) inside = !inside;
  return inside;
}

/** Map coordinates [eastings, northings] of a point. `map`: of the site's origin, and the angle of its x axis from east, counter-clockwise. */
export function toMap([x, y], map) {
  const turn = (map.x_axis_deg * Math.PI) / 180;
  const [cos, sin] = [Math.cos(turn), Math.sin(turn)];
  return [map.eastings_m + x * cos - y * sin, map.northings_m + x * sin + y * cos];
}

/** The point of map coordinates. */
export function fromMap([east, north], map) {
  const turn = (map.x_axis_deg * Math.PI) / 180;
  const [cos, sin] = [Math.cos(turn), Math.sin(turn)];
  const [de, dn] = [east - map.eastings_m, north - map.northings_m];
  return [de * cos + dn * sin, dn * cos - de * sin];
}

/** Where north is on plan: clockwise from +y, in degrees; null if neither the model nor a map says it. */
export const northOf = (northDeg, map) => northDeg ?? (map ? map.x_axis_deg : null);
