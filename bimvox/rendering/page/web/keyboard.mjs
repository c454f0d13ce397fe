// Keyboard shortcuts. Fields and lists keep the keys that they use.
import { byId, el, fill } from "./dom.mjs";

const KEYS = [
  ["space", "play or pause"],
  ["← →", "previous or next lift; with Shift 10 seconds back or forward"],
  ["↑ ↓", "faster or slower"],
  ["Home, End", "first or last moment"],
  ["/", "search the lifts"],
  ["1 2 3 4", "view from above, from the front, overview, follow the load"],
  ["5", "from the crane: from the trolley down the hook, from the cab, and back"],
  ["b", "radii of the cranes with their gross capacity"],
  ["f", "fit everything"],
  ["+ −", "zoom"],
  ["w a s d", "rotate the view"],
  ["i h g", "isolate, hide or ghost the part; buttons in its details do so for its class, storey, crane"],
  ["u", "undo the last change of what is shown"],
  ["t", "timeline of the lifts; in it arrows move between the bars, Enter chooses"],
  ["c", "colour by the next criterion; with Shift the one before"],
  ["v", "voxels or real shapes"],
  [", . x", "section: lower or higher by 0.5 m, none; in its card also along x and y"],
  ["m", "measure: click two points, corners of parts before surfaces and ground, or type them; again ends it"],
  ["l", "copy a link to this moment and view"],
  ["r", "list the remarks"],
  ["p", "paths: of the lift under way, of the chosen part, all, none"],
  ["[ ]", "earlier or later revision"],
  ["Tab", "next list or control; in a list ↑ ↓ Home End move between its rows"],
  ["Esc", "clear the choice"],
  ["?", "this list"],
];
const OWN_ARROWS = new Set(["SELECT", "INPUT"]);

export function watchKeys(app) {
  const help = byId("help");
  fill(help.querySelector("dl"), ...KEYS.flatMap(([keys, what]) => [el("dt", {}, el("kbd", {}, keys)), el("dd", {}, what)]));
  byId("help-button").addEventListener("click", () => help.showModal());

  const actions = {
    ArrowLeft: (event) => (event.shiftKey ? app.seek(app.time - 10) : app.stepLift(-1)),
    ArrowRight: (event) => (event.shiftKey ? app.seek(app.time + 10) : app.stepLift(1)),
    ArrowUp: () => app.timeline.nextSpeed(1),
    ArrowDown: () => app.timeline.nextSpeed(-1),
    Home: () => app.seek(app.plan.begins),
    End: () => app.seek(app.plan.ends),
    "/": () => app.search(),
    1: () => app.view("top"),
    2: () => app.view("front"),
    3: () => app.view("iso"),
    4: () => app.view("follow"),
    5: () => app.view("crane"),
    b: () => app.setLayer("rings", !app.layers.rings),
    f: () => app.view("fit"),
    "+": () => app.view("in"),
    "=": () => app.view("in"),
    "-": () => app.view("out"),
    w: () => app.turn(0, 20),
    s: () => app.turn(0, -20),
    a: () => app.turn(25, 0),
    d: () => app.turn(-25, 0),
    i: () => app.lookAtPart("isolate"),
    h: () => app.lookAtPart("hide"),
    g: () => app.lookAtPart("ghost"),
    u: () => app.undoLook(),
    c: () => app.layerList.nextColour(1),
    C: () => app.layerList.nextColour(-1),
    t: () => app.gantt.toggle(),
    l: () => app.link.copy(),
    ",": () => app.section.nudge(-1),
    ".": () => app.section.nudge(1),
    x: () => app.section.clear(),
    m: () => app.measure.toggle(),
    v: () => app.setLayer("voxels", !app.layers.voxels),
    p: () => app.layerList.nextPaths(),
    r: () => app.remarks.open(),
    "[": () => app.setRevision(app.number - 1),
    "]": () => app.setRevision(app.number + 1),
    Escape: () => app.choose(null),
    "?": () => help.showModal(),
  };

  document.addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey || help.open) return;
    const at = event.target;
    const typing = at instanceof HTMLInputElement && at.type === "search";
    if (typing) {
      if (event.key === "Escape") {
        at.value = "";
        at.dispatchEvent(new Event("input"));
        at.blur();
      }
      return;
    }
    if (at instanceof HTMLInputElement && at.type === "number") return;
    if (event.key === " ") {
      // Space presses a focused button; otherwise it plays or pauses.
      if (at instanceof HTMLButtonElement || at instanceof HTMLSelectElement || at.tagName === "SUMMARY" || at.type === "checkbox") return;
      event.preventDefault();
      app.toggle();
      return;
    }
    if (OWN_ARROWS.has(at.tagName) && (event.key.startsWith("Arrow") || event.key === "Home" || event.key === "End")) return;
    if (at instanceof HTMLSelectElement) return;
    const scrolls = at.closest?.(".scroll") && !(at instanceof HTMLButtonElement);
    if (scrolls && (event.key === "ArrowUp" || event.key === "ArrowDown" || event.key === "Home" || event.key === "End")) return;
    const act = actions[event.key];
    if (!act) return;
    event.preventDefault();
    act(event);
  });
}
