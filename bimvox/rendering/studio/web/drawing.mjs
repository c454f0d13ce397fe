// The plan view: a drawing to scale, in three layers: the ground with areas and parts, in metres; rings; labels and handles, in pixels.
import { areaOf, boundsOf, centreOf, distance, edgesOf, isInside, middle, northOf, toMap, fromMap } from "./geometry.mjs";
import { dimensionsOf } from "./dimensions.mjs";
import { areasOf, extentOf, handleOf, handlesOf } from "./setup.mjs";
import { fitted, multiples, panned, resized, roundLength, scaleBar, shown, toMetres, toPixels, zoomed } from "./view.mjs";
import { byId, el } from "../page/dom.mjs";
import { fixed, nameOf, tonnes } from "../page/words.mjs";
import { label, pathOf, set, svg } from "./svg.mjs";
import { OTHERS, stateOf, useWords } from "./use.mjs";

const MARGIN = [50, 70, 50, 70];

export class Drawing {
  constructor(app) {
    this.app = app;
    this.sheet = byId("sheet");
    this.view = { centre: [0, 0], scale: 0.1, width: 800, height: 600 };
    this.parts = new Map();
    this.layers = new Map();
    this.handles = new Map();
    this.grid = svg("g", { class: "grid", "aria-hidden": "true" });
    this.areas = svg("g", { class: "areas", "aria-hidden": "true" });
    this.outline = svg("path", { class: "outline", "aria-hidden": "true" });
    this.plan = svg("g", { class: "parts", "aria-hidden": "true" });
    this.boxes = svg("g", { class: "areas", "aria-hidden": "true" });
    this.metres = svg("g", {}, this.areas, this.outline, this.plan, this.boxes);
    this.ground = svg("svg", {}, patterns(), this.grid, this.metres);
    this.rings = el("div", { class: "rings", "aria-hidden": "true" });
    this.over = svg("g", { class: "over", "aria-hidden": "true" });
    this.grips = svg("g", { class: "grips" });
    this.frame = svg("g", { class: "frame", "aria-hidden": "true" });
    this.above = svg("svg", { class: "above" }, this.over, this.frame, this.grips);
    this.sheet.append(this.ground, this.rings, this.above);
    new ResizeObserver(() => this.resize()).observe(this.sheet);
  }

  resize() {
    const { width, height } = this.sheet.getBoundingClientRect();
    if (!width || !height) return;
    this.view = resized(this.view, width, height);
    if (this.waiting) this.fit();
    else this.render();
  }

  /** Draw another site. */
  open() {
    const { opened } = this.app;
    this.parts.clear();
    // Large parts first, so that small ones stay visible and can be clicked.
    const order = opened.parts.filter((part) => part.hull.length > 2).sort((a, b) => areaOf(b.hull) - areaOf(a.hull));
    for (const part of order) this.parts.set(part.id, svg("path", { d: pathOf([part.hull]), "data-part": part.id }));
    this.plan.replaceChildren(...this.parts.values());
    this.edges = opened.parts.flatMap((part) => edgesOf(part.hull));
    this.outlineEdges = opened.building.outline.flatMap(edgesOf);
    set(this.outline, { d: pathOf(opened.building.outline) });
    this.fit();
  }

  /** Show everything. */
  fit() {
    const { opened, setup } = this.app;
    this.waiting = !this.sheet.getBoundingClientRect().width;
    if (!opened || this.waiting) return;
    const shown = (margin) => fitted(extentOf(opened, setup), this.view.width, this.view.height, margin);
    this.view = shown(MARGIN);
    // The legend does not cover what a hand takes hold of.
    const [sheet, legend] = [this.sheet, byId("key")].map((one) => one.getBoundingClientRect());
    const right = legend.right - sheet.left + 24;
    const top = legend.top - sheet.top - 24;
    const isCovered = handlesOf(setup).some(({ at }) => {
      const [x, y] = toPixels(this.view, at);
      return x < right && y > top;
    });
    if (isCovered && legend.width && right < this.view.width / 3) this.view = shown([right + 20, ...MARGIN.slice(1)]);
    this.render();
  }

