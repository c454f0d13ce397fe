// The studio: what is open, what is chosen, and how a change goes from a hand to the drawing, the list and the server.
import { byId, el, fill } from "../page/dom.mjs";
import { counted, nameOf, percent, plain, whole } from "../page/words.mjs";
import { call, first, Latest } from "./api.mjs";
import { ask, askFile, askName, askWatch, wrongName } from "./dialogs.mjs";
import { Drawing } from "./drawing.mjs";
import { Form } from "./form.mjs";
import { watchHands } from "./hands.mjs";
import { History } from "./history.mjs";
import { Kept } from "./kept.mjs";
import { watchKeys } from "./keys.mjs";
import { Legend } from "./legend.mjs";
import { List } from "./list.mjs";
import { Panes } from "./panes.mjs";
import { Picture } from "./picture.mjs";
import { Planning } from "./planning.mjs";
import { PlanState } from "./state.mjs";
import { handleOf, moved, saved, withCorner, withoutCorner } from "./setup.mjs";
import { sameKinds } from "./types.mjs";
import { matching, meansOf, stateOf } from "./use.mjs";
import { Uploading } from "./uploading.mjs";
import { Variants } from "./variants.mjs";
import { Watching } from "./watching.mjs";

class App {
  constructor() {
    this.opened = null;
    this.history = new History(null);
    this.draft = null;
    this.moving = null;
    this.answer = null;
    this.chosen = null;
    this.query = "";
    this.states = null;
    this.shown = null;
    this.onMap = false;
    this.changes = null;
    this.done = new Set();
    this.carried = null;
    this.speed = null;
    this.result = null;
    this.other = null;
    this.placed = "[]";
    this.boxesSha256 = null;
    this.isSaving = false;
    this.drawing = new Drawing(this);
    this.list = new List(this);
    this.form = new Form(this);
    this.legend = new Legend(this);
    this.table = new Variants(this);
    this.planning = new Planning(this);
    this.watching = new Watching(this);
    this.kept = new Kept(this);
    this.state = new PlanState(this);
    this.panes = new Panes(this);
    this.picture = new Picture(this);
    this.uploading = new Uploading(this);
    this.trying = new Latest(
      ({ opened, setup }) => call("POST", "/api/try", { path: opened.path, setup: saved(setup) }),
      (answer, { opened }) => opened === this.opened && this.take(answer),
      (error) => this.fail(error),
    );
    this.placing = new Latest(
      ({ opened, boxes }) => call("POST", "/api/obstructions", { path: opened.path, obstructions: boxes, sha256: this.boxesSha256 }),
      ({ sha256 }, { opened }) => {
        if (opened === this.opened) this.boxesSha256 = sha256;
        this.state.look();
      },
      (error) => {
        this.placed = null;
        if (error.status === 409) this.sayBoxesChanged(error.message);
        else this.fail(error);
      },
    );
    watchHands(this);
    watchKeys(this);
    byId("open").addEventListener("click", () => this.chooseFile());
    byId("add-files").addEventListener("click", () => this.uploading.choose());
    byId("undo").addEventListener("click", () => this.undo());
    byId("redo").addEventListener("click", () => this.redo());
    byId("save").addEventListener("click", () => this.save());
    byId("save-variant").addEventListener("click", () => this.saveVariant());
    byId("start-plan").addEventListener("click", () => this.plan());
    byId("start-watch").addEventListener("click", () => this.watch());
    byId("fit").addEventListener("click", () => this.drawing.fit());
    byId("zoom-in").addEventListener("click", () => this.drawing.zoom(0.8));
    byId("zoom-out").addEventListener("click", () => this.drawing.zoom(1.25));
    addEventListener("beforeunload", (event) => this.isChanged && event.preventDefault());
  }

  /** The set-up on screen: the one being dragged, otherwise the entered one. */
  get setup() {
    return this.draft ?? this.history.state;
  }

  get isChanged() {
    return this.opened !== null && this.history.isChanged;
  }

  found(id) {
    return this.answer?.parts[id];
  }

  stateOf(part) {
    return stateOf(part, this.setup, this.found(part.id));
  }

  /** How far a part is that is lifted: "set" if that is done, "unset" or "lifting" while the plan is carried out, otherwise "". */
  stageOf(part) {
    if (meansOf(part, this.setup) !== "crane") return "";
    return this.carried ? this.carried.stageOf(part.id) : this.done.has(part.id) ? "set" : "";
  }

