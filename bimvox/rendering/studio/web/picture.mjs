// The set-up in 3-D beside the plan view, drawn by the server after every change that is entered. The ground is moved in it.
import { el } from "../page/dom.mjs";
import { Latest, picture } from "./api.mjs";
import { GroundHandle } from "./ground.mjs";
import { saved } from "./setup.mjs";

const STEP_DEG = 45;
/** A picture takes the server a second: it waits until the hand rests. */
const REST_MS = 400;

export class Picture {
  constructor(app) {
    this.app = app;
    this.turn = 0;
    this.image = el("img", { alt: "The site in 3-D: building, cranes, areas", hidden: true });
    this.said = el("p", { role: "status" });
    this.ground = new GroundHandle(app);
    const button = (words, label, step) => el("button", { type: "button", "aria-label": label, title: label, onclick: () => this.look(step) }, words);
    this.card = el("details", { class: "solid", hidden: true }, el("summary", {}, "3-D view"), el("div", { class: "scene" }, this.image, this.ground.sheet), this.said, el("div", { class: "group", role: "group", "aria-label": "Look from" }, button("⟲", "Look from further left", -STEP_DEG), button("⟳", "Look from further right", STEP_DEG)));
    app.form.body.before(this.card);
    this.asking = new Latest(
      ({ opened, setup, turn }) => picture({ path: opened.path, setup, turn_deg: turn }),
      ({ address, ground }, { opened, setup }) => {
        if (opened !== this.app.opened) return;
        this.show(address, "");
        this.ground.show(ground, setup.ground_m);
      },
      (error) => this.show(null, error.message),
    );
    this.card.open = matchMedia("(min-width: 1200px)").matches;
    this.card.addEventListener("toggle", () => this.refresh());
  }

  /** Another site is open: what is shown is not its picture. */
  open() {
    this.card.hidden = false;
    this.show(null, "The 3-D view is being drawn …");
  }

  look(step) {
    this.turn = (this.turn + step) % 360;
    this.refresh();
  }

  /** Draw what is entered as soon as the hand rests. */
  wait() {
    clearTimeout(this.waiting);
    this.waiting = setTimeout(() => this.refresh(), REST_MS);
  }

  /** Draw what is entered; not while a hand still moves something. */
  refresh() {
    clearTimeout(this.waiting);
    const { opened, draft } = this.app;
    if (opened && !draft && this.card.open) this.asking.ask({ opened, setup: saved(this.app.setup), turn: this.turn });
  }

  show(address, words) {
    this.image.hidden = !address;
    this.ground.show(null);
    if (address) this.image.src = address;
    this.said.textContent = words;
  }
}
