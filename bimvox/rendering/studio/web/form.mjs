// The pane of the set-up: what is typed and chosen. Fields are made once for a structure and then only updated, so that focus stays.
import { byId, el, fill, terms } from "../page/dom.mjs";
import { classWords, fixed, nameOf, sentence, tonnes } from "../page/words.mjs";
import { calendarFields } from "./calendar.mjs";
import { areaWords } from "./dimensions.mjs";
import { chooseMeans } from "./list.mjs";
import { axisNames, numberOf, pointOf, shownPair, written } from "./numbers.mjs";
import { areasOf, craneName, MEANS, acrossOf, withArea, withBox, withCorner, withCrane, withKind, withMeans, withNewCrane, withObstruction, withoutArea, withoutCorner, withoutCrane, withPolygon, withZone, polygonOf, ZONE_KINDS } from "./setup.mjs";
import { KINDS, withPartKind } from "./types.mjs";
import { meansOf, OTHERS, useWords } from "./use.mjs";

/** While a hand moves something: a browser looks through all fields of a page whenever one of them is filled. */
const PERIOD_MS = 150;

export class Form {
  constructor(app) {
    this.app = app;
    this.pane = byId("pane-setup");
    this.fields = [];
    this.made = null;
    this.part = el("div", { class: "chosen-part" });
    this.problems = el("div", { class: "problems" });
    this.body = el("div");
    fill(this.pane, this.problems, this.part, this.body);
  }

  /** The map if coordinates are typed as the map's, otherwise null. */
  get map() {
    return this.app.onMap ? this.app.opened.map : null;
  }

  render() {
    const { app } = this;
    if (!app.opened) return;
    const { setup } = app;
    const structure = JSON.stringify([app.opened.path, app.onMap, setup.cranes.map((crane) => [crane.name, crane.machine]), areasOf(setup).map(({ id, kind, polygon }) => [id, kind, polygon.length])]);
    if (structure !== this.made) {
      this.made = structure;
      this.build();
    }
    if (!app.draft) this.renderFields();
    else this.waiting ??= setTimeout(() => this.renderFields(), PERIOD_MS);
    this.renderProblems();
    this.renderPart();
  }

  renderFields() {
    clearTimeout(this.waiting);
    this.waiting = null;
    for (const field of this.fields) field.update(this.app.setup);
  }

  build() {
    const { app } = this;
    const key = document.activeElement?.closest?.("#pane-setup [data-key]")?.dataset.key;
    const open = new Map([...this.body.querySelectorAll("details")].map((group) => [group.dataset.group, group.open]));
    this.fields = [];
    const several = app.setup.cranes.length > 1;
    const group = (id, title, ...content) => el("details", { class: "group-of", "data-group": id, open: open.get(id) ?? !/^(access|construction|zones|calendar)/.test(id) }, el("summary", {}, title), ...content);
    // What is added is typed next: its fields open, and the first one has the focus.
    const adding = (key, words, added) => el("button", { type: "button", "data-key": key, onclick: () => this.add(words, added()) }, words);
    const areas = areasOf(app.setup).map((area) => {
      const made = group(area.id, area.name, ...this.area(area));
      this.fields.push({ update: (setup) => (made.firstChild.textContent = areasOf(setup).find(({ id }) => id === area.id).name) });
      return made;
    });
    fill(
      this.body,
      app.opened.map ? this.units() : null,
      group("ground", "Ground", this.ground()),
      ...app.setup.cranes.map((crane, n) => group(`cranes/${n}`, craneName(crane, n, several), this.crane(n))),
      ...areas,
      group("calendar", "Calendar", calendarFields(this)),
      el("div", { class: "links" }, app.opened.moves ? null : el("button", { type: "button", "data-key": "add-crane", onclick: () => this.addCrane() }, "Add a crane"), adding("add-yard", "Add a yard", () => withArea(app.setup, "yard", app.drawing.view.centre)), adding("add-access", "Add an access", () => withArea(app.setup, "access", app.drawing.view.centre, "", [12, 4])), adding("add-zone", "Add a zone", () => withArea(app.setup, "zones", app.drawing.view.centre)), adding("add-box", "Add an obstruction", () => withObstruction(app.setup, app.drawing.view.centre))),
    );
    if (key) this.body.querySelector(`[data-key="${CSS.escape(key)}"]`)?.focus();
  }