  isShown(part) {
    return this.shown === null || this.shown.has(part.id);
  }

  labelOf(id) {
    return handleOf(this.setup, id)?.label ?? "the point";
  }

  // --- Files

  async start() {
    if (first) await this.openFile(first);
    else await this.chooseFile();
  }

  async chooseFile() {
    const found = await this.files(["site", "model", "log"], "Open");
    if (found?.kind === "log") this.showOther(`/page/${encodeURI(found.path)}`, `The log ${found.path} as it was written; it is not compared with what is open here.`);
    else if (found) await this.openFile(found.path);
  }

  async files(kinds, title) {
    try {
      const { folder, files } = await call("GET", "/api/files");
      return await askFile(folder, files, kinds, title, (asked) => call("POST", "/api/found", asked), () => this.uploading.choose());
    } catch (error) {
      this.fail(error);
      return null;
    }
  }

  /** Open a file; `discarding`: what is not saved is not asked about. */
  async openFile(path, discarding = false) {
    if (!discarding && !(await this.mayLeave())) return;
    byId("path").textContent = `Opening ${plain(path)} …`;
    document.body.setAttribute("aria-busy", "true");
    try {
      const opened = await call("POST", "/api/open", { path });
      this.unsay();
      const { obstructions: boxes, sha256 = null } = opened.exists ? await this.obstructionsOf(opened.path) : { obstructions: [] };
      this.state.reset();
      this.kept.reset();
      this.table.reset();
      this.panes.allowResult(false);
      Object.assign(this, { result: null, other: null, boxesSha256: sha256, opened, history: new History({ ...opened.setup, boxes }, saved), placed: JSON.stringify(boxes), changes: null, done: new Set(), heard: opened.sha256, carried: null, draft: null, moving: null, answer: null, chosen: null, onMap: false });
      this.legend.reset();
      this.list.open();
      this.picture.open();
      this.panes.show("plan");
      this.drawing.open();
      this.render();
      this.try();
      if (opened.exists) await this.state.settled();
      this.state.render();
      this.kept.look();
      this.table.look();
    } catch (error) {
      this.fail(error);
    } finally {
      document.body.removeAttribute("aria-busy");
      this.renderHead();
    }
  }

  /** The obstructions of a site that are boxes, and the hash of their file; none, and a message, if it cannot be read. */
  async obstructionsOf(path) {
    try {
      return await call("GET", `/api/obstructions?path=${encodeURIComponent(path)}`);
    } catch (error) {
      this.fail(error);
      return { obstructions: [] };
    }
  }

  /** Whether the obstructions on screen are those that were read from their file, or written to it. */
  get isPlaced() {
    return JSON.stringify(this.history.state?.boxes) === this.placed && !this.placing.busy;
  }

  /** Hear how the files on disk are: what other programs wrote is shown, or asked about if it would replace an edit. */
  hear({ sha256, obstructions_sha256: boxesSha256 }) {
    const { opened } = this;
    if (!this.isSaving && sha256 !== opened.sha256 && sha256 !== this.heard) {
      this.heard = sha256;
      if (byId("told").hidden) this.sayChanged(`${opened.path} was changed on disk since it was opened here.`); // a refused save has said it
    }
    if (this.placing.busy || boxesSha256 === this.boxesSha256) return;
    if (this.isPlaced) this.takeBoxes();
    else if (byId("told").hidden) this.sayBoxesChanged("The obstructions were changed by another program.");
  }

  /** Show the obstructions of the file; those that were on screen can be had back with undo. */
  async takeBoxes() {
    const { opened } = this;
    const { obstructions: boxes, sha256 = null } = await this.obstructionsOf(opened.path);
    if (opened !== this.opened || this.placing.busy) return;
    Object.assign(this, { boxesSha256: sha256, placed: JSON.stringify(boxes) });
    this.change({ ...this.history.state, boxes }, "obstructions changed by another program");
    this.state.look();
  }

  /** Write the obstructions on screen over those of the file. */
  async placeOver() {
    this.boxesSha256 = (await this.obstructionsOf(this.opened.path)).sha256 ?? null;
    this.placed = null;
    this.unsay();
    this.place();
  }

