// The site files of one model next to each other, as the folder has them.
import { byId, el, fill } from "../page/dom.mjs";
import { counted, fixed, percent, whole } from "../page/words.mjs";
import { call } from "./api.mjs";
import { documentLink } from "./kept.mjs";
import { figuresOf } from "./state.mjs";

const MOST = 12;

/**
 * @typedef Variant {path, name, setup, answer: of `try`, plan: figures and time of its plan or null, title: the state of its plan, when, counts, differs: from what is open, in words, revisions, reports}
 */

/** The words of a figure; "–" without a plan. */
const planned = (plan, words) => (plan ? words(figuresOf(plan)) : "–");

const ROWS = [
  ["Plan", ({ title }) => title ?? "…"],
  ["Made", ({ when }) => when ?? "–"],
  ["Differs in", ({ differs, current }) => (current ? "–" : differs === undefined ? "…" : differs.length ? differs : "nothing")],
  ["Machine", ({ setup }) => each(setup?.cranes, (crane) => crane.machine || "own")],
  ["Jib", ({ setup, answer }) => each(setup?.cranes, (crane, n) => (crane.jib_m ?? answer?.cranes[n]?.most_m ? `${fixed(crane.jib_m ?? answer.cranes[n].most_m, 1)} m` : "usual"))],
  ["Place x, y", ({ setup }) => each(setup?.cranes, (crane) => crane.base_m.map((value) => fixed(value, 2)).join(", "))],
  ["Can be lifted", ({ answer }) => (answer ? `${whole(answer.served)} of ${whole(answer.of)}` : "…")],
  ["Highest utilisation", ({ answer }) => (answer ? percent(answer.highest) : "…")],
  ["Problems", ({ answer }) => (answer ? whole(answer.problems.length) : "…")],
  ["Time", ({ plan }) => planned(plan, ({ time }) => time)],
  ["Crane hours", ({ plan }) => planned(plan, ({ hours }) => (hours === null ? "–" : fixed(hours, 1)))],
  ["Highest in the plan", ({ plan }) => planned(plan, ({ highest }) => percent(highest))],
  ["Critical lifts", ({ plan }) => planned(plan, ({ critical }) => critical)],
  ["Lifts planned", ({ counts }) => (counts ? whole(counts.planned) : "–")],
  ["Lifts refused", ({ counts }) => (counts ? whole(counts.refused) : "–")],
  ["Replanned, done", ({ counts }) => (counts ? `${whole(counts.replanned)}, ${whole(counts.done)}` : "–")],
  ["Revisions", ({ revisions }) => (revisions?.length ? whole(revisions.length) : "–")],
  ["Documents", ({ documents }) => (documents?.length ? documents.map(documentLink) : "–")],
];

export class Variants {
  constructor(app) {
    this.app = app;
    this.pane = byId("pane-variants");
    this.reset();
  }

  reset() {
    Object.assign(this, { all: [], more: 0, of: null });
  }

  /** Find the other site files of the model that is open, and what each of them holds. */
  async look() {
    const { app } = this;
    const { opened } = app;
    try {
      const { files } = await call("GET", "/api/files");
      const paths = files.filter(({ kind, model, path }) => kind === "site" && model === opened.model && path !== opened.path).map(({ path }) => path);
      if (opened !== app.opened) return;
      const known = new Map(this.all.map((variant) => [variant.path, variant]));
      this.all = paths.slice(0, MOST).map((path) => known.get(path) ?? { path, name: path.replace(/\.site\.toml$/, "") });
      this.more = paths.length - this.all.length;
      this.render();
      for (const { path } of this.all) await this.update(path);
    } catch (error) {
      app.fail(error);
    }
  }

  /** Look again what the folder holds of a site file. */
  async update(path) {
    const { app } = this;
    const { opened } = app;
    const found = await call("POST", "/api/found", { path, whole: true, ...(opened.exists ? { against: opened.path } : {}) });
    if (opened !== app.opened) return;
    this.all = this.all.map((variant) => (variant.path === path ? found : variant));
    this.render();
  }

  render() {
    const { app } = this;
    if (!app.opened || this.pane.hidden) return;
    const focused = this.pane.contains(document.activeElement) && document.activeElement.dataset.key;
    const { title, when, counts } = app.state.now;
    const { revisions, documents } = app.kept.found ?? {};
    const now = { path: app.opened.path, name: `${app.opened.name}${app.history.isChanged ? ", unsaved" : ""}`, setup: app.setup, answer: app.answer, plan: app.state.plan, title, when, counts, revisions, documents, current: true };
    const all = [now, ...this.all];
    const head = all.map(({ name, path, current }) => el("th", { scope: "col", class: current ? "current" : null }, el("span", {}, name), el("small", {}, current ? `${path}, shown here` : path)));
    const cell = (words) => (words instanceof Element ? words : el("span", {}, words));
    const rows = ROWS.map(([words, read]) => el("tr", {}, el("th", { scope: "row" }, words), ...all.map((variant) => el("td", { class: variant.current ? "current" : null }, ...[].concat(read(variant)).map(cell)))));
    const acts = el(
      "tr",
      {},
      el("th", { scope: "row" }, el("span", { class: "unseen" }, "Actions")),
      ...all.map((variant) => {
        const { path, name, current, plan } = variant;
        return el(
          "td",
          { class: current ? "current" : null },
          current ? null : el("button", { type: "button", "data-key": `show ${path}`, onclick: () => app.openFile(path), "aria-label": `Show ${name}` }, "Show"),
          current ? null : el("button", { type: "button", "data-key": `plan ${path}`, disabled: app.isBusy, onclick: () => app.planOf(path), "aria-label": `Plan ${name}` }, "Plan"),
          plan ? el("button", { type: "button", "data-key": `result ${path}`, onclick: () => (current ? app.panes.show("result") : app.showOther(plan.page, otherWords(variant))), "aria-label": `Show the result of ${name}` }, "Result") : null,
        );
      }),
    );
    fill(
      this.pane,
      el("h2", {}, "Variants"),
      el("p", { class: "about" }, `The set-up that is open, next to the other site files of this model. What can be lifted and the highest utilisation are tried without a plan; the rows from the time on come from a plan.${this.more ? ` ${counted(this.more, "more site file")} of this model ${this.more === 1 ? "is" : "are"} not shown.` : ""}`),
      el("div", { class: "wide", tabindex: 0, role: "region", "aria-label": "Table of variants" }, el("table", { class: "compare" }, el("thead", {}, el("tr", {}, el("td"), ...head)), el("tbody", {}, ...rows, acts))),
      el("div", { class: "links" }, el("button", { type: "button", "data-key": "variant", class: "main", onclick: () => app.saveVariant() }, "Save as variant…")),
    );
    if (focused) this.pane.querySelector(`[data-key="${CSS.escape(focused)}"]`)?.focus();
  }
}

const otherWords = ({ path, words }) => `Of ${path}, not of what is open here: ${words}`;

const each = (list, words) => (list?.length ? list.map(words) : [list ? "–" : "…"]);
