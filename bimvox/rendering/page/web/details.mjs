// Details of the chosen part and of the whole plan.
import { byId, el, fill, terms } from "./dom.mjs";
import { cranesOf } from "./cranes.mjs";
import { HOW, deliveryWords } from "./plan.mjs";
import { extent } from "./overlays.mjs";
import { LOOKS, SCOPES, SEEN } from "./visibility.mjs";
import { MASS_SOURCES, METHODS, STORED, classWords, clock, counted, degrees, digitsOf, elapsed, fixed, metres, nameOf, percent, point, sentence, span, tonnes, whole } from "./words.mjs";

/** The share of each of the two cranes that carry a part, as rows. */
function ofTwoCranes(tandem, cranes) {
  const share = (n) => `${tonnes(tandem.load_kg[n])} level, ${tonnes(tandem.most_kg[n])} at most; ${fixed(tandem.used[n] * 100, 0)} % of its load chart`;
  return [...tandem.cranes.map((crane, n) => [`Share of ${cranes[crane].name}`, share(n)]), ["Two hooks", `${metres(tandem.apart_m)} apart, in time with each other; no other lift meanwhile`]];
}

/** The shares of the mass on the two hooks that turn a part over, and how much of what they may carry they use. */
function betweenHooks(flip) {
  const used = Math.max(flip.main_used, flip.auxiliary_used, flip.both_used);
  const level = `level: main ${tonnes(flip.main_kg[0])}, auxiliary ${tonnes(flip.auxiliary_kg[0])}`;
  return `turned over in the air; ${level}; ${fixed(used * 100, 0)} % used at most; ${metres(flip.clear_m)} clear of the ground`;
}

export class Details {
  constructor(app) {
    this.app = app;
    this.tabs = ["part", "plan", "remarks"].map((name) => ({ name, tab: byId(`tab-${name}`), panel: byId(`panel-${name}`) }));
    for (const { name, tab } of this.tabs) {
      tab.addEventListener("click", () => this.open(name));
      tab.addEventListener("keydown", (event) => {
        if (event.key !== "ArrowLeft" && event.key !== "ArrowRight") return;
        event.stopPropagation();
        const step = event.key === "ArrowLeft" ? this.tabs.length - 1 : 1;
        const other = this.tabs[(this.tabs.findIndex((entry) => entry.name === name) + step) % this.tabs.length];
        this.open(other.name);
        other.tab.focus();
      });
    }
    byId("plan-button").addEventListener("click", () => {
      this.app.panes.show("details");
      this.open("plan");
      byId("panel-plan").focus();
    });
  }

  open(name) {
    this.opened = name;
    for (const entry of this.tabs) {
      const own = entry.name === name;
      entry.tab.setAttribute("aria-selected", String(own));
      entry.tab.tabIndex = own ? 0 : -1;
      entry.panel.hidden = !own;
    }
  }

  renderPart() {
    const { app } = this;
    const panel = byId("panel-part");
    if (app.obstruction) fill(panel, ...this._obstruction(app.obstruction));
    else if (app.chosen !== null) fill(panel, ...this._part(app.chosen));
    else if (app.lift) fill(panel, el("p", { class: "kicker" }, "Under way; choose a part in the list or in the view to pin it here"), ...this._part(app.lift.part));
    else fill(panel, el("p", {}, "Choose a lift in the list, or click a part in the view."));
    panel.scrollTop = 0;
  }

