// Undo and redo over states that never change.

export class History {
  /** @param kept what of a state is saved with it; the rest is undone and redone, but has a file of its own */
  constructor(state, kept = (all) => all) {
    this.kept = kept;
    this.past = [];
    this.future = [];
    this.state = state;
    this.saved = state;
  }

  /** Enter a state. `what` names the change; `same`: it continues the last change (a key held down) and shares its undo. */
  push(state, what, same = false) {
    if (equal(state, this.state)) return;
    if (!same || this.past.at(-1)?.what !== what) this.past.push({ state: this.state, what });
    this.future = [];
    this.state = state;
  }

  /** Go back; returns what was undone, null if there is nothing. */
  undo() {
    const last = this.past.pop();
    if (!last) return null;
    this.future.push({ state: this.state, what: last.what });
    this.state = last.state;
    return last.what;
  }

  /** Go forward again; returns what was redone, null if there is nothing. */
  redo() {
    const next = this.future.pop();
    if (!next) return null;
    this.past.push({ state: this.state, what: next.what });
    this.state = next.state;
    return next.what;
  }

  get canUndo() {
    return this.past.length > 0;
  }

  get canRedo() {
    return this.future.length > 0;
  }

  /** Whether the state differs from the saved one. */
  get isChanged() {
    const { state, saved } = this;
    if (this.compared?.state !== state || this.compared.saved !== saved) this.compared = { state, saved, differ: !equal(this.kept(state), this.kept(saved)) };
    return this.compared.differ;
  }

  /** Note that a state was saved: the current one, or the one that was sent. */
  markSaved(state = this.state) {
    this.saved = state;
  }
}

const equal = (a, b) => a === b || JSON.stringify(a) === JSON.stringify(b);
