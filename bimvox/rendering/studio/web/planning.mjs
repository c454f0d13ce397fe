// A plan under way: its stage, its progress, and the button that cancels it; then its page in this window.
import { byId, el, fill } from "../page/dom.mjs";
import { whole } from "../page/words.mjs";
import { call, token } from "./api.mjs";

const PERIOD_MS = 400;

export class Planning {
  constructor(app) {
    this.app = app;
    this.bar = byId("job");
    this.job = null;
  }

  get isRunning() {
    return this.job !== null;
  }

  /** Plan a site. */
  async start(path) {
    await this.run("/api/plan", { path }, "Planning");
  }

  /** Start a job and follow it. `words`: what it does. */
  async run(address, asked, words) {
    const { job } = await call("POST", address, asked);
    Object.assign(this, { job, words, isDocument: address === "/api/document" });
    this.stage = el("span", { id: "stage", role: "status" }, `${words} starts`);
    this.meter = el("progress", { "aria-label": "Progress of this stage" });
    this.cancel = el("button", { type: "button", onclick: () => this.stop() }, "Cancel");
    fill(this.bar, this.stage, this.meter, el("span", { id: "done" }), this.cancel);
    this.bar.hidden = false;
    this.app.state.look();
    this.app.render();
    await this.follow(asked.path);
  }

  async follow(path) {
    const { job } = this;
    try {
      for (;;) {
        const now = await call("GET", `/api/plan/${job}`);
        if (now.state !== "running") return await this.ended(path, now);
        this.show(now);
        await new Promise((done) => setTimeout(done, PERIOD_MS));
      }
    } catch (error) {
      if (this.job) await this.ended(path, { state: "failed" });
      this.app.fail(error);
    }
  }

  show({ stage, done, of }) {
    const words = stage ? `${this.words}: ${stage}` : this.words;
    if (this.stage.textContent !== words) this.stage.textContent = words;
    if (of) {
      this.meter.max = of;
      this.meter.value = done ?? 0;
    } else this.meter.removeAttribute("value");
    byId("done").textContent = of ? `${whole(done ?? 0)} of ${whole(of)}` : "";
  }

  async stop() {
    this.cancel.disabled = true;
    this.stage.textContent = "Cancelling";
    try {
      await call("DELETE", `/api/plan/${this.job}`);
    } catch (error) {
      this.app.fail(error);
    }
  }

  async ended(path, now) {
    const { app } = this;
    this.job = null;
    this.bar.hidden = true;
    app.render();
    app.state.look();
    if (now.state === "done" && this.isDocument) {
      await app.kept.look();
      app.announce(`The document of ${path} is ready.`);
    } else if (now.state === "done") {
      // The result of what is open is shown at once, that of another variant on request.
      if (path !== app.opened?.path) await app.table.update(path);
      else {
        await app.state.settled();
        app.panes.show("result");
      }
      app.announce(`The plan of ${path} is ready.`);
    } else if (now.state === "cancelled") app.say(`${this.words} was cancelled; nothing was written.`, null, "aside");
    else if (now.error) app.say(typeof now.error === "string" ? now.error : now.error.error, now.hint ?? now.error.hint);
  }

  /** Put the page of a log into the pane of the result; it begins at a time if one is given, in seconds. */
  open(page, mark = "", time_s = null) {
    const address = `${page}?token=${encodeURIComponent(token)}${mark === "" ? "" : `&revision=${mark}`}`;
    const pane = byId("shown");
    if (pane.querySelector("iframe")?.getAttribute("src").split("#")[0] === address) return;
    const wait = el("p", { class: "aside", role: "status" }, "The plan is read and proven again …");
    const src = address + (time_s === null ? "" : `#t=${Math.round(time_s)}`);
    fill(pane, wait, el("iframe", { src, title: "The plan", "data-state": this.told ?? "", onload: () => wait.remove() }));
  }

  /** Say on the page of the plan of what it is: its own verdict is about the files that it carries. */
  tell(title) {
    this.told = title;
    const frame = byId("shown").querySelector("iframe");
    if (!frame || frame.dataset.state === title) return;
    frame.dataset.state = title;
    frame.contentWindow.page?.header.render();
  }
}
