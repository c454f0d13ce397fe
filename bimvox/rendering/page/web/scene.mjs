// The site in 3-D at a moment: places everything and draws it.
import { Lines, Rows, Solids } from "./batches.mjs";
import { Crane, cranesOf } from "./cranes.mjs";
import { programOf, textureOf } from "./gl.mjs";
import { cross, lookAt, multiplied, orthographic, turned, unit } from "./maths.mjs";
import { axesAt, hookOf, loadAt, storedAt } from "./motion.mjs";
import { Overlays } from "./overlays.mjs";
import { ARRIVED, ASSEMBLED, AWAY, IN_TRANSIT, UNBUILT } from "./plan.mjs";
import { DEPTH_FRAGMENT, EDGE_FRAGMENT, EDGE_VERTEX, GHOSTLY, HATCHED, LINE_FRAGMENT, LINE_VERTEX, PICK_FRAGMENT, PICK_VERTEX, PLACE_FRAGMENT, SHOWN, SOLID_FRAGMENT, SOLID_VERTEX, STRIPED, VOXELS, WHOLE } from "./shaders.mjs";
import { Slab } from "./slab.mjs";
import { GHOST, HIDDEN, SEEN } from "./visibility.mjs";

const SHADOW_SIZE = 2048;
const SNAP_PX = 9;
const SPAN_M = 200;
const NO_TURN = [0, 0, 0, 1];
/** Nothing is cut off. */
export const NO_CUT = { low: [-1e9, -1e9, -1e9], high: [1e9, 1e9, 1e9] };

export class Scene {
  /**
   * @param document The page's document.
   * @param numbers From a reference to its numbers.
   */
  constructor(gl, document, numbers) {
    this.gl = gl;
    this.document = document;
    this.site = document.site;
    this.parts = document.parts;
    this.states = ["", "unbuilt", "in_transit", "arrived", "assembled"].map((name) => document.colours.states[name]);
    this.kinds = document.colours.kinds;
    this.shapes = document.geometries.map((shape) => ({
      step: shape.step_m, points: numbers(shape.points), faces: numbers(shape.faces), edges: numbers(shape.edges),
    }));
    this.boxes = this.parts.map((part) => numbers(part.boxes));
    this._layOutRows(numbers);
    this._build(numbers);
    this.slab = new Slab(gl, this.site, numbers(this.site.slab), this.kinds);
    this.solid = programOf(gl, SOLID_VERTEX, SOLID_FRAGMENT);
    this.line = programOf(gl, LINE_VERTEX, LINE_FRAGMENT);
    this.edge = programOf(gl, EDGE_VERTEX, EDGE_FRAGMENT);
    this.depth = programOf(gl, SOLID_VERTEX, DEPTH_FRAGMENT);
    this.pickProgram = programOf(gl, PICK_VERTEX, PICK_FRAGMENT);
    this.placeProgram = programOf(gl, PICK_VERTEX, PLACE_FRAGMENT);
    this._prepareLight();
    this.looks = new Uint8Array(this.parts.length);
    this.paint = null;
    this.cut = NO_CUT;
    this.shown = null;
  }

  /** Foot of the crane of a motion. */
  baseOf(motion) {
    return this.cranes[motion.crane ?? 0]?.record.base_m;
  }

  partRow(index) {
    return 1 + index;
  }

  _layOutRows(numbers) {
    let next = 1 + this.parts.length;
    const cranes = cranesOf(this.document);
    const firsts = cranes.map((record) => {
      const first = next;
      next += Crane.rowsOf(record);
      return first;
    });
    this.standing = this.document.standing.map((record) => ({ ...record, row: next++, boxes: numbers(record.boxes) }));
    this.obstructions = new Map();
    for (const revision of this.document.revisions)
      for (const record of revision.obstructions) {
        const key = `${record.boxes.join()} ${record.id}`;
        if (!this.obstructions.has(key)) this.obstructions.set(key, { ...record, row: next++, boxes: numbers(record.boxes) });
      }
    this.rows = new Rows(this.gl, next);
    this.rows.shape(0, 1, [0, 0, 0]);
    this.rows.look(0, [0, 0, 0], SHOWN);
    this.setUps = this.document.set_ups ?? [];
    this.cranes = cranes.map((record, n) => new Crane(record, numbers, this.rows, firsts[n]));
  }

