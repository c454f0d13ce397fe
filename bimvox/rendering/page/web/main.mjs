// The page: holds the current state and notifies every part of the page when it changes.
import { Camera } from "./camera.mjs";
import { unpack } from "./container.mjs";
import { COLOURINGS, paintOf } from "./colours.mjs";
import { cranesOf, ringsOf } from "./cranes.mjs";
import { Details } from "./details.mjs";
import { byId, el, fill } from "./dom.mjs";
import { Gantt } from "./gantt.mjs";
import { Groups } from "./groups.mjs";
import { Header } from "./header.mjs";
import { watchKeys } from "./keyboard.mjs";
import { Labels } from "./labels.mjs";
import { LAYERS, Layers } from "./layers.mjs";
import { Link } from "./link.mjs";
import { LiftList } from "./list.mjs";
import { Live } from "./live.mjs";
import { clamp } from "./maths.mjs";
import { motionOf } from "./motion.mjs";
import { Panes } from "./panes.mjs";
import { Plan } from "./plan.mjs";
import { watchPointers } from "./pointer.mjs";
import { Remarks } from "./remarks.mjs";
import { Scene } from "./scene.mjs";
import { SEATS, seatOf } from "./seat.mjs";
import { Section } from "./section.mjs";
import { Measure } from "./measure.mjs";
import { Timeline, nowWords } from "./timeline.mjs";
import { Visibility } from "./visibility.mjs";
import { PHASES, metres, tonnes } from "./words.mjs";

const MOST_PIXELS = 2;
const FOLLOW_M = 28;
const FOLLOW_DEG = 50;
const SAY_MS = 1500;

class App {
  constructor(document, numbers) {
    this.document = document;
    this.parts = document.parts;
    const motions = document.motions.map((record) => motionOf(record, numbers, document.scales));
    this.plans = document.revisions.map((revision) => new Plan(revision, this.parts, motions, document.set_ups));
    this.number = this.plans.length - 1;
    this.time = this.plan.begins;
    this.playing = false;
    this.speed = 50;
    this.chosen = null;
    this.obstruction = null;
    this.following = false;
    this.seat = null;
    this.layers = { ...LAYERS };
    this.groups = new Groups(this.parts, cranesOf(document).map((crane) => crane.name));
    this.visibility = new Visibility(this.groups);
    this.colourBy = "status";
    this.paint = null;
    this.still = matchMedia("(prefers-reduced-motion: reduce)").matches;
    this.camera = new Camera(this.still);
    this.scene = this._scene(numbers);
    this.labels = new Labels();
    this.header = new Header(this);
    this.list = new LiftList(this);
    this.remarks = new Remarks(this);
    this.details = new Details(this);
    this.timeline = new Timeline(this);
    this.gantt = new Gantt(this);
    this.layerList = new Layers(this);
    this.section = new Section(this);
    this.measure = new Measure(this);
    this.panes = new Panes(this);
    this._listen();
    this.show();
    this.view("iso", true);
    this.link = new Link(this);
    this.link.read();
    this.live = new Live(this);
    this.loop();
  }

  get plan() {
    return this.plans[this.number];
  }

  _scene(numbers) {
    const canvas = byId("canvas");
    const gl = canvas.getContext("webgl2", { antialias: true, alpha: false, powerPreference: "high-performance" });
    if (!gl) {
      canvas.hidden = true;
      byId("failure").hidden = false;
      byId("failure").textContent = "This browser has no WebGL 2, so the site is not drawn; the list, the details and the times work.";
      return null;
    }
    canvas.addEventListener("webglcontextlost", (event) => event.preventDefault());
    canvas.addEventListener("webglcontextrestored", () => {
      this.scene = new Scene(gl, this.document, numbers);
      this.changed();
    });
    return new Scene(gl, this.document, numbers);
  }

