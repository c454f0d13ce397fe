// One revision of the plan: which lift runs when, what has become of every part, and lists of lifts.
import { classWords, nameOf } from "./words.mjs";

export const [AWAY, UNBUILT, IN_TRANSIT, ARRIVED, ASSEMBLED] = [0, 1, 2, 3, 4];

/** From this share of the capacity on a lift is marked as critical. */
export const HOT = 0.9;

export class Plan {
  /**
   * @param revision A revision's record.
   * @param parts Records of all parts.
   * @param motions Decoded motions.
   */
  constructor(revision, parts, motions) {
    this.revision = revision;
    this.parts = parts;
    this.lifts = revision.lifts;
    this.motions = motions;
    this.timed = this.lifts.filter((lift) => lift.motion !== null);
    this.ofPart = new Array(parts.length).fill(null);
    for (const lift of this.lifts) this.ofPart[lift.part] = lift;
    this.begins = revision.begins_s;
    this.ends = revision.ends_s;
  }

  motionOf(lift) {
    return lift.motion === null ? null : this.motions[lift.motion];
  }

  endOf(lift) {
    return lift.begins_s + this.motionOf(lift).length_s;
  }

  /** The lift under way at a time: the last one that has begun; null where nothing is timed. */
  liftAt(time) {
    let low = 0;
    let high = this.timed.length - 1;
    while (low < high) {
      const middle = (low + high + 1) >> 1;
      if (this.timed[middle].begins_s <= time) low = middle;
      else high = middle - 1;
    }
    return this.timed[low] ?? null;
  }

  /** The lift before or after another in time; null at the ends. */
  neighbour(lift, step) {
    return this.timed[this.timed.indexOf(lift) + step] ?? null;
  }

  /** The phase of a lift at a time, as the log names it; null where the log has none. */
  phaseAt(lift, time) {
    let found = null;
    for (const [name, start] of this.motionOf(lift).phases) if (time - lift.begins_s >= start) found = name;
    return found;
  }

  /**
   * What has become of every part: earlier lifts are assembled, the delivery of the lift under way lies in the yard
   * (it arrives when all lifts of the earlier ones are done), later deliveries are not there.
   */
  statesAt(time) {
    const states = new Uint8Array(this.parts.length);
    const now = this.liftAt(time);
    for (const lift of this.lifts) {
      if (lift.status === "planned" && (now === null || lift.order < now.order)) states[lift.part] = ASSEMBLED;
      else if (now !== null && lift.start_m !== null && lift.delivery === now.delivery) states[lift.part] = UNBUILT;
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