  zoom(factor, at) {
    this.view = zoomed(this.view, factor, at);
    this.render();
  }

  pan(dx, dy) {
    this.view = panned(this.view, dx, dy);
    this.render();
  }

  /** Metres of a point of the window. */
  metresAt(event) {
    const box = this.sheet.getBoundingClientRect();
    return toMetres(this.view, [event.clientX - box.left, event.clientY - box.top]);
  }

  /** Move the view so that a place is on it. */
  reveal(at) {
    const [x, y] = toPixels(this.view, at);
    const { width, height } = this.view;
    if (x > 30 && y > 30 && x < width - 30 && y < height - 30) return;
    this.view = { ...this.view, centre: at };
    this.render();
  }

  render() {
    const { app, view } = this;
    if (!app.opened) return;
    const { opened, setup, answer } = app;
    const { cranes, yard, access, construction, zones, boxes } = setup;
    const [ox, oy] = toPixels(view, [0, 0]);
    for (const layer of [this.ground, this.above]) set(layer, { viewBox: `0 0 ${view.width} ${view.height}` });
    set(this.metres, { transform: `translate(${ox} ${oy}) scale(${1 / view.scale} ${-1 / view.scale})` });
    this.layer(this.areas, [yard, access, construction, zones], () => drawnAreas({ ...setup, boxes: [] }));
    this.layer(this.boxes, [boxes], () => drawnAreas({ zones: [], boxes }));
    this.layer(this.rings, [view.scale, cranes.length, answer?.cranes], () => this.drawnCranes());
    // Whole pixels: a layer between them would be blurred.
    cranes.forEach(({ base_m: base }, n) => (this.rings.children[n].style.transform = `translate(${toPixels(view, base).map((value) => `${Math.round(value)}px`).join(",")})`));
    this.layer(this.over, [view, opened, setup, answer?.cranes, app.moving], () => this.labels());
    this.layer(this.frame, [view, opened], () => [...this.gridLabels(), ...this.scaleBar(), ...this.north()]);
    this.drawHandles();
  }

  /** Draw a layer again if a value that it shows has been replaced: what stays is neither laid out nor painted. */
  layer(element, values, drawn) {
    const before = this.layers.get(element);
    if (before && values.every((value, n) => value === before[n])) return;
    this.layers.set(element, values);
    element.replaceChildren(...drawn());
  }

  /** Colour the parts. */
  drawParts() {
    const { app } = this;
    if (!app.opened) return;
    for (const part of app.opened.parts) {
      const path = this.parts.get(part.id);
      if (!path) continue;
      const state = app.stateOf(part);
      const change = app.changes?.get(part.id);
      set(path, { class: `part ${state}${change ? ` changed ${change.kind}` : ""} ${app.stageOf(part)}${app.isShown(part) ? "" : " ghost"}${app.chosen === part.id ? " chosen" : ""}` });
      if (app.chosen === part.id && path.nextSibling) this.plan.append(path);
    }
  }

  /** Reach and rings of each crane: what the server says of the set-up that is shown, or of the last one. */
  drawnCranes() {
    const { setup, answer } = this.app;
    return setup.cranes.map((_, n) => {
      const found = answer?.cranes?.[n];
      if (!found) return svg("svg");
      const circle = (radius, name) => svg("circle", { r: radius / this.view.scale, class: name });
      return svg(
        "svg",
        {},
        ...found.rings.filter(({ radius_m: r }) => r < found.most_m - 0.01).map(({ radius_m: r }) => circle(r, "ring")),
        found.least_m > 0 ? circle(found.least_m, "reach least") : null,
        circle(found.most_m, "reach"),
      );
    });
  }

