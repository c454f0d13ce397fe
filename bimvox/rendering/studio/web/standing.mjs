// Whether the plan on disk is one of what is shown: of exactly its set-up and its obstructions. The server compares them after
// every change, and every other second, because other programs write these files too.
import { byId, el, fill } from "../page/dom.mjs";
import { counted, whole } from "../page/words.mjs";
import { call, Latest } from "./api.mjs";
import { saved } from "./setup.mjs";
import { figuresOf } from "./variants.mjs";

const PERIOD_MS = 2000;

export class Standing {
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
    Object.assign(this, { answer: null, of: null, shown: null });
  }

  send({ opened, setup }) {
    return call("POST", "/api/standing", { path: opened.path, setup: saved(setup), sha256: opened.sha256 });
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
    if (answer) app.hear(answer);
    if (this.plan) {
      app.setResult(this.plan.page, this.plan.version);
    }
    this.render();
  }

  get plan() {
    return this.answer?.plan ?? null;
  }

  /** "none", "gone", "current", "earlier", or "unknown" until the server has compared it with what is shown. */
  get state() {
    const { app, plan } = this;
    if (!plan) return app.result ? "gone" : "none";
    if (!app.isPlaced || this.answer.obstructions_sha256 !== app.boxesSha256) return "earlier";
    if (this.of !== app.setup) return "unknown";
    return plan.is_current ? "current" : "earlier";
  }

  /** The figures of the plan for the table; null if there is none. */
  get figures() {
    return this.plan && { ...figuresOf(this.plan), isCurrent: this.state === "current" };
  }

  /** How many parts the plan of what is shown refuses. */
  get refused() {
    return this.state === "current" ? this.plan.infeasible.length : 0;
  }

  /** What is to be said above the plan, in words. */
  get words() {
    return standingWords(this.state, this.plan);
  }

  /** Mark the plan; the pane may show that of another file instead. */
  render() {
    const { app, state } = this;
    const { other } = app;
    const mark = other ? "other" : state === "gone" ? "earlier" : state;
    const canPlan = mark === "earlier" && !app.isBusy;
    const shown = `${mark} ${canPlan} ${other?.words} ${JSON.stringify(this.plan)}`;
    if (shown === this.shown) return;
    this.shown = shown;
    const again = canPlan ? el("button", { type: "button", onclick: () => app.plan() }, "Plan again") : null;
    fill(byId("standing"), el("span", {}, other?.words ?? this.words), again);
    byId("standing").className = `standing ${mark} ${mark === "current" && this.refused ? "refused" : ""}`;
    byId("pane-result").classList.toggle("not-shown-here", mark !== "current");
    if (state !== "unknown") byId("tab-result").textContent = state === "earlier" ? "Result, earlier" : "Result";
    app.renderHead();
    app.table.render();
  }
}

/** What a plan is of, in a sentence. */
export function standingWords(state, plan) {
  if (state === "gone") return "The log of this plan is not on disk any more.";
  if (state === "unknown") return "The plan is compared with what is shown here …";
  if (state === "earlier") return `Plan of an earlier state, not of what is shown here. Changed since: ${(plan.differs.length ? plan.differs : ["the obstructions"]).join(", ")}.`;
  if (state === "current") return `Plan of the set-up and the obstructions that are shown here: ${counted(plan.planned, "lift")} planned, ${whole(plan.infeasible.length)} refused.`;
  return "";
}
