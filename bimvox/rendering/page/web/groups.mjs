// What parts have in common: by class, storey, crane, delivery, utilisation or remark, each with a name.
import { classWords, nameOf, percent } from "./words.mjs";

export const GROUPINGS = ["part", "class", "storey", "crane", "delivery", "utilisation", "remark"];
export const BEYOND = "beyond";
const STEPS = [0.25, 0.5, 0.75];
const SEVERE = ["serious", "minor", "note"];

/** The groups of the parts of a plan. A key is a text; null if a part belongs to none. */
export class Groups {
  /**
   * @param parts Records of all parts.
   * @param cranes Names of the cranes.
   */
  constructor(parts, cranes) {
    this.parts = parts;
    this.cranes = cranes;
    this.plan = null;
  }

  /** Takes over a revision's plan. */
  show(plan) {
    if (this.plan === plan) return;
    this.plan = plan;
    /** Lower ends of the ranges of utilisation; the last one is critical. */
    this.edges = [0, ...STEPS.filter((edge) => edge < plan.hot - 1e-9), plan.hot];
    this.severity = new Array(this.parts.length).fill(null);
    const index = new Map(this.parts.map((part, n) => [part.id, n]));
    for (const { component, severity } of plan.revision.remarks) {
      const part = index.get(component);
      const rank = (name) => (name === null ? SEVERE.length : SEVERE.indexOf(name));
      if (part !== undefined && rank(severity) < rank(this.severity[part])) this.severity[part] = severity;
    }
  }

  of(part, by) {
    const record = this.parts[part];
    if (by === "part") return record.id;
    if (by === "class") return record.ifc_class || null;
    if (by === "storey") return record.storey || null;
    if (by === "remark") return this.severity[part];
    const lift = this.plan.ofPart[part];
    if (!lift) return null;
    if (by === "delivery") return lift.delivery === null ? null : String(lift.delivery);
    if (by === "utilisation") {
      if (!lift.governs) return null;
      const share = lift.governs.utilisation;
      return share === null ? BEYOND : String(this.edges.findLastIndex((edge) => share >= edge));
    }
    const motion = this.plan.motionOf(lift);
    return motion && this.cranes.length ? this.cranes[motion.crane ?? 0] : null;
  }

  /** Whether a group should be looked at: critical lifts, and serious remarks. */
  alarming(by, key) {
    return (by === "utilisation" && (key === BEYOND || Number(key) === this.edges.length - 1)) || (by === "remark" && key === "serious");
  }

  /** A key in words. */
  label(by, key) {
    if (key === null) return { storey: "no storey", crane: "not by a crane", delivery: "without a delivery", utilisation: "not by a crane", remark: "no remark" }[by] ?? "none";
    if (by === "part") return nameOf(this.parts.find((part) => part.id === key) ?? { name: key });
    if (by === "class") return classWords(key);
    if (by === "delivery") return String(Number(key) + 1);
    if (by !== "utilisation") return key;
    if (key === BEYOND) return "beyond the chart";
    const n = Number(key);
    if (n >= this.edges.length - 1) return `${percent(this.edges.at(-1))} or more, critical`;
    return n ? `${percent(this.edges[n])} to ${percent(this.edges[n + 1])}` : `below ${percent(this.edges[1])}`;
  }

  /** A group in words: `class Column`. */
  name(by, key) {
    return by === "part" ? this.label(by, key) : `${by} ${this.label(by, key)}`;
  }

  /** All groups of a grouping: [key, indices of its parts], in the order to list them; parts without a group last. */
  all(by) {
    const found = new Map();
    this.parts.forEach((_, part) => {
      const key = this.of(part, by);
      found.set(key, [...(found.get(key) ?? []), part]);
    });
    const height = (own) => Math.min(...own.map((part) => this.parts[part].target_m[2]));
    const rank = {
      class: ([, own]) => -own.length,
      storey: ([, own]) => height(own),
      crane: ([key]) => this.cranes.indexOf(key),
      delivery: ([key]) => Number(key),
      utilisation: ([key]) => (key === BEYOND ? Infinity : Number(key)),
      remark: ([key]) => SEVERE.indexOf(key),
    }[by];
    const compare = (a, b) => (a[0] === null) - (b[0] === null) || rank(a) - rank(b) || (a[0] < b[0] ? -1 : 1);
    return [...found].sort(compare);
  }
}