  _listen() {
    const canvas = byId("canvas");
    const height = () => canvas.clientHeight || 1;
    watchPointers(canvas, {
      orbit: (dx, dy) => this.turn(dx, dy),
      pan: (dx, dy) => {
        this._stopFollowing();
        this.camera.pan(dx / height(), dy / height());
        this.changed();
      },
      zoom: (factor, x, y) => {
        if (this.seat) this._stopFollowing();
        this.camera.zoom(factor, this.following ? 0 : x, this.following ? 0 : y);
        this.changed();
      },
      choose: (x, y) => this._pick(x, y),
    });
    document.querySelector('[data-view="crane"]').hidden = !this.groups.cranes.length;
    for (const button of document.querySelectorAll("[data-view]")) button.addEventListener("click", () => this.view(button.dataset.view));
    new ResizeObserver(() => this.changed()).observe(canvas);
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => this.changed());
    window.addEventListener("beforeprint", () => this._printable());
    watchKeys(this);
  }

  /** Shows everything of a revision. */
  show() {
    this.time = clamp(this.time, this.plan.begins, this.plan.ends);
    this.states = this.plan.statesAt(this.time);
    this.lift = this.plan.liftAt(this.time);
    this.visibility.update(this.plan);
    this._repaint();
    this.scene?.forget();
    this.header.render();
    this.header.renderFilter();
    this.list.search.value = this.visibility.query;
    this.list.render();
    this.timeline.render();
    this.gantt.render();
    this.layerList.renderLegend();
    this.details.renderPart();
    this.details.renderPlan();
    this.remarks.render();
    this._refresh();
  }

  setRevision(number) {
    if (number < 0 || number >= this.plans.length || number === this.number) return;
    this.number = number;
    this.obstruction = null;
    this.show();
    this.details.open("plan");
    this.say(`Revision ${this.plan.revision.number}`);
  }

  /** Requests a frame. */
  changed() {
    if (this.asked) return;
    this.asked = true;
    requestAnimationFrame((now) => this.loop(now));
  }

  loop(now = performance.now()) {
    this.asked = false;
    if (this.playing) {
      const passed = Math.min((now - (this.last ?? now)) / 1000, 0.25);
      this.time = Math.min(this.time + passed * this.speed, this.plan.ends);
      if (this.time >= this.plan.ends) this.playing = false;
      this._refresh();
    }
    this.last = this.playing ? now : undefined;
    const gliding = this.camera.step(now);
    this._draw(now);
    if (this.playing || gliding) this.changed();
  }

  _refresh() {
    this.states = this.plan.statesAt(this.time);
    const lift = this.plan.liftAt(this.time);
    if (lift !== this.lift) {
      this.lift = lift;
      const words = nowWords(this);
      if (words) this.say(words.title);
      if (this.chosen === null && !this.obstruction) this.details.renderPart();
    }
    this.list.update();
    this.timeline.update();
    this.gantt.update();
    this._showNow();
    this.changed();
  }

  _showNow() {
    const words = nowWords(this);
    if (!words) {
      byId("now").hidden = true;
      return;
    }
    const phase = words.phase ? (PHASES[words.phase] ?? words.phase) : "";
    fill(byId("now"), el("strong", {}, words.title), el("span", {}, [this.plan.timeAt(this.time), phase].filter(Boolean).join(" · ")));
    const held = this.document.crane && this.scene?.hook;
    if (held) byId("now").title = `hook at ${held.map(metres).join(", ")}`;
  }

  /** Announces to screen readers, at a rate that they can read out. */
  say(text) {
    this.saying = text;
    if (this.timer) return;
    byId("live").textContent = text;
    this.saying = null;
    this.timer = setTimeout(() => {
      this.timer = null;
      if (this.saying) this.say(this.saying);
    }, SAY_MS);
  }

  _frame() {
    const canvas = byId("canvas");
    const pixels = Math.min(devicePixelRatio || 1, MOST_PIXELS);
    const hidden = !canvas.clientWidth;
    const width = hidden ? canvas.width : Math.max(1, Math.round(canvas.clientWidth * pixels));
    const height = hidden ? canvas.height : Math.max(1, Math.round(canvas.clientHeight * pixels));
    if (canvas.width !== width || canvas.height !== height) Object.assign(canvas, { width, height });
    this.camera.aspect = width / height;
    const dark = matchMedia("(prefers-color-scheme: dark)").matches && !matchMedia("print").matches;
    const paper = dark ? [0.29, 0.31, 0.35] : [0.933, 0.945, 0.957];
    return { camera: this.camera, width, height, pixels, paper };
  }

  _draw() {
    if (!this.scene) return;
    this.scene.show({ plan: this.plan, time: this.time, layers: this.layers, chosen: this.chosen, obstruction: this.obstruction, looks: this.visibility.looks, paint: this.paint, cut: this.section.box, measured: this.measure.line });
    const frame = this._frame();
    if (this.following && this.lift && !this.camera.glide) {
      const at = this.states[this.lift.part] > 1 ? this.scene.middleOf(this.lift.part) : (this.scene.hook ?? this.scene.middleOf(this.lift.part));
      if (at) this.camera.target = at;
    }
    if (this.seat) Object.assign(this.camera, this._seated());
    if (!byId("canvas").clientWidth) return;
    this.scene.draw(frame, this.layers);
    this.labels.set("measure", this.measure.labels);
    this.labels.set("rings", this.layers.rings ? this._ringLabels() : []);
    this.labels.place(this.camera.matrix(this.scene.radius), frame.width / frame.pixels, frame.height / frame.pixels);
    document.documentElement.dataset.drawn = String(Number(document.documentElement.dataset.drawn ?? 0) + 1);
  }

  _pick(x, y) {
    if (!this.scene) return;
    const frame = this._frame();
    if (this.measure.isOn) return this.measure.take(this.scene.pointAt(frame, this.layers, Math.round(x * frame.pixels), Math.round(y * frame.pixels)));
    const thing = this.scene.pick(frame, this.layers, Math.round(x * frame.pixels), Math.round(y * frame.pixels));
    if (thing?.kind === "part") this.choose(thing.index, { from: "view" });
    else if (thing?.kind === "obstruction") {
      const own = this.plan.revision.obstructions.find((record) => this.scene.obstructionOf(record) === thing.record);
      this.chooseObstruction(own);
    } else this.choose(null);
  }

  /** Chooses a part by its index; null chooses nothing. */
  choose(part, { from = "" } = {}) {
    this.chosen = part;
    this.obstruction = null;
    this.details.renderPart();
    if (part !== null && from !== "remarks") this.details.open("part");
    this.remarks.update();
    this.list.update();
    if (part !== null && from !== "list") this.list.reveal(part);
    if (from === "list") this.panes.show("details");
    this.timeline.update();
    this.gantt.mark();
    this.changed();
  }

  chooseObstruction(record) {
    this.chosen = null;
    this.obstruction = record;
    this.details.renderPart();
    this.details.open("part");
    this.remarks.update();
    this.list.update();
    this.timeline.update();
    this.gantt.mark();
    this.changed();
  }

  seek(time) {
    this.time = clamp(time, this.plan.begins, this.plan.ends);
    this._refresh();
  }

  toggle() {
    if (!this.plan.timed.length) return;
    if (!this.playing && this.time >= this.plan.ends) this.time = this.plan.begins;
    this.playing = !this.playing;
    this._refresh();
  }

  setSpeed(speed) {
    this.speed = speed;
    this.timeline.update();
  }

  /** Goes to the start of the next or previous lift; backwards first to the start of this one. */
  stepLift(step) {
    if (!this.lift) return;
    const within = this.time - this.lift.begins_s > 1;
    const to = step < 0 && within ? this.lift : this.plan.neighbour(this.lift, step);
    if (to) this.seek(to.begins_s);
    else this.seek(step < 0 ? this.plan.begins : this.plan.ends);
  }

  setLayer(name, value) {
    this.layers[name] = value;
    this.scene?.forget();
    this.layerList.update();
    this.changed();
  }

  /** The part of which the details are shown: the chosen one, or that of the lift under way. */
  get detailed() {
    return this.chosen ?? (this.obstruction ? null : (this.lift?.part ?? null));
  }

  lookAtPart(act) {
    if (this.detailed !== null) this.look(act, "part", this.parts[this.detailed].id);
  }

  /** Isolates, hides or ghosts a group of parts: see Visibility. */
  look(act, by, value) {
    this.visibility.apply(act, by, value);
    this._refilter();
  }

  search() {
    this.panes.show("list");
    byId("search").focus();
  }

  setSearch(query) {
    this.visibility.search(query);
    this._refilter();
  }

  undoLook() {
    if (this.visibility.undo()) this._refilter();
  }

  showAll() {
    this.visibility.clear();
    this._refilter();
  }

  /** Shows what the filter leaves. */
  _refilter() {
    const { visibility, list } = this;
    visibility.update(this.plan);
    this.header.renderFilter();
    if (list.search.value !== visibility.query) list.search.value = visibility.query;
    if (list.query !== visibility.query) list.render();
    else list.update();
    this.gantt.paint();
    const focused = document.activeElement?.dataset?.look;
    this.details.renderPart();
    if (focused) document.querySelector(`[data-look="${focused}"]`)?.focus();
    this.say(visibility.words || "All parts shown");
    this.changed();
  }

  /** Colours the parts by a criterion: see COLOURINGS. */
  setColour(by) {
    if (!COLOURINGS.includes(by)) return;
    this.colourBy = by;
    this._repaint();
    this.layerList.update();
    this.layerList.renderLegend();
    this.gantt.paint();
    this.details.renderPart();
    this.say(`Coloured by ${by}`);
    this.changed();
  }

  _repaint() {
    this.paint = paintOf(this.groups, this.colourBy, this.document.colours, this.parts.length);
  }

  /** The view from the seat in the crane of the lift under way. */
  _seated() {
    const n = (this.lift && this.plan.motionOf(this.lift)?.crane) ?? 0;
    return seatOf(this.scene.cranes[n], this.scene.poseOf(this.plan, n, this.time), this.scene.slab.high[2], this.seat);
  }

  /** Radius and capacity of each ring, on the side of the site's middle. */
  _ringLabels() {
    const { low, high } = this.scene.slab;
    return this.scene.cranes.flatMap(({ record }) => {
      const [x, y] = record.base_m;
      const angle = Math.atan2((low[1] + high[1]) / 2 - y, (low[0] + high[0]) / 2 - x);
      return ringsOf(record).map(({ radius, capacity }) => ({
        at: [x + radius * Math.cos(angle), y + radius * Math.sin(angle), high[2]],
        text: capacity === null ? metres(radius) : `${metres(radius)}: ${tonnes(capacity)}`,
      }));
    });
  }

  /** Takes the next seat in the crane; after the last one returns to the view before. */
  _nextSeat() {
    const camera = ({ azimuth, elevation, target, distance }) => ({ azimuth, elevation, target, distance });
    const next = SEATS[SEATS.indexOf(this.seat) + 1] ?? null;
    const from = this.seat ? this.unseated : camera(this.camera);
    this._stopFollowing();
    this.camera.glide = null;
    this.seat = next;
    this.unseated = from;
    if (!next) Object.assign(this.camera, from);
    const button = document.querySelector('[data-view="crane"]');
    button.setAttribute("aria-pressed", String(next !== null));
    this.link.tell({ trolley: "From the trolley, down the hook. Again: from the cab.", cab: "From the cab to the hook. Again: back." }[next] ?? "Back from the crane.");
    this.changed();
  }

  turn(dx, dy) {
    if (this.seat) this._stopFollowing();
    this.camera.orbit(dx, dy);
    this.changed();
  }

  _stopFollowing() {
    this.following = false;
    this.seat = null;
    document.querySelector('[data-view="crane"]').setAttribute("aria-pressed", "false");
    document.querySelector('[data-view="follow"]').setAttribute("aria-pressed", "false");
  }

  view(name, atOnce = false) {
    if (name === "crane") {
      if (this.scene?.cranes.length) this._nextSeat();
      return;
    }
    if (name === "in" || name === "out") {
      if (this.seat) this._stopFollowing();
      this.camera.zoom(name === "in" ? 0.8 : 1.25);
      this.changed();
      return;
    }
    const follow = name === "follow" && !this.following;
    this._stopFollowing();
    this._frame();
    const now = performance.now();
    if (name === "follow") {
      this.following = follow;
      document.querySelector('[data-view="follow"]').setAttribute("aria-pressed", String(follow));
      // From straight above, jib and hook block hide the load.
      const { distance, elevation } = this.camera;
      if (follow) this.camera.go({ distance: Math.min(distance, FOLLOW_M), elevation: Math.min(elevation, FOLLOW_DEG) }, now);
      this.changed();
      return;
    }
    const [azimuth, elevation] = this.document.site.view_deg;
    const square = Math.round(azimuth / 90) * 90;
    const turns = { top: [square, 89.9], front: [square, 4], iso: [azimuth, elevation], fit: [this.camera.azimuth, this.camera.elevation] };
    const [low, high] = this.scene ? this.scene.bounds(this.plan, this.time, this.visibility.looks) : [[0, 0, 0], [10, 10, 10]];
    const to = this._uncovered(this.camera.fitting(low, high, ...turns[name]));
    if (atOnce) Object.assign(this.camera, to);
    else this.camera.go(to, now);
    this.changed();
  }

  /** Shifts a view so that its content lies between the cards at the top and bottom edge. */
  _uncovered(view) {
    const height = byId("canvas").clientHeight;
    if (!height) return view;
    const upper = Math.min(byId("now").offsetHeight + 16, 0.15 * height);
    const lower = Math.min(byId("legend").offsetHeight + 16, 0.2 * height);
    const distance = (view.distance * height) / (height - upper - lower);
    const probe = Object.assign(new Camera(true), view, { distance, aspect: this.camera.aspect });
    probe.pan(0, (upper - lower) / 2 / height);
    return { ...view, distance, target: probe.target };
  }

  /** Stores the picture for printing. */
  _printable() {
    if (!this.scene) return;
    this._draw();
    byId("still").src = byId("canvas").toDataURL("image/png");
  }
}

unpack(byId("data").textContent)
  .then(({ document: data, numbers }) => {
    byId("data").remove();
    window.page = new App(data, numbers);
  })
  .catch((error) => {
    byId("failure").hidden = false;
    byId("failure").textContent = `This page cannot be shown: ${error.message}`;
    throw error;
  });
