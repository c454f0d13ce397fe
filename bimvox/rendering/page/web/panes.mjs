// On a narrow screen one pane at a time: view, list, details or timeline, chosen by tabs.
import { byId } from "./dom.mjs";

const PANES = ["view", "list", "details", "timeline"];

export class Panes {
  constructor(app) {
    this.app = app;
    this.narrow = matchMedia("(max-width: 600px)");
    this.tabs = PANES.map((name) => byId(`pane-${name}`));
    this.tabs.forEach((tab, n) => {
      tab.addEventListener("click", () => this.show(PANES[n]));
      tab.addEventListener("keydown", (event) => {
        if (event.key !== "ArrowLeft" && event.key !== "ArrowRight") return;
        event.stopPropagation();
        event.preventDefault();
        const other = (n + (event.key === "ArrowLeft" ? PANES.length - 1 : 1)) % PANES.length;
        this.show(PANES[other]);
        this.tabs[other].focus();
      });
    });
    this.narrow.addEventListener("change", () => this.show(this.shown));
    this.show("view");
  }

  /** Shows a pane; on a wide screen, which has all of them, it is only remembered. */
  show(name) {
    this.shown = name;
    document.body.dataset.pane = name;
    this.tabs.forEach((tab, n) => {
      tab.setAttribute("aria-selected", String(PANES[n] === name));
      tab.tabIndex = PANES[n] === name ? 0 : -1;
    });
    if (!this.narrow.matches) return;
    this.app.gantt.toggle(name === "timeline");
    if (name === "list") this.app.list.reveal(this.app.chosen ?? this.app.lift?.part);
    this.app.changed();
  }
}
