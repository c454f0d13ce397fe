// Reloads a page that is rewritten while open, and restores its state. A small script next to the page announces the
// new version; a script works for files opened from disk too, unlike a request.
import { byId } from "./dom.mjs";

const EVERY_MS = 1000;
const KEY = "bimvox live page";
const CAMERA = ["azimuth", "elevation", "target", "distance"];

export class Live {
  constructor(app) {
    this.app = app;
    this.button = byId("follow");
    const meta = document.querySelector('meta[name="bimvox-live"]');
    if (!meta) return;
    this.name = meta.content;
    this.version = meta.dataset.version;
    this.on = true;
    this.state = "waiting";
    window.bimvoxLive = (news) => this._hear(news);
    this.button.hidden = false;
    this.button.addEventListener("click", () => this.toggle());
    this._restore();
    this._show();
    this._look();
  }

  toggle() {
    if (this.state === "ended") return;
    this.on = !this.on;
    this._show();
    if (this.on && this.news) this._hear(this.news);
  }

  _show() {
    const words = this.state === "ended" ? "no longer live" : !this.on ? "live: paused" : this.state === "lost" ? "live: no connection" : "● live";
    this.button.textContent = words;
    this.button.disabled = this.state === "ended";
    this.button.setAttribute("aria-pressed", String(this.on && this.state !== "ended"));
    this.button.dataset.state = this.state;
  }

  _look() {
    if (this.state === "ended") return;
    const script = document.createElement("script");
    const next = (state) => {
      script.remove();
      if (this.state !== "ended" && state) this.state = state;
      this._show();
      setTimeout(() => this._look(), EVERY_MS);
    };
    script.addEventListener("load", () => next(null));
    script.addEventListener("error", () => next("lost"));
    script.src = `${encodeURIComponent(this.name)}?${Date.now()}`;
    document.head.append(script);
  }

  _hear(news) {
    this.news = news;
    this.state = news.ended ? "ended" : "heard";
    if (news.version !== this.version && this.on) {
      this._save();
      location.reload();
    }
  }

  _save() {
    const { app } = this;
    const kept = {
      newest: app.number === app.plans.length - 1,
      revision: app.plan.revision.number,
      time: app.time,
      playing: app.playing,
      speed: app.speed,
      layers: app.layers,
      filter: app.visibility.state,
      colourBy: app.colourBy,
      section: app.section.state,
      pane: app.panes.shown,
      gantt: { open: app.gantt.open, by: app.gantt.by, zoom: app.gantt.zoom },
      tab: app.details.opened,
      chosen: app.chosen === null ? null : app.parts[app.chosen].id,
      camera: Object.fromEntries(CAMERA.map((name) => [name, app.camera[name]])),
      version: this.version,
    };
    try {
      sessionStorage.setItem(KEY + location.pathname, JSON.stringify(kept));
    } catch {
      // Without session storage the page starts from the beginning.
    }
  }

  _restore() {
    const { app } = this;
    let kept = null;
    try {
      kept = JSON.parse(sessionStorage.getItem(KEY + location.pathname));
      sessionStorage.removeItem(KEY + location.pathname);
    } catch {
      return;
    }
    if (!kept) return;
    const same = app.plans.findIndex((plan) => plan.revision.number === kept.revision);
    app.number = kept.newest || same < 0 ? app.plans.length - 1 : same;
    app.time = kept.time;
    app.speed = kept.speed;
    app.playing = kept.playing;
    app.layers = { ...app.layers, ...kept.layers };
    if (kept.gantt) Object.assign(app.gantt, { by: kept.gantt.by, zoom: kept.gantt.zoom });
    if (kept.gantt?.open) app.gantt.toggle(true);
    if (kept.colourBy) app.colourBy = kept.colourBy;
    if (kept.filter) app.visibility.take(kept.filter);
    const chosen = app.parts.findIndex((part) => part.id === kept.chosen);
    app.chosen = chosen < 0 ? null : chosen;
    Object.assign(app.camera, kept.camera, { glide: null });
    app.layerList.update();
    app.show();
    if (kept.section) app.section.take(kept.section);
    if (kept.pane) app.panes.show(kept.pane);
    if (kept.tab) app.details.open(kept.tab);
    const { revision } = app.plans[app.plans.length - 1];
    const { changes } = revision;
    app.say(changes ? `Revision ${revision.number} loaded: ${changes.replanned.length} replanned, ${revision.infeasible} refused` : `Revision ${revision.number} loaded`);
  }
}
