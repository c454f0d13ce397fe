// Corrections of what the parts of a type are: in the set-up as they are in the site file, by what selects the type.

export const KINDS = { precast: "precast", concrete: "concrete", masonry: "masonry", timber: "timber", steel: "steel", light: "light construction", glazing: "glazing", formwork: "formwork", pile: "pile", earth: "earth", other: "unknown" };
export const WAYS = { crane: "lifted by the crane", in_situ: "cast in place", built: "built in place", by_hand: "set by hand", out: "not in the plan", pinned: "stands already" };

const chosen = (setup, select) => (setup.kinds ?? []).find((one) => one.select === select);

/** What a row of types is now: the set-up's choice, otherwise what the model says. */
export function typeOf(setup, row) {
  const own = chosen(setup, row.select);
  return { kind: own?.kind ?? row.kind, means: own?.means ?? row.means, isChosen: Boolean(own) };
}

/** The set-up with another `kind` or `means` for the parts of a row. */
export function withType(setup, row, key, value) {
  const own = { select: row.select, kind: null, means: null, ...chosen(setup, row.select), [key]: value };
  return { ...setup, kinds: [...(setup.kinds ?? []).filter((one) => one.select !== row.select), own] };
}

/** The set-up with another kind for one part. */
export const withPartKind = (setup, id, kind) => ({ ...setup, part_kinds: { ...setup.part_kinds, [id]: kind } });

/** Whether two set-ups say the same of what parts are: otherwise the model has to be read again. */
export const sameKinds = (a, b) => JSON.stringify([a.kinds ?? [], a.part_kinds ?? {}]) === JSON.stringify([b.kinds ?? [], b.part_kinds ?? {}]);
