// By what the parts are coloured: their state, or what they have in common.
export const COLOURINGS = ["status", "crane", "delivery", "utilisation", "class", "storey", "remark"];

/**
 * The groups of a colouring with their colours; striped are those that should be looked at.
 * @param colours The document's: `groups` for what has no order, `shares` for utilisation, from low to high.
 * @returns {key, label, rgb, striped, parts} of each group.
 */
export function colouring(groups, by, colours) {
  const [others, last] = [colours.groups.at(-1), colours.groups.length - 1];
  const colourOf = (key, n) => {
    if (key === null) return colours.none;
    if (by === "utilisation") return ramp(groups, key, colours.shares);
    if (by === "remark") return colours.remarks[key];
    return by === "class" ? (colours.groups[n] ?? others) : colours.groups[n % last];
  };
  return groups.all(by).map(([key, parts], n) => ({ key, label: groups.label(by, key), rgb: colourOf(key, n), striped: key !== null && groups.alarming(by, key), parts }));
}

/** The colour of a range of utilisation: critical ones the last one. */
function ramp(groups, key, shares) {
  const critical = groups.alarming("utilisation", key);
  return critical ? shares.at(-1) : shares[Math.min(Number(key), shares.length - 2)];
}

/** Colour and stripes of every part; null if they have the colours of their states. */
export function paintOf(groups, by, colours, count) {
  if (by === "status") return null;
  const paint = { rgb: new Array(count), striped: new Uint8Array(count) };
  for (const { rgb, striped, parts } of colouring(groups, by, colours))
    for (const part of parts) {
      paint.rgb[part] = rgb;
      paint.striped[part] = striped ? 1 : 0;
    }
  return paint;
}
