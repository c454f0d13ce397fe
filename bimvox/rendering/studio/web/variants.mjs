// Set-ups of the same building next to each other.
import { byId, el, fill } from "../page/dom.mjs";
import { fixed, percent, whole } from "../page/words.mjs";

/**
 * @typedef Variant {path, name, setup, answer: of `try`, figures: {time, hours, critical, highest, refused, page, isCurrent} of its plan or null}
 */

/** The figures of a plan that the table has. */
export function figuresOf({ figures, time, infeasible, page, is_current: isCurrent }) {
  const { crane_hours: hours, critical_lifts: critical, highest_utilisation: highest } = figures;
  return { time: time?.span_in_words ?? "–", hours, critical, highest, refused: infeasible.length, page, isCurrent };
}

/** The words of a figure, marked if the plan is of an earlier state; "not planned" without a plan. */
const planned = (figures, words) => (figures ? `${words(figures)}${figures.isCurrent ? "" : " (earlier state)"}` : "not planned");

const ROWS = [
  ["Machine", ({ setup }) => each(setup.cranes, (crane) => crane.machine || "own")],
  ["Jib", ({ setup, answer }) => each(setup.cranes, (crane, n) => (crane.jib_m ?? answer?.cranes[n]?.most_m ? `${fixed(crane.jib_m ?? answer.cranes[n].most_m, 1)} m` : "usual"))],
  ["Place x, y", ({ setup }) => each(setup.cranes, (crane) => crane.base_m.map((value) => fixed(value, 2)).join(", "))],
  ["Can be lifted", ({ answer }) => (answer ? `${whole(answer.served)} of ${whole(answer.of)}` : "…")],
  ["Highest utilisation", ({ answer }) => (answer ? percent(answer.highest) : "…")],
  ["Problems", ({ answer }) => (answer ? whole(answer.problems.length) : "…")],
  ["Time", ({ figures }) => planned(figures, ({ time }) => time)],
  ["Crane hours", ({ figures }) => planned(figures, ({ hours }) => (hours === null ? "–" : fixed(hours, 1)))],
  ["Highest in the plan", ({ figures }) => planned(figures, ({ highest }) => percent(highest))],
  ["Critical lifts", ({ figures }) => planned(figures, ({ critical }) => whole(critical ?? 0))],
  ["Refused parts", ({ figures }) => planned(figures, ({ refused }) => whole(refused))],
];

export class Variants {
  constructor(app) {
    this.app = app;
    this.pane = byId("pane-variants");
  }

  render() {
    const { app } = this;
    if (!app.opened || this.pane.hidden) return;
    const focused = this.pane.contains(document.activeElement) && document.activeElement.dataset.key;
    const now = { path: app.opened.path, name: `${app.opened.name}${app.history.isChanged ? ", unsaved" : ""}`, setup: app.setup, answer: app.answer, figures: app.standing.figures, current: true };
    const all = [now, ...app.variants.filter((variant) => variant.path !== now.path).map((variant) => ({ ...variant, figures: app.figures.get(variant.path) ?? null }))];
    const head = all.map(({ name, path, current }) => el("th", { scope: "col", class: current ? "current" : null }, el("span", {}, name), el("small", {}, current ? "shown here" : path)));
    const rows = ROWS.map(([title, read]) => el("tr", {}, el("th", { scope: "row" }, title), ...all.map((variant) => el("td", { class: variant.current ? "current" : null }, ...[].concat(read(variant)).map((words) => el("span", {}, words))))));
    const acts = el(
      "tr",
      {},
      el("th", { scope: "row" }, el("span", { class: "unseen" }, "Actions")),
      ...all.map(({ path, name, current, figures }) =>
        el(
          "td",
          { class: current ? "current" : null },
          current ? null : el("button", { type: "button", "data-key": `show ${path}`, onclick: () => app.openFile(path), "aria-label": `Show ${name}` }, "Show"),
          current ? null : el("button", { type: "button", "data-key": `plan ${path}`, disabled: app.isBusy, onclick: () => app.planOf(path), "aria-label": `Plan ${name}` }, "Plan"),
          figures?.page ? el("button", { type: "button", "data-key": `result ${path}`, onclick: () => (current ? app.panes.show("result") : app.showOther(figures.page, otherWords(path, figures))), "aria-label": `Show the result of ${name}` }, "Result") : null,
          current ? null : el("button", { type: "button", "data-key": `drop ${path}`, onclick: () => app.dropVariant(path), "aria-label": `Take ${name} out of the table` }, "Remove"),
        ),
      ),
    );
    fill(
      this.pane,
      el("h2", {}, "Variants"),
      el("p", { class: "about" }, "The set-up that is open, next to saved ones. What can be lifted and the highest utilisation are tried without a plan; the rows from the hours on come from a plan."),
      el("div", { class: "wide", tabindex: 0, role: "region", "aria-label": "Table of variants" }, el("table", { class: "compare" }, el("thead", {}, el("tr", {}, el("td"), ...head)), el("tbody", {}, ...rows, acts))),
      el("div", { class: "links" }, el("button", { type: "button", "data-key": "variant", class: "main", onclick: () => app.saveVariant() }, "Save as variant…"), el("button", { type: "button", "data-key": "compare", onclick: () => app.addVariant() }, "Compare with a site file…")),
    );
    if (focused) this.pane.querySelector(`[data-key="${CSS.escape(focused)}"]`)?.focus();
  }
}

const otherWords = (path, { isCurrent }) => `Plan of ${path}, not of what is open here${isCurrent ? "" : "; that file or its obstructions have changed since"}.`;

const each = (list, words) => (list.length ? list.map(words) : ["–"]);
