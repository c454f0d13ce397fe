// A watch under way: obstructions that are dropped go to their file, and each revision is told; the state of the plan marks the parts.
import { byId, el, fill } from "../page/dom.mjs";
import { call } from "./api.mjs";
import { CarriedOut } from "./carried.mjs";
import { revisionWords, stopWords } from "./revision.mjs";

const TICK_MS = 200;

export class Watching {
  constructor(app) {
    this.app = app;
    this.bar = byId("job");
    this.watch = null;
  }

  get isRunning() {
    return this.watch !== null;
  }

  /** @param speed how many times as fast as real time the plan is carried out; null: it is not */
  async start(path, speed) {
    const { watch } = await call("POST", "/api/watch", { path, simulate: speed });
    this.watch = watch;
    this.isBegun = false;
    this.carried = speed === null ? null : new CarriedOut();
    this.clock = el("span", { id: "carried" });
    this.status = el("span", { id: "stage", role: "status" }, "The watch starts");
    this.end = el("button", { type: "button", onclick: () => this.stop() }, "End the watch");
    fill(this.bar, this.carried ? this.clock : null, this.status, el("span", { class: "gap" }), this.end);
    this.bar.hidden = false;
    this.app.state.look();
    if (this.carried) this.ticking = setInterval(() => this.tick(), TICK_MS);
    this.tick();
    await this.follow(path);
  }

  async follow(path) {
    const { watch } = this;
    try {
      for (let next = 0; ; ) {
        const now = await call("GET", `/api/watch/${watch}?after=${next}`);
        next = now.next;
        if (now.state === "starting" && now.stage) this.status.textContent = `The watch starts: ${now.stage}`;
        for (const event of now.events) this.take(event, path);
        if (this.carried && now.events.length && path === this.app.opened?.path) this.app.setCarried(this.carried);
        if (now.state === "ended" || now.state === "failed") return this.ended(now);
      }
    } catch (error) {
      this.ended({ state: "ended" });
      this.app.fail(error);
    }
  }

  take(event, path) {
    const { app } = this;
    this.carried?.take(event);
    if (event.event === "state" || event.event === "clock") return;
    if (event.revision === undefined || event.event === "rejected" || event.event === "failed") {
      if (event.message) app.say(event.message, event.hint);
      return;
    }
    const isFirst = !this.isBegun; // a new plan, or the one on disk
    this.isBegun = true;
    const words = isFirst ? `Watching ${path}` : [revisionWords(event), stopWords(event, (id) => app.nameOf(id))].filter(Boolean).join(" · ");
    this.status.textContent = words;
    if (path === app.opened?.path) app.state.look();
    app.announce(words);
  }

  /** Show the simulated time and what is lifted. */
  tick() {
    if (this.carried) this.clock.textContent = this.carried.words((id) => this.app.nameOf(id));
  }

  async stop() {
    this.end.disabled = true;
    this.status.textContent = "The watch ends and writes its log";
    try {
      await call("DELETE", `/api/watch/${this.watch}`);
    } catch (error) {
      this.app.fail(error);
    }
  }

  ended(now) {
    clearInterval(this.ticking);
    this.watch = this.carried = null;
    this.bar.hidden = true;
    this.app.setCarried(null);
    this.app.state.look();
    if (now.state === "failed") this.app.say(now.error ?? "The watch failed.", now.hint);
  }
}
