// The list of lifts: search, sorting, and current states.
import { byId, el, fill } from "./dom.mjs";
import { HOW, sorted } from "./plan.mjs";
import { Roving } from "./roving.mjs";
import { LOOKS, SEEN } from "./visibility.mjs";
import { STATES, classWords, counted, nameOf, percent, shortClock } from "./words.mjs";

const GLYPHS = ["", "•", "▲", "✓", "✓"];
const FALLING = new Set(["utilisation", "duration", "mass"]);

export class LiftList {
  constructor(app) {
    this.app = app;
    this.body = byId("list").tBodies[0];
    this.roving = new Roving(this.body, "td button");
    this.search = byId("search");
    this.key = "order";
    this.descending = false;
    this.search.addEventListener("input", () => app.setSearch(this.search.value));
    this.buttons = [...document.querySelectorAll("[data-sort]")];
    for (const button of this.buttons)
      button.addEventListener("click", () => {
        const again = this.key === button.dataset.sort;
        this.descending = again ? !this.descending : FALLING.has(button.dataset.sort);
        this.key = button.dataset.sort;
        this.render();
      });
  }

  /** Lists the lifts of the revision shown. */
  render() {
    const { plan, visibility } = this.app;
    this.query = visibility.query;
    const lifts = sorted(plan, plan.matching(visibility.query), this.key, this.descending);
    this.rows = new Map();
    fill(this.body, ...lifts.map((lift) => this._row(plan, lift)));
    this.roving.renew();
    for (const button of this.buttons) {
      const own = button.dataset.sort === this.key;
      button.setAttribute("aria-pressed", String(own));
      button.title = own ? `sorted ${this.descending ? "descending" : "ascending"}; again to reverse` : `sort by ${button.textContent}`;
    }
    byId("count").textContent = lifts.length === plan.lifts.length ? counted(lifts.length, "part") : `${lifts.length} of ${counted(plan.lifts.length, "part")}`;
    this.states = null;
    this.update();
  }

  _row(plan, lift) {
    const part = this.app.parts[lift.part];
    const bad = lift.status === "infeasible";
    const other = HOW[lift.status];
    const motion = plan.motionOf(lift);
    const use = lift.governs?.utilisation ?? null;
    const state = el("span", { class: "state" });
    const look = el("small");
    const under = [classWords(part.ifc_class), part.storey].filter(Boolean).join(" · ");
    const button = el("button", { type: "button", onclick: () => this.app.choose(lift.part, { from: "list" }) }, el("span", {}, nameOf(part)), el("small", {}, bad ? `${lift.by_other_means ? "by other means" : "infeasible"} · ${under}` : other ? `${other} · ${under}` : under), look);
    const row = el("tr", { class: bad ? "bad" : null, "data-part": lift.part },
      el("td", {}, state),
      el("td", {}, String(lift.number)),
      el("td", {}, button),
      el("td", { class: lift.critical ? "hot" : null }, bad ? "" : percent(use)),
      el("td", {}, bad ? "✕" : motion ? shortClock(motion.length_s) : "–"),
    ); // prettier-ignore
    this.rows.set(lift.part, { row, state, button, look });
    return row;
  }

  /** Marks states, the lift under way and the chosen part. */
  update() {
    const { app } = this;
    const states = app.states;
    for (const lift of app.plan.lifts) {
      const found = this.rows.get(lift.part);
      const value = lift.status === "infeasible" ? "x" : states[lift.part];
      if (found) this._showLook(found, app.visibility.looks[lift.part]);
      if (!found || found.value === value) continue;
      found.value = value;
      found.state.className = `state s${value}`;
      found.state.title = value === "x" ? "infeasible" : STATES[value];
      found.state.textContent = value === "x" ? "✕" : GLYPHS[value];
    }
    if (this.lift !== app.lift) {
      this.rows.get(this.lift?.part)?.row.classList.remove("now");
      this.lift = app.lift;
      if (!this.search.value && this.key === "order" && !this.body.contains(document.activeElement)) this._reveal(this.lift?.part);
    }
    this.rows.get(this.lift?.part)?.row.classList.add("now");
    if (this.chosen !== app.chosen) {
      this.rows.get(this.chosen)?.row.classList.remove("chosen");
      this.roving.stopAt(this.rows.get(app.chosen)?.button);
    }
    this.chosen = app.chosen;
    const own = this.rows.get(this.chosen);
    own?.row.classList.add("chosen");
    for (const { button } of this.rows.values()) if (button.hasAttribute("aria-current")) button.removeAttribute("aria-current");
    own?.button.setAttribute("aria-current", "true");
  }

  /** Says of a row that its part is not shown, or as a ghost. */
  _showLook(found, look) {
    if ((found.seen ?? SEEN) === look) return;
    found.seen = look;
    found.row.classList.toggle("unshown", look !== SEEN);
    found.look.textContent = look === SEEN ? "" : `${LOOKS[look]} in the view`;
  }

  _reveal(part) {
    const scroll = byId("list-scroll");
    const row = this.rows.get(part)?.row;
    if (!row || !scroll.clientHeight) return;
    const top = row.offsetTop - 30;
    if (top < scroll.scrollTop || top + row.offsetHeight + 30 > scroll.scrollTop + scroll.clientHeight) scroll.scrollTop = top - scroll.clientHeight / 3;
  }

  reveal(part) {
    this._reveal(part);
  }
}
