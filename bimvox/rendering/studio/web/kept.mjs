// What the folder keeps of the site that is open: revisions of its plan and its documents, with date and state; and new ones.
import { byId, el, fill } from "../page/dom.mjs";
import { call, token } from "./api.mjs";

const MOST = 12;
const DOCUMENTS = [[".report.html", "Make a report"], [".report.pdf", "As PDF"], [".project.xml", "Schedule for MS Project"], [".4d.ifc", "4D IFC"]]; // prettier-ignore

export class Kept {
  constructor(app) {
    this.app = app;
    this.reset();
  }

  reset() {
    Object.assign(this, { found: null, key: "" });
  }

  /** Look again: a plan, a revision or a document is new. */
  async look() {
    const { app } = this;
    const { opened } = app;
    if (!opened?.exists) return;
    const found = await call("POST", "/api/found", { path: opened.path });
    if (opened !== app.opened) return;
    Object.assign(this, { found, key: JSON.stringify([found.revisions, found.documents]) });
    app.state.render();
  }

  render() {
    const { app, found } = this;
    const list = byId("kept");
    const plan = app.other ? null : app.state.plan;
    list.hidden = !plan;
    if (!plan) return;
    const button = ([suffix, words]) => el("button", { type: "button", disabled: app.isBusy, onclick: () => app.make(suffix) }, words);
    const isIfc = /\.ifc(zip)?$/i.test(app.opened.model);
    const revisions = (found?.revisions ?? []).slice(-MOST);
    fill(
      list,
      ...DOCUMENTS.filter(([suffix]) => isIfc || suffix !== ".4d.ifc").map(button),
      ...(found?.documents ?? []).map(documentLink),
      revisions.length > 1 ? el("span", {}, "Revisions") : null,
      ...(revisions.length > 1 ? revisions.map((one) => el("button", { type: "button", class: "link", onclick: () => app.showOther(one.page, `Revision ${one.revision} of ${one.when}, not the newest plan.`) }, `${one.revision}, ${one.when}`)) : []),
    );
  }
}

/** A link to a document that says of which plan it is. */
export const documentLink = ({ name, page, when, is_of_plan: isOfPlan }) => el("a", { href: `${encodeURI(page)}?token=${encodeURIComponent(token)}`, target: "_blank", rel: "noopener", class: isOfPlan ? "" : "earlier" }, `${name}, ${when}${isOfPlan ? "" : ", of an earlier plan"}`);