  _part(index) {
    const { app } = this;
    const part = app.parts[index];
    const lift = app.plan.ofPart[index];
    const motion = lift && app.plan.motionOf(lift);
    const bad = lift?.status !== "planned";
    const other = HOW[lift?.status];
    const use = lift?.governs;
    return [
      el("h2", {}, nameOf(part)),
      el("p", {}, `${classWords(part.ifc_class)}${lift ? `, lift ${lift.number} of ${app.plan.lifts.length}` : ""}`),
      lift ? (other ? this._notLifted(lift, other) : bad ? this._infeasible(lift) : this._proof(lift)) : null,
      ...app.remarks.about(index).map((remark) => el("p", { class: `aside ${remark.severity}` }, el("strong", {}, `${remark.severity === "note" ? "Note" : `Remark, ${remark.severity}`}: `), remark.text)),
      motion ? el("p", { class: "links" }, el("button", { type: "button", onclick: () => app.seek(lift.begins_s) }, `Go to this lift, ${lift.begins_in_words ?? clock(lift.begins_s)}`)) : null,
      ...this._looks(index),
      el("h3", {}, "Part"),
      terms([
        ["GlobalId", el("code", {}, part.global_id)],
        ["Id", part.id === part.global_id ? null : el("code", {}, part.id)],
        ["Class", part.ifc_class],
        ["Type", part.type_name],
        ["Storey", part.storey],
        ["Material", part.material],
        ["Mass", tonnes(part.mass_kg)],
        ["Mass from", MASS_SOURCES[part.mass_source] ?? "not recorded"],
        ["Cells", whole(part.cells)],
        ["Size", `${part.size_m.map((value) => fixed(value, digitsOf(app.document.site.voxel_size_m))).join(" × ")} m`],
      ]),
      ...(lift && !bad ? this._lift(lift, motion, use) : []),
    ];
  }

  /** Buttons that isolate, hide or ghost the part, or all of its class, storey or crane. */
  _looks(index) {
    const { visibility, groups } = this.app;
    const acts = [["isolate", "i"], ["hide", "h"], ["ghost", "g"]];
    const rows = SCOPES.filter((by) => by !== "crane" || groups.cranes.length > 1).map((by) => [by, groups.of(index, by)]).filter(([, value]) => value !== null);
    const look = visibility.looks[index];
    return [
      el("h3", {}, "In the view"),
      look === SEEN ? null : el("p", { class: "kicker" }, `This part is ${LOOKS[look]}.`),
      this.app.colourBy === "status" ? null : el("p", { class: "kicker" }, `Coloured by ${this.app.colourBy}: ${groups.label(this.app.colourBy, groups.of(index, this.app.colourBy))}.`),
      el("div", { class: "looks" }, ...rows.flatMap(([by, value]) => [
        el("span", {}, by === "part" ? "This part" : groups.name(by, value)),
        el("span", { class: "group", role: "group", "aria-label": by === "part" ? "This part" : `All of ${groups.name(by, value)}` }, ...acts.map(([act, key]) =>
          el("button", { type: "button", "data-look": `${act} ${by}`, title: by === "part" ? `${act} this part (${key})` : `${act} ${groups.name(by, value)}`, onclick: () => this.app.look(act, by, value) }, act))),
      ])),
    ]; // prettier-ignore
  }

  _notLifted(lift, words) {
    const by = lift.needed_by_s === null ? "" : `, by ${lift.needed_by_in_words ?? clock(lift.needed_by_s)}`;
    const { step } = lift;
    return el("div", { class: "aside", role: "note" },
      el("strong", {}, `No lift of the crane: ${words}.`),
      el("p", {}, `${sentence(lift.reason)}. It is needed after all earlier parts of the sequence${by}.`),
      step?.in_words ? el("p", {}, `The work begins ${step.in_words[0]} and ends ${step.in_words[1]}; it carries what rests on it from ${step.in_words[2]}.`) : step ? el("p", {}, `In elapsed time, the work begins at ${elapsed(step.begins_s)} and ends at ${elapsed(step.ends_s)}; it carries what rests on it from ${elapsed(step.carries_s)}.`) : null,
    ); // prettier-ignore
  }

  _infeasible(lift) {
    const { app } = this;
    return el("div", { class: "warn", role: "note" },
      el("strong", {}, lift.by_other_means ? "NOT LIFTED: to be set by other means." : "INFEASIBLE: not lifted."),
      el("p", {}, sentence(lift.reason ?? "no reason is recorded.")),
      lift.by_other_means ? el("p", {}, `It is needed after all earlier parts of the sequence${lift.needed_by_s === null ? "" : `, by ${lift.needed_by_in_words ?? clock(lift.needed_by_s)}`}; what rests on it is proven with it in place.`) : null,
      lift.blocked_by.length ? el("p", {}, "Blocked by (red in the view):") : null,
      lift.blocked_by.length ? el("div", { class: "links" }, ...lift.blocked_by.map((id) => this._link(id))) : null,
    ); // prettier-ignore
  }

