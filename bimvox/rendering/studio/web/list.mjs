// The list of parts: what cannot be lifted first, then by storey and class.
import { byId, el, fill } from "../page/dom.mjs";
import { Roving } from "../page/roving.mjs";
import { counted, nameOf, tonnes, whole } from "../page/words.mjs";
import { Kinds } from "./kinds.mjs";
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
    this.kinds = new Kinds(app);
    this.roving = new Roving(byId("parts-list"), "li[data-part] button");
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
      const element = el("details", { class: "kind", open: !closed, ontoggle: () => element.open && this.render() }, title, el("label", { class: "all" }, el("span", {}, "All of them"), means), rows);
      return { ...group, means, summary: title, rows, element, order: group.parts };
    });
    this.changed = el("details", { class: "kind changed", open: true }, (this.changedTitle = el("summary")), (this.changedRows = el("ul")));
    this.kinds.open();
    fill(byId("parts-list"), this.changed, this.cannot, this.kinds.element, ...this.groups.map((group) => group.element));
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
    this.kinds.render();
    const shown = matching(app.opened.parts, app.query, app.states, (part) => app.stateOf(part));
    const isShown = new Set(shown.map((part) => part.id));
    const { length } = app.opened.parts;
    say(byId("parts-count"), shown.length === length ? counted(length, "part") : `${whole(shown.length)} of ${counted(length, "part")}`);
    const changed = shown.filter((part) => app.changes?.has(part.id)).sort((a, b) => Number(app.changes.get(b.id).kind === "refused") - Number(app.changes.get(a.id).kind === "refused"));
    const isChanged = new Set(changed.map((part) => part.id));
    this.changed.hidden = !changed.length;
    say(this.changedTitle, changed.length ? changedTitle(app.changes, app.state.plan?.revision) : "");
    this.fill(this.changedRows, changed);
    const cannot = shown.filter((part) => app.stateOf(part) === "cannot" && !isChanged.has(part.id)).sort((a, b) => b.mass_kg - a.mass_kg);
    const apart = new Set([...isChanged, ...cannot.map((part) => part.id)]);
    this.cannot.hidden = !cannot.length;
    say(this.cannotTitle, `Cannot be lifted (${whole(cannot.length)})`);
    this.fill(this.cannotRows, cannot);
    for (const group of this.groups) {
      // While a hand moves something, rows keep their order.
      if (!app.draft) group.order = [...group.parts].sort(byUse(app.answer?.parts));
      const here = group.order.filter((part) => isShown.has(part.id));
      const own = here.filter((part) => !apart.has(part.id));
      group.element.hidden = !here.length;
      say(group.summary, `${group.title} (${whole(here.length)}${own.length < here.length ? `, ${whole(here.length - own.length)} above` : ""})`);
      chooseMeans(group.means, commonMeans(group.parts, app.setup));
      if (group.element.open) this.fill(group.rows, own); // a closed one is filled when it opens
    }
    this.roving.renew();
  }

  /** Put the rows of parts into a list, as the parts are now. */
  fill(list, parts) {
    for (const part of parts) this.update(part);
    put(list, parts.map((part) => this.rows.get(part.id).element)); // prettier-ignore
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
    say(row.small, small);
    say(row.use, use);
    say(row.why, why);
    const chosen = app.chosen === part.id;
    if (chosen !== row.button.hasAttribute("aria-current")) row.button.toggleAttribute("aria-current", chosen);
  }

  /** Bring the row of the chosen part into view. */
  reveal(id) {
    const row = this.rows.get(id).element;
    const apart = [this.changed, this.cannot].find((group) => group.contains(row));
    const group = apart ?? this.groups.find(({ parts }) => parts.some((part) => part.id === id)).element;
    if (!group.open) {
      group.open = true;
      this.render();
    }
    row.scrollIntoView({ block: "nearest" });
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

const say = (element, words) => {
  if (element.textContent !== words) element.textContent = words;
};

/** Put elements into a list in this order; what is in its place stays there, and so do focus and scrolling. */
function put(list, elements) {
  const focused = document.activeElement;
  let next = list.firstChild;
  for (const element of elements) {
    if (element === next) next = next.nextSibling;
    else list.insertBefore(element, next);
  }
  while (list.children.length > elements.length) list.lastChild.remove();
  if (focused && focused !== document.activeElement && list.contains(focused)) focused.focus({ preventScroll: true });
}
