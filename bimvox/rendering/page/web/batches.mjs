// Triangles and lines, each drawn in one call; everything that differs between things is in their rows.
import { bufferOf, textureOf } from "./gl.mjs";
import { ROWS_WIDTH } from "./shaders.mjs";

const BOX_FACES = [0, 2, 1, 1, 2, 3, 4, 5, 6, 5, 7, 6, 0, 1, 4, 1, 5, 4, 2, 6, 3, 3, 6, 7, 0, 4, 2, 2, 4, 6, 1, 3, 5, 3, 7, 5];
export const BOX_EDGES = [0, 1, 2, 3, 4, 5, 6, 7, 0, 2, 1, 3, 4, 6, 5, 7, 0, 4, 1, 5, 2, 6, 3, 7];

/** The rows of one texture: place, rotation, offset, colour and flags of every thing. */
export class Rows {
  constructor(gl, count) {
    this.gl = gl;
    this.height = Math.ceil(count / ROWS_WIDTH);
    this.data = new Float32Array(ROWS_WIDTH * this.height * 16);
    this.texture = textureOf(gl, gl.RGBA32F, ROWS_WIDTH * 4, this.height, gl.RGBA, gl.FLOAT, this.data);
    for (let row = 0; row < count; row++) this.place(row, [0, 0, 0], [0, 0, 0, 1]);
    this.changed = true;
  }

  place(row, at, turn) {
    this.data.set(at, row * 16);
    this.data.set(turn, row * 16 + 4);
    this.changed = true;
  }

  shape(row, scale, offset) {
    this.data[row * 16 + 3] = scale;
    this.data.set(offset, row * 16 + 8);
    this.changed = true;
  }

  look(row, rgb, flags) {
    const at = row * 16 + 12;
    this.data[at] = rgb[0] / 255;
    this.data[at + 1] = rgb[1] / 255;
    this.data[at + 2] = rgb[2] / 255;
    this.data[at + 3] = flags;
    this.changed = true;
  }

  placeOf(row) {
    return [this.data.slice(row * 16, row * 16 + 3), this.data.slice(row * 16 + 4, row * 16 + 8)].map((v) => Array.from(v));
  }

  /** Uploads the rows if any changed; returns whether they did. */
  send() {
    if (!this.changed) return false;
    const { gl } = this;
    gl.bindTexture(gl.TEXTURE_2D, this.texture);
    gl.texSubImage2D(gl.TEXTURE_2D, 0, 0, 0, ROWS_WIDTH * 4, this.height, gl.RGBA, gl.FLOAT, this.data);
    this.changed = false;
    return true;
  }
}

/** Collects triangles and their visible edges: lattice points and the row that places them. */
export class Solids {
  constructor() {
    this.pieces = [];
    this.points = 0;
    this.corners = 0;
    this.ends = 0;
  }

  add(row, points, faces, edges = []) {
    this.pieces.push({ row, points, faces, edges });
    this.points += points.length / 3;
    this.corners += faces.length;
    this.ends += edges.length;
  }

  addBoxes(row, boxes) {
    const points = new Uint16Array((boxes.length / 6) * 24);
    const faces = new Uint32Array((boxes.length / 6) * 36);
    for (let n = 0; n * 6 < boxes.length; n++) {
      const box = boxes.subarray(n * 6, n * 6 + 6);
      for (let corner = 0; corner < 8; corner++)
        for (let axis = 0; axis < 3; axis++) points[n * 24 + corner * 3 + axis] = box[axis + ((corner >> axis) & 1) * 3];
      for (let face = 0; face < 36; face++) faces[n * 36 + face] = n * 8 + BOX_FACES[face];
    }
    this.add(row, points, faces);
  }

