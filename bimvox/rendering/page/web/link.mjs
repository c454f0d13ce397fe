// A link to a moment and a view: time, camera, choice, filter and colours after the # of the address.
import { byId } from "./dom.mjs";

const SAID_MS = 4000;

/** The text of a link for what an app shows. */
export function linkOf(app) {
  const { camera, visibility, plan } = app;
  const round = (value) => Number(value.toFixed(3));
  const link = new URLSearchParams();
  link.set("log", plan.revision.sha256.slice(0, 12));
  link.set("t", String(round(app.time)));
  link.set("camera", [camera.azimuth, camera.elevation, camera.distance, ...camera.target].map(round).join());
  if (app.chosen !== null) link.set("part", app.parts[app.chosen].id);
  if (visibility.query) link.set("search", visibility.query);
  for (const { act, by, value } of visibility.steps) link.append("show", value === null ? `${act}:${by}` : `${act}:${by}:${value}`);
  if (app.colourBy !== "status") link.set("colour", app.colourBy);
  if (app.section.state) link.set("section", app.section.state.join());
  return link.toString();
}

/** What a link says: only what can be read of it. */
export function readLink(text) {
  const link = new URLSearchParams(text.replace(/^#/, ""));
  const numbers = (name, count) => {
    const found = (link.get(name) ?? "").split(",").map((word) => (word.trim() ? Number(word) : NaN));
    return found.length === count && found.every(Number.isFinite) ? found : null;
  };
  const steps = link.getAll("show").map((step) => {
    const [act, by, ...value] = step.split(":");
    return { act, by, value: value.length ? value.join(":") : null };
  });
  return {
    log: link.get("log"),
    time: numbers("t", 1)?.[0] ?? null,
    camera: numbers("camera", 6),
    section: numbers("section", 6),
    part: link.get("part"),
    filter: { query: link.get("search") ?? "", steps },
    colour: link.get("colour") ?? "status",
  };
}

export class Link {
  constructor(app) {
    this.app = app;
    byId("link-button").addEventListener("click", () => this.copy());
    window.addEventListener("hashchange", () => this.read());
  }

  /** Puts the link into the address and the clipboard. */
  async copy() {
    history.replaceState(null, "", `#${linkOf(this.app)}`);
    try {
      await navigator.clipboard.writeText(location.href);
      this.tell("The link to this moment and view is copied.");
    } catch {
      this.tell("The link to this moment and view is in the address bar.");
    }
  }

  /** Shows what the address says. */
  read() {
    if (location.hash.length < 2) return;
    const { app } = this;
    const told = readLink(location.hash);
    const number = told.log === null ? -1 : app.plans.findLastIndex((plan) => plan.revision.sha256.startsWith(told.log));
    if (number >= 0) app.number = number;
    if (told.time !== null) app.time = told.time;
    app.visibility.take(told.filter);
    app.colourBy = app.layerList.used.includes(told.colour) ? told.colour : "status";
    app.section.take(told.section);
    app.layerList.update();
    app.show();
    const part = told.part === null ? -1 : app.parts.findIndex((entry) => entry.id === told.part);
    app.choose(part < 0 ? null : part);
    if (told.camera) {
      const [azimuth, elevation, distance, ...target] = told.camera;
      Object.assign(app.camera, { azimuth, elevation, distance: Math.max(distance, 1), target, glide: null });
    }
    if (told.log !== null && number < 0) this.tell("This link was made from another plan; what this plan has of it is shown.");
    else if (told.part !== null && part < 0) this.tell("The part of this link is not in this plan.");
    app.changed();
  }

  /** Shows a note for a while, and says it. */
  tell(words) {
    const note = byId("note");
    note.textContent = words;
    note.hidden = false;
    clearTimeout(this.timer);
    this.timer = setTimeout(() => (note.hidden = true), SAID_MS);
    this.app.say(words);
  }
}
