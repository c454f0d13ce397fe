// A watch under way: obstructions that are dropped go to their file, and each revision says which parts it changed.
import { byId, el, fill } from "../page/dom.mjs";
import { call } from "./api.mjs";
import { changesOf, revisionWords } from "./revision.mjs";

export class Watching {
  constructor(app) {
    this.app = app;
    this.bar = byId("job");
    this.watch = null;
  }

  get isRunning() {
    return this.watch !== null;
  }

  async start(path) {
    const { watch } = await call("POST", "/api/watch", { path, simulate: null });
    this.watch = watch;
    this.status = el("span", { id: "stage", role: "status" }, "The watch starts");
    this.end = el("button", { type: "button", onclick: () => this.stop() }, "End the watch");
    fill(this.bar, this.status, el("span", { class: "gap" }), this.end);
    this.bar.hidden = false;
    this.app.setChanges(null, null);
    await this.follow(path);
  }

  async follow(path) {
    const { watch } = this;
    try {
      for (let next = 0; ; ) {
        const now = await call("GET", `/api/watch/${watch}?after=${next}`);
        next = now.next;
        if (now.state === "starting" && now.stage) this.status.textContent = `The watch starts: ${now.stage}`;
        for (const event of now.events) this.take(event, now.page, path);
        if (now.state === "ended" || now.state === "failed") return this.ended(now);
      }
    } catch (error) {
      this.ended({ state: "ended" });
      this.app.fail(error);
    }
  }

  take(event, page, path) {
    const { app } = this;
    if (event.event === "state") return;
    if (event.revision === undefined || event.event === "rejected" || event.event === "failed") {
      if (event.message) app.say(event.message, event.hint);
      return;
    }
    const isFirst = event.event === "planned";
    const words = isFirst ? `Watching ${path}` : revisionWords(event);
    this.status.textContent = words;
    if (path === app.opened?.path) app.setChanges(isFirst ? null : changesOf(event), words);
    app.setResult(page, event.revision);
    app.announce(words);
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
    this.watch = null;
    this.bar.hidden = true;
    this.app.setChanges(null, null);
    if (now.state === "failed") this.app.say(now.error ?? "The watch failed.", now.hint);
  }
}
