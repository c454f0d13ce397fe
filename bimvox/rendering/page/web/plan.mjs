// One revision of the plan: times of the lifts, states of the parts, and lists of lifts.
import { classWords, clock, counted, localDate, metres, nameOf, percent, span } from "./words.mjs";

export const [AWAY, UNBUILT, IN_TRANSIT, ARRIVED, ASSEMBLED] = [0, 1, 2, 3, 4];

/** A delivery that the crane unloads, in words: crane time, largest radius and utilisation, and when. */
export function deliveryWords(plan, { number, begins_s: begins, ends_s: ends }) {
  const own = plan.lifts.filter((lift) => lift.delivery === number && lift.unloading).map((lift) => lift.unloading);
  const most = (key) => Math.max(...own.map((one) => one[key]));
  return [
    `Delivery ${number + 1}: ${counted(own.length, "part")} unloaded by the crane`,
    `${span(own.reduce((sum, one) => sum + one.crane_s, 0))} of the crane before its first lift`,
    `radius up to ${metres(most("radius_m"))}, up to ${percent(most("utilisation"))} of the capacity`,
    begins === null ? null : `${plan.local(begins)} to ${plan.local(ends)}`,
  ].filter(Boolean);
}

export class Plan {
  /**
   * @param revision A revision's record.
   * @param parts Records of all parts.
   * @param motions Decoded motions.
   * @param setUps Names of the set-ups, if the cranes are one that moves.
   */
  constructor(revision, parts, motions, setUps = []) {
    this.revision = revision;
    this.setUps = setUps;
    /** Share of the capacity from which a lift is critical. */
    this.hot = revision.critical_share;
    this.parts = parts;
    this.lifts = revision.lifts;
    this.motions = motions;
    this.timed = this.lifts.filter((lift) => lift.motion !== null).sort((a, b) => a.begins_s - b.begins_s || a.order - b.order);
    const cranesOf = (lift) => [motions[lift.motion].crane ?? 0, ...(motions[lift.motion].second ? [motions[lift.motion].second.crane] : [])];
    this.cranes = Math.max(1, ...this.timed.flatMap((lift) => cranesOf(lift).map((n) => n + 1)));
    /** By crane, the lifts that it carries, alone or with another one. */
    this.ofCrane = Array.from({ length: this.cranes }, (_, n) => this.timed.filter((lift) => cranesOf(lift).includes(n)));
    /** By crane, its motions and when they begin: of a part that two cranes carry, each has its own. */
    this.drives = this.ofCrane.map((lifts, n) => lifts.map((lift) => this._driveOf(lift, n)).sort((a, b) => a.begins_s - b.begins_s));
    this.ofPart = new Array(parts.length).fill(null);
    for (const lift of this.lifts) this.ofPart[lift.part] = lift;
    this.begins = revision.begins_s;
    this.ends = revision.ends_s;
  }

  /** Of a crane that moves, the set-up in which it stands at a time: that of the last lift that has begun. */
  standsIn(time) {
    const lift = this.liftAt(time);
    return lift ? (this.motions[lift.motion].crane ?? 0) : 0;
  }

  /** A local time in words: date and clock, or the number of the working day and clock. */
  local(seconds) {
    const days = this.revision.days ?? [];
    if (!days.length) return localDate(seconds);
    const at = Math.round(seconds);
    return `day ${Math.max(1, days.findLastIndex((midnight) => midnight <= at) + 1)} ${localDate(at).slice(-5)}`;
  }

  /** When it is on the site at a time; between blocks of lifts that of the block's end. Null of an extract. */
  dateAt(time) {
    const blocks = this.revision.dates ?? [];
    if (!blocks.length) return null;
    const [begins, ends, at] = blocks[Math.max(0, blocks.findLastIndex(([start]) => start <= time))];
    return this.local(at + Math.min(Math.max(time, begins), ends) - begins);
  }

  /** The same; of an extract, or of a plan without dates, on the clock of the log. */
  timeAt(time) {
    return this.dateAt(time) ?? clock(time);
  }

  motionOf(lift) {
    return lift.motion === null ? null : this.motions[lift.motion];
  }

  endOf(lift) {
    return lift.begins_s + this.motionOf(lift).length_s;
  }

  _driveOf(lift, crane) {
    const motion = this.motions[lift.motion];
    const { second } = motion;
    return second?.crane === crane ? { begins_s: lift.begins_s + second.starts_s, motion: second } : { begins_s: lift.begins_s, motion };
  }

  /** What a crane drives at a time: its motion, and when that begins; null if it has none. */
  driveOf(crane, time) {
    return this._lastOf(this.drives[crane] ?? [], time);
  }

  /** The lift under way at a time: the last one that has begun; null if nothing is timed. With several cranes, a lift with its load on the hook takes precedence. */
  liftAt(time) {
    if (this.setUps.length) return this._lastOf(this.timed, time);
    if (this.cranes === 1) return this.liftOf(0, time);
    const own = this.ofCrane.map((_, n) => this.liftOf(n, time)).filter((lift) => lift !== null);
    const busy = (lift) => {
      const motion = this.motionOf(lift);
      const since = time - lift.begins_s;
      if (since < 0 || since >= motion.length_s) return 0;
      if (since >= motion.lifted_s && since < motion.assembled_s) return 3;
      return this.phaseAt(lift, time) === "wait" ? 1 : 2;
    };
    return own.reduce((best, lift) => (best === null || busy(lift) > busy(best) ? lift : best), null);
  }

