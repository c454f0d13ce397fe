// A plan that is carried out while it is watched: the simulated time, and how far each part is.
import { clock, whole } from "../page/words.mjs";

const AT_WORK = new Set(["in_transit", "arrived"]);

export class CarriedOut {
  /** @param now the wall clock in milliseconds */
  constructor(now = () => performance.now()) {
    Object.assign(this, { now, states: new Map(), lifts: 0, speed: 0, from: null, at: 0, held: null });
  }

  /** Take an event of the watch. */
  take(event) {
    if (event.event === "clock") Object.assign(this, { speed: event.speed, from: event.time_s, at: this.now() });
    else if (event.event === "state") {
      this.states.set(event.component, event.state);
      this.last_s = event.time_s;
    } else if (event.kept) {
      this.lifts = event.kept.length + event.replanned.length;
      this.held = event.stopped?.held ? event.stopped.component : null;
    }
  }

  /** The simulated time in seconds; null before the clock starts. When every part is set, the time of the last one. */
  get time_s() {
    if (this.from === null) return null;
    return this.isDone ? this.last_s : this.from + (this.speed * (this.now() - this.at)) / 1000;
  }

  get set() {
    return [...this.states.values()].filter((state) => state === "assembled").length;
  }

  get isDone() {
    return this.lifts > 0 && this.set >= this.lifts;
  }

  /** The ids of the parts that are lifted now. */
  get lifted() {
    return [...this.states].filter(([, state]) => AT_WORK.has(state)).map(([id]) => id);
  }

  /** How far a part is: "lifting", "set" or "unset". */
  stageOf(id) {
    const state = this.states.get(id);
    return AT_WORK.has(state) ? "lifting" : state ? "set" : "unset";
  }

  /** The time and what is lifted, in a line. `nameOf`: from an id to a name. */
  words(nameOf) {
    if (this.time_s === null) return "The simulation starts";
    const { lifted } = this;
    const now = this.isDone ? "all parts are set" : this.held ? `${nameOf(this.held)} is held` : lifted.length ? `lifting ${lifted.map(nameOf).join(" and ")}` : "between two lifts";
    return `${clock(this.time_s)} · ${now} · ${whole(this.set)} of ${whole(this.lifts)} set`;
  }
}

/** A stage in words; "" before a part's lift. */
export const stageWords = (stage) => ({ lifting: "is lifted now", set: "is set" })[stage] ?? "";