  labels() {
    const dimensions = this.dimensions();
    const words = dimensions.filter(({ tagName }) => tagName === "text");
    return [...this.ringLabels(words.map((one) => ["x", "y"].map((axis) => Number(one.getAttribute(axis))))), ...this.areaLabels(), ...dimensions];
  }

  /** Radius and capacity on each ring, in the direction that has most of the labels on screen, clear of some places and outside of the building. */
  ringLabels(clear) {
    const { setup, answer } = this.app;
    const taken = [];
    const grips = [...clear, ...handlesOf(setup).map(({ at }) => toPixels(this.view, at))];
    if (setup.construction?.length) {
      const [x0, , x1, y1] = boundsOf(setup.construction);
      const [x, y] = toPixels(this.view, [(x0 + x1) / 2, y1]);
      grips.push([x, y - 12], [x - 40, y - 12], [x + 40, y - 12]); // its name
    }
    return setup.cranes.flatMap(({ base_m: base }, n) => {
      const found = answer?.cranes?.[n];
      if (!found) return [];
      const rings = found.rings.length ? found.rings : [{ radius_m: found.most_m, capacity_kg: null }];
      const place = (radius, turn) => toPixels(this.view, [base[0] + radius * Math.cos(turn), base[1] + radius * Math.sin(turn)]);
      const [width, height] = [this.view.width - 60, this.view.height - 60];
      // Clear of the coordinates, the legend and the buttons.
      const isFree = ([x, y]) => x > 115 && x < width && y > 50 && y < height && !(x < 260 && y > height - 130) && !(x > width - 140 && y < 80);
      const turns = Array.from({ length: 24 }, (_, k) => Math.PI / 2 + ((k % 2 ? 1 : -1) * Math.ceil(k / 2) * Math.PI) / 12);
      const outline = this.app.opened.building.outline.map((polygon) => polygon.map((point) => toPixels(this.view, point)));
      const sorted = [...rings].sort((a, b) => b.radius_m - a.radius_m);
      const placed = (turn) => {
        const own = [];
        for (const ring of sorted) {
          const at = place(ring.radius_m, turn);
          const meets = ([x, y]) => Math.abs(x - at[0]) < 130 && Math.abs(y - at[1]) < 18;
          const onGrip = ([x, y]) => Math.abs(x - at[0]) < 85 && Math.abs(y - at[1]) < 20;
          if (isFree(at) && !grips.some(onGrip) && !taken.some(meets) && !own.some((one) => meets(one.at))) own.push({ ring, at });
        }
        return own;
      };
      const score = (own) => own.reduce((sum, { at }) => sum + (outline.some((polygon) => isInside(polygon, at)) ? 1 : 2), 0);
      const best = turns.map(placed).reduce((a, b) => (score(b) > score(a) ? b : a));
      taken.push(...best.map(({ at }) => at));
      // What a part may weigh, less gear, hook block and reserve, stands at the outermost ring that has it.
      const told = (ring, n) => ring.capacity_kg !== null && (n === 0 || Math.abs(best[n - 1].ring.capacity_kg - ring.capacity_kg) > 0.5);
      const metres = (value) => `${fixed(value, Number.isInteger(value) ? 0 : 1)} m`;
      return best.map(({ ring, at: [x, y] }, n) => label(metres(ring.radius_m) + (told(ring, n) ? ` · ${tonnes(ring.capacity_kg)} net` : ""), [x, y + 4], { class: "label ring-label" }));
    });
  }

  areaLabels() {
    return areasOf(this.app.setup).map(({ polygon, name, what, kind }) => {
      // The construction area's name is above it, the others' inside: at the lower edge, or next to the handle if there is little room.
      const points = polygon.map((point) => toPixels(this.view, point));
      const [high, under] = [Math.min(...points.map(([, y]) => y)), Math.max(...points.map(([, y]) => y))];
      const x = (Math.min(...points.map(([px]) => px)) + Math.max(...points.map(([px]) => px))) / 2;
      const classes = { class: `label area-label ${what} ${kind ?? ""}` };
      if (what === "construction") return label(name, [x, high - 8], classes);
      if (under - high > 80) return label(name, [x, under - 10], classes);
      const [hx, hy] = toPixels(this.view, centreOf(polygon));
      return label(name, [hx + 18, hy + 4], { ...classes, "text-anchor": "start" });
    });
  }

