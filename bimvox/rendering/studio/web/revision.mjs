// What a revision of the plan changed, and its words.
import { counted, whole } from "../page/words.mjs";

/** What a revision did to the parts that it changed: a map from their ids to {kind, reason}. */
export function changesOf(event) {
  const changes = new Map();
  for (const [kind, ids] of [["retimed", event.retimed], ["replanned", event.replanned], ["refused", event.infeasible]]) for (const id of ids ?? []) changes.set(id, { kind, reason: null }); // prettier-ignore
  for (const { component, reason, blocked_by: by } of event.blocked ?? []) changes.set(component, { kind: "refused", reason: by?.length ? `${reason} (${by.join(", ")})` : reason });
  return changes;
}

/** What happened to a part, in words. */
export const changeWords = ({ kind, reason }) => (kind === "refused" ? `cannot be set: ${reason ?? "something is in the way"}` : kind === "replanned" ? "new path" : "same path, new motion");

/** A revision in a line. */
export function revisionWords(event) {
  const count = (ids) => whole(ids?.length ?? 0);
  const parts = [`${count(event.kept)} kept`, `${count(event.replanned)} replanned`, `${count(event.retimed)} with new motion`, `${count(event.infeasible)} infeasible`];
  return `Revision ${event.revision}: ${parts.join(", ")}${event.latency_ms ? ` · ${whole(event.latency_ms)} ms` : ""}`;
}

/** The title of the group of changed parts. */
export const changedTitle = (words, changes) => `${words.split(":")[0]}: ${counted(changes.size, "part")} changed`;
