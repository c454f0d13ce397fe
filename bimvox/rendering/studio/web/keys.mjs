// Keyboard shortcuts. Text fields keep the keys that they use.
import { byId, el, fill } from "../page/dom.mjs";

const KEYS = [
  ["Tab", "to the handles of crane, yard and zones, and to everything else"],
  ["← → ↑ ↓", "on a handle: move it by 0.5 m, with Shift by 0.1 m; on the plan: move the view"],
  ["Enter", "on a handle: type its coordinates"],
  ["↑ ↓", "on the ground of the 3-D view: move it by 0.5 m, with Shift by 0.1 m"],
  ["Insert, Delete", "on a corner: add one after it, remove it"],
  ["Esc", "let go of what is dragged; clear the choice"],
  ["Ctrl+Z, Ctrl+Y", "undo, redo"],
  ["Ctrl+S", "save"],
  ["Ctrl+Enter", "save and plan"],
  ["Ctrl+O", "open a file"],
  ["/", "search the parts"],
  ["f", "show everything"],
  ["+ −", "zoom"],
  ["?", "this list"],
];

export function watchKeys(app) {
  const help = byId("help");
  fill(help.querySelector("dl"), ...KEYS.flatMap(([keys, what]) => [el("dt", {}, el("kbd", {}, keys)), el("dd", {}, what)]));
  byId("help-button").addEventListener("click", () => help.showModal());
  const withControl = {
    z: (event) => (event.shiftKey ? app.redo() : app.undo()),
    y: () => app.redo(),
    s: () => app.save(),
    o: () => app.chooseFile(),
    enter: () => app.plan(),
  };
  const alone = {
    "/": () => {
      app.panes.show("parts");
      byId("query").focus();
    },
    f: () => app.drawing.fit(),
    "+": () => app.drawing.zoom(0.8),
    "=": () => app.drawing.zoom(0.8),
    "-": () => app.drawing.zoom(1.25),
    "?": () => help.showModal(),
    Escape: () => app.choose(null),
  };
  document.addEventListener("keydown", (event) => {
    if (document.querySelector("dialog[open]") || event.altKey) return;
    const at = event.target;
    const typing = at instanceof HTMLInputElement && !/^(radio|checkbox)$/.test(at.type);
    const key = event.key.length > 1 ? event.key : event.key.toLowerCase();
    if (event.ctrlKey || event.metaKey) {
      const act = withControl[key.toLowerCase()];
      // A field with something typed in it undoes its own typing.
      if (!act || (typing && /^[zy]$/.test(key) && at.value !== (at.dataset.shown ?? ""))) return;
      if (typing && key !== "z" && key !== "y") at.dispatchEvent(new Event("change"));
      event.preventDefault();
      act(event);
      return;
    }
    if (typing && event.key === "Escape" && at.type === "search") {
      app.filter({ query: (at.value = "") });
      return at.blur();
    }
    if (typing || at instanceof HTMLSelectElement) return;
    const act = alone[key];
    if (!act || (key === "Escape" && !app.opened)) return;
    event.preventDefault();
    act(event);
  });
}