  dimensions() {
    const id = this.app.moving;
    if (!id || !handleOf(this.app.setup, id)) return []; // it may just have been removed
    return dimensionsOf(this.app.setup, id, this.outlineEdges).flatMap(({ from, to, text }) => {
      const [a, b] = [toPixels(this.view, from), toPixels(this.view, to)];
      const [mx, my] = middle(a, b);
      return [svg("line", { x1: a[0], y1: a[1], x2: b[0], y2: b[1], class: "dimension", "marker-start": "url(#tick)", "marker-end": "url(#tick)" }), distance(a, b) > 30 ? label(text, [mx, my - 5], { class: "label dimension-label" }) : null].filter(Boolean);
    });
  }

  /** Draw the lines of the survey's grid if the site is on a map, otherwise of the site's metres; returns their coordinates at the edges. */
  gridLabels() {
    const { view } = this;
    const { map } = this.app.opened;
    const [x0, y0, x1, y1] = shown(view);
    const step = roundLength(view.scale * 140);
    const [forth, back, names] = map ? [(p) => toMap(p, map), (p) => fromMap(p, map), ["E ", "N "]] : [(p) => p, (p) => p, ["x ", "y "]];
    const corners = [[x0, y0], [x1, y0], [x1, y1], [x0, y1]].map(forth); // prettier-ignore
    const low = [0, 1].map((axis) => Math.min(...corners.map((corner) => corner[axis])));
    const high = [0, 1].map((axis) => Math.max(...corners.map((corner) => corner[axis])));
    const [lines, labels] = [[], []];
    for (const axis of [0, 1]) {
      for (const value of multiples(low[axis], high[axis], step)) {
        const at = (other) => toPixels(view, back(axis === 0 ? [value, other] : [other, value]));
        const [a, b] = [at(low[1 - axis]), at(high[1 - axis])];
        lines.push(svg("line", { x1: a[0], y1: a[1], x2: b[0], y2: b[1] }));
        const text = names[axis] + fixed(value, step < 1 ? 1 : 0).replaceAll(",", " ");
        // The label where the line meets the sheet's upper edge, or its left edge if it lies flat.
        const flat = Math.abs(b[0] - a[0]) > Math.abs(b[1] - a[1]);
        const share = flat ? (4 - a[0]) / (b[0] - a[0]) : (12 - a[1]) / (b[1] - a[1]);
        const place = [a[0] + share * (b[0] - a[0]), a[1] + share * (b[1] - a[1])];
        const fits = flat ? place[1] > 26 : place[0] > 90 && place[0] < view.width - 8 * text.length;
        if (Number.isFinite(share) && fits) labels.push(label(text, flat ? [4, place[1] - 3] : [place[0] + 3, 12], { class: "label grid-label", "text-anchor": "start" }));
      }
    }
    this.grid.replaceChildren(...lines);
    return labels;
  }

  scaleBar() {
    const { length_m: length, pixels } = scaleBar(this.view);
    const [x, y] = [this.view.width - pixels - 24, this.view.height - 18];
    return [svg("path", { d: `M${x} ${y - 6}v6h${pixels}v-6M${x + pixels / 2} ${y - 4}v4`, class: "bar-line" }), label(`${fixed(length, length < 1 ? 1 : 0)} m`, [x + pixels / 2, y - 10], { id: "scale" })];
  }

