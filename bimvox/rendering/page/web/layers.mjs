// Visible layers and the legend.
import { COLOURINGS, colouring } from "./colours.mjs";
import { byId, el, fill } from "./dom.mjs";

const CHOICES = [
  ["crane", "Crane"],
  ["rings", "Radii of the cranes with gross capacity"],
  ["yard", "Parts in the yard"],
  ["coming", "Parts to come, as ghosts at their places"],
  ["props", "Props and shores"],
  ["boxes", "Start and target boxes"],
  ["targets", "All targets"],
  ["structure", "Existing structure"],
  ["obstructions", "Obstructions"],
  ["voxels", "Voxels, not real shapes (v)"],
];
const PATHS = [["active", "of the lift under way"], ["chosen", "of the chosen part"], ["all", "all"], ["none", "none"]];

export const LAYERS = { crane: true, rings: false, yard: true, coming: false, props: true, boxes: true, targets: false, structure: true, obstructions: true, voxels: false, paths: "active" };

export class Layers {
  constructor(app) {
    this.app = app;
    const set = document.querySelector("#layers fieldset");
    const used = CHOICES.filter(([name]) => name !== "rings" || app.groups.cranes.length);
    this.boxes = used.map(([name, label]) => {
      const input = el("input", { type: "checkbox", "data-layer": name, onchange: () => app.setLayer(name, input.checked) });
      set.append(el("label", {}, input, label));
      return [name, input];
    });
    this.paths = el("select", { id: "paths", onchange: () => app.setLayer("paths", this.paths.value) }, ...PATHS.map(([value, label]) => el("option", { value }, label)));
    set.append(el("label", {}, "Paths", this.paths));
    this.colours = byId("colour");
    this.used = COLOURINGS.filter((by) => by !== "crane" || app.groups.cranes.length);
    fill(this.colours, ...this.used.map((by) => el("option", { value: by }, by)));
    this.colours.addEventListener("change", () => app.setColour(this.colours.value));
    this.update();
  }

  update() {
    for (const [name, input] of this.boxes) input.checked = this.app.layers[name];
    this.paths.value = this.app.layers.paths;
    this.colours.value = this.app.colourBy;
  }

  nextPaths() {
    const at = PATHS.findIndex(([value]) => value === this.app.layers.paths);
    this.app.setLayer("paths", PATHS[(at + 1) % PATHS.length][0]);
  }

  nextColour(step) {
    const { used } = this;
    this.app.setColour(used[(used.indexOf(this.app.colourBy) + step + used.length) % used.length]);
  }

  /** The entries of the states, or of the groups by which the parts are coloured. */
  _partEntries() {
    const { app } = this;
    const { colours } = app.document;
    const { states } = colours;
    if (app.colourBy === "status")
      return [["unbuilt (in the yard)", states.unbuilt], ["in transit", states.in_transit, "hatch"], ["arrived", states.arrived], ["assembled", states.assembled]];
    return colouring(app.groups, app.colourBy, colours).map(({ key, label, rgb, striped, parts }) => [`${label} (${parts.length})`, rgb, striped ? "striped" : "", key]);
  }

  /** The legend of the revision shown; activating a group isolates it. */
  renderLegend() {
    const { app } = this;
    const { states, kinds } = app.document.colours;
    const there = new Set(app.document.standing.map((thing) => thing.kind));
    const entries = [
      ...this._partEntries(),
      ["construction area", kinds.construction_area],
      ["yard", kinds.yard],
      app.scene?.slab.hasAccess ? ["access of trucks", kinds.access] : null,
      there.has("structure") ? ["existing structure", kinds.structure] : null,
      app.plan.revision.obstructions.length ? ["obstruction", [44, 44, 48]] : null,
      app.plan.revision.props ? ["prop or shore", [168, 20, 8], "line"] : null,
      ["start", [190, 100, 0], "box"],
      ["target", [196, 40, 120], "box"],
      app.plan.revision.infeasible ? ["infeasible", [200, 30, 20], "box dashed"] : null,
      ["path", states.in_transit, "line"],
    ];
    fill(document.querySelector("#legend ul"), ...entries.filter(Boolean).map(([label, rgb, kind, key]) => {
      const swatch = el("span", { class: `swatch ${kind ?? ""}` });
      const colour = `rgb(${rgb.join(" ")})`;
      if (kind && kind !== "hatch" && kind !== "striped") swatch.style.borderColor = colour;
      else swatch.style.backgroundColor = colour;
      if (key === undefined) return el("li", {}, swatch, label);
      const name = app.groups.name(app.colourBy, key);
      return el("li", {}, el("button", { type: "button", "data-look": `legend ${key}`, title: `isolate ${name}`, onclick: () => app.look("isolate", app.colourBy, key) }, swatch, label));
    })); // prettier-ignore
    document.querySelector("#legend summary").textContent = app.colourBy === "status" ? "Legend" : `Legend: parts by ${app.colourBy}`;
    if (matchMedia("(max-height: 640px), (max-width: 860px)").matches) byId("legend").open = false;
  }
}