  sayBoxesChanged(sentence) {
    const take = () => {
      this.unsay();
      this.takeBoxes();
    };
    this.say(sentence, "What you drew is still here.", "warn", [["Write mine over it", () => this.placeOver()], ["Take theirs", take]]);
  }

  /** Say that the site file is not what was opened; what was entered stays until the person decides. */
  sayChanged(sentence) {
    const { opened } = this;
    const again = () => this.openFile(opened.path, true);
    const mine = [["Save mine as a variant…", () => this.saveVariant()], ["Save mine over it", () => this.saveOver()], ["Open theirs", again]];
    this.say(sentence, this.isChanged ? "What you entered is still here." : null, "warn", this.isChanged ? mine : [["Open it again", again]]);
  }

  /** Save the set-up on screen over what somebody else saved. */
  async saveOver() {
    try {
      this.opened.sha256 = (await call("POST", "/api/state", { path: this.opened.path })).sha256;
      await this.save();
    } catch (error) {
      this.fail(error);
    }
  }

  /** Write the obstructions if they have changed. */
  place() {
    const { boxes } = this.history.state;
    const words = JSON.stringify(boxes);
    if (words === this.placed || (!this.opened.exists && !boxes.length)) return;
    this.placed = words;
    this.placing.ask({ opened: this.opened, boxes });
  }

  /** Ask about unsaved changes; returns whether what is open may be replaced. */
  async mayLeave() {
    if (!this.isChanged) return true;
    const answer = await ask("Unsaved changes", `${this.opened.path} has changes that are not saved.`, [["save", "Save"], ["discard", "Discard them"], [null, "Cancel"]]); // prettier-ignore
    return answer === "save" ? this.save() : answer === "discard";
  }

  /** Save; returns whether it worked. */
  async save() {
    if (!this.opened) return false;
    const { opened, history } = this;
    const setup = history.state;
    this.isSaving = true;
    try {
      const { path, sha256, changed } = await call("POST", "/api/save", { path: opened.path, setup: saved(setup), sha256: opened.sha256 });
      Object.assign(opened, { path, sha256, exists: true });
      history.markSaved(setup);
      this.unsay();
      this.place();
      this.state.look();
      this.announce(changed.length ? `Saved ${path}: ${changed.join(", ")}` : `Saved ${path}`);
      this.render();
      if (!sameKinds(setup, opened.setup)) await this.openFile(path, true); // the model was read again: other parts, masses, ways
      return true;
    } catch (error) {
      if (error.status === 409) this.sayChanged(error.message);
      else this.fail(error);
      return false;
    } finally {
      this.isSaving = false;
    }
  }

  /** Save the set-up on the screen, with its obstructions, as a site file of its own, and go on with that. */
  async saveVariant() {
    if (!this.opened) return;
    const names = new Set([this.opened, ...this.table.all].map(({ path }) => path.replace(/\.site\.toml$/, "").split("/").at(-1)));
    const stem = this.opened.name.replace(/ \d+$/, "");
    let number = 2;
    while (names.has(`${stem} ${number}`)) number += 1;
    const name = await askName("Save as variant", "Name of the variant; it becomes a site file of its own.", `${stem} ${number}`, wrongName);
    if (!name) return;
    const { opened } = this;
    try {
      const { path, double } = await call("POST", "/api/variant", { path: opened.path, setup: saved(this.history.state), name });
      if (double && path === opened.path) return this.say(`Nothing is changed: ${path} holds this set-up.`, null, "aside");
      await this.openFile(path, true);
      this.panes.show("variants");
      if (double) this.say(`${path} holds this set-up already; it is open now, and no second file was written.`, null, "aside");
      else this.announce(`Saved ${path}`);
    } catch (error) {
      this.fail(error);
    }
  }

  // --- Changes

  /** Show a set-up while a hand is moving something; null: nothing moves any more. */
  preview(setup, id = null) {
    this.draft = setup;
    this.moving = setup ? id : null;
    this.drawing.render();
    this.form.render();
    this.try();
  }

  /** Enter what was dragged. */
  settle(what) {
    const { draft } = this;
    this.draft = this.moving = null;
    if (draft) this.change(draft, what);
  }

  /** Enter a changed set-up. */
  change(setup, what, same = false) {
    this.draft = null;
    if (setup === this.history.state) return;
    this.history.push(setup, what, same);
    this.changed();
  }

