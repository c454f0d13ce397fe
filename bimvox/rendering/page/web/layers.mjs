// Visible layers and the legend.
import { byId, el, fill } from "./dom.mjs";

const CHOICES = [
  ["crane", "Crane"],
  ["yard", "Parts in the yard"],
  ["boxes", "Start and target boxes"],
  ["targets", "All targets"],
  ["structure", "Existing structure"],
  ["obstructions", "Obstructions"],
  ["voxels", "Voxels, not real shapes (v)"],
];
const PATHS = [["active", "of the lift under way"], ["chosen", "of the chosen part"], ["all", "all"], ["none", "none"]];

export const LAYERS = { crane: true, yard: true, boxes: true, targets: false, structure: true, obstructions: true, voxels: false, paths: "active" };

export class Layers {
  constructor(app) {
    this.app = app;
    const set = document.querySelector("#layers fieldset");
    this.boxes = CHOICES.map(([name, label]) => {
      const input = el("input", { type: "checkbox", "data-layer": name, onchange: () => app.setLayer(name, input.checked) });
      set.append(el("label", {}, input, label));
      return [name, input];
    });
    this.paths = el("select", { id: "paths", onchange: () => app.setLayer("paths", this.paths.value) }, ...PATHS.map(([value, label]) => el("option", { value }, label)));
    set.append(el("label", {}, "Paths", this.paths));
    this.update();
  }

  update() {
    for (const [name, input] of this.boxes) input.checked = this.app.layers[name];
    this.paths.value = this.app.layers.paths;
  }

  nextPaths() {
    const at = PATHS.findIndex(([value]) => value === this.app.layers.paths);
    this.app.setLayer("paths", PATHS[(at + 1) % PATHS.length][0]);
  }

  /** The legend of the revision shown. */
  renderLegend() {
    const { app } = this;
    const { states, kinds } = app.document.colours;
    const there = new Set(app.document.standing.map((thing) => thing.kind));
    const entries = [
      ["unbuilt (in the yard)", states.unbuilt],
      ["in transit", states.in_transit, "hatch"],
      ["arrived", states.arrived],
      ["assembled", states.assembled],
      ["construction area", kinds.construction_area],
      ["yard", kinds.yard],
      app.scene?.slab.hasAccess ? ["access of trucks", kinds.access] : null,
      there.has("structure") ? ["existing structure", kinds.structure] : null,
      app.plan.revision.obstructions.length ? ["obstruction", [44, 44, 48]] : null,
      ["start", [190, 100, 0], "box"],
      ["target", [196, 40, 120], "box"],
      app.plan.revision.infeasible ? ["infeasible", [200, 30, 20], "box dashed"] : null,
      ["path", states.in_transit, "line"],
    ];
    fill(document.querySelector("#legend ul"), ...entries.filter(Boolean).map(([label, rgb, kind]) => {
      const swatch = el("span", { class: `swatch ${kind ?? ""}` });
      const colour = `rgb(${rgb.join(" ")})`;
      if (kind && kind !== "hatch") swatch.style.borderColor = colour;
      else swatch.style.backgroundColor = colour;
      return el("li", {}, swatch, label);
    })); // prettier-ignore
    if (matchMedia("(max-height: 640px), (max-width: 860px)").matches) byId("legend").open = false;
  }
}
