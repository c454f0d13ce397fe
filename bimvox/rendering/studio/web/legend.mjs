// The legend of the plan view: each entry shows or hides the parts of its colour.
import { byId, el, fill } from "../page/dom.mjs";
import { whole } from "../page/words.mjs";
import { BANDS, countsOf, OTHERS } from "./use.mjs";

const ENTRIES = [...BANDS.map(({ key, words }) => [key, words]), ...Object.entries(OTHERS)];

export class Legend {
  constructor(app) {
    this.app = app;
    this.shown = new Map();
    this.entries = new Map(
      ENTRIES.map(([key, words]) => {
        const count = el("b");
        const button = el("button", { type: "button", "aria-pressed": "false", title: "Show only these", onclick: () => this.toggle(key) }, el("i", { class: `dot ${key}`, "aria-hidden": "true" }), el("span", {}, words), count);
        return [key, { element: el("li", {}, button), button, count }];
      }),
    );
    this.note = el("li", { class: "about" }, "faint: not set yet · blue: lifted now");
    this.marks = el("li", { class: "about marks" });
    fill(byId("key").querySelector("ul"), ...[...this.entries.values()].map(({ element }) => element), this.note, this.marks);
    if (matchMedia("(max-width: 860px)").matches) byId("key").open = false;
  }

  reset() {
    Object.assign(this.app, { states: null, query: "", shown: null });
    byId("query").value = "";
  }

  toggle(key) {
    const states = new Set(this.app.states ?? []);
    if (!states.delete(key)) states.add(key);
    this.app.filter({ states: states.size ? states : null });
  }

  /** What the plan did to parts: its outlines, and how many have each. */
  renderMarks() {
    const { counts, holds } = this.app.state.now;
    const all = holds && counts ? [["refused", "refused by the plan"], ["replanned", "replanned"], ["done", "done"]].filter(([key]) => counts[key]) : []; // prettier-ignore
    this.marks.hidden = !all.length;
    fill(this.marks, ...all.flatMap(([key, words]) => [el("i", { class: `outline-of ${key}`, "aria-hidden": "true" }), el("span", {}, `${words} `), el("b", {}, whole(counts[key]))]));
  }

  render() {
    const { app } = this;
    byId("key").hidden = false;
    this.note.hidden = !app.carried;
    this.renderMarks();
    const counts = countsOf(app.opened.parts, app.setup, app.answer?.parts);
    for (const [key, { element, button, count }] of this.entries) {
      const pressed = app.states?.has(key) ?? false;
      const shown = `${counts[key]} ${pressed}`;
      if (this.shown.get(key) === shown) continue;
      this.shown.set(key, shown);
      element.hidden = !counts[key] && !pressed;
      count.textContent = whole(counts[key] ?? 0);
      button.setAttribute("aria-pressed", String(pressed));
    }
  }
}
