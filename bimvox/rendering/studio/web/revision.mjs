// What a revision of the plan changed, and its words.
import { whole } from "../page/words.mjs";

/** What a revision did to the parts that it changed: a map from their ids to {kind, reason}. `nameOf`: from an id to a name. */
export function changesOf(event, nameOf = (id) => id) {
  const changes = new Map();
  const cause = event.obstructions?.length ? event.obstructions.join(", ") : null;
  for (const [kind, ids] of [["retimed", event.retimed], ["replanned", event.replanned], ["refused", event.infeasible]]) for (const id of ids ?? []) changes.set(id, { kind, reason: kind === "refused" ? null : cause }); // prettier-ignore
  for (const { component, reason, blocked_by: by } of event.blocked ?? []) changes.set(component, { kind: "refused", reason: by?.length ? `${reason} (${[...new Set(by.map(nameOf))].join(", ")})` : reason });
  return changes;
}

/** What happened to a part, in words. */
export const changeWords = ({ kind, reason }) => (kind === "refused" ? `cannot be set: ${reason ?? "something is in the way"}` : `${kind === "replanned" ? "new path" : "same path, new motion"}${reason ? `, because of ${reason}` : ""}`);

/** What happened to the load under way, in words; null if none was stopped. */
export function stopWords({ stopped }, nameOf) {
  if (!stopped) return null;
  return `${nameOf(stopped.component)} was stopped ${stopped.held ? "and is held: there is no path for it" : "and goes on along a new path"}${stopped.safe ? "" : "; no stop was free of contact"}`;
}

/** A revision in a line. */
export function revisionWords(event) {
  const count = (ids) => whole(ids?.length ?? 0);
  const parts = [`${count(event.kept)} kept`, `${count(event.replanned)} replanned`, `${count(event.retimed)} with new motion`, `${count(event.infeasible)} refused`];
  const cause = event.obstructions?.length ? ` (${event.obstructions.join(", ")})` : "";
  return `Revision ${event.revision}${cause}: ${parts.join(", ")}${event.latency_ms ? ` · ${whole(event.latency_ms)} ms` : ""}`;
}

/** The title of the group of parts that the newest revision changed or the plan refuses. `changes`: see changesOf. */
export function changedTitle(changes, revision) {
  const count = (kind) => [...changes.values()].filter((change) => change.kind === kind).length;
  const [refused, replanned, retimed] = ["refused", "replanned", "retimed"].map(count);
  const words = [refused ? `${whole(refused)} refused` : "", replanned ? `${whole(replanned)} replanned` : "", retimed ? `${whole(retimed)} with new motion` : ""];
  return `${revision ? `Revision ${whole(revision)}` : "Plan"}: ${words.filter(Boolean).join(", ")}`;
}
