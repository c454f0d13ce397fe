// A section: only what lies between two heights, and between two planes along x and y, is drawn.
import { byId, el } from "./dom.mjs";
import { clamp } from "./maths.mjs";
import { NO_CUT } from "./scene.mjs";
import { fixed, metres } from "./words.mjs";

const AXES = [["z", "Height"], ["x", "Along x"], ["y", "Along y"]];
const INDEX = { x: 0, y: 1, z: 2 };
const STEP_M = 0.1;
const NUDGE_M = 0.5;

export class Section {
  constructor(app) {
    this.app = app;
    const { origin_m: origin, shape, voxel_size_m: cell } = app.document.site;
    this.least = origin.slice();
    this.most = origin.map((low, axis) => low + shape[axis] * cell);
    this.low = this.least.slice();
    this.high = this.most.slice();
    this.rows = AXES.map(([axis, name]) => this._row(INDEX[axis], name));
    byId("section-clear").addEventListener("click", () => this.clear());
    this.update();
  }

  _row(axis, name) {
    const slider = (side, words) => {
      const input = el("input", { type: "range", min: this.least[axis], max: this.most[axis], step: "any", "aria-label": `${name}: ${words}`, "data-cut": `${"xyz"[axis]} ${side}` });
      input.addEventListener("input", () => this.set(axis, side, Number(input.value)));
      input.addEventListener("keydown", (event) => {
        const by = { ArrowUp: 1, ArrowRight: 1, ArrowDown: -1, ArrowLeft: -1, PageUp: 10, PageDown: -10 }[event.key];
        if (!by) return;
        event.preventDefault();
        event.stopPropagation();
        this.set(axis, side, this[side][axis] + by * STEP_M);
      });
      return input;
    };
    const row = { axis, low: slider("low", "from"), high: slider("high", "to"), words: el("output") };
    byId("section-rows").append(el("div", { role: "group", "aria-label": name }, el("span", {}, name), row.low, row.high, row.words));
    return row;
  }

  /** Whether anything is cut. */
  get cuts() {
    return this.low.some((low, axis) => low > this.least[axis]) || this.high.some((high, axis) => high < this.most[axis]);
  }

  /** What is drawn; a side that is not cut has no end. */
  _boxed() {
    if (!this.cuts) return NO_CUT;
    return {
      low: this.low.map((low, axis) => (low > this.least[axis] ? low : NO_CUT.low[axis])),
      high: this.high.map((high, axis) => (high < this.most[axis] ? high : NO_CUT.high[axis])),
    };
  }

  /** Sets one side, rounded to steps, and moves the other if it would lie beyond. */
  set(axis, side, value) {
    const within = clamp(Math.round(value / STEP_M) * STEP_M, this.least[axis], this.most[axis]);
    this[side][axis] = within;
    if (side === "low") this.high[axis] = Math.max(this.high[axis], within);
    else this.low[axis] = Math.min(this.low[axis], within);
    this.update();
  }

  /** Raises or lowers the height up to which is drawn; from no cut, starts at the top of what is built. */
  nudge(step) {
    const tops = this.app.parts.map((part) => part.target_m[2] + part.size_m[2]);
    const from = this.high[2] < this.most[2] ? this.high[2] : Math.max(...tops, this.least[2]);
    this.set(2, "high", from + step * NUDGE_M);
    this.app.say(`Section at a height of ${metres(this.high[2])}`);
  }

  clear() {
    this.low = this.least.slice();
    this.high = this.most.slice();
    this.update();
    this.app.say("No section");
  }

  /** The section as numbers, for a link; null without a cut. */
  get state() {
    return this.cuts ? [...this.low, ...this.high].map((value) => Number(value.toFixed(3))) : null;
  }

  take(numbers) {
    this.low = this.least.map((least, axis) => clamp(numbers?.[axis] ?? least, least, this.most[axis]));
    this.high = this.most.map((most, axis) => clamp(numbers?.[axis + 3] ?? most, this.low[axis], most));
    this.update();
  }

  update() {
    /** What is drawn: { low, high }; another object after every change. */
    this.box = this._boxed();
    for (const { axis, low, high, words } of this.rows) {
      low.value = this.low[axis];
      high.value = this.high[axis];
      words.textContent = `${fixed(this.low[axis], 1)} to ${fixed(this.high[axis], 1)} m`;
      for (const [input, value] of [[low, this.low[axis]], [high, this.high[axis]]]) input.setAttribute("aria-valuetext", metres(value));
    }
    byId("section-clear").disabled = !this.cuts;
    document.querySelector("#section summary").textContent = this.cuts ? "Section ✂" : "Section";
    this.app.changed();
  }
}
