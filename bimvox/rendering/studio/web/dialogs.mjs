// Questions to the person: which file, which name, what of unsaved changes.
import { byId, el, fill } from "../page/dom.mjs";
import { counted } from "../page/words.mjs";
import { numberOf } from "./numbers.mjs";

const KINDS = { site: "Site files", model: "Models", log: "Plans (logs)" };

/** Ask with buttons; returns the value of the pressed one, null if the person closed the question. */
export function ask(title, sentence, choices) {
  const dialog = byId("ask");
  return new Promise((done) => {
    let chosen = null;
    const buttons = choices.map(([value, words], n) => el("button", { type: "button", class: n === 0 ? "main" : null, onclick: () => ((chosen = value), dialog.close()) }, words));
    fill(dialog, el("h2", { id: "ask-title" }, title), el("p", {}, sentence), el("div", { class: "answers" }, ...buttons));
    dialog.addEventListener("close", () => done(chosen), { once: true });
    dialog.showModal();
  });
}

/** Ask for a name; returns it, null if the person closed the question. `check` says what is wrong with a name. */
export function askName(title, sentence, given, check) {
  const dialog = byId("ask");
  return new Promise((done) => {
    let chosen = null;
    const input = el("input", { type: "text", id: "new-name", value: given, autocomplete: "off", spellcheck: "false" });
    const wrong = el("p", { class: "warn", role: "alert", hidden: true });
    const form = el(
      "form",
      { method: "dialog" },
      el("label", { for: "new-name" }, sentence),
      input,
      wrong,
      el("div", { class: "answers" }, el("button", { type: "submit", class: "main" }, "Save"), el("button", { type: "button", onclick: () => dialog.close() }, "Cancel")),
    );
    form.addEventListener("submit", (event) => {
      const name = input.value.trim();
      const why = check(name);
      if (!why) return void (chosen = name);
      event.preventDefault();
      wrong.textContent = why;
      wrong.hidden = false;
      input.focus();
    });
    fill(dialog, el("h2", { id: "ask-title" }, title), form);
    dialog.addEventListener("close", () => done(chosen), { once: true });
    dialog.showModal();
    input.select();
  });
}

/** Ask how a plan is watched; returns {speed: how many times as fast as real time it is carried out, null: it is not}, null if the person closed the question. */
export function askWatch(last) {
  const dialog = byId("ask");
  return new Promise((done) => {
    let chosen = null;
    const choice = (value, words) => el("label", { class: "choice" }, el("input", { type: "radio", name: "carried", value, checked: (last === null) === (value === "no") }), el("span", {}, words));
    const speed = el("input", { type: "text", id: "speed", inputmode: "decimal", value: String(last ?? 60), autocomplete: "off", "aria-label": "Times as fast as real time" });
    const wrong = el("p", { class: "warn", role: "alert", hidden: true });
    const form = el(
      "form",
      { method: "dialog" },
      el("p", {}, "Every obstruction that is drawn, moved or removed then changes the plan at once, and what changed is marked. The log is kept up to date."),
      choice("no", "Keep the whole plan up to date"),
      choice("yes", "Also carry the plan out: a simulated clock runs, parts are lifted and set"),
      el("label", { class: "pace", for: "speed" }, "Speed, times real time", speed),
      wrong,
      el("div", { class: "answers" }, el("button", { type: "submit", class: "main" }, "Start"), el("button", { type: "button", onclick: () => dialog.close() }, "Cancel")),
    );
    const isCarried = () => form.elements.carried.value === "yes";
    const show = () => (speed.disabled = !isCarried());
    form.addEventListener("change", show);
    form.addEventListener("submit", (event) => {
      const value = numberOf(speed.value);
      if (!isCarried() || (value >= 0.1 && value <= 10000)) return void (chosen = { speed: isCarried() ? value : null });
      event.preventDefault();
      wrong.textContent = "The speed is a number from 0.1 to 10000, such as 60: a minute in a second.";
      wrong.hidden = false;
      speed.focus();
    });
    fill(dialog, el("h2", { id: "ask-title" }, "Watch the plan"), form);
    show();
    dialog.addEventListener("close", () => done(chosen), { once: true });
    dialog.showModal();
    form.querySelector("[type=submit]").focus();
  });
}

/**
 * Show the files of the folder; returns the chosen one, null if the person closed the list. A site file says the state of its plan,
 * what it differs in from the first one of its model, its revisions and documents. `look`: (asked) => promise of what the folder
 * holds of a site; `add`: lets the person add files.
 */
export function askFile(folder, files, kinds, title, look, add) {
  const dialog = byId("files");
  return new Promise((done) => {
    let chosen = null;
    const choose = (file) => ((chosen = file), dialog.close());
    const item = (file) => el("li", {}, el("button", { type: "button", onclick: () => choose(file) }, el("span", {}, file.path), file.kind === "site" ? el("small", { class: "held", "data-held": file.path }, "…") : null));
    const groups = kinds.map((kind) => [kind, files.filter((file) => file.kind === kind && !isRevision(file.path))]).filter(([, own]) => own.length);
    fill(
      dialog,
      el("h2", { id: "files-title" }, title),
      el("p", { class: "kicker" }, `Folder ${folder}, ${counted(files.length, "file")}`),
      el("div", { class: "scroll" }, ...groups.flatMap(([kind, own]) => [el("h3", {}, KINDS[kind]), el("ul", { class: "files" }, ...own.map(item))]), groups.length ? null : el("p", { class: "aside" }, "There is no file here that can be opened. Drop an IFC or mesh file on this page, or add it.")),
      el("div", { class: "answers" }, el("button", { type: "button", onclick: add }, "Add files…"), el("button", { type: "button", onclick: () => dialog.close() }, "Cancel")),
    );
    dialog.addEventListener("close", () => done(chosen), { once: true });
    dialog.showModal();
    describe(dialog, files.filter(({ kind }) => kind === "site"), look); // prettier-ignore
  });
}

/** A segment of a watch or a log of its simulation: it is found through its site. */
const isRevision = (path) => /\.(r|live)\d{4,}\.mcap$/.test(path);

/** Fill what the folder holds of each site file, one after the other, as long as the list is open. */
async function describe(dialog, sites, look) {
  for (const { path, model } of sites) {
    const base = sites.find((one) => one.model === model).path;
    const found = await look({ path, ...(base === path ? {} : { against: base }) }).catch((error) => ({ title: error.message }));
    if (!dialog.open) return;
    const at = dialog.querySelector(`[data-held="${CSS.escape(path)}"]`);
    if (at) fill(at, ...heldWords(found, base).map((words) => el("span", {}, words)));
  }
}

/** What the folder holds of a site, in lines. */
export function heldWords({ title, when, counts, changes = [], differs, revisions = [], documents = [] }, base) {
  const plan = [title, when, counts?.words].filter(Boolean).join(" · ");
  const also = [revisions.length > 1 ? counted(revisions.length, "revision") : "", ...documents.map(({ name, is_of_plan: isOfPlan }) => (isOfPlan ? name : `${name} of an earlier plan`))];
  return [plan, changes.length ? `Changed since: ${changes.join(", ")}` : "", differs ? `Differs from ${base} in: ${differs.join(", ") || "nothing"}` : "", also.filter(Boolean).join(" · ")].filter(Boolean);
}

/** What is wrong with the name of a site file; null if nothing. */
export const wrongName = (name) => (!name ? "Type a name." : /[\\/:*?"<>|\x00-\x1f]|^\.|\.$/.test(name) ? 'A name has none of \\ / : * ? " < > | and no dot at its ends.' : null);
