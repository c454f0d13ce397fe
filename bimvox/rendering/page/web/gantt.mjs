// The lifts as bars in time, a row for each crane, storey or class; linked to view and list.
import { colouring } from "./colours.mjs";
import { byId, el, fill } from "./dom.mjs";
import { deliveryWords } from "./plan.mjs";
import { clock, counted, localDate, nameOf, percent, span } from "./words.mjs";

const ROWS = ["crane", "storey", "class"];
const DEEPEST = 64;
const NAMES_PX = 136;
const LABEL_PX = 66;
const DATE_PX = 104;
const HOURS = [60, 300, 600, 1800, 3600, 7200, 14400, 21600, 43200, 86400, 604800];

export class Gantt {
  constructor(app) {
    this.app = app;
    this.zoom = 1;
    this.by = app.groups.cranes.length > 1 ? "crane" : "storey";
    this.section = byId("gantt");
    this.chart = byId("gantt-chart");
    this.scroll = byId("gantt-scroll");
    this.select = byId("gantt-by");
    this.bars = [];
    fill(this.select, ...ROWS.filter((by) => by !== "crane" || app.groups.cranes.length).map((by) => el("option", { value: by }, by)));
    this.select.addEventListener("change", () => this.setRows(this.select.value));
    byId("gantt-button").addEventListener("click", () => this.toggle());
    byId("gantt-in").addEventListener("click", () => this.setZoom(this.zoom * 2));
    byId("gantt-out").addEventListener("click", () => this.setZoom(this.zoom / 2));
    this.chart.addEventListener("keydown", (event) => this._key(event));
    this.chart.addEventListener("click", (event) => this._seek(event));
    new ResizeObserver(() => this.lay()).observe(this.scroll);
  }

  get open() {
    return !this.section.hidden;
  }

  toggle(open = !this.open) {
    this.section.hidden = !open;
    byId("gantt-button").setAttribute("aria-expanded", String(open));
    if (open) this.render();
  }

  setRows(by) {
    if (![...this.select.options].some((option) => option.value === by)) return;
    this.by = by;
    this.render();
  }

  setZoom(zoom) {
    this.zoom = Math.min(Math.max(zoom, 1), DEEPEST);
    this.lay();
    this._reveal(this.marked?.lift.begins_s ?? this.app.time);
  }

  /** Makes the rows and bars of the revision shown. */
  render() {
    if (!this.open) return;
    const { app } = this;
    const { groups, plan } = app;
    this.select.value = this.by;
    this.bars = [];
    const rows = groups.all(this.by).map(([key, parts]) => {
      const own = new Set(parts);
      const lifts = plan.timed.filter((lift) => own.has(lift.part));
      if (!lifts.length) return null;
      const name = groups.label(this.by, key);
      const track = el("div", { class: "track" }, ...lifts.map((lift) => this._bar(lift)));
      return el("div", { class: "row", role: "group", "aria-label": `${this.by} ${name}, ${counted(lifts.length, "lift")}` }, el("span", { class: "name", title: name }, name), track);
    });
    this.axis = el("div", { class: "track", "aria-hidden": "true" });
    this.cursor = el("div", { class: "cursor", "aria-hidden": "true" });
    fill(this.chart, el("div", { class: "row axis" }, el("span", { class: "name" }), this.axis), this._deliveries(), ...rows.filter(Boolean), this.cursor);
    this.tracks = [...this.chart.querySelectorAll(".row:not(.axis) .track")];
    this.stop = null;
    this.paint();
    this.lay();
    this.mark();
  }

  _share(time) {
    const { begins, ends } = this.app.plan;
    return (time - begins) / Math.max(ends - begins, 1e-9);
  }

  _bar(lift) {
    const { app } = this;
    const { plan } = app;
    const ends = plan.endOf(lift);
    const long = ends - lift.begins_s;
    const part = app.parts[lift.part];
    const use = lift.governs?.utilisation ?? null;
    const words = [`Lift ${lift.number}: ${nameOf(part)}`, part.storey, `${lift.begins_in_words ?? clock(lift.begins_s)}, ${span(long)}`, lift.governs && `${use === null ? "beyond the load chart" : `${percent(use)} of the capacity`}${lift.critical ? ", critical" : ""}`];
    const bar = el("button", { type: "button", tabindex: "-1", title: words.filter(Boolean).join("\n"), "aria-label": words.filter(Boolean).join(", "), "data-part": lift.part, onclick: () => this._choose(lift) }, el("span", {}, String(lift.number)));
    bar.className = lift.critical ? "hot-bar" : "";
    bar.style.left = `${100 * this._share(lift.begins_s)}%`;
    bar.style.width = `${100 * (this._share(ends) - this._share(lift.begins_s))}%`;
    const phases = plan.motionOf(lift).phases;
    phases.forEach(([name, start], n) => {
      if (name !== "wait") return;
      const wait = el("i", { title: "waiting" });
      wait.style.left = `${(100 * start) / long}%`;
      wait.style.width = `${(100 * ((phases[n + 1]?.[1] ?? long) - start)) / long}%`;
      bar.append(wait);
    });
    this.bars.push({ lift, bar, ends });
    return bar;
  }

