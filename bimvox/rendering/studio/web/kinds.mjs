// What the parts are and how they get to their places, by type: the doubtful ones first, each with its two choices.
import { el, fill } from "../page/dom.mjs";
import { classWords, counted, tonnes, whole } from "../page/words.mjs";
import { KINDS, typeOf, WAYS, withType } from "./types.mjs";

/** Beyond so many rows, those that are certain are counted only. */
const MOST = 60;

export class Kinds {
  constructor(app) {
    this.app = app;
    this.summary = el("summary");
    this.rows = el("ul");
    this.element = el("details", { class: "kind types" }, this.summary, el("p", { class: "about" }, "As bimvox sees the model. What you choose goes into the site file when you save, and the model is read again."), this.rows);
  }

  open() {
    const { kinds } = this.app.opened;
    const doubtful = kinds.filter((row) => row.doubtful).reduce((sum, row) => sum + row.count, 0);
    this.element.open = doubtful > 0;
    this.summary.textContent = `What the parts are (${counted(kinds.length, "type")}${doubtful ? `, ${counted(doubtful, "part")} assumed` : ""})`;
    this.shown = kinds.slice(0, MOST).map((row) => this.rowOf(row));
    const rest = kinds.length - this.shown.length;
    fill(this.rows, ...this.shown.map((one) => one.element), rest ? el("li", { class: "about" }, `and ${counted(rest, "more type")}: bimvox inspect --csv lists all`) : null);
  }

  rowOf(row) {
    const name = [classWords(row.ifc_class), row.type].filter(Boolean).join(" · ");
    const [low, high] = (row.mass_kg ?? []).map(tonnes);
    const about = `${low ? `${whole(row.count)} × ${low === high ? low : `${low} to ${high}`}` : counted(row.count, "part")}: ${row.doubtful ? "assumed, " : ""}${row.kind_from}`;
    const choice = (key, choices, said) => {
      const select = el("select", { "aria-label": `${said} of ${name}` }, ...Object.entries(choices).map(([value, words]) => el("option", { value, disabled: value === "pinned" }, words)));
      select.addEventListener("change", () => this.app.change(withType(this.app.setup, row, key, select.value), `${said} of ${name}`));
      return select;
    };
    const kind = choice("kind", KINDS, "kind");
    const means = choice("means", WAYS, "way");
    const element = el("li", { class: row.doubtful ? "doubtful" : "" }, el("span", { class: "who" }, el("span", {}, name), el("small", {}, about)), el("span", { class: "choices" }, kind, means));
    return { row, element, kind, means };
  }

  /** Show what is chosen now. */
  render() {
    for (const { row, element, kind, means } of this.shown) {
      const now = typeOf(this.app.setup, row);
      kind.value = now.kind;
      means.value = now.means;
      means.disabled = row.means === "pinned";
      element.classList.toggle("corrected", now.isChosen);
    }
  }
}
