// Decompresses gzip (RFC 1951, RFC 1952) for browsers that cannot: those before 2023.

const LENGTH_BASE = [3, 4, 5, 6, 7, 8, 9, 10, 11, 13, 15, 17, 19, 23, 27, 31, 35, 43, 51, 59, 67, 83, 99, 115, 131, 163, 195, 227, 258];
const LENGTH_BITS = [0, 0, 0, 0, 0, 0, 0, 0, 1, 1, 1, 1, 2, 2, 2, 2, 3, 3, 3, 3, 4, 4, 4, 4, 5, 5, 5, 5, 0];
const DISTANCE_BASE = [1, 2, 3, 4, 5, 7, 9, 13, 17, 25, 33, 49, 65, 97, 129, 193, 257, 385, 513, 769, 1025, 1537, 2049, 3073, 4097, 6145, 8193, 12289, 16385, 24577];
const DISTANCE_BITS = [0, 0, 0, 0, 1, 1, 2, 2, 3, 3, 4, 4, 5, 5, 6, 6, 7, 7, 8, 8, 9, 9, 10, 10, 11, 11, 12, 12, 13, 13];
const LENGTHS_ORDER = [16, 17, 18, 0, 8, 7, 9, 6, 10, 5, 11, 4, 12, 3, 13, 2, 14, 1, 15];

/** Canonical Huffman code from code lengths: the number of codes of each length, and their symbols in order. */
function huffman(lengths) {
  const counts = new Uint16Array(16);
  for (const length of lengths) counts[length]++;
  counts[0] = 0;
  const first = new Uint16Array(16);
  for (let n = 1; n < 16; n++) first[n] = first[n - 1] + counts[n - 1];
  const symbols = new Uint16Array(lengths.length);
  lengths.forEach((length, symbol) => {
    if (length) symbols[first[length]++] = symbol;
  });
  return { counts, symbols };
}

/** Returns the content of a gzip member without optional header fields, as a Uint8Array. */
export function gunzip(data) {
  if (data[0] !== 0x1f || data[1] !== 0x8b || data[2] !== 8 || data[3] !== 0) throw new Error("not plain gzip");
  const view = new DataView(data.buffer, data.byteOffset, data.byteLength);
  const out = new Uint8Array(view.getUint32(data.length - 4, true));
  let at = 10;
  let held = 0;
  let count = 0;
  let end = 0;

  function bits(wanted) {
    while (count < wanted) {
      held |= data[at++] << count;
      count += 8;
    }
    const value = held & ((1 << wanted) - 1);
    held >>>= wanted;
    count -= wanted;
    return value;
  }

  function symbol({ counts, symbols }) {
    let code = 0;
    let first = 0;
    let index = 0;
    for (let length = 1; length < 16; length++) {
      code |= bits(1);
      const here = counts[length];
      if (code - here < first) return symbols[index + (code - first)];
      index += here;
      first = (first + here) << 1;
      code <<= 1;
    }
    throw new Error("invalid code");
  }

  function tables() {
    const literals = bits(5) + 257;
    const distances = bits(5) + 1;
    const ordered = new Array(19).fill(0);
    const given = bits(4) + 4;
    for (let n = 0; n < given; n++) ordered[LENGTHS_ORDER[n]] = bits(3);
    const code = huffman(ordered);
    const lengths = [];
    while (lengths.length < literals + distances) {
      const next = symbol(code);
      if (next < 16) lengths.push(next);
      else if (next === 16) lengths.push(...new Array(3 + bits(2)).fill(lengths[lengths.length - 1]));
      else lengths.push(...new Array(next === 17 ? 3 + bits(3) : 11 + bits(7)).fill(0));
    }
    return [huffman(lengths.slice(0, literals)), huffman(lengths.slice(literals))];
  }

  function fixedTables() {
    const lengths = Array.from({ length: 288 }, (_, n) => (n < 144 ? 8 : n < 256 ? 9 : n < 280 ? 7 : 8));
    return [huffman(lengths), huffman(new Array(30).fill(5))];
  }

  for (let last = 0; !last; ) {
    last = bits(1);
    const kind = bits(2);
    if (kind === 0) {
      held = count = 0;
      const length = view.getUint16(at, true);
      out.set(data.subarray(at + 4, at + 4 + length), end);
      at += 4 + length;
      end += length;
      continue;
    }
    const [literals, distances] = kind === 2 ? tables() : fixedTables();
    for (;;) {
      const next = symbol(literals);
      if (next < 256) out[end++] = next;
      else if (next === 256) break;
      else {
        const length = LENGTH_BASE[next - 257] + bits(LENGTH_BITS[next - 257]);
        const far = symbol(distances);
        const from = end - (DISTANCE_BASE[far] + bits(DISTANCE_BITS[far]));
        for (let n = 0; n < length; n++) out[end++] = out[from + n];
      }
    }
  }
  return out;
}