  /** A row with a bar for each delivery that the crane unloads: from its first lift to the end of its last one. Null if there is none. */
  _deliveries() {
    const { plan } = this.app;
    const bars = (plan.revision.deliveries ?? []).map((delivery) => this._delivery(delivery)).filter(Boolean);
    if (!bars.length) return null;
    return el("div", { class: "row", role: "group", "aria-label": counted(bars.length, "delivery").replace(/ys$/, "ies") }, el("span", { class: "name", title: "Deliveries, unloaded by the crane before their first lift" }, "Deliveries"), el("div", { class: "track" }, ...bars));
  }

  _delivery(delivery) {
    const { app } = this;
    const { plan } = app;
    const lifts = plan.timed.filter((lift) => lift.delivery === delivery.number);
    if (!lifts.length) return null;
    const [begins, ends] = [lifts[0].begins_s, Math.max(...lifts.map((lift) => plan.endOf(lift)))];
    const words = deliveryWords(plan, delivery);
    const choose = () => {
      app.choose(lifts[0].part, { from: "gantt" });
      app.seek(begins);
    };
    const bar = el("button", { type: "button", tabindex: "-1", class: "truck-bar", title: words.join("\n"), "aria-label": words.join(", "), "data-part": lifts[0].part, onclick: choose }, el("span", {}, String(delivery.number + 1)));
    bar.style.left = `${100 * this._share(begins)}%`;
    bar.style.width = `${100 * (this._share(ends) - this._share(begins))}%`;
    return bar;
  }

  _choose(lift) {
    this._stopAt(this._of(lift.part));
    this.app.choose(lift.part, { from: "gantt" });
    this.app.seek(lift.begins_s);
  }

  _of(part) {
    return this.bars.find(({ lift }) => lift.part === part);
  }

  /** Makes a bar the one that Tab reaches. */
  _stopAt(entry) {
    if (this.stop) this.stop.bar.tabIndex = -1;
    this.stop = entry ?? this.bars[0] ?? null;
    if (this.stop) this.stop.bar.tabIndex = 0;
  }

  /** Colours the bars as the parts, and fades those whose parts are not shown. */
  paint() {
    if (!this.open) return;
    const { app } = this;
    const groups = app.colourBy === "status" ? [] : colouring(app.groups, app.colourBy, app.document.colours);
    const of = new Map(groups.flatMap((group) => group.parts.map((part) => [part, group])));
    for (const { lift, bar } of this.bars) {
      const group = of.get(lift.part);
      bar.style.backgroundColor = group ? `rgb(${group.rgb.join(" ")})` : "";
      bar.style.color = group ? (group.rgb[0] * 0.299 + group.rgb[1] * 0.587 + group.rgb[2] * 0.114 > 125 ? "#16171a" : "#fff") : "";
      bar.classList.toggle("striped", group?.striped ?? false);
      bar.classList.toggle("unshown", app.visibility.looks[lift.part] !== 0);
    }
    this.update();
  }

  /** Shows the time: the cursor, and which lifts are done, under way or to come. */
  update() {
    if (!this.open || !this.cursor) return;
    const { app } = this;
    this.cursor.style.left = `${NAMES_PX + this._share(app.time) * this.wide}px`;
    for (const entry of this.bars) {
      const when = app.time >= entry.ends ? "done" : app.time >= entry.lift.begins_s ? "now" : "later";
      if (entry.when !== when) entry.bar.dataset.when = entry.when = when;
    }
    if (app.playing) this._reveal(app.time);
  }

