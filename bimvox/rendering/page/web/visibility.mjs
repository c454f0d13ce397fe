// What of the parts the view shows: each is seen, a ghost or hidden, by the search and by steps that can be undone.
import { GROUPINGS } from "./groups.mjs";
import { counted } from "./words.mjs";

export const [SEEN, GHOST, HIDDEN] = [0, 1, 2];
export const LOOKS = ["shown", "a ghost", "hidden"];
export const ACTS = { isolate: "isolated", hide: "hidden", ghost: "as ghosts" };
export const SCOPES = ["part", "class", "storey", "crane"];
const TOLD = 4;

export class Visibility {
  /** @param groups The groups of the parts. */
  constructor(groups) {
    this.groups = groups;
    this.query = "";
    this.steps = [];
    this.past = [];
    this.typing = false;
    this.looks = new Uint8Array(groups.parts.length);
  }

  /** Whether anything is filtered. */
  get filters() {
    return this.query.trim() !== "" || this.steps.length > 0;
  }

  /** Sets the search; what is typed in a row is one step for undo. */
  search(query) {
    if (query === this.query) return;
    if (!this.typing || !query) this._keep();
    this.typing = query !== "";
    this.query = query;
  }

  /** @param act A key of ACTS; isolating shows the group alone. @param by, value A grouping and a key of it; null for the parts without a group. */
  apply(act, by, value) {
    const last = this.steps.at(-1);
    if (last && last.act === act && last.by === by && last.value === value) return;
    this._keep();
    this.steps = [...(act === "isolate" ? [] : this.steps), { act, by, value }];
  }

  clear() {
    if (!this.filters) return;
    this._keep();
    this.query = "";
    this.steps = [];
  }

  /** Takes back the last step; returns whether there was one. */
  undo() {
    const before = this.past.pop();
    this.typing = false;
    if (before) Object.assign(this, before);
    return before !== undefined;
  }

  /** The search and the steps, to keep; `take` takes them over. */
  get state() {
    return { query: this.query, steps: this.steps };
  }

  take({ query, steps }) {
    const known = (step) => step && Object.hasOwn(ACTS, step.act) && GROUPINGS.includes(step.by) && (step.value === null || typeof step.value === "string");
    this.query = String(query ?? "");
    this.steps = Array.isArray(steps) ? steps.filter(known) : [];
  }

  _keep() {
    this.past.push(this.state);
    this.typing = false;
  }

  /** Sets and returns the look of every part; a new array, so that a change is seen. */
  update(plan) {
    this.groups.show(plan);
    const looks = new Uint8Array(this.groups.parts.length);
    for (const { act, by, value } of this.steps)
      for (let part = 0; part < looks.length; part++) {
        const own = this.groups.of(part, by) === value;
        if (act === "isolate") looks[part] = own ? SEEN : HIDDEN;
        else if (own) looks[part] = act === "hide" ? HIDDEN : GHOST;
      }
    if (this.query.trim()) {
      const found = new Set(plan.matching(this.query).map((lift) => lift.part));
      for (let part = 0; part < looks.length; part++) if (!found.has(part)) looks[part] = HIDDEN;
    }
    this.looks = looks;
    return looks;
  }

  /** What is filtered, in words; empty if nothing is. */
  get words() {
    if (!this.filters) return "";
    let [seen, ghosts] = [0, 0];
    for (const look of this.looks) {
      seen += look === SEEN;
      ghosts += look === GHOST;
    }
    const steps = this.steps.slice(-TOLD).map(({ act, by, value }) => `${this.groups.name(by, value)} ${ACTS[act]}`);
    if (this.steps.length > TOLD) steps.unshift(`${this.steps.length - TOLD} more`);
    if (this.query.trim()) steps.push(`search “${this.query.trim()}”`);
    return `${seen} of ${counted(this.looks.length, "part")} shown${ghosts ? `, ${counted(ghosts, "ghost")}` : ""}: ${steps.join(", ")}`;
  }
}