  _link(id) {
    const { app } = this;
    const part = app.parts.findIndex((entry) => entry.id === id);
    const obstruction = app.plan.revision.obstructions.find((entry) => entry.id === id);
    const standing = app.document.standing.find((entry) => entry.id === id);
    const go = part >= 0 ? () => app.choose(part) : obstruction ? () => app.chooseObstruction(obstruction) : null;
    return go ? el("button", { type: "button", onclick: go }, part >= 0 ? nameOf(app.parts[part]) : id) : standing?.name ? el("span", { title: id }, standing.name) : el("code", {}, id);
  }

  _proof(lift) {
    const { proof } = this.app.plan.revision;
    if (lift.proven === null) return el("p", { class: "warn" }, proof ? "NOT PROVEN here: this log is an extract and does not carry the path of this lift." : "NOT PROVEN: no proof was made for this page.");
    const checks = proof.checks.filter((check) => check.samples > 0);
    if (!lift.proven) return el("p", { class: "warn" }, "NOT PROVEN: a check of this lift failed; see Plan.");
    if (!lift.current) return el("p", { class: "aside minor" }, "Proven against the obstructions before the last change only, not against the current ones: its part was set before it.");
    const clean = this.app.remarks.about(lift.part).every((remark) => remark.severity === "note");
    return el("p", { class: clean ? "fine" : "aside" }, `${clean ? "✓ " : ""}Proven: ${checks.length} checks of the log passed for this lift${lift.samples ? `, ${counted(lift.samples, "sample")} of its motion` : ""}.`);
  }

  _lift(lift, motion, use) {
    const { app } = this;
    const excess = lift.shortest_moves ? ` (${fixed(lift.moves / lift.shortest_moves, 2)} × shortest)` : "";
    const parts = [];
    if (use) {
      const share = use.utilisation ?? 1;
      const bar = el("div", { class: lift.critical ? "hot" : null });
      bar.style.width = `${Math.min(100, share * 100)}%`;
      parts.push(
        el("h3", {}, "Capacity"),
        el("div", { class: "meter", role: "img", "aria-label": `${percent(use.utilisation)} of the capacity used` }, bar),
        terms([
          ["Utilisation", `${use.utilisation === null ? "beyond the chart" : `${fixed(use.utilisation * 100, 1)} %`}`],
          ["On the hook", `${tonnes(use.load_kg)} with rigging and hook block`],
          ["Gross capacity", `${tonnes(use.capacity_kg)} at ${metres(use.radius_m)}`],
          ["Permitted wind", lift.lifting?.permitted_wind_m_s ? `up to ${fixed(lift.lifting.permitted_wind_m_s, 1)} m/s` : null],
          ["Governing sample", el("button", { type: "button", onclick: () => app.seek(use.time_s), title: "Go there" }, `${span(use.time_s - lift.begins_s)} after it begins`)],
        ]),
      );
    }
    if (motion) {
      const nominal = motion.kind === "carried";
      parts.push(
        el("h3", {}, "Time"),
        terms([
          ["Crane", cranesOf(app.document).length > 1 ? [motion.crane ?? 0, ...(motion.second ? [motion.second.crane] : [])].map((n) => cranesOf(app.document)[n].name).join(" and ") : null],
          ["Begins", lift.begins_in_words ?? clock(lift.begins_s)],
          ["Whole lift", nominal ? `${span(motion.length_s)} (nominal, 1 s per move)` : span(motion.length_s)],
          ["Heading", lift.heading],
          ["Carrying", lift.duration_s === null ? null : span(lift.duration_s)],
          ["Bound", lift.bound_s === null ? null : `${span(lift.bound_s)} (${fixed(lift.duration_s / lift.bound_s, 2)} ×)`],
        ]),
      );
    }
    parts.push(
      el("h3", {}, "Path"),
      terms([
        ["Found by", METHODS[lift.method] ?? lift.method],
        ["Moves", lift.moves === null ? null : `${whole(lift.moves)} cells${excess}`],
        ["Shortest", lift.shortest_moves === null ? null : `${whole(lift.shortest_moves)} cells`],
        ["In contact", lift.contact_moves ? `last ${counted(lift.contact_moves, "placement")}` : null],
        ["Delivery", lift.delivery === null ? null : `no. ${lift.delivery + 1}`],
        ["Stored", STORED[lift.stored] ?? lift.stored],
        ["Two hooks", lift.flip ? betweenHooks(lift.flip) : null],
        ...(lift.tandem ? ofTwoCranes(lift.tandem, cranesOf(app.document)) : []),
      ]),
    );
    const delivery = (app.plan.revision.deliveries ?? []).find(({ number }) => number === lift.delivery);
    if (lift.unloading)
      parts.push(
        el("h3", {}, "Unloading from the truck"),
        terms([
          ["Radius", metres(lift.unloading.radius_m)],
          ["Utilisation", `${fixed(lift.unloading.utilisation * 100, 1)} %`],
          ["Crane time", span(lift.unloading.crane_s)],
          ["", delivery ? deliveryWords(app.plan, delivery).join(", ") : null, true],
        ]),
      );
    if (lift.pick)
      parts.push(
        el("h3", {}, "Hook"),
        terms([
          ["Pick point", point(lift.pick.hook_m), true],
          ["", null],
          ["at", `radius ${metres(lift.pick.radius_m)}, slew ${degrees(lift.pick.slew_rad)}`],
          ["Set point", point(lift.set.hook_m), true],
          ["at", `radius ${metres(lift.set.radius_m)}, slew ${degrees(lift.set.slew_rad)}`],
        ]),
      );
    return parts;
  }