  /** Marks the bar of the chosen part, and scrolls to it. */
  mark() {
    if (!this.open) return;
    this.marked?.bar.removeAttribute("aria-current");
    this.marked = this.app.chosen === null ? null : this._of(this.app.chosen);
    this.marked?.bar.setAttribute("aria-current", "true");
    this._stopAt(this.marked ?? this.stop ?? this._of(this.app.lift?.part));
    if (!this.marked) return;
    this._reveal(this.marked.lift.begins_s);
    const row = this.marked.bar.closest(".row");
    const top = row.offsetTop - this.chart.firstElementChild.offsetHeight;
    if (top < this.scroll.scrollTop) this.scroll.scrollTop = top;
    else if (row.offsetTop + row.offsetHeight > this.scroll.scrollTop + this.scroll.clientHeight) this.scroll.scrollTop = row.offsetTop + row.offsetHeight - this.scroll.clientHeight;
  }

  _reveal(time) {
    const at = this._share(time) * this.wide;
    const seen = this.scroll.clientWidth - NAMES_PX;
    if (at < this.scroll.scrollLeft || at > this.scroll.scrollLeft + seen - 20) this.scroll.scrollLeft = at - seen / 4;
  }

  /** Lays out chart and axis for the width of the window. */
  lay() {
    if (!this.open || !this.axis) return;
    this.wide = Math.max(60, (this.scroll.clientWidth - NAMES_PX - 2) * this.zoom);
    this.chart.style.width = `${NAMES_PX + this.wide}px`;
    byId("gantt-in").disabled = this.zoom >= DEEPEST;
    byId("gantt-out").disabled = this.zoom <= 1;
    fill(this.axis, ...this._ticks().map(([time, words, day]) => {
      const tick = el("span", { class: day ? "day" : null }, words);
      tick.style.left = `${100 * this._share(time)}%`;
      return tick;
    })); // prettier-ignore
    this.update();
  }

  /** Times and their labels: of the clock, or with a calendar days and hours on the site. */
  _ticks() {
    const { plan } = this.app;
    const long = Math.max(plan.ends - plan.begins, 1e-9);
    const step = HOURS.find((seconds) => (seconds / long) * this.wide > LABEL_PX) ?? HOURS.at(-1);
    const ticks = [];
    const blocks = plan.revision.dates ?? [];
    for (let at = Math.ceil(plan.begins / step) * step; at <= plan.ends && !blocks.length; at += step) ticks.push([at, clock(at).replace(/:00$/, ""), false]);
    for (const [begins, ends, at] of blocks) {
      ticks.push([begins, plan.local(at).replace(/ \d{4} /, " "), true]);
      for (let hour = Math.ceil(at / step) * step; hour - at < ends - begins; hour += step) ticks.push([begins + hour - at, localDate(hour).slice(-5), false]);
    }
    const kept = [];
    let free = -Infinity;
    for (const tick of ticks.sort((a, b) => a[0] - b[0] || b[2] - a[2])) {
      const x = this._share(tick[0]) * this.wide;
      if (x < free || x > this.wide - (tick[2] ? DATE_PX : 44)) continue;
      kept.push(tick);
      free = x + (tick[2] ? DATE_PX : LABEL_PX - 20);
    }
    return kept;
  }

  _key(event) {
    const [bar, keys] = [event.target.closest("button"), ["ArrowLeft", "ArrowRight", "ArrowUp", "ArrowDown", "Home", "End"]];
    if (!bar || !keys.includes(event.key) || event.ctrlKey || event.metaKey || event.altKey) return;
    event.preventDefault();
    event.stopPropagation();
    const own = [...bar.parentElement.children];
    let next = null;
    if (event.key === "Home" || event.key === "End") next = event.key === "Home" ? own[0] : own.at(-1);
    else if (event.key === "ArrowLeft" || event.key === "ArrowRight") next = own[own.indexOf(bar) + (event.key === "ArrowLeft" ? -1 : 1)];
    else {
      const track = this.tracks[this.tracks.indexOf(bar.parentElement) + (event.key === "ArrowUp" ? -1 : 1)];
      const far = (other) => Math.abs(parseFloat(other.style.left) - parseFloat(bar.style.left));
      next = track ? [...track.children].reduce((best, other) => (far(other) < far(best) ? other : best)) : null;
    }
    if (!next) return;
    const entry = this._of(Number(next.dataset.part));
    this._stopAt(entry);
    this._reveal(entry.lift.begins_s);
    next.focus({ preventScroll: false });
  }

  /** A click next to the bars goes to that time. */
  _seek(event) {
    const track = event.target.closest(".track");
    if (!track || event.target.closest("button")) return;
    const box = track.getBoundingClientRect();
    const { begins, ends } = this.app.plan;
    this.app.seek(begins + ((event.clientX - box.left) / box.width) * (ends - begins));
  }
}
