// The handle of the ground in the 3-D view: a horizontal plane that is moved up and down, and entered like the field.
import { fixed } from "../page/words.mjs";
import { stepOf } from "./snap.mjs";
import { set, svg } from "./svg.mjs";

/** Heights that a pointer chooses, metres; finer ones are typed. */
const GRID_M = 0.05;

export class GroundHandle {
  constructor(app) {
    this.app = app;
    this.plane = svg("path", { class: "plane" });
    this.text = svg("text", { class: "label", x: 34, y: 7 });
    this.grip = svg("g", { class: "grip", tabindex: 0, role: "slider", "aria-orientation": "vertical", "aria-label": "Height of the ground in the model, m" }, svg("circle", { r: 44, class: "target" }), svg("path", { d: "M0-24 14-6H6V6H14L0 24-14 6H-6V-6H-14Z" }), this.text);
    this.sheet = svg("svg", { class: "ground-handle" }, this.plane, this.grip);
    const { grip } = this;
    grip.addEventListener("pointerdown", (event) => this.take(event));
    grip.addEventListener("pointermove", (event) => this.drag?.pointer === event.pointerId && this.moveTo(this.drag.from_m + this.metresOf(event.clientY - this.drag.y)));
    grip.addEventListener("pointerup", (event) => this.drag?.pointer === event.pointerId && this.leave(true));
    grip.addEventListener("pointercancel", () => this.leave(false));
    grip.addEventListener("keydown", (event) => this.press(event));
    this.show(null);
  }

  /** Show where the ground is in a picture, at a height in the model; null: nowhere. */
  show(ground, height_m = null) {
    this.drag = null;
    Object.assign(this, { ground, drawn_m: height_m });
    const isThere = Boolean(ground?.corners.length) && height_m !== null;
    this.sheet.style.display = isThere ? "" : "none";
    if (!isThere) return;
    set(this.sheet, { viewBox: `0 0 ${ground.size.join(" ")}` });
    /** The corner in front: what stands on the ground does not cover it. */
    this.front = ground.corners.reduce((low, corner) => (corner[1] > low[1] ? corner : low));
    this.moveTo(height_m);
  }

  /** Metres up of so many pixels down on the screen. */
  metresOf(down) {
    return (down * this.ground.size[1]) / this.sheet.getBoundingClientRect().height / this.front[3];
  }

  take(event) {
    if (event.button !== 0 || this.drag) return;
    event.preventDefault();
    this.grip.setPointerCapture(event.pointerId);
    this.grip.focus({ preventScroll: true });
    this.drag = { pointer: event.pointerId, y: event.clientY, from_m: this.height_m };
  }

  leave(isEntered) {
    if (!this.drag) return;
    const { from_m } = this.drag;
    this.drag = null;
    if (!isEntered) this.moveTo(from_m);
    else if (this.height_m !== from_m) this.enter();
  }

  /** Show the plane at a height. */
  moveTo(height_m) {
    this.height_m = Number((Math.round(height_m / GRID_M) * GRID_M).toFixed(4));
    if (Math.abs(height_m - this.drawn_m) < GRID_M / 2) this.height_m = this.drawn_m;
    const up = this.height_m - this.drawn_m;
    const at = ([x, y, dx, dy]) => [x + up * dx, y + up * dy];
    set(this.plane, { d: `M${this.ground.corners.map((corner) => at(corner).map((value) => value.toFixed(1)).join(" ")).join("L")}Z` });
    set(this.grip, { transform: `translate(${at(this.front).join(" ")})`, "aria-valuenow": this.height_m, "aria-valuetext": `${fixed(this.height_m, 2)} m` });
    this.text.textContent = `${fixed(this.height_m, 2)} m`;
  }

  enter() {
    const { app, height_m } = this;
    app.change({ ...app.setup, ground_m: height_m }, "height of the ground");
    app.announce(`The ground is at ${fixed(height_m, 2)} m in the model.`);
  }

  press(event) {
    const [, up] = stepOf(event.key, event.shiftKey) ?? [0, 0];
    if (event.key === "Escape" && this.drag) this.leave(false);
    else if (up) {
      this.moveTo(this.height_m + up);
      this.enter();
    } else return;
    event.preventDefault();
    event.stopPropagation();
  }
}