  /** What the site file changes in the machines. */
  _overrides() {
    return cranesOf(this.app.document).flatMap((crane) =>
      crane.overrides.map((one) => [`Override, ${crane.name}`, `${one.key}: ${one.site} instead of ${one.catalogue}`]),
    );
  }

  /** For several cranes: name, lifts, and share of the time that each works. */
  _cranes() {
    const { plan, document } = this.app;
    const cranes = cranesOf(document);
    if (cranes.length < 2) return [];
    if (plan.setUps.length) return this._setUps();
    const whole = Math.max(plan.ends - plan.begins, 1e-9);
    return cranes.map((crane, n) => {
      const lifts = plan.ofCrane[n] ?? [];
      const busy = lifts.flatMap((lift) => plan.busyOf(lift)).reduce((sum, [start, end]) => sum + end - start, 0);
      return [`Crane ${crane.name}`, `${counted(lifts.length, "lift")}, busy ${percent(busy / whole)}`];
    });
  }

  /** For a crane that moves: the set-ups, the lifts there, and how long the move to each takes. */
  _setUps() {
    const { plan } = this.app;
    return plan.setUps.map((name, n) => {
      const lifts = plan.ofCrane[n] ?? [];
      const numbers = lifts.map((lift) => lift.order + 1);
      const move = (plan.revision.moves ?? []).find(({ to }) => to === n);
      const moved = move ? `; the move there takes ${elapsed(move.takes_s)}` : "";
      const which = numbers.length > 1 ? `lifts ${Math.min(...numbers)} to ${Math.max(...numbers)}` : `lift ${numbers[0]}`;
      return [`Set-up ${name}`, numbers.length ? `${which}${moved}` : "no lift: the crane does not go there"];
    });
  }

  _obstruction(record) {
    const { app } = this;
    const { boxes } = app.scene ? app.scene.obstructionOf(record) : { boxes: [] };
    const cell = app.document.site.voxel_size_m;
    const [low, high] = extent(boxes);
    const blocked = app.plan.lifts.filter((lift) => lift.blocked_by.includes(record.id));
    return [
      el("h2", {}, record.id),
      el("p", {}, "Obstruction (its cells, extended by the site's clearance)"),
      boxes.length ? terms([
        ["Size", `${low.map((value, axis) => fixed((high[axis] - value) * cell, digitsOf(cell))).join(" × ")} m`],
        ["Lowest corner", point(low.map((value, axis) => app.document.site.origin_m[axis] + value * cell)), true],
      ]) : null,
      el("h3", {}, "Blocks"),
      blocked.length ? el("div", { class: "links" }, ...blocked.map((lift) => this._link(app.parts[lift.part].id))) : el("p", {}, "no lift"),
    ]; // prettier-ignore
  }

