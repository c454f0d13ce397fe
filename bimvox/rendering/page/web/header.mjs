// The header: names, the plan in a line, the verdict of the proof, and the choice of a revision.
import { byId, el, fill } from "./dom.mjs";
import { counted, plain, span } from "./words.mjs";

export class Header {
  constructor(app) {
    this.app = app;
    const { revisions, left_out: leftOut } = app.document;
    byId("revisions").hidden = revisions.length < 2;
    const words = (revision) => {
      const { changes } = revision;
      return changes ? `${revision.number}: ${changes.replanned.length} replanned, ${revision.infeasible} refused` : `${revision.number}`;
    };
    fill(byId("revision"), ...revisions.map((revision, n) => el("option", { value: n }, words(revision))));
    byId("revision").title = leftOut ? `${leftOut} earlier revisions are not in this page` : "";
    byId("revision").addEventListener("change", (event) => app.setRevision(Number(event.target.value)));
    byId("revision-earlier").addEventListener("click", () => app.setRevision(app.number - 1));
    byId("revision-later").addEventListener("click", () => app.setRevision(app.number + 1));
    byId("filter-undo").addEventListener("click", () => app.undoLook());
    byId("filter-clear").addEventListener("click", () => app.showAll());
  }

  /** Says what is filtered. */
  renderFilter() {
    const { visibility } = this.app;
    byId("filter").hidden = !visibility.filters;
    byId("filter-words").textContent = plain(visibility.words);
    byId("filter-undo").disabled = !visibility.past.length;
  }

  render() {
    const { app } = this;
    const { revision } = app.plan;
    const { site } = app.document;
    byId("title").textContent = plain(site.model && site.model !== site.name ? `${site.name} · ${site.model}` : site.name);
    const facts = [
      `${counted(revision.planned, "lift")} planned, ${revision.infeasible} refused`,
      revision.time ? `${revision.time.span_in_words}, ${revision.time.hours_in_words}` : revision.timed ? `${span(revision.ends_s - revision.begins_s)} of crane time` : "no crane",
      `log ${revision.log}, SHA-256 ${revision.sha256.slice(0, 12)}…`,
    ];
    byId("facts").textContent = plain(facts.join(" · "));
    const chip = byId("proof");
    const { proof, verdict } = revision;
    const state = window.frameElement?.dataset.state; // the studio says of what the plan is
    const isEarlier = Boolean(state) && !state.includes("exactly");
    chip.className = `chip ${isEarlier ? "remarked" : verdict.proof_light}`;
    chip.textContent = isEarlier ? `${state} · for that: ${verdict.proof.replace(/^✓ /, "")}` : verdict.proof;
    chip.title = proof?.verified ? "Every check of the log passed when this page was made" : proof ? "A check of the log failed: see Plan" : "No proof was made for this page: run bimvox verify";
    const remarks = byId("remarks-button");
    remarks.className = `chip ${verdict.remarks_light}`;
    remarks.textContent = verdict.remarks;
    byId("revision").value = String(app.number);
    byId("revision-earlier").disabled = app.number === 0;
    byId("revision-later").disabled = app.number === app.document.revisions.length - 1;
  }
}
