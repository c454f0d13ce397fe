// Numbers as text, uniform across the page.

/** `1:02:03` */
export function clock(seconds) {
  const whole = Math.round(Math.max(0, seconds));
  const two = (n) => String(n).padStart(2, "0");
  return `${Math.floor(whole / 3600)}:${two(Math.floor(whole / 60) % 60)}:${two(whole % 60)}`;
}

/** `Fri 13 Mar 2026 07:12`, of seconds after 1970, local time */
export const localDate = (seconds) =>
  new Date(seconds * 1000)
    .toLocaleString("en-GB", { timeZone: "UTC", weekday: "short", day: "numeric", month: "short", year: "numeric", hour: "2-digit", minute: "2-digit" })
    .replaceAll(",", "");

/** `4:48`, `1:02:03` */
export const shortClock = (seconds) => clock(seconds).replace(/^0:0?/, "");

/** `4 min 12 s`, `1 h 5 min` */
export function span(seconds) {
  if (seconds === null || seconds === undefined) return "–";
  if (seconds < 60) return `${fixed(seconds, 1)} s`;
  const whole = Math.round(seconds);
  if (whole < 3600) return `${Math.floor(whole / 60)} min ${whole % 60} s`;
  const minutes = Math.round(seconds / 60);
  return `${Math.floor(minutes / 60)} h ${minutes % 60} min`;
}

/** An elapsed time: `8 d 16 h`, less than a day as on the clock; in words before the first lift. */
export function elapsed(seconds) {
  const far = Math.abs(seconds);
  const hours = Math.round(far / 3600);
  return `${far >= 86400 ? `${Math.floor(hours / 24)} d ${hours % 24} h` : clock(far)}${seconds < -0.5 ? " before the first lift" : ""}`;
}

/** A text that begins a sentence. */
export const sentence = (text) => text.charAt(0).toUpperCase() + text.slice(1);

/** Writers of numbers by their digits: making one costs more than hundreds of numbers. */
const WRITERS = [];

export function fixed(value, digits) {
  WRITERS[digits] ??= new Intl.NumberFormat("en", { signDisplay: "negative", minimumFractionDigits: digits, maximumFractionDigits: digits });
  return WRITERS[digits].format(Number(value));
}
export const whole = (value) => fixed(value, 0);
export const counted = (count, noun) => `${whole(count)} ${noun}${count === 1 ? "" : "s"}`;
export const tonnes = (kg) => (kg < 1000 ? `${whole(kg)} kg` : `${fixed(kg / 1000, 2)} t`);
export const percent = (share) => (share === null || share === undefined ? "–" : `${fixed(share * 100, 0)} %`);
/** Digits of lengths that are whole cells: millimetres if a cell is not whole centimetres. */
export const digitsOf = (cell) => (Math.abs(cell * 100 - Math.round(cell * 100)) < 1e-6 ? 2 : 3);
export const metres = (value) => `${fixed(value, 2)} m`;
export const point = (at) => `x ${fixed(at[0], 2)}, y ${fixed(at[1], 2)}, z ${fixed(at[2], 2)} m`;
export const degrees = (radians) => `${fixed((radians * 180) / Math.PI, 1)}°`;

/** `IfcBuildingElementPart` -> `Building element part` */
export function classWords(ifcClass) {
  const words = ifcClass.replace(/^Ifc/, "").replace(/([a-z0-9])([A-Z])/g, "$1 $2").toLowerCase();
  return sentence(words);
}

/** A text from a file with control characters written out, not obeyed; line ends stay. */
export const plain = (text) => text.replace(/[\x00-\x09\x0b-\x1f\x7f-\x9f\u202a-\u202e\u2066-\u2069]/g, (found) => {
  const code = found.charCodeAt(0).toString(16);
  return code.length > 2 ? `\\u${code.padStart(4, "0")}` : `\\x${code.padStart(2, "0")}`;
}); // prettier-ignore

/** A part's name in lists, or its GlobalId if it has none. */
export const nameOf = (part) => plain(part.name || part.global_id || part.id);

export const METHODS = { policy: "policy", retrained: "policy, retrained", search: "search (A*)" };
export const MASS_SOURCES = { quantity: "from the model's quantities", density: "volume × density of its material", default: "volume × usual density of its kind" };
export const STORED = { as_built: "as built in", lying_x: "lying along x, tipped up", lying_y: "lying along y, tipped up" };
export const PHASES = { approach: "empty hook, moving to the part", wait: "waiting for the other crane", leave: "leaving", hook_on: "hooking on", raise: "raising", turn: "turning the part", hoist: "hoisting", traverse: "slewing and trolleying", lower: "lowering", set: "setting", release: "releasing the slings", stop: "stopping" };
export const STATES = ["not delivered yet", "in the yard", "in transit", "arrived", "assembled"];