  renderPlan() {
    const { app } = this;
    const { revision } = app.plan;
    const { site } = app.document;
    const shares = new Map();
    for (const lift of app.plan.lifts) if (lift.method) shares.set(lift.method, (shares.get(lift.method) ?? 0) + 1);
    fill(
      byId("panel-plan"),
      el("h2", {}, site.name),
      revision.changes || app.document.revisions.length > 1 ? el("h3", {}, `Revision ${revision.number}`) : null,
      ...this._changes(revision),
      el("h3", {}, "Plan"),
      terms([
        ["Model", site.model],
        ["Log", revision.log],
        ["Planned", `${revision.planned} of ${counted(app.plan.lifts.length, "lift")}`],
        ["Infeasible", String(revision.infeasible)],
        ["In this log", revision.carried < app.plan.lifts.length ? `${revision.carried} (it is an extract)` : null],
        ["Recovered", revision.metadata.recovered === "true" ? "recovered from a damaged log; some lifts may be missing" : null],
        ["Time", revision.time ? revision.time.span_in_words : revision.timed ? span(revision.ends_s - revision.begins_s) : "no crane: nominal times, 1 s per move"],
        ["Work", revision.time?.hours_in_words],
        ["Crane", cranesOf(app.document).length > 1 ? (app.plan.setUps.length ? app.document.crane.machine : null) : app.document.crane?.name],
        ...this._cranes(),
        ...this._overrides(),
        ...cranesOf(app.document).map(({ name, rigging_mass_kg: mass }, _, all) => [all.length > 1 ? `Empty hook, ${name}` : "Empty hook", `${tonnes(mass)}: hook block and rigging`]),
        ["Mass lifted", tonnes(app.plan.lifts.filter((lift) => lift.status === "planned").reduce((sum, lift) => sum + app.parts[lift.part].mass_kg, 0))],
        ["Found by", [...shares].map(([method, count]) => `${METHODS[method] ?? method} ${count}`).join(", ")],
        ["Cells", `${site.shape.join(" × ")} of ${fixed(site.voxel_size_m, digitsOf(site.voxel_size_m))} m`],
      ]),
      ...this._infeasibleList(),
      el("h3", {}, "Proof"),
      ...this._checks(revision),
      ...this._sentences("Overlaps in the model", revision.clashes.map((clash) => `${this._name(clash.first)} and ${this._name(clash.second)}: ${clash.at_least ? "at least " : ""}${fixed(clash.depth_m * 1000, 1)} mm`)),
      ...this._sentences("Notes", [...revision.notes, ...site.notes, ...revision.obstruction_notes]),
      el("h3", {}, "Hashes"),
      terms([
        ["Log, SHA-256", el("code", {}, revision.sha256), true],
        ["Site digest", el("code", {}, revision.digest), true],
        ["Geometry digest", el("code", {}, site.geometry_digest), true],
        ["Model, SHA-256", el("code", {}, site.model_sha256), true],
        ...Object.entries(revision.metadata).filter(([key]) => key.startsWith("sha256 ")).map(([key, value]) => [`${key.slice(7)}, SHA-256`, el("code", {}, value), true]),
        ...["policy", "policy_steps", "seed"].filter((key) => key in revision.metadata).map((key) => [key.replace("_", " "), el("code", {}, revision.metadata[key])]),
      ]),
    ); // prettier-ignore
  }

  _name(id) {
    const part = this.app.parts.find((entry) => entry.id === id);
    return part ? nameOf(part) : id;
  }

  _changes(revision) {
    const { app } = this;
    if (!revision.changes) return app.document.revisions.length > 1 ? [el("p", {}, "The first revision in this page.")] : [];
    const { since, kept, replanned, infeasible, changed_cells: cells } = revision.changes;
    const links = (parts) => el("div", { class: "links" }, ...parts.map((part) => el("button", { type: "button", onclick: () => app.choose(part) }, nameOf(app.parts[part]))));
    return [
      el("p", {}, `Since revision ${since}: ${counted(cells, "obstruction cell")} changed.`),
      terms([["Kept", String(kept.length)], ["Replanned", String(replanned.length)], ["Infeasible", String(infeasible.length)]]),
      replanned.length ? el("h3", {}, "Replanned") : null,
      replanned.length ? links(replanned) : null,
    ]; // prettier-ignore
  }

