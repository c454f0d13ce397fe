// Tabs. On a wide window parts and set-up are always there, and the tabs change what lies between them; on a narrow one every pane is a tab.
import { byId } from "../page/dom.mjs";

const NARROW = "(max-width: 860px)";
const ALWAYS = new Set(["parts", "setup"]);
const NAMES = ["parts", "plan", "setup", "variants", "result"];

export class Panes {
  constructor(app) {
    this.app = app;
    this.now = "plan";
    this.narrow = matchMedia(NARROW);
    this.narrow.addEventListener("change", () => this.show(this.now));
    this.tabs = NAMES.map((name) => byId(`tab-${name}`));
    for (const tab of this.tabs) tab.addEventListener("click", () => this.show(tab.dataset.pane));
    byId("tab-plan").closest("[role=tablist]").addEventListener("keydown", (event) => {
      const step = { ArrowRight: 1, ArrowLeft: -1 }[event.key];
      if (!step) return;
      const there = this.tabs.filter((tab) => !tab.disabled && tab.offsetParent !== null);
      const next = there[(there.indexOf(document.activeElement) + step + there.length) % there.length];
      this.show(next.dataset.pane);
      next.focus();
      event.preventDefault();
      event.stopPropagation();
    });
    this.show("plan");
  }

  allowResult(isThere = true) {
    byId("tab-result").disabled = !isThere;
  }

  /** Show a pane; a wide window shows parts and set-up anyway. */
  show(name) {
    const wide = !this.narrow.matches;
    if (name !== "result") this.app.other = null;
    if (wide && ALWAYS.has(name)) name = ALWAYS.has(this.now) ? "plan" : this.now === "result" ? "plan" : this.now;
    this.now = name;
    document.body.dataset.pane = name;
    for (const one of NAMES) {
      byId(`pane-${one}`).hidden = wide ? (ALWAYS.has(one) ? name === "result" : one !== name) : one !== name;
      const tab = byId(`tab-${one}`);
      tab.setAttribute("aria-selected", String(one === name));
      tab.tabIndex = one === name ? 0 : -1;
    }
    if (name === "result") this.app.openResult();
    if (name === "variants") {
      this.app.table?.render();
      this.app.table?.look();
    }
  }
}
