// The ground slab: one box, its areas looked up in a map of its columns.
import { bufferOf, programOf, textureOf } from "./gl.mjs";
import { SLAB_FRAGMENT, SLAB_VERTEX } from "./shaders.mjs";

export class Slab {
  constructor(gl, site, map, kinds) {
    this.gl = gl;
    this.site = site;
    this.kinds = kinds;
    this.hasAccess = map.some((column) => (column & 7) === 4);
    const [nx, ny] = site.shape;
    const cell = site.voxel_size_m;
    const [x0, y0] = site.origin_m;
    const z0 = site.slab_low_m;
    this.low = [x0, y0, z0];
    this.high = [x0 + nx * cell, y0 + ny * cell, z0 + cell];
    this.program = programOf(gl, SLAB_VERTEX, SLAB_FRAGMENT);
    this.map = textureOf(gl, gl.R8UI, nx, ny, gl.RED_INTEGER, gl.UNSIGNED_BYTE, map);
    const corner = (n) => [n & 1 ? this.high[0] : x0, n & 2 ? this.high[1] : y0, n & 4 ? this.high[2] : z0];
    const faces = [4, 5, 6, 5, 7, 6, 0, 1, 4, 1, 5, 4, 2, 6, 3, 3, 6, 7, 0, 4, 2, 2, 4, 6, 1, 3, 5, 3, 7, 5];
    this.count = faces.length;
    this.array = gl.createVertexArray();
    gl.bindVertexArray(this.array);
    bufferOf(gl, new Float32Array(faces.flatMap(corner)));
    gl.enableVertexAttribArray(0);
    gl.vertexAttribPointer(0, 3, gl.FLOAT, false, 0, 0);
    gl.bindVertexArray(null);
  }

  /** @param light Sets the uniforms of lit programs. */
  draw(clipFromWorld, light) {
    const { gl, site } = this;
    const { program, place } = this.program;
    gl.useProgram(program);
    gl.uniformMatrix4fv(place("clipFromWorld"), false, clipFromWorld);
    light(place);
    gl.activeTexture(gl.TEXTURE2);
    gl.bindTexture(gl.TEXTURE_2D, this.map);
    gl.activeTexture(gl.TEXTURE0);
    gl.uniform1i(place("slab"), 2);
    gl.uniform2f(place("origin"), site.origin_m[0], site.origin_m[1]);
    gl.uniform1f(place("cell"), site.voxel_size_m);
    gl.uniform1f(place("top"), this.high[2]);
    for (const [name, kind] of [["ground", "ground"], ["area", "construction_area"], ["yard", "yard"], ["access", "access"]])
      gl.uniform3fv(place(name), this.kinds[kind].map((value) => value / 255));
    gl.bindVertexArray(this.array);
    gl.drawArrays(gl.TRIANGLES, 0, this.count);
  }
}