  /** The obstruction of a revision's record. */
  obstructionOf(record) {
    return this.obstructions.get(`${record.boxes.join()} ${record.id}`);
  }

  _build() {
    const { gl } = this;
    const [real, voxels, fixed, craneLines] = [new Solids(), new Solids(), new Solids(), new Lines()];
    this.parts.forEach((part, n) => {
      const shape = this.shapes[part.geometry];
      real.add(this.partRow(n), shape.points, shape.faces, shape.edges);
      voxels.addBoxes(this.partRow(n), this.boxes[n]);
    });
    for (const thing of this.standing) {
      if (thing.geometry === null) fixed.addBoxes(thing.row, thing.boxes);
      else {
        const shape = this.shapes[thing.geometry];
        real.add(thing.row, shape.points, shape.faces, shape.edges);
        voxels.addBoxes(thing.row, thing.boxes);
      }
    }
    for (const thing of this.obstructions.values()) fixed.addBoxes(thing.row, thing.boxes);
    for (const crane of this.cranes) crane.addTo(fixed, craneLines);
    this.batches = { real: real.upload(gl), voxels: voxels.upload(gl), fixed: fixed.upload(gl), crane: craneLines.upload(gl) };
    this.overlays = new Overlays(this);
  }

  _prepareLight() {
    const { gl, site } = this;
    const size = site.shape.map((n) => n * site.voxel_size_m);
    const middle = site.origin_m.map((low, axis) => low + size[axis] / 2);
    const angle = ((site.view_deg[0] + 48) * Math.PI) / 180;
    this.sun = unit([0.62 * Math.cos(angle), 0.62 * Math.sin(angle), 0.78]);
    this.radius = Math.hypot(...size) / 2;
    const eye = middle.map((value, axis) => value + this.sun[axis] * 2 * this.radius);
    this.lightFromWorld = multiplied(orthographic(this.radius, this.radius, 3 * this.radius), lookAt(eye, middle, [0, 0, 1]));
    this.shadow = textureOf(gl, gl.DEPTH_COMPONENT24, SHADOW_SIZE, SHADOW_SIZE, gl.DEPTH_COMPONENT, gl.UNSIGNED_INT, null);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, gl.LINEAR);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MAG_FILTER, gl.LINEAR);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_COMPARE_MODE, gl.COMPARE_REF_TO_TEXTURE);
    this.shadowFrame = gl.createFramebuffer();
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.shadowFrame);
    gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.DEPTH_ATTACHMENT, gl.TEXTURE_2D, this.shadow, 0);
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
  }

  /** Discards all places, so that the next moment is set completely: after a change of revision or layers. */
  forget() {
    this.shown = null;
  }

  /**
   * Shows a moment.
   * @param moment {plan, time, layers, chosen: part index or null, obstruction: record or null, looks: of every part,
   *   paint: {rgb, striped} of every part, or null for the colours of states, cut: {low, high} of what is drawn}
   */
  show(moment) {
    const { plan, time, layers } = moment;
    const states = plan.statesAt(time);
    const lift = plan.liftAt(time);
    const { looks = this.looks, paint = null, cut = NO_CUT } = moment;
    if (cut !== this.cut) this.rows.changed = true;
    this.cut = cut;
    if (looks !== this.looks || paint !== this.paint) {
      Object.assign(this, { looks, paint });
      this.forget();
    }
    if (this.shown === null) this._setFixed(plan, layers);
    const old = this.shown?.states;
    for (let n = 0; n < states.length; n++) {
      const moving = states[n] === IN_TRANSIT || states[n] === ARRIVED;
      if (!moving && old && old[n] === states[n]) continue;
      this._setPart(n, states[n], plan, time, layers);
    }
    const motion = lift && plan.motionOf(lift);
    const since = lift ? time - lift.begins_s : 0;
    this.cranes.forEach((crane, n) => {
      const pose = this.poseOf(plan, n, time);
      if (n === (motion?.crane ?? 0)) this.hook = hookOf(crane.record.base_m, pose);
      crane.pose(pose, layers.crane && (!this.setUps.length || n === plan.standsIn(time)));
    });
    this.overlays.show(moment, lift, motion, since);
    this.shown = { states, lift };
  }

  _setFixed(plan, layers) {
    for (const thing of this.standing) {
      const solid = thing.geometry !== null && !layers.voxels;
      const flags = (layers.structure ? SHOWN : 0) | (solid ? 0 : VOXELS);
      this.rows.place(thing.row, solid ? [0, 0, 0] : this.site.origin_m, NO_TURN);
      this.rows.shape(thing.row, solid ? this.shapes[thing.geometry].step : this.site.voxel_size_m, solid ? thing.low_m : [0, 0, 0]);
      this.rows.look(thing.row, this.kinds[thing.kind] ?? this.kinds.structure, flags);
    }
    const present = new Set(plan.revision.obstructions.map((record) => this.obstructionOf(record).row));
    for (const thing of this.obstructions.values()) {
      this.rows.place(thing.row, this.site.origin_m, NO_TURN);
      this.rows.shape(thing.row, this.site.voxel_size_m, [0, 0, 0]);
      this.rows.look(thing.row, [44, 44, 48], VOXELS | (layers.obstructions && present.has(thing.row) ? SHOWN : 0));
    }
    this.parts.forEach((part, n) => {
      if (layers.voxels) this.rows.shape(this.partRow(n), this.site.voxel_size_m, [0, 0, 0]);
      else this.rows.shape(this.partRow(n), this.shapes[part.geometry].step, part.low_m);
    });
  }

  _setPart(n, state, plan, time, layers) {
    const part = this.parts[n];
    const row = this.partRow(n);
    const lift = plan.ofPart[n];
    const look = this.looks[n];
    const coming = state === AWAY && layers.coming && lift?.status !== "infeasible";
    if (look === HIDDEN || (state === AWAY && !coming) || (state === UNBUILT && !layers.yard)) {
      this.rows.look(row, [0, 0, 0], 0);
      return;
    }
    let at = { corner: part.target_m, tilt: NO_TURN };
    if (state === UNBUILT) at = storedAt(lift, part);
    else if (state !== ASSEMBLED && state !== AWAY) {
      const motion = plan.motionOf(lift);
      at = loadAt(motion, this.baseOf(motion), lift.stored, time - lift.begins_s);
    }
    this.rows.place(row, at.corner, at.tilt);
    const flags = SHOWN | (layers.voxels ? VOXELS : 0) | (state === IN_TRANSIT ? HATCHED | WHOLE : 0) | (look === GHOST || coming ? GHOSTLY : 0) | (this.paint?.striped[n] ? STRIPED : 0);
    this.rows.look(row, this.paint?.rgb[n] ?? this.states[coming ? ASSEMBLED : state], flags);
  }

  /** The centre of a part's box as shown now; null if it is not shown. */
  middleOf(n) {
    const state = this.shown?.states[n];
    const part = this.parts[n];
    if (!state) return null;
    if (state === ASSEMBLED || state === UNBUILT) {
      const low = state === UNBUILT ? null : part.target_m;
      if (low) return low.map((value, axis) => value + part.size_m[axis] / 2);
    }
    const [place] = this.rows.placeOf(this.partRow(n));
    return place.map((value, axis) => value + (state === UNBUILT ? 0 : part.size_m[axis] / 2));
  }

  /** Draws everything. @param view {camera, width, height, pixels: device pixels a CSS pixel, paper: background rgb} */
  draw({ camera, width, height, pixels, paper }, layers) {
    const { gl } = this;
    if (this.rows.send()) this._drawShadow(layers);
    const clip = camera.matrix(this.radius);
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    gl.viewport(0, 0, width, height);
    gl.clearColor(...paper, 1);
    gl.enable(gl.DEPTH_TEST);
    gl.depthFunc(gl.LEQUAL);
    gl.disable(gl.BLEND);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    const light = (place) => {
      gl.uniformMatrix4fv(place("lightFromWorld"), false, this.lightFromWorld);
      gl.uniform3fv(place("sun"), this.sun);
      gl.uniform3fv(place("eye"), camera.eye);
      gl.uniform1i(place("shadow"), 1);
      gl.activeTexture(gl.TEXTURE1);
      gl.bindTexture(gl.TEXTURE_2D, this.shadow);
    };
    this.slab.draw(clip, light);
    this._useSolid(this.solid, clip);
    light(this.solid.place);
    gl.enable(gl.POLYGON_OFFSET_FILL);
    gl.polygonOffset(1, 1);
    this._drawSolids(layers);
    if (layers.coming || this.looks.includes(GHOST)) this._drawGhosts(layers);
    gl.disable(gl.POLYGON_OFFSET_FILL);
    this._drawLines(camera, clip, width, height, pixels, layers);
    gl.bindVertexArray(null);
  }

  _useSolid({ program, place }, clip) {
    const { gl } = this;
    gl.useProgram(program);
    gl.uniformMatrix4fv(place("clipFromWorld"), false, clip);
    gl.activeTexture(gl.TEXTURE0);
    gl.bindTexture(gl.TEXTURE_2D, this.rows.texture);
    gl.uniform1i(place("rows"), 0);
    gl.uniform3fv(place("cutLow"), this.cut.low);
    gl.uniform3fv(place("cutHigh"), this.cut.high);
    gl.uniform1i(place("cuts"), this.cut === NO_CUT ? 0 : 1);
  }

  _drawSolids(layers) {
    const { gl } = this;
    for (const batch of [layers.voxels ? this.batches.voxels : this.batches.real, this.batches.fixed]) {
      gl.bindVertexArray(batch.array);
      gl.drawElements(gl.TRIANGLES, batch.count, gl.UNSIGNED_INT, 0);
    }
  }

  _drawGhosts(layers) {
    const { gl } = this;
    gl.enable(gl.BLEND);
    gl.blendFunc(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA);
    gl.depthMask(false);
    gl.uniform1i(this.solid.place("ghosts"), 1);
    this._drawSolids(layers);
    gl.uniform1i(this.solid.place("ghosts"), 0);
    gl.depthMask(true);
    gl.disable(gl.BLEND);
  }

  _drawShadow(layers) {
    const { gl } = this;
    gl.activeTexture(gl.TEXTURE1);
    gl.bindTexture(gl.TEXTURE_2D, null);
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.shadowFrame);
    gl.viewport(0, 0, SHADOW_SIZE, SHADOW_SIZE);
    gl.enable(gl.DEPTH_TEST);
    gl.depthFunc(gl.LEQUAL);
    gl.clear(gl.DEPTH_BUFFER_BIT);
    gl.enable(gl.POLYGON_OFFSET_FILL);
    gl.polygonOffset(1.5, 2);
    this._useSolid(this.depth, this.lightFromWorld);
    this._drawSolids(layers);
    gl.disable(gl.POLYGON_OFFSET_FILL);
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
  }

  _drawLines(camera, clip, width, height, pixels, layers) {
    const { gl } = this;
    const { place } = this.line;
    gl.enable(gl.BLEND);
    gl.blendFunc(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA);
    if (!layers.voxels) {
      this._useSolid(this.edge, clip);
      gl.uniform1f(this.edge.place("focal"), (camera.focal * height) / 2 / pixels);
      gl.bindVertexArray(this.batches.real.edges.array);
      gl.drawElements(gl.LINES, this.batches.real.edges.count, gl.UNSIGNED_INT, 0);
    }
    this._useSolid(this.line, clip);
    gl.uniform2f(place("viewport"), width, height);
    gl.uniform1f(place("pixels"), pixels);
    gl.uniform1f(place("focal"), (camera.focal * height) / 2);
    const stroke = (batch, { bias = 0, widen = 0, override = [0, 0, 0, 0], dashes = 0, behind = false } = {}) => {
      if (!batch || !batch.count) return;
      gl.depthFunc(behind ? gl.GREATER : gl.LEQUAL);
      gl.depthMask(!behind);
      gl.uniform1f(place("bias"), bias);
      gl.uniform1f(place("widen"), widen);
      gl.uniform4fv(place("override"), override);
      gl.uniform1f(place("dashes"), dashes * pixels);
      gl.bindVertexArray(batch.array);
      gl.drawArraysInstanced(gl.TRIANGLE_STRIP, 0, 4, batch.count);
    };
    const { slings, props, boxes, paths, active, chosen, rings, measured } = this.overlays.batches;
    stroke(rings, { bias: 1e-5, widen: 2, override: [1, 1, 1, 0.7] });
    stroke(rings, { bias: 2e-5 });
    stroke(measured, { behind: true, widen: -1, dashes: 6 });
    stroke(measured, { bias: 1e-5, widen: 2, override: [1, 1, 1, 0.9] });
    stroke(measured, { bias: 2e-5 });
    stroke(this.batches.crane);
    stroke(slings);
    stroke(props);
    if (!layers.voxels) stroke(active, { bias: 6e-6 });
    stroke(boxes, { behind: true, override: [0.35, 0.35, 0.4, 0.4], dashes: 7 });
    stroke(boxes, { bias: 1e-5 });
    stroke(paths, { behind: true, override: [0, 0.39, 0.75, 0.5], dashes: 8 });
    stroke(paths, { bias: 1e-5, widen: 2, override: [1, 1, 1, 0.8] });
    stroke(paths, { bias: 2e-5 });
    stroke(chosen, { behind: true, widen: -1, override: [0, 0, 0, 0.7], dashes: 5 });
    stroke(chosen, { bias: 1e-5, widen: 2.6, override: [1, 1, 1, 0.95] });
    stroke(chosen, { bias: 2e-5 });
    gl.depthMask(true);
    gl.depthFunc(gl.LEQUAL);
    gl.disable(gl.BLEND);
  }

  /** The thing at a device pixel: {kind, index or record}, or null. */
  pick(frame, layers, x, y) {
    const found = this._pixel(frame, layers, x, y, this.pickProgram, () => {});
    return this._thingOf(found[0] + 256 * found[1] + 65536 * found[2]);
  }

  /** The point of the site at a device pixel: a corner of the part there if one is near, the surface, or the ground; null if nothing is there. */
  pointAt(frame, layers, x, y) {
    const thing = this.pick(frame, layers, x, y);
    if (!thing) return this._groundAt(frame, x, y);
    const corner = thing.kind === "part" && !layers.voxels ? this._cornerNear(frame, thing.index, x, y) : null;
    if (corner) return corner;
    const [low, high] = [this.slab.low.map((value) => value - SPAN_M), this.slab.high.map((value) => value + SPAN_M)];
    return [0, 1, 2].map((axis) => {
      const span = high[axis] - low[axis];
      const found = this._pixel(frame, layers, x, y, this.placeProgram, (place) => {
        this.gl.uniform1i(place("axis"), axis);
        this.gl.uniform2f(place("span"), low[axis], span);
      });
      return low[axis] + (span * (found[0] + 256 * found[1] + 65536 * found[2])) / 16777215;
    });
  }

  _groundAt({ camera, width, height }, x, y) {
    const back = camera.direction;
    const right = unit(cross([0, 0, 1], back));
    const up = cross(back, right);
    const [a, b] = [((2 * x) / width - 1) * camera.aspect, 1 - (2 * y) / height];
    const way = [0, 1, 2].map((axis) => (right[axis] * a + up[axis] * b) / camera.focal - back[axis]);
    const share = (this.slab.high[2] - camera.eye[2]) / way[2];
    const at = [0, 1, 2].map((axis) => camera.eye[axis] + share * way[axis]);
    const isThere = share > 0 && [0, 1].every((axis) => at[axis] >= this.slab.low[axis] && at[axis] <= this.slab.high[axis]);
    return isThere ? at : null;
  }

  /** The corner of a part nearest to a pixel, if it is near enough. */
  _cornerNear({ camera, width, height, pixels }, n, x, y) {
    const clip = camera.matrix(this.radius);
    const { points } = this.shapes[this.parts[n].geometry];
    const data = this.rows.data.subarray(this.partRow(n) * 16, this.partRow(n) * 16 + 12);
    let best = null;
    let nearest = SNAP_PX * pixels;
    for (let k = 0; k < points.length; k += 3) {
      const local = [0, 1, 2].map((axis) => points[k + axis] * data[3] + data[8 + axis]);
      const at = turned(Array.from(data.subarray(4, 8)), local).map((value, axis) => value + data[axis]);
      const [cx, cy, , w] = [0, 1, 2, 3].map((row) => clip[row] * at[0] + clip[4 + row] * at[1] + clip[8 + row] * at[2] + clip[12 + row]);
      const off = w > 0 ? Math.hypot(((cx / w + 1) / 2) * width - x, ((1 - cy / w) / 2) * height - y) : Infinity;
      if (off < nearest) [best, nearest] = [at, off];
    }
    return best;
  }

  /** The colour that a program gives one device pixel. */
  _pixel({ camera, width, height }, layers, x, y, program, uniforms) {
    const { gl } = this;
    const texture = textureOf(gl, gl.RGBA8, width, height, gl.RGBA, gl.UNSIGNED_BYTE, null);
    const depth = gl.createRenderbuffer();
    gl.bindRenderbuffer(gl.RENDERBUFFER, depth);
    gl.renderbufferStorage(gl.RENDERBUFFER, gl.DEPTH_COMPONENT24, width, height);
    const frame = gl.createFramebuffer();
    gl.bindFramebuffer(gl.FRAMEBUFFER, frame);
    gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.TEXTURE_2D, texture, 0);
    gl.framebufferRenderbuffer(gl.FRAMEBUFFER, gl.DEPTH_ATTACHMENT, gl.RENDERBUFFER, depth);
    gl.viewport(0, 0, width, height);
    gl.enable(gl.SCISSOR_TEST);
    gl.scissor(x, height - 1 - y, 1, 1);
    gl.clearColor(0, 0, 0, 0);
    gl.enable(gl.DEPTH_TEST);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    this._useSolid(program, camera.matrix(this.radius));
    uniforms(program.place);
    this._drawSolids(layers);
    const found = new Uint8Array(4);
    gl.readPixels(x, height - 1 - y, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, found);
    gl.disable(gl.SCISSOR_TEST);
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    gl.bindVertexArray(null);
    gl.deleteFramebuffer(frame);
    gl.deleteRenderbuffer(depth);
    gl.deleteTexture(texture);
    return found;
  }

  _thingOf(row) {
    if (row >= 1 && row <= this.parts.length) return { kind: "part", index: row - 1 };
    for (const record of this.obstructions.values()) if (record.row === row) return { kind: "obstruction", record };
    for (const record of this.standing) if (record.row === row) return { kind: "standing", record };
    return null;
  }

  /** Slew, radius and height of a crane at a time. */
  poseOf(plan, n, time) {
    const own = plan.driveOf(n, time);
    return own && own.motion.kind === "crane" ? axesAt(own.motion, time - own.begins_s) : this.cranes[n].parked;
  }

  /** The bounding box of parts at their places and in the yard, and of the cranes as they stand at a time; if some parts are hidden, of the others at their places. */
  bounds(plan, time, looks = this.looks) {
    const low = [Infinity, Infinity, Infinity];
    const high = [-Infinity, -Infinity, -Infinity];
    const take = (a, b) => {
      for (let axis = 0; axis < 3; axis++) {
        low[axis] = Math.min(low[axis], a[axis]);
        high[axis] = Math.max(high[axis], b[axis]);
      }
    };
    const sum = (a, b) => a.map((value, axis) => value + b[axis]);
    const some = looks.some((look) => look !== SEEN) && looks.includes(SEEN);
    for (const lift of plan.lifts) {
      const part = this.parts[lift.part];
      if (some && looks[lift.part] !== SEEN) continue;
      take(part.target_m, sum(part.target_m, part.size_m));
      if (lift.start_m && !some) take(lift.start_m, sum(lift.start_m, lift.start_size_m));
    }
    if (some) return [low, high];
    this.cranes.forEach((crane, n) => {
      const { base_m, jib_height_m, mast_size_m } = crane.record;
      take(base_m, [base_m[0], base_m[1], jib_height_m + mast_size_m]);
      for (const end of crane.ends(this.poseOf(plan, n, time))) take(end, end);
    });
    return [low, high];
  }
}