  changed() {
    this.drawing.drawParts();
    this.renderSetup();
    this.place();
    this.state.render();
    this.state.look();
    this.try();
  }

  nudge(id, step, held) {
    this.moving = id;
    this.change(moved(this.history.state, id, step), `step of ${this.labelOf(id)}`, held);
    clearTimeout(this.still);
    this.still = setTimeout(() => {
      this.moving = null;
      this.drawing.render();
      this.announceHandle(id);
    }, 1500);
  }

  addCorner(id) {
    const [what, n, corner] = id.split("/");
    if (corner !== undefined) this.change(withCorner(this.history.state, `${what}/${n}`, Number(corner)), "new corner");
  }

  removeCorner(id) {
    const [what, n, corner] = id.split("/");
    if (corner !== undefined) this.change(withoutCorner(this.history.state, `${what}/${n}`, Number(corner)), "corner removed");
  }

  undo() {
    const what = this.history.undo();
    if (what) this.announce(`Undone: ${what}`);
    if (what) this.changed();
  }

  redo() {
    const what = this.history.redo();
    if (what) this.announce(`Done again: ${what}`);
    if (what) this.changed();
  }

  try() {
    if (this.opened) this.trying.ask({ opened: this.opened, setup: this.setup });
  }

  /** Take the server's answer about a set-up. */
  take(answer) {
    const isFirst = !this.answer;
    // A crane that has only moved keeps its rings.
    if (JSON.stringify(answer.cranes) === JSON.stringify(this.answer?.cranes)) answer.cranes = this.answer.cranes;
    this.answer = answer;
    this.picture.wait();
    this.render();
    if (isFirst && !this.draft) this.drawing.fit(); // the legend has its size now
  }

  // --- What is looked at

  choose(id, reveal = false) {
    this.chosen = id;
    this.render();
    if (!id) return;
    const part = this.opened.parts.find((one) => one.id === id);
    if (reveal) {
      const points = part.hull;
      if (points.length) this.drawing.reveal([points.reduce((sum, [x]) => sum + x, 0) / points.length, points.reduce((sum, [, y]) => sum + y, 0) / points.length]);
    } else this.list.reveal(id);
    byId("pane-setup").scrollTop = 0;
    this.announce(this.drawing.wordsOf(part));
  }

  filter({ query = this.query, states = this.states }) {
    Object.assign(this, { query, states });
    this.render();
  }

  setUnits(onMap) {
    this.onMap = onMap;
    this.form.render();
  }

  hint(id) {
    const part = id && this.opened?.parts.find((one) => one.id === id);
    byId("hint").hidden = !part;
    if (part) byId("hint").textContent = this.drawing.wordsOf(part);
  }

  showFields(id) {
    this.panes.show("setup");
    this.form.focus(id);
  }

  announceHandle(id) {
    const handle = handleOf(this.setup, id);
    if (handle) this.announce(`${handle.label}: x ${handle.at[0].toFixed(2)} m, y ${handle.at[1].toFixed(2)} m. ${this.summary()}`);
  }

  summary() {
    const { answer } = this;
    return answer ? `${whole(answer.served)} of ${counted(answer.of, "part")} can be lifted, highest utilisation ${percent(answer.highest)}.` : "";
  }

  // --- Plan

  async plan() {
    if (!this.opened || this.isBusy) return;
    if ((this.isChanged || !this.opened.exists) && !(await this.save())) return;
    await this.planOf(this.opened.path);
  }

  /** Keep the plan up to date with the obstructions. */
  async watch() {
    if (!this.opened || this.isBusy) return;
    const how = await askWatch(this.speed);
    if (!how) return;
    this.speed = how.speed;
    if ((this.isChanged || !this.opened.exists) && !(await this.save())) return;
    try {
      await this.watching.start(this.opened.path, how.speed);
    } catch (error) {
      this.fail(error);
    }
  }

  /** Whether a plan or a watch is under way. */
  get isBusy() {
    return this.planning.isRunning || this.watching.isRunning;
  }

  /** Mark the parts that the plan refuses or its newest revision changed (null: none), and those that are done. */
  setMarks(changes, done) {
    Object.assign(this, { changes, done });
    this.render();
  }

  /** Show how far a plan is that is carried out; null: none is. */
  setCarried(carried) {
    this.carried = carried;
    this.render();
  }

