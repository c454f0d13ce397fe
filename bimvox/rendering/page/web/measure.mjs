// Measuring: two points of the view, picked or typed, and how far they are apart.
import { byId, el, fill } from "./dom.mjs";
import { lengthOf, sub } from "./maths.mjs";
import { fixed, metres } from "./words.mjs";

const COORDINATES = ["x", "y", "z"];

export class Measure {
  constructor(app) {
    this.app = app;
    this.card = byId("measure");
    this.points = [null, null];
    this.fields = this.points.map((_, n) => COORDINATES.map((axis, k) => this._field(n, axis, k)));
    this.words = el("output", { "aria-live": "polite" });
    const rows = this.fields.map((fields, n) => el("div", { role: "group", "aria-label": `Point ${n + 1}` }, el("span", {}, `Point ${n + 1}`), ...fields));
    fill(byId("measure-rows"), ...rows, this.words);
    byId("measure-clear").addEventListener("click", () => this.clear());
    this.card.addEventListener("toggle", () => this.app.changed());
    this.update();
  }

  _field(n, axis, k) {
    const field = el("input", { type: "number", step: "any", placeholder: axis, "aria-label": `Point ${n + 1}: ${axis} in metres` });
    field.addEventListener("change", () => {
      const typed = this.fields[n].map((one) => (one.value === "" ? Number.NaN : Number(one.value)));
      this.points[n] = typed.every(Number.isFinite) ? typed : null;
      this.update(k);
    });
    return field;
  }

  /** Whether a click measures instead of choosing. */
  get isOn() {
    return this.card.open;
  }

  toggle() {
    this.card.open = !this.card.open;
    this.app.say(this.isOn ? "Measuring: choose two points" : "No measuring");
  }

  /** Takes a point of the view; a third one begins anew. */
  take(point) {
    if (!point) return this.app.say("Nothing is there");
    this.points = this.points[0] && !this.points[1] ? [this.points[0], point] : [point, null];
    this.update();
  }

  clear() {
    this.points = [null, null];
    this.update();
  }

  /** The two points, if both are there and the card is open. */
  get line() {
    return this.isOn && this.points[0] && this.points[1] ? this.points : null;
  }

  get labels() {
    if (!this.isOn) return [];
    const [a, b] = this.points;
    if (!a || !b) return [a, b].filter(Boolean).map((at) => ({ at, text: "+" }));
    return [{ at: a.map((value, axis) => (value + b[axis]) / 2), text: metres(lengthOf(sub(b, a))) }];
  }

  /** @param typed The field that is being typed into keeps its text. */
  update(typed = null) {
    this.points.forEach((point, n) => {
      if (point || typed === null) this.fields[n].forEach((field, k) => (field.value = point ? fixed(point[k], 3) : ""));
    });
    const [a, b] = this.points;
    const apart = a && b ? sub(b, a) : null;
    this.words.textContent = apart ? `${metres(lengthOf(apart))} (${COORDINATES.map((axis, k) => `${axis} ${fixed(apart[k], 2)}`).join(", ")}; on plan ${metres(Math.hypot(apart[0], apart[1]))})` : "Click two points, or type them.";
    this.app.changed();
  }
}