  _infeasibleList() {
    const { app } = this;
    const bad = app.plan.lifts.filter((lift) => lift.status === "infeasible");
    if (!bad.length) return [];
    return [el("h3", {}, "Infeasible"), el("div", { class: "links" }, ...bad.map((lift) => el("button", { type: "button", class: "hot", onclick: () => app.choose(lift.part) }, `✕ ${nameOf(app.parts[lift.part])}`)))];
  }

  _checks({ proof, verdict, conditions, not_covered: open }) {
    if (!proof) return [el("p", { class: "warn" }, "NOT PROVEN. This page was made without a proof; bimvox verify proves the log.")];
    const failed = proof.checks.filter((check) => !check.passed);
    const samples = proof.checks.reduce((sum, check) => sum + check.samples, 0);
    const looked = proof.checks.filter((check) => check.samples > 0);
    const rows = proof.checks.map((check) =>
      el("tr", {}, el("td", {}, check.name.replaceAll("_", " ")), el("td", { class: check.passed ? null : "hot" }, !check.passed ? `✕ ${check.failed} failed` : check.samples ? "✓ passed" : "– nothing to check"), el("td", {}, whole(check.samples)), el("td", { title: check.unit }, check.worst === null ? "" : worst(check.worst))),
    );
    const head = el("thead", {}, el("tr", {}, ...["Check", "Result", "Samples", "Worst"].map((name) => el("th", { scope: "col" }, name))));
    return [
      proof.verified ? el("p", { class: verdict.proof_light === "clean" ? "fine" : "aside" }, `${verdict.proof_light === "clean" ? "✓ " : ""}Proven again from the log alone when this page was made: ${counted(looked.length, "check")}, ${whole(samples)} samples; ${verdict.remarks}.`) : el("p", { class: "warn" }, `NOT PROVEN: ${counted(failed.length, "check")} failed.`),
      ...this._earlier(proof.not_current),
      ...(proof.verified && proof.claims.length ? [el("p", {}, `It rests on ${counted(proof.claims.length, "claim")} of the log. bimvox verify proves those that name an option:`), el("ul", { class: "claims" }, ...proof.claims.map(({ text, bind_with: option }) => el("li", {}, option ? `${text} (${option} proves it)` : text)))] : []),
      ...(proof.verified && conditions.length ? [el("p", {}, "Provided that:"), el("ul", { class: "conditions" }, ...conditions.map((words) => el("li", {}, words)))] : []),
      ...(open.length ? [el("p", {}, "Not covered by the plan, to be ticked by a person (bimvox report):"), el("ul", { class: "not-covered" }, ...open.map(({ topic, text }) => el("li", {}, el("b", {}, topic), `: ${text}`)))] : []),
      ...failed.flatMap((check) => [el("h3", {}, check.name.replaceAll("_", " ")), el("ul", {}, ...check.failures.map((text) => el("li", {}, text)))]),
      el("table", {}, head, el("tbody", {}, ...rows)),
    ];
  }

  /** The lifts whose parts were set before the obstructions became the current ones. */
  _earlier(lifts) {
    if (!lifts.length) return [];
    return [el("div", { class: "aside minor" }, el("p", {}, `Proven against earlier obstructions only, not against the current ones: ${counted(lifts.length, "lift")} whose parts were set before the last change.`), el("div", { class: "links" }, ...lifts.map((lift) => this._link(lift.component))))];
  }

  _sentences(title, sentences) {
    return sentences.length ? [el("h3", {}, `${title} (${sentences.length})`), el("ul", {}, ...sentences.map((text) => el("li", {}, text)))] : [];
  }
}

const worst = (value) => (value !== 0 && Math.abs(value) < 0.001 ? value.toExponential(1) : fixed(value, 3));