  /** The lift that a crane drives at a time: its last one that has begun; null if it has none. */
  liftOf(crane, time) {
    return this._lastOf(this.ofCrane[crane] ?? [], time);
  }

  /** The last one of some lifts that has begun at a time; before that the first; null if there are none. */
  _lastOf(timed, time) {
    let low = 0;
    let high = timed.length - 1;
    while (low < high) {
      const middle = (low + high + 1) >> 1;
      if (timed[middle].begins_s <= time) low = middle;
      else high = middle - 1;
    }
    return timed[low] ?? null;
  }

  /** Spans of a lift in which its crane does not wait: [start, end] on the plan's clock. */
  busyOf(lift) {
    const { phases } = this.motionOf(lift);
    const ends = [...phases.slice(1).map(([, start]) => lift.begins_s + start), this.endOf(lift)];
    return phases.map(([name, start], n) => [name, lift.begins_s + start, ends[n]]).filter(([name]) => name !== "wait").map(([, start, end]) => [start, end]);
  }

  /** The lift before or after another in time; null at the ends. */
  neighbour(lift, step) {
    return this.timed[this.timed.indexOf(lift) + step] ?? null;
  }

  /** The phase of a lift at a time, by its name in the log; null if the log has none. */
  phaseAt(lift, time) {
    let found = null;
    for (const [name, start] of this.motionOf(lift).phases) if (time - lift.begins_s >= start) found = name;
    return found;
  }

  /**
   * The states of all parts: earlier lifts are assembled, the delivery of the lift under way lies in the yard (it
   * arrives when all lifts of the earlier ones are done), later deliveries have not arrived.
   */
  statesAt(time) {
    return this.cranes > 1 && !this.setUps.length ? this._overlapping(time) : this._oneByOne(time);
  }

  /** The same if lifts of several cranes overlap: every part by its own motion. */
  _overlapping(time) {
    const states = new Uint8Array(this.parts.length);
    const since = (lift) => time - lift.begins_s;
    const waiting = this.timed.filter((lift) => since(lift) < this.motionOf(lift).lifted_s);
    const next = waiting.reduce((first, lift) => (first === null || lift.order < first.order ? lift : first), null);
    for (const lift of this.lifts) {
      const motion = this.motionOf(lift);
      const there = next !== null && lift.start_m !== null && lift.delivery === next.delivery;
      if (motion === null) {
        if (isSet(lift) && (next === null || lift.order < next.order)) states[lift.part] = ASSEMBLED;
        else if (there && waits(lift)) states[lift.part] = UNBUILT;
      } else if (since(lift) >= motion.assembled_s) states[lift.part] = ASSEMBLED;
      else if (since(lift) >= motion.arrived_s) states[lift.part] = ARRIVED;
      else if (since(lift) >= motion.lifted_s) states[lift.part] = IN_TRANSIT;
      else if (there) states[lift.part] = UNBUILT;
    }
    return states;
  }

  _oneByOne(time) {
    const states = new Uint8Array(this.parts.length);
    const now = this.liftAt(time);
    for (const lift of this.lifts) {
      if (isSet(lift) && (now === null || lift.order < now.order)) states[lift.part] = ASSEMBLED;
      else if (waits(lift) && now !== null && lift.start_m !== null && lift.delivery === now.delivery) states[lift.part] = UNBUILT;
    }
    if (now !== null) {
      const motion = this.motionOf(now);
      const since = time - now.begins_s;
      if (since >= motion.assembled_s) states[now.part] = ASSEMBLED;
      else if (since >= motion.arrived_s) states[now.part] = ARRIVED;
      else if (since >= motion.lifted_s) states[now.part] = IN_TRANSIT;
      else states[now.part] = UNBUILT;
    }
    return states;
  }

  /** The lifts whose part matches every word of a query (name, GlobalId, class, type, storey, material). */
  matching(query) {
    const words = query.toLowerCase().split(/\s+/).filter(Boolean);
    if (!words.length) return this.lifts;
    return this.lifts.filter((lift) => {
      const part = this.parts[lift.part];
      const text = [nameOf(part), part.global_id, part.id, part.ifc_class, classWords(part.ifc_class), part.type_name, part.storey, part.material, lift.status, lift.method]
        .filter(Boolean).join(" ").toLowerCase(); // prettier-ignore
      return words.every((word) => text.includes(word));
    });
  }
}

const SORT_KEYS = {
  order: (plan, lift) => lift.order,
  name: (plan, lift) => nameOf(plan.parts[lift.part]).toLowerCase(),
  utilisation: (plan, lift) => lift.governs?.utilisation ?? -1,
  duration: (plan, lift) => plan.motionOf(lift)?.length_s ?? -1,
  mass: (plan, lift) => plan.parts[lift.part].mass_kg,
};

/** Whether the part of a lift is in place after its turn, set by the crane or otherwise. */
const isSet = (lift) => lift.status !== "infeasible" || lift.by_other_means;

/** Whether the part of a lift lies in the yard before its turn. */
const waits = (lift) => lift.status === "planned" || !isSet(lift);

/** What a part is that the crane does not lift. */
export const HOW = { in_situ: "cast in place", built: "built in place", by_hand: "set by hand" };

/** Lifts sorted by a key, ties by order; infeasible ones without a number come last when descending. */
export function sorted(plan, lifts, key, descending) {
  const value = SORT_KEYS[key];
  const sign = descending ? -1 : 1;
  const compare = (a, b) => {
    const [x, y] = [value(plan, a), value(plan, b)];
    return (x < y ? -sign : x > y ? sign : 0) || a.order - b.order;
  };
  return lifts.slice().sort(compare);
}