  units() {
    const { app } = this;
    const choice = (value, words) => {
      const input = el("input", { type: "radio", name: "units", "data-key": `units-${words}`, onchange: () => app.setUnits(value) });
      input.checked = app.onMap === value;
      return el("label", {}, input, words);
    };
    return el("fieldset", { class: "units" }, el("legend", {}, "Coordinates"), choice(false, "of the site"), choice(true, "of the map"));
  }

  ground() {
    const { app } = this;
    return el("div", { class: "fields" }, this.number("ground", "Height in the model, m", (setup) => setup.ground_m, (value) => app.change({ ...app.setup, ground_m: value }, "height of the ground")), el("p", { class: "about" }, app.opened.ground_why ?? ""));
  }

  /** Enter a set-up with another area. */
  add(words, setup) {
    const { app } = this;
    const had = new Set(areasOf(app.setup).map(({ id }) => id));
    app.change(setup, words.replace(/^Add an? /, "new "));
    const added = areasOf(app.setup).find(({ id }) => !had.has(id));
    if (added) this.focus(added.id);
  }

  /** Another crane, of the machine of the last one. */
  addCrane() {
    const { app } = this;
    const { setup } = app;
    const { machines, building } = app.opened;
    const last = setup.cranes.at(-1);
    const machine = machines.find(({ name }) => name === last?.machine) ?? machines[0];
    const at = last ? acrossOf(last.base_m, building.outline) : app.drawing.view.centre;
    app.change(withNewCrane(setup, machine.name, at), "new crane");
    app.drawing.reveal(app.setup.cranes.at(-1).base_m);
    this.focus(`cranes/${setup.cranes.length}`);
  }

  crane(n) {
    const { app } = this;
    const crane = app.setup.cranes[n];
    const machines = app.opened.machines;
    const machine = machines.find((one) => one.name === crane.machine);
    const change = (values, what) => app.change(withCrane(app.setup, n, values), what);
    const options = [...(machine ? [] : [[crane.machine ?? "", crane.machine || "described in the site file"]]), ...machines.map((one) => [one.name, one.label])];
    const numbers = (list, own, unit) => [["", "the usual one"], ...[...new Set([...list, ...(own ? [own] : [])])].sort((a, b) => a - b).map((value) => [String(value), unit(value)])];
    const of = (value) => (value === "" ? null : Number(value));
    return el(
      "div",
      { class: "fields" },
      // Of a crane that moves, the machine is one for all set-ups: the site file says it.
      app.opened.moves ? el("p", { class: "about" }, `${machine?.label ?? crane.machine}; a set-up of the crane that moves`) : this.select(`crane-${n}-machine`, "Machine", options, (setup) => setup.cranes[n].machine ?? "", (value) => change({ machine: value, jib_m: null, falls: null, height_m: null }, "machine")),
      machine?.jibs_m.length ? this.select(`crane-${n}-jib`, machine.kind === "mobile" ? "Boom" : "Jib", numbers(machine.jibs_m, crane.jib_m, (value) => `${value} m`), (setup) => text(setup.cranes[n].jib_m), (value) => change({ jib_m: of(value) }, "jib")) : null,
      machine?.falls.length && !app.opened.moves ? this.select(`crane-${n}-falls`, "Falls", numbers(machine.falls, crane.falls, (value) => String(value)), (setup) => text(setup.cranes[n].falls), (value) => change({ falls: of(value) }, "falls")) : null,
      // A machine of another kind stands as high as the server says until a height is typed.
      machine?.kind === "mobile" || (!machine && !crane.height_m) ? null : this.number(`crane-${n}-height`, "Jib height, m", (setup) => setup.cranes[n].height_m ?? app.answer?.cranes[n]?.height_m, (value) => change({ height_m: value }, "jib height"), (value) => (value > 0 ? null : "The jib height must be above 0 m.")),
      this.pair(`cranes/${n}`, (setup) => setup.cranes[n].base_m, (at) => change({ base_m: at }, "place of the crane")),
      app.setup.cranes.length > 1 && !app.opened.moves ? el("div", {}, el("button", { type: "button", "data-key": `crane-${n}-remove`, onclick: () => app.change(withoutCrane(app.setup, n), "crane removed") }, "Remove this crane")) : null,
    );
  }

