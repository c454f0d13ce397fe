// The page's data: base64 of gzip of [length of the JSON, the JSON, one block of numbers].
import { gunzip } from "./inflate.mjs";

const TYPES = { u8: Uint8Array, u16: Uint16Array, u32: Uint32Array, i32: Int32Array, f32: Float32Array };

/** Returns the document, and a function from a reference [type, offset, count] to a typed array. */
export async function unpack(base64) {
  const packed = Uint8Array.from(atob(base64.trim()), (letter) => letter.charCodeAt(0));
  const bytes = typeof DecompressionStream === "function" ? await inflated(packed) : gunzip(packed);
  return opened(bytes);
}

/** Reads the unpacked bytes. */
export function opened(bytes) {
  const length = new DataView(bytes.buffer, bytes.byteOffset).getUint32(0, true);
  const document = JSON.parse(new TextDecoder().decode(bytes.subarray(4, 4 + length)));
  const start = bytes.byteOffset + 4 + length;
  const numbers = ([type, offset, count]) => new TYPES[type](bytes.buffer, start + offset, count);
  return { document, numbers };
}

/** Decodes columns of steps into columns of values: `columns` Float64Arrays, each divided by its scale. */
export function columnsOf(steps, scales) {
  const rows = steps.length / scales.length;
  return scales.map((scale, column) => {
    const values = new Float64Array(rows);
    for (let row = 0, sum = 0; row < rows; row++) {
      sum += steps[column * rows + row];
      values[row] = sum / scale;
    }
    return values;
  });
}

async function inflated(packed) {
  const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("gzip"));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}
