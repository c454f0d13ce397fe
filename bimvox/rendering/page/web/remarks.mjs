// The remarks of a plan: what a person should look at, by severity and kind. A click leads to the part and its lift.
import { byId, el, fill } from "./dom.mjs";
import { Roving } from "./roving.mjs";
import { counted, nameOf } from "./words.mjs";

/** A longer group is closed at first. */
const LONG = 6;
const SEVERITIES = [
  ["serious", "⚠\ufe0e Serious", "Decide about these before the plan is carried out."],
  ["minor", "! Minor", "Unusual, or below what the field asks for."],
  ["note", "Notes", "What was assumed."],
];

export class Remarks {
  constructor(app) {
    this.app = app;
    this.panel = byId("panel-remarks");
    this.byId = new Map(app.parts.map((part, index) => [part.id, index]));
    byId("remarks-button").addEventListener("click", () => this.open());
    window.addEventListener("beforeprint", () => this._openAll());
    window.addEventListener("afterprint", () => this._restore());
  }

  open() {
    this.app.panes.show("details");
    this.app.details.open("remarks");
    this.panel.focus();
  }

  /** The remarks of the revision shown. */
  get all() {
    return this.app.plan.revision.remarks;
  }

  /** The remarks about a part, by its index. */
  about(part) {
    return this.all.filter((remark) => this.byId.get(remark.component) === part);
  }

  render() {
    const { remarks, verdict } = this.app.plan.revision;
    this.buttons = [];
    const count = remarks.filter((remark) => remark.severity !== "note").length;
    byId("tab-remarks").textContent = count ? `Remarks ${count}` : "Remarks";
    fill(
      this.panel,
      el("h2", {}, verdict.remarks),
      el("p", { class: "kicker" }, "Proven and plausible are two things: a proof compares the plan with the model and the site file, not with practice."),
      remarks.length === 0 ? el("p", {}, "No rule of plausibility found anything.") : null,
      ...SEVERITIES.flatMap((entry) => this._severity(...entry)),
    );
    this.update();
  }

  _severity(severity, title, words) {
    const kinds = new Map();
    const found = this.all.filter((one) => one.severity === severity);
    for (const { kind } of found) kinds.set(kind, []);
    for (const remark of found) kinds.get(remark.kind).push(remark);
    if (!found.length) return [];
    return [el("h3", { class: severity }, `${title} (${found.length})`), el("p", { class: "kicker" }, words), ...[...kinds].map(([kind, group]) => this._kind(severity, kind, group))];
  }

  _kind(severity, kind, group) {
    const order = (remark) => this._lift(remark)?.order ?? -1;
    const items = group.slice().sort((a, b) => order(a) - order(b)).map((remark) => el("li", {}, this._remark(remark)));
    const list = el("ul", {}, ...items);
    new Roving(list, "li button").renew();
    return el("details", { class: `kind ${severity}`, open: group.length <= LONG }, el("summary", {}, `${kind.replaceAll("_", " ")} (${group.length})`), list);
  }

  _lift(remark) {
    return this.app.plan.ofPart[this.byId.get(remark.component)] ?? null;
  }

  /** A remark as a button that leads to its part; as text if it is about the whole plan. */
  _remark(remark) {
    const part = this.byId.get(remark.component);
    if (part === undefined) return el("p", {}, remark.name ? el("strong", {}, remark.name) : null, el("span", {}, remark.text));
    const lift = this._lift(remark);
    const head = lift ? `Lift ${lift.number} · ${nameOf(this.app.parts[part])}` : nameOf(this.app.parts[part]);
    const button = el("button", { type: "button", onclick: () => this._go(part, lift) }, el("strong", {}, head), el("span", {}, remark.text));
    this.buttons.push([part, button]);
    return button;
  }

  /** Chooses a part in the view and the list, and goes to its lift; the remarks stay open. */
  _go(part, lift) {
    const { app } = this;
    app.choose(part, { from: "remarks" });
    if (lift?.motion !== null && lift?.motion !== undefined) app.seek(lift.begins_s);
    app.say(`${lift ? `Lift ${lift.number}: ` : ""}${nameOf(app.parts[part])}, ${counted(this.about(part).length, "remark")}`);
  }

  /** Marks the remarks about the chosen part. */
  update() {
    for (const [part, button] of this.buttons) {
      if (part === this.app.chosen) button.setAttribute("aria-current", "true");
      else button.removeAttribute("aria-current");
    }
  }

  /** Paper cannot be opened. */
  _openAll() {
    this.closed = [...this.panel.querySelectorAll("details:not([open])")];
    for (const group of this.closed) group.open = true;
  }

  _restore() {
    for (const group of this.closed ?? []) group.open = false;
    this.closed = [];
  }
}