  area({ id, what, kind, polygon, name }) {
    const { app } = this;
    const n = Number(id.split("/")[1]);
    const remove = (words) => el("button", { type: "button", "data-key": `${id}-remove`, onclick: () => app.change(withoutArea(app.setup, id), words) }, sentence(words));
    const size = el("p", { class: "about" });
    this.fields.push({ update: (setup) => (size.textContent = areaWords(polygonOf(setup, id))) });
    const corners = polygon.map((_, m) =>
      el(
        "div",
        { class: "corner", role: "group", "aria-label": `${name}, corner ${m + 1}` },
        el("span", { class: "number" }, String(m + 1)),
        this.pair(`${id}/${m}`, (setup) => polygonOf(setup, id)[m], (at) => app.change(withPolygon(app.setup, id, polygonOf(app.setup, id).map((old, k) => (k === m ? at : old))), `corner of ${name}`)),
        el("button", { type: "button", "data-key": `${id}/${m}-add`, title: "Add a corner after this one", "aria-label": `Add a corner after corner ${m + 1}`, onclick: () => app.change(withCorner(app.setup, id, m), "new corner") }, "+"),
        el("button", { type: "button", "data-key": `${id}/${m}-drop`, title: "Remove this corner", "aria-label": `Remove corner ${m + 1}`, disabled: polygon.length < 4, onclick: () => app.change(withoutCorner(app.setup, id, m), "corner removed") }, "−"),
      ),
    );
    if (what === "boxes") return [this.box(n), remove("remove this obstruction")];
    const zone = what === "zones" ? this.zone(n, kind) : [];
    return [el("div", { class: "fields" }, ...zone, size), el("div", { class: "corner heads", "aria-hidden": "true" }, el("span", { class: "number" }), ...axisNames(this.map).map((axis) => el("span", {}, `${axis}, m`)), el("span", { class: "acting" })), ...corners, what === "zones" ? remove("remove this zone") : what === "access" ? remove("remove this access") : what === "yard" && app.setup.yard.length > 1 ? remove("remove this yard") : null];
  }

  /** The fields of an obstruction: its name, and from where to where it is, in metres of the site. */
  box(n) {
    const { app } = this;
    const take = (typed) => {
      const id = typed.trim();
      if (!id) return "An obstruction needs a name.";
      if (app.setup.boxes.some((box, m) => m !== n && box.id === id)) return `There is an obstruction “${id}” already.`;
      return app.change(withBox(app.setup, n, { id }), "name of the obstruction");
    };
    const end = (axis, which) => {
      const check = (value) => (which === "min" ? value < app.setup.boxes[n].max[axis] : value > app.setup.boxes[n].min[axis]) ? null : `It must ${which === "min" ? "begin before it ends" : "end after it begins"}.`; // prettier-ignore
      const write = (value) => app.change(withBox(app.setup, n, { [which]: app.setup.boxes[n][which].map((old, k) => (k === axis ? value : old)) }), "size of the obstruction");
      return this.number(`boxes/${n}-${which}-${axis}`, which === "min" ? "from" : "to", (setup) => setup.boxes[n][which][axis], write, check);
    };
    const name = this.input(`boxes/${n}-name`, (setup) => setup.boxes[n].id, take, "text");
    const axes = ["x", "y", "z"].map((axis, k) => el("div", { class: "corner", role: "group", "aria-label": `${axis} in metres` }, el("span", { class: "number" }, axis), el("div", { class: "pair ends" }, end(k, "min"), end(k, "max"))));
    return el("div", { class: "fields" }, el("label", {}, el("span", {}, "Name"), name), ...axes);
  }

