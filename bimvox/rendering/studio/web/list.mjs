// The list of parts: what cannot be lifted first, then by storey and class.
import { byId, el, fill } from "../page/dom.mjs";
import { counted, nameOf, tonnes, whole } from "../page/words.mjs";
import { CHOICES, MEANS, withMeans } from "./setup.mjs";
import { changedTitle, changeWords } from "./revision.mjs";
import { stageWords } from "./carried.mjs";
import { byUse, commonMeans, grouped, matching, useWords } from "./use.mjs";

/** Beyond so many parts, groups start closed. */
const MANY = 150;

export class List {
  constructor(app) {
    this.app = app;
    this.rows = new Map();
    byId("query").addEventListener("input", (event) => app.filter({ query: event.target.value }));
  }

  open() {
    this.rows.clear();
    const { parts } = this.app.opened;
    for (const part of parts) this.rows.set(part.id, this.rowOf(part));
    const closed = parts.length > MANY;
    this.cannot = el("details", { class: "kind cannot", open: true }, (this.cannotTitle = el("summary")), (this.cannotRows = el("ul")));
    this.groups = grouped(parts).map((group) => {
      const means = el("select", { "aria-label": `How ${group.title} is set` });
      means.addEventListener("change", () => this.app.change(withMeans(this.app.setup, this.changeable(group.parts), means.value), `means of ${group.title}`));
      const [title, rows] = [el("summary"), el("ul")];
      return { ...group, means, summary: title, rows, element: el("details", { class: "kind", open: !closed }, title, el("label", { class: "all" }, el("span", {}, "All of them"), means), rows) };
    });
    this.changed = el("details", { class: "kind changed", open: true }, (this.changedTitle = el("summary")), (this.changedRows = el("ul")));
    fill(byId("parts-list"), this.changed, this.cannot, ...this.groups.map((group) => group.element));
  }

  changeable(parts) {
    return parts.filter((part) => part.means !== "pinned").map((part) => part.id);
  }

  rowOf(part) {
    const use = el("span", { class: "use" });
    const why = el("small", { class: "why" });
    const small = el("small", {}, tonnes(part.mass_kg));
    const button = el("button", { type: "button", onclick: () => this.app.choose(part.id, true) }, el("i", { class: "dot", "aria-hidden": "true" }), el("span", { class: "who" }, el("span", {}, nameOf(part)), small, why), use);
    return { element: el("li", { "data-part": part.id }, button), button, use, why, small, state: null };
  }

  render() {
    const { app } = this;
    if (!app.opened) return;
    const shown = matching(app.opened.parts, app.query, app.states, (part) => app.stateOf(part));
    const isShown = new Set(shown.map((part) => part.id));
    const { length } = app.opened.parts;
    byId("parts-count").textContent = shown.length === length ? counted(length, "part") : `${whole(shown.length)} of ${counted(length, "part")}`;
    for (const part of shown) this.update(part);
    const changed = shown.filter((part) => app.changes?.has(part.id)).sort((a, b) => Number(app.changes.get(b.id).kind === "refused") - Number(app.changes.get(a.id).kind === "refused"));
    const isChanged = new Set(changed.map((part) => part.id));
    this.changed.hidden = !changed.length;
    this.changedTitle.textContent = changed.length ? changedTitle(app.changedBy, app.changes) : "";
    put(this.changedRows, changed.map((part) => this.rows.get(part.id).element)); // prettier-ignore
    const cannot = shown.filter((part) => app.stateOf(part) === "cannot" && !isChanged.has(part.id)).sort((a, b) => b.mass_kg - a.mass_kg);
    const apart = new Set([...isChanged, ...cannot.map((part) => part.id)]);
    this.cannot.hidden = !cannot.length;
    this.cannotTitle.textContent = `Cannot be lifted (${whole(cannot.length)})`;
    put(this.cannotRows, cannot.map((part) => this.rows.get(part.id).element)); // prettier-ignore
    for (const group of this.groups) {
      const own = group.parts.filter((part) => isShown.has(part.id) && !apart.has(part.id));
      const here = group.parts.filter((part) => isShown.has(part.id));
      group.element.hidden = !here.length;
      group.summary.textContent = `${group.title} (${whole(here.length)}${own.length < here.length ? `, ${whole(here.length - own.length)} above` : ""})`;
      put(group.rows, [...own].sort(byUse(app.answer?.parts)).map((part) => this.rows.get(part.id).element)); // prettier-ignore
      chooseMeans(group.means, commonMeans(group.parts, app.setup));
    }
  }

  update(part) {
    const { app } = this;
    const row = this.rows.get(part.id);
    const state = app.stateOf(part);
    const found = app.found(part.id);
    const change = app.changes?.get(part.id);
    const use = change?.kind === "refused" ? "no" : useWords(state, found);
    const why = change ? changeWords(change) : state === "cannot" ? found?.reason ?? "" : "";
    if (row.state !== state) row.element.className = row.state = state;
    const small = [tonnes(part.mass_kg), stageWords(app.stageOf(part))].filter(Boolean).join(" · ");
    if (row.small.textContent !== small) row.small.textContent = small;
    if (row.use.textContent !== use) row.use.textContent = use;
    if (row.why.textContent !== why) row.why.textContent = why;
    const chosen = app.chosen === part.id;
    if (chosen !== row.button.hasAttribute("aria-current")) row.button.toggleAttribute("aria-current", chosen);
  }

  /** Bring the row of the chosen part into view. */
  reveal(id) {
    const row = this.rows.get(id)?.element;
    const group = row?.closest("details");
    if (group) group.open = true;
    row?.scrollIntoView({ block: "nearest" });
  }
}

/** The three choices, and the current one if it is none of them. */
export function chooseMeans(select, current) {
  const wanted = current === "pinned" ? ["pinned"] : current ? CHOICES : ["", ...CHOICES];
  if (select.options.length !== wanted.length || wanted.some((value, n) => select.options[n].value !== value))
    fill(select, ...wanted.map((value) => el("option", { value, disabled: !value }, value ? MEANS[value] : "set in different ways")));
  select.value = current;
  select.disabled = current === "pinned";
}

/** Put elements into a list in this order; nothing moves if they are there already, so that focus and scrolling stay. */
function put(list, elements) {
  if (list.children.length === elements.length && elements.every((element, n) => list.children[n] === element)) return;
  const focused = document.activeElement;
  list.replaceChildren(...elements);
  if (focused && focused !== document.activeElement && list.contains(focused)) focused.focus({ preventScroll: true });
}