  /** Returns a vertex array and the number of indices, for the triangles and for the edges. */
  upload(gl) {
    const vertices = new Uint16Array(this.points * 4);
    const indices = new Uint32Array(this.corners);
    const lines = new Uint32Array(this.ends);
    let first = 0;
    let corner = 0;
    let end = 0;
    for (const { row, points, faces, edges } of this.pieces) {
      for (let n = 0; n < points.length / 3; n++) {
        vertices.set(points.subarray(n * 3, n * 3 + 3), (first + n) * 4);
        vertices[(first + n) * 4 + 3] = row;
      }
      for (let n = 0; n < faces.length; n++) indices[corner + n] = first + faces[n];
      for (let n = 0; n < edges.length; n++) lines[end + n] = first + edges[n];
      first += points.length / 3;
      corner += faces.length;
      end += edges.length;
    }
    const buffer = bufferOf(gl, vertices);
    const arrayOf = (elements) => {
      const array = gl.createVertexArray();
      gl.bindVertexArray(array);
      gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
      gl.enableVertexAttribArray(0);
      gl.vertexAttribPointer(0, 3, gl.UNSIGNED_SHORT, false, 8, 0);
      gl.enableVertexAttribArray(1);
      gl.vertexAttribIPointer(1, 1, gl.UNSIGNED_SHORT, 8, 6);
      bufferOf(gl, elements, gl.ELEMENT_ARRAY_BUFFER);
      gl.bindVertexArray(null);
      return { array, count: elements.length };
    };
    return { ...arrayOf(indices), edges: arrayOf(lines) };
  }
}

/** Collects line segments, each end on a row. */
export class Lines {
  constructor() {
    this.at = [];
    this.rows = [];
    this.inks = [];
    this.styles = [];
  }

  get count() {
    return this.rows.length / 2;
  }

  /** @param style {rgba: 0..255 each, width: pixels, metres: minimum width in metres, dash: period in pixels, 0 solid} */
  add(from, to, rowFrom, rowTo, style) {
    this.at.push(from[0], from[1], from[2], to[0], to[1], to[2]);
    this.rows.push(rowFrom, rowTo);
    this.inks.push(...style.rgba);
    this.styles.push(style.width, style.metres ?? 0, style.dash ?? 0);
  }

  addPolyline(points, row, style) {
    for (let n = 1; n < points.length; n++) this.add(points[n - 1], points[n], row, row, style);
  }

  addBox(low, high, row, style) {
    const corner = (n) => [n & 1 ? high[0] : low[0], n & 2 ? high[1] : low[1], n & 4 ? high[2] : low[2]];
    for (let n = 0; n < BOX_EDGES.length; n += 2) this.add(corner(BOX_EDGES[n]), corner(BOX_EDGES[n + 1]), row, row, style);
  }

  /** Edges of a shape: lattice points and pairs of indices. */
  addEdges(points, edges, row, style) {
    const point = (n) => points.subarray(n * 3, n * 3 + 3);
    for (let n = 0; n < edges.length; n += 2) this.add(point(edges[n]), point(edges[n + 1]), row, row, style);
  }

  upload(gl) {
    const array = gl.createVertexArray();
    gl.bindVertexArray(array);
    const attribute = (place, size, type, normal, stride, offset, whole) => {
      gl.enableVertexAttribArray(place);
      if (whole) gl.vertexAttribIPointer(place, size, type, stride, offset);
      else gl.vertexAttribPointer(place, size, type, normal, stride, offset);
      gl.vertexAttribDivisor(place, 1);
    };
    const buffers = [bufferOf(gl, new Float32Array([0, -1, 0, 1, 1, -1, 1, 1]))];
    gl.enableVertexAttribArray(0);
    gl.vertexAttribPointer(0, 2, gl.FLOAT, false, 0, 0);
    buffers.push(bufferOf(gl, new Float32Array(this.at)));
    attribute(1, 3, gl.FLOAT, false, 24, 0);
    attribute(2, 3, gl.FLOAT, false, 24, 12);
    buffers.push(bufferOf(gl, new Uint16Array(this.rows)));
    attribute(3, 2, gl.UNSIGNED_SHORT, false, 4, 0, true);
    buffers.push(bufferOf(gl, new Uint8Array(this.inks)));
    attribute(4, 4, gl.UNSIGNED_BYTE, true, 4, 0);
    buffers.push(bufferOf(gl, new Float32Array(this.styles)));
    attribute(5, 3, gl.FLOAT, false, 12, 0);
    gl.bindVertexArray(null);
    const free = () => {
      buffers.forEach((buffer) => gl.deleteBuffer(buffer));
      gl.deleteVertexArray(array);
    };
    return { array, count: this.count, free };
  }
}
