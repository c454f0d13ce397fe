// How far the crane is used by each part: colours, words, groups of the list.
import { classWords, nameOf, percent } from "../page/words.mjs";

/** Bands of the utilisation: key of the colour, words, and the share up to which it goes. */
export const BANDS = [
  { key: "u1", upTo: 0.5, words: "up to 50 %" },
  { key: "u2", upTo: 0.75, words: "up to 75 %" },
  { key: "u3", upTo: 0.9, words: "up to 90 %" },
  { key: "u4", upTo: Infinity, words: "above 90 %" },
];
export const OTHERS = {
  cannot: "cannot be lifted",
  in_situ: "cast in place",
  built: "built in place",
  by_hand: "set by hand",
  pinned: "stays where it is",
  unknown: "not checked yet",
};

/** How a part is set now: the set-up's choice, otherwise the site's. */
export const meansOf = (part, setup) => (part.means === "pinned" ? "pinned" : setup.means[part.id] ?? part.means);

/** A part's state: the key of its colour. `found`: what the server says of it. */
export function stateOf(part, setup, found) {
  const means = meansOf(part, setup);
  if (means !== "crane") return means;
  if (!found) return "unknown";
  if (found.utilisation === null || found.utilisation === undefined || found.reason) return "cannot";
  return BANDS.find((band) => found.utilisation <= band.upTo + 1e-12).key;
}

/** A state in a word or two, as the list has it. */
export const useWords = (state, found) => (state === "cannot" ? "no" : state in OTHERS ? { in_situ: "cast", built: "built", by_hand: "by hand", pinned: "stays", unknown: "…" }[state] : percent(found.utilisation));

/** How many parts have each state. */
export function countsOf(parts, setup, found) {
  const counts = {};
  for (const part of parts) {
    const state = stateOf(part, setup, found?.[part.id]);
    counts[state] = (counts[state] ?? 0) + 1;
  }
  return counts;
}

/** The parts whose name, id, class or storey has every word of a query, and whose state is asked for. */
export function matching(parts, query, states, stateAt) {
  const words = query.toLowerCase().split(/\s+/).filter(Boolean);
  if (!words.length && !states) return parts;
  return parts.filter((part) => {
    if (states && !states.has(stateAt(part))) return false;
    const text = [nameOf(part), part.id, part.class, classWords(part.class ?? ""), part.storey].filter(Boolean).join(" ").toLowerCase();
    return words.every((word) => text.includes(word));
  });
}

/** Parts in groups by storey and class: [{key, title, parts}], storeys from below, parts by name. */
export function grouped(parts) {
  const groups = new Map();
  for (const part of parts) {
    const key = `${part.storey ?? ""}\n${part.class ?? ""}`;
    if (!groups.has(key)) groups.set(key, { key, storey: part.storey, class: part.class, low_m: Infinity, parts: [] });
    const group = groups.get(key);
    group.low_m = Math.min(group.low_m, part.low_m);
    group.parts.push(part);
  }
  const lowest = new Map();
  for (const group of groups.values()) lowest.set(group.storey, Math.min(lowest.get(group.storey) ?? Infinity, group.low_m));
  const byName = (a, b) => compare(nameOf(a), nameOf(b));
  return [...groups.values()]
    .sort((a, b) => lowest.get(a.storey) - lowest.get(b.storey) || compare(a.storey ?? "", b.storey ?? "") || compare(a.class ?? "", b.class ?? ""))
    .map(({ key, storey, class: ifcClass, parts: own }) => ({ key, title: [storey || "No storey", classWords(ifcClass ?? "") || "No class"].join(" · "), parts: own.sort(byName) }));
}

/** The one means of all parts of a group; "" if they differ. */
export function commonMeans(parts, setup) {
  const found = new Set(parts.map((part) => meansOf(part, setup)));
  return found.size === 1 ? [...found][0] : "";
}

/** Largest utilisation first. */
export const byUse = (found) => (a, b) => (found?.[b.id]?.utilisation ?? -1) - (found?.[a.id]?.utilisation ?? -1);

const compare = (a, b) => a.localeCompare(b, "en", { numeric: true });