  /** The name of a part. */
  nameOf(id) {
    const part = this.opened.parts.find((one) => one.id === id);
    return part ? nameOf(part) : id;
  }

  /** Note the page of the newest result; it is loaded when it is looked at. */
  setResult(page, mark) {
    if (this.result?.mark !== mark) this.kept.look();
    this.result = { page, mark };
    this.panes.allowResult();
    if (this.panes.now === "result") this.openResult();
  }

  openResult() {
    const { page, mark } = this.other ?? this.result ?? {};
    if (page) this.planning.open(page, mark, this.carried?.time_s ?? null);
    this.state.render();
  }

  /** Plan a saved site. */
  async planOf(path) {
    try {
      await this.planning.start(path);
    } catch (error) {
      this.fail(error);
    }
  }

  /** Make a document of the newest plan: its suffix is ".report.html", ".report.pdf", ".project.xml" or ".4d.ifc". */
  async make(suffix) {
    try {
      await this.planning.run("/api/document", { path: this.opened.path, suffix }, "The document");
    } catch (error) {
      this.fail(error);
    }
  }

  /** Show a plan that is not of what is open, until another pane is shown. */
  showOther(page, words) {
    this.other = { page, mark: "", words };
    this.panes.show("result");
  }

  // --- Messages

  announce(words) {
    byId("live").textContent = plain(words);
  }

  say(sentence, hint = null, kind = "warn", acts = []) {
    fill(byId("told"), el("p", { class: kind }, el("span", { class: "said" }, el("span", {}, sentence), hint ? el("span", { class: "hint" }, hint) : null), ...acts.map(([words, act]) => el("button", { type: "button", onclick: act }, words)), el("button", { type: "button", class: "close", "aria-label": "Close this message", onclick: () => this.unsay() }, "×")));
    byId("told").hidden = false;
  }

  unsay() {
    byId("told").hidden = true;
    fill(byId("told"));
  }

  /** Show what the server refused. Nothing that was entered is lost. */
  fail(error) {
    const where = error.where && !error.message.includes(error.where) ? `${error.where}: ` : "";
    this.say(where + error.message, error.hint);
    this.renderHead();
    if (error.status === undefined) throw error;
  }

  // --- Drawing all of it

  render() {
    if (!this.opened) return this.renderHead();
    const all = !this.query.trim() && !this.states;
    this.shown = all ? null : new Set(matching(this.opened.parts, this.query, this.states, (part) => this.stateOf(part)).map((part) => part.id));
    this.drawing.drawParts();
    this.renderSetup();
    this.list.render();
    this.legend.render();
    this.table.render();
  }

  renderSetup() {
    this.drawing.render();
    this.form.render();
    this.renderHead();
  }

  renderHead() {
    const { opened, history, answer } = this;
    byId("undo").disabled = !history.canUndo;
    byId("redo").disabled = !history.canRedo;
    byId("save").disabled = !opened || (opened.exists && !history.isChanged);
    byId("save-variant").disabled = !opened;
    for (const id of ["start-plan", "start-watch"]) byId(id).disabled = !opened || this.isBusy;
    if (!opened) return void (byId("path").textContent = "Nothing is open");
    const mark = this.isChanged ? ", unsaved changes" : opened.exists ? "" : ", not written yet";
    byId("name").textContent = plain(opened.name);
    byId("path").textContent = plain(opened.path) + mark;
    document.title = `${this.isChanged ? "• " : ""}${plain(opened.name)}: ${this.state.now.title} · bimvox studio`;
    const chip = byId("served");
    chip.hidden = !answer;
    if (!answer) return;
    const bad = answer.served < answer.of || answer.problems.length > 0;
    const words = `${bad ? "✕" : "✓"} ${whole(answer.served)} of ${whole(answer.of)} can be lifted · highest ${percent(answer.highest)}${answer.problems.length ? ` · ${counted(answer.problems.length, "problem")}` : ""}`;
    const problem = answer.problems.length ? `: ${answer.problems[0]}` : ""; // where the set-up is another pane
    if (chip.textContent !== words + problem) fill(chip, words, el("span", { class: "narrow" }, problem));
    chip.className = `chip ${bad ? "refused" : "plain"}`;
  }
}

export const app = new App();
window.studio = app;
app.start();
