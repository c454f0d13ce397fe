// The part of the plan on screen. A view is {centre (m), scale (m per pixel), width, height (pixels)}; +y is up.

const LEAST = 0.002;
const MOST = 5;

/** The view that shows bounds with a margin in pixels on each side: [left, top, right, bottom]. */
export function fitted([x0, y0, x1, y1], width, height, margin = [40, 40, 40, 40]) {
  const [left, top, right, bottom] = margin;
  const scale = clamped(Math.max((x1 - x0) / Math.max(width - left - right, 50), (y1 - y0) / Math.max(height - top - bottom, 50), LEAST));
  return { centre: [(x0 + x1) / 2 + ((right - left) / 2) * scale, (y0 + y1) / 2 + ((top - bottom) / 2) * scale], scale, width, height };
}

export const toPixels = (view, [x, y]) => [view.width / 2 + (x - view.centre[0]) / view.scale, view.height / 2 - (y - view.centre[1]) / view.scale];

export const toMetres = (view, [px, py]) => [view.centre[0] + (px - view.width / 2) * view.scale, view.centre[1] - (py - view.height / 2) * view.scale];

/** The view moved with the pointer by pixels. */
export const panned = (view, dx, dy) => ({ ...view, centre: [view.centre[0] - dx * view.scale, view.centre[1] + dy * view.scale] });

/** The view zoomed about a pixel, which keeps its place. A factor above 1 shows more. */
export function zoomed(view, factor, at = [view.width / 2, view.height / 2]) {
  const still = toMetres(view, at);
  const scale = clamped(view.scale * factor);
  const share = scale / view.scale;
  return { ...view, scale, centre: [still[0] + (view.centre[0] - still[0]) * share, still[1] + (view.centre[1] - still[1]) * share] };
}

/** The same centre and scale in a window of another size. */
export const resized = (view, width, height) => ({ ...view, width, height });

/** [lowest x, lowest y, highest x, highest y] on screen. */
export function shown(view) {
  const [x0, y1] = toMetres(view, [0, 0]);
  const [x1, y0] = toMetres(view, [view.width, view.height]);
  return [x0, y0, x1, y1];
}

/** The longest round length (1, 2 or 5 times a power of ten) of at most so many metres. */
export function roundLength(most) {
  const power = 10 ** Math.floor(Math.log10(most));
  return [5, 2, 1].map((n) => n * power).find((length) => length <= most * (1 + 1e-9));
}

/** A scale bar: its length in metres and in pixels. */
export function scaleBar(view, mostPixels = 140) {
  const length = roundLength(view.scale * mostPixels);
  return { length_m: length, pixels: length / view.scale };
}

/** Multiples of a step between two values. */
export function multiples(low, high, step) {
  const found = [];
  for (let n = Math.ceil(low / step - 1e-9); n * step <= high + 1e-9 * step; n += 1) found.push(n * step || 0); // no minus zero
  return found;
}

const clamped = (scale) => Math.min(Math.max(scale, LEAST), MOST);