  north() {
    const turn = northOf(this.app.opened.north_deg, this.app.opened.map);
    const [x, y] = [this.view.width - 40, this.view.height - 84];
    const known = turn !== null;
    const head = svg("g", { transform: `translate(${x} ${y}) rotate(${known ? turn : 0})`, class: "north" }, svg("path", { d: "M0 -24 9 14 0 8 -9 14Z" }), label(known ? "N" : "+y", [0, -29]));
    return [head];
  }

  drawHandles() {
    const { app } = this;
    const handles = handlesOf(app.setup);
    const ids = handles.map((handle) => handle.id);
    if (ids.length !== this.handles.size || ids.some((id) => !this.handles.has(id))) {
      const focused = document.activeElement?.getAttribute?.("data-handle");
      this.handles = new Map(handles.map((handle) => [handle.id, this.handleOf(handle)]));
      this.grips.replaceChildren(...this.handles.values());
      if (focused) (this.handles.get(focused) ?? this.handles.get(focused.split("/").slice(0, 2).join("/")))?.focus();
    }
    for (const handle of handles) {
      const [x, y] = toPixels(this.view, handle.at);
      const where = handle.at.map((value) => fixed(value, 2));
      set(this.handles.get(handle.id), {
        transform: `translate(${x} ${y})`,
        "aria-label": `${handle.label}: x ${where[0]} m, y ${where[1]} m`,
        class: `handle of-${handle.kind} ${handle.what ?? ""}${app.moving === handle.id ? " moving" : ""}`,
      });
    }
  }

  handleOf({ id, kind }) {
    const shapes = {
      crane: () => [svg("rect", { x: -9, y: -9, width: 18, height: 18, rx: 2 }), svg("path", { d: "M-9 -9 9 9M9 -9-9 9" })],
      area: () => [svg("circle", { r: 12 }), svg("path", { d: "M-8 0H8M0 -8V8M-2.5 -5.5 0 -8 2.5 -5.5M-2.5 5.5 0 8 2.5 5.5M-5.5 -2.5 -8 0 -5.5 2.5M5.5 -2.5 8 0 5.5 2.5" })],
      corner: () => [svg("rect", { x: -5, y: -5, width: 10, height: 10 })],
    };
    return svg("g", { "data-handle": id, tabindex: 0, role: "button", "aria-roledescription": "movable point" }, svg("circle", { r: 22, class: "target" }), svg("g", { class: "mark" }, ...shapes[kind]()));
  }

  /** What the pointer is over, in words. */
  wordsOf(part) {
    const { app } = this;
    const found = app.found(part.id);
    const state = stateOf(part, app.setup, found);
    const use = state === "cannot" ? found?.reason || OTHERS.cannot : state in OTHERS ? OTHERS[state] : `${useWords(state, found)} of what the crane may lift`;
    return `${nameOf(part)}, ${tonnes(part.mass_kg)}: ${use}`;
  }
}

/** Areas as paths, the construction area under the others. */
function drawnAreas(setup) {
  const areas = areasOf(setup);
  const order = [...areas.filter((area) => area.what === "construction"), ...areas.filter((area) => area.what !== "construction")];
  return order.map(({ id, what, kind, polygon }) => svg("path", { d: pathOf([polygon]), class: `area ${what} ${kind ?? ""}`, "data-area": what === "yard" || what === "boxes" ? id : null }));
}

function patterns() {
  const hatch = (id, d, size) => svg("pattern", { id, width: size, height: size, patternUnits: "userSpaceOnUse", patternTransform: "rotate(45)" }, svg("rect", { width: size, height: size, class: `${id}-ground` }), svg("path", { d, class: `${id}-lines` }));
  return svg(
    "defs",
    {},
    hatch("hatch-cannot", "M0 0V0.5", 0.5),
    hatch("hatch-in-situ", "M0 0V0.8", 0.8),
    svg("marker", { id: "tick", markerWidth: 8, markerHeight: 8, refX: 4, refY: 4, orient: "auto", markerUnits: "userSpaceOnUse" }, svg("path", { d: "M1 7 7 1", class: "tick" })),
  );
}