  zone(n, kind) {
    const { app } = this;
    const number = (key, title, check) => this.number(`zones/${n}-${key}`, title, (setup) => setup.zones[n][key], (value) => app.change(withZone(app.setup, n, { [key]: value }), title), check, true);
    const name = this.input(`zones/${n}-name`, (setup) => setup.zones[n].name ?? "", (typed) => app.change(withZone(app.setup, n, { name: typed.trim() || null }), "name of the zone"), "text"); // prettier-ignore
    return [
      el("label", {}, el("span", {}, "Name"), name),
      this.select(`zones/${n}-kind`, "Kind", Object.entries(ZONE_KINDS), (setup) => setup.zones[n].kind, (value) => app.change(withKind(app.setup, n, value), "kind of the zone")),
      kind === "slow" ? number("share", "Share of the rates", (value) => (value > 0 && value <= 1 ? null : "The share must be above 0 and at most 1.")) : null,
      ...(kind === "limiter" ? [number("lowest_hook_m", "Lowest hook, m"), number("highest_hook_m", "Highest hook, m")] : []),
    ];
  }

  select(key, title, options, read, write) {
    const select = el("select", { "data-key": key }, ...options.map(([value, words]) => el("option", { value }, words)));
    select.addEventListener("change", () => write(select.value));
    this.fields.push({ update: (setup) => (select.value = read(setup)) });
    return el("label", {}, el("span", {}, title), select);
  }

  number(key, title, read, write, check = () => null, optional = false) {
    const input = this.input(key, (setup) => written1(read(setup)), (typed) => {
      if (optional && !typed.trim()) return write(null);
      const value = numberOf(typed);
      const wrong = value === null ? `“${typed}” is not a number: write it as 12.5.` : check(value);
      if (wrong) return wrong;
      return write(value);
    }); // prettier-ignore
    return el("label", {}, el("span", {}, title), input);
  }

  /** Two coordinates of one point. */
  pair(key, read, write) {
    const names = axisNames(this.map);
    const inputs = names.map((name, axis) => {
      const input = this.input(`${key}-${axis}`, (setup) => written(shownPair(read(setup), this.map)[axis]), (typed) => {
        const value = numberOf(typed);
        if (value === null) return `“${typed}” is not a coordinate: write metres, as in 12.5.`;
        const now = shownPair(read(this.app.setup), this.map);
        now[axis] = value;
        return write(pointOf(now, this.map));
      }); // prettier-ignore
      return el("label", { class: "axis" }, el("span", {}, `${name}, m`), input);
    });
    return el("div", { class: "pair" }, ...inputs);
  }

  /** A text field. `take` enters what was typed, or returns a sentence that says what is wrong with it. */
  input(key, read, take, mode = "decimal") {
    const input = el("input", { type: "text", inputmode: mode, autocomplete: "off", "data-key": key });
    input.addEventListener("change", () => {
      const wrong = take(input.value);
      if (typeof wrong === "string") {
        input.setAttribute("aria-invalid", "true");
        this.app.say(wrong);
      } else {
        input.removeAttribute("aria-invalid");
        this.app.unsay();
        input.dataset.shown = input.value = read(this.app.setup);
      }
    });
    input.addEventListener("keydown", (event) => {
      if (event.key !== "Escape" || input.value === input.dataset.shown) return;
      event.stopPropagation();
      input.value = input.dataset.shown;
      input.removeAttribute("aria-invalid");
    });
    this.fields.push({
      update: (setup) => {
        const value = read(setup);
        if (input.dataset.shown === value) return;
        input.dataset.shown = input.value = value;
        input.removeAttribute("aria-invalid");
      },
    });
    return input;
  }

