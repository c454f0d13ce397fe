// Of what the plan is, as the server says it: one of four states, when it was made, what has changed since, and its lifts by
// outcome. Every view takes words, counts and marks from here. The server compares after every change, and every other second,
// because other programs write these files too.
import { byId, el, fill } from "../page/dom.mjs";
import { whole } from "../page/words.mjs";
import { call, Latest } from "./api.mjs";
import { changesOf } from "./revision.mjs";
import { saved } from "./setup.mjs";

const PERIOD_MS = 2000;
const NONE = { state: "none", title: "No plan", words: "No plan of this site yet.", changes: [], counts: null, when: null, holds: false };
/** What is shown until the server has compared the newest change: what is on the screen is not known to be planned. */
const COMPARED = { state: "earlier", title: "Plan of an earlier state", words: "Plan of an earlier state. What has changed since is compared …", changes: [], holds: false };
const LIGHTS = { none: "plain", earlier: "remarked", working: "working" };

export class PlanState {
  constructor(app) {
    this.app = app;
    this.reset();
    this.asking = new Latest(
      (asked) => this.send(asked),
      (answer, asked) => this.take(answer, asked),
      () => {
        this.of = null;
        this.render();
      },
    );
    setInterval(() => document.visibilityState === "visible" && this.look(), PERIOD_MS);
    addEventListener("focus", () => this.look());
  }

  /** Forget the plan of what was open. */
  reset() {
    Object.assign(this, { answer: null, of: null, shown: null, marked: null });
  }

  send({ opened, setup }) {
    return call("POST", "/api/state", { path: opened.path, setup: saved(setup), sha256: opened.sha256 });
  }

  get asked() {
    return { opened: this.app.opened, setup: this.app.setup };
  }

  look() {
    if (this.app.opened?.exists && !this.app.draft) this.asking.ask(this.asked);
  }

  /** Look, and wait for the answer. */
  async settled() {
    const { asked } = this;
    this.take(await this.send(asked), asked);
  }

  take(answer, { opened, setup }) {
    const { app } = this;
    if (opened !== app.opened) return;
    Object.assign(this, { answer, of: setup });
    app.hear(answer);
    if (this.plan) app.setResult(this.plan.page, this.plan.version);
    else app.panes.allowResult(false);
    this.render();
  }

  get plan() {
    return this.answer?.plan ?? null;
  }

  /** {state: "none", "current", "earlier" or "working", title, words, changes, counts, when} */
  get now() {
    const { app, answer } = this;
    if (!answer) return NONE;
    const isCompared = this.of === app.setup && app.isPlaced && answer.obstructions_sha256 === app.boxesSha256;
    return isCompared || answer.state !== "current" ? answer : { ...answer, ...COMPARED };
  }

  /** The counts in a few words; "" without a plan. */
  get counts() {
    return this.now.counts?.words ?? "";
  }

  /** Mark the parts by what became of them in the plan of what is shown: refused, replanned, done. */
  mark() {
    const { app, plan } = this;
    const key = this.now.holds && plan ? `${plan.version} ${JSON.stringify([plan.refused, plan.done])}` : "";
    if (key === this.marked) return;
    this.marked = key;
    const changes = key ? changesOf({ ...plan, infeasible: [], blocked: plan.refused }, (id) => app.nameOf(id)) : null;
    app.setMarks(changes?.size ? changes : null, new Set(key ? plan.done : []));
  }

  /** Say the state everywhere. The pane of the result may show the plan of another file instead. */
  render() {
    const { app, now } = this;
    this.mark();
    const { other } = app;
    const canPlan = !other && (now.state === "earlier" || now.state === "none") && !app.isBusy;
    const shown = JSON.stringify([now, canPlan, other?.words, app.isBusy, app.kept.key]);
    if (shown === this.shown) return;
    this.shown = shown;
    const mark = other ? "other" : now.state;
    const again = canPlan && app.opened ? el("button", { type: "button", onclick: () => app.plan() }, now.state === "none" ? "Plan" : "Plan again") : null;
    fill(byId("standing"), el("span", {}, other?.words ?? now.words), again);
    byId("standing").className = `standing ${mark} ${this.hasRefused ? "refused" : ""}`;
    byId("pane-result").classList.toggle("not-shown-here", mark !== "current");
    byId("tab-result").textContent = { earlier: "Result, earlier", working: "Result, in work" }[now.state] ?? "Result";
    const chip = byId("state");
    chip.hidden = !app.opened;
    chip.textContent = [now.title, this.counts].filter(Boolean).join(" · ");
    chip.title = now.words;
    chip.className = `chip ${this.light}`;
    app.planning.tell(other ? "" : now.title);
    app.renderHead();
    app.table.render();
    app.kept.render();
  }

  get hasRefused() {
    return this.now.state === "current" && this.now.counts.refused > 0;
  }

  /** The colour of the badge: green only for a plan of exactly what is shown that refuses nothing. */
  get light() {
    return LIGHTS[this.now.state] ?? (this.hasRefused ? "refused" : "clean");
  }
}

/** The figures of a plan in words. */
export function figuresOf({ figures, time }) {
  const { crane_hours: hours, critical_lifts: critical, highest_utilisation: highest } = figures;
  return { time: time?.span_in_words ?? "–", hours, critical: whole(critical ?? 0), highest };
}