  /** Go to the fields of a handle. */
  focus(id) {
    const [what, n] = id.split("/");
    const group = this.body.querySelector(`[data-group="${what}/${n}"]`);
    if (group) group.open = true;
    const key = what === "cranes" ? `cranes/${n}-0` : what === "boxes" ? `boxes/${n}-name` : what === "zones" && id.split("/").length < 3 ? `zones/${n}-name` : id.split("/").length > 2 ? `${id}-0` : `${id}/0-0`;
    const field = this.body.querySelector(`[data-key="${CSS.escape(key)}"]`);
    field?.focus();
    field?.select();
  }

  renderProblems() {
    const found = this.app.answer?.problems ?? [];
    const words = JSON.stringify(found);
    if (words === this.problemsMade) return;
    this.problemsMade = words;
    fill(this.problems, ...found.map((problem) => el("p", { class: "warn" }, problem)));
  }

  renderPart() {
    const { app } = this;
    const part = app.opened.parts.find((one) => one.id === app.chosen);
    const found = part && app.found(part.id);
    const state = part && app.stateOf(part);
    const kindNow = part && (app.setup.part_kinds?.[part.id] ?? part.kind);
    const words = JSON.stringify([app.chosen, found, state, kindNow, app.opened.path]);
    if (words === this.partMade) return;
    this.partMade = words;
    if (!part) return fill(this.part);
    const focused = this.part.contains(document.activeElement) && document.activeElement.dataset.key;
    const means = el("select", { "data-key": "part-means" });
    chooseMeans(means, meansOf(part, app.setup));
    means.addEventListener("change", () => app.change(withMeans(app.setup, [part.id], means.value), `means of ${nameOf(part)}`));
    const kind = el("select", { "data-key": "part-kind" }, ...Object.entries(KINDS).map(([value, said]) => el("option", { value }, said)));
    kind.value = kindNow;
    kind.addEventListener("change", () => app.change(withPartKind(app.setup, part.id, kind.value), `kind of ${nameOf(part)}`));
    fill(
      this.part,
      el("p", { class: "kicker" }, [classWords(part.class ?? ""), part.storey].filter(Boolean).join(" · ")),
      el("h2", {}, nameOf(part)),
      state === "cannot" ? el("p", { class: "warn" }, found?.reason || "It cannot be lifted here.") : null,
      terms([
        ["Use", state in OTHERS ? (state === "cannot" ? null : MEANS[state] ?? OTHERS[state]) : useWords(state, found)],
        ["Mass", tonnes(part.mass_kg)],
        ["On the hook", meansOf(part, app.setup) === "crane" && part.hook_load_kg ? tonnes(part.hook_load_kg) : null],
        ["Radius", found?.radius_m !== null && found?.radius_m !== undefined ? `${fixed(found.radius_m, 2)} m` : null],
        ["Crane", app.setup.cranes.length > 1 ? found?.crane : null],
        ["Height", `${fixed(part.low_m, 2)} to ${fixed(part.top_m, 2)} m`],
        ["Id", el("code", {}, part.id)],
      ]),
      el("div", { class: "fields" }, el("label", {}, el("span", {}, "How it is set"), means), el("label", {}, el("span", {}, "What it is"), kind)),
      kindNow === part.kind ? el("p", { class: "about" }, part.kind_from) : null,
    );
    if (focused) this.part.querySelector(`[data-key="${focused}"]`)?.focus();
  }
}

const text = (value) => (value === null || value === undefined ? "" : String(value));
const written1 = (value) => (value === null || value === undefined ? "" : written(value));
