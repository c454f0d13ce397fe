// The shaders. Everything that moves or changes colour has a row of four texels in one texture:
// [place, scale], [turn], [offset within its own frame, -], [colour, flags].

export const ROWS_WIDTH = 256;
export const [SHOWN, VOXELS, HATCHED, GHOSTLY, STRIPED, WHOLE] = [1, 2, 4, 8, 16, 32];

const ROW = `
precision highp float;
precision highp int;
precision highp sampler2D;
uniform sampler2D rows;
vec4 row_texel(uint row, int n) {
  int r = int(row);
  return texelFetch(rows, ivec2((r % ${ROWS_WIDTH}) * 4 + n, r / ${ROWS_WIDTH}), 0);
}
vec3 turned(vec4 q, vec3 v) { return v + 2.0 * cross(q.xyz, cross(q.xyz, v) + q.w * v); }
vec3 placed(uint row, vec3 at) {
  vec4 place = row_texel(row, 0);
  return place.xyz + turned(row_texel(row, 1), row_texel(row, 2).xyz + place.w * at);
}
`;

const CUT = `
precision highp float;
uniform vec3 cutLow;
uniform vec3 cutHigh;
bool cut_off(vec3 at, int flags) {
  return (flags & ${WHOLE}) == 0 && (any(lessThan(at, cutLow)) || any(greaterThan(at, cutHigh)));
}
`;

const LIGHT = `
precision highp sampler2DShadow;
uniform sampler2DShadow shadow;
uniform mat4 lightFromWorld;
uniform vec3 sun;
float lit(vec3 world, vec3 normal) {
  float facing = dot(normal, sun);
  if (facing <= 0.0) return 0.0;
  vec4 at = lightFromWorld * vec4(world + normal * 0.06, 1.0);
  vec3 p = at.xyz * 0.5 + 0.5;
  if (any(lessThan(p, vec3(0.0))) || any(greaterThan(p, vec3(1.0)))) return facing;
  p.z -= 0.0012;
  float texel = 1.0 / float(textureSize(shadow, 0).x);
  float sum = 0.0;
  for (int x = 0; x < 2; x++)
    for (int y = 0; y < 2; y++) sum += texture(shadow, vec3(p.xy + (vec2(x, y) - 0.5) * 1.2 * texel, p.z));
  return facing * sum * 0.25;
}
vec3 shaded(vec3 rgb, vec3 world, vec3 normal) {
  float sky = 0.70 + 0.10 * normal.z;
  return rgb * (sky + 0.32 * lit(world, normal));
}
`;

export const SOLID_VERTEX = `#version 300 es
${ROW}
layout(location = 0) in vec3 at;
layout(location = 1) in uint row;
uniform mat4 clipFromWorld;
uniform bool ghosts;
out vec3 world;
out vec3 local;
flat out vec4 look;
void main() {
  look = row_texel(row, 3);
  local = at;
  world = placed(row, at);
  int flags = int(look.w);
  bool drawn = (flags & ${SHOWN}) != 0 && ((flags & ${GHOSTLY}) != 0) == ghosts;
  gl_Position = !drawn ? vec4(2.0, 2.0, 2.0, 1.0) : clipFromWorld * vec4(world, 1.0);
}`;

export const SOLID_FRAGMENT = `#version 300 es
precision highp float;
${CUT}
${LIGHT}
in vec3 world;
in vec3 local;
flat in vec4 look;
uniform vec3 eye;
uniform bool cuts;
out vec4 colour;
void main() {
  vec3 normal = normalize(cross(dFdx(world), dFdy(world)));
  if (dot(normal, eye - world) < 0.0) normal = -normal;
  int flags = int(look.w);
  if (cut_off(world, flags)) discard;
  vec3 rgb = shaded(look.rgb, world, normal);
  // The inside of a part that was cut open.
  if (cuts && !gl_FrontFacing && (flags & ${WHOLE}) == 0) rgb = look.rgb * 0.5;
  if ((flags & ${VOXELS}) != 0) {
    vec3 change = fwidth(local);
    vec3 off = abs(fract(local + 0.5) - 0.5) / max(change, vec3(1e-6));
    off = mix(vec3(1e3), off, greaterThan(change, vec3(1e-4)));
    float line = 1.0 - smoothstep(0.4, 1.2, min(off.x, min(off.y, off.z)));
    float small = max(change.x, max(change.y, change.z));
    float bright = dot(look.rgb, vec3(0.33));
    rgb = mix(rgb, bright < 0.3 ? vec3(0.42) : vec3(0.1), line * 0.45 * (1.0 - smoothstep(0.06, 0.30, small)));
  }
  if ((flags & ${HATCHED}) != 0) {
    float stripe = mod(gl_FragCoord.x + gl_FragCoord.y, 11.0);
    if (stripe < 3.2) rgb = mix(rgb, vec3(1.0), 0.55);
  }
  if ((flags & ${STRIPED}) != 0) {
    float stripe = mod(gl_FragCoord.x - gl_FragCoord.y, 9.0);
    if (stripe < 2.2) rgb = mix(rgb, vec3(0.05), 0.75);
  }
  colour = vec4(rgb, (flags & ${GHOSTLY}) != 0 ? 0.16 : 1.0);
}`;

export const EDGE_VERTEX = `#version 300 es
${ROW}
layout(location = 0) in vec3 at;
layout(location = 1) in uint row;
uniform mat4 clipFromWorld;
uniform float focal;
out float strength;
out vec3 world;
flat out vec4 look;
void main() {
  world = placed(row, at);
  look = row_texel(row, 3);
  gl_Position = clipFromWorld * vec4(world, 1.0);
  // Edges fade with distance, so that finely shaped parts do not turn black.
  strength = clamp(focal / gl_Position.w / 30.0, 0.3, 1.0);
  gl_Position.z -= 3e-6 * gl_Position.w;
  int flags = int(look.w);
  if ((flags & ${GHOSTLY}) != 0) strength *= 0.3;
  if ((flags & ${SHOWN}) == 0) gl_Position = vec4(2.0, 2.0, 2.0, 1.0);
}`;

export const EDGE_FRAGMENT = `#version 300 es
${CUT}
in float strength;
in vec3 world;
flat in vec4 look;
out vec4 colour;
void main() {
  if (cut_off(world, int(look.w))) discard;
  colour = vec4(0.12, 0.12, 0.14, 0.65 * strength);
}`;

export const DEPTH_FRAGMENT = `#version 300 es
${CUT}
in vec3 world;
flat in vec4 look;
void main() { if (cut_off(world, int(look.w))) discard; }`;

export const PICK_VERTEX = SOLID_VERTEX.replace("flat out vec4 look;", "flat out vec4 look; flat out uint picked;").replace(
  "local = at;",
  "local = at; picked = row;",
);

export const PICK_FRAGMENT = `#version 300 es
precision highp int;
${CUT}
in vec3 world;
flat in vec4 look;
flat in uint picked;
out vec4 colour;
void main() {
  if (cut_off(world, int(look.w))) discard;
  colour = vec4(float(picked & 255u), float((picked >> 8u) & 255u), float(picked >> 16u), 255.0) / 255.0;
}`;

/** Where a pixel lies along one axis, as a share of a span. */
export const PLACE_FRAGMENT = `#version 300 es
precision highp float;
precision highp int;
${CUT}
in vec3 world;
flat in vec4 look;
flat in uint picked;
uniform int axis;
uniform vec2 span;
out vec4 colour;
void main() {
  if (cut_off(world, int(look.w))) discard;
  uint share = uint(clamp((world[axis] - span.x) / span.y, 0.0, 1.0) * 16777215.0);
  colour = vec4(float(share & 255u), float((share >> 8u) & 255u), float(share >> 16u), 255.0) / 255.0;
}`;

export const SLAB_VERTEX = `#version 300 es
precision highp float;
layout(location = 0) in vec3 at;
uniform mat4 clipFromWorld;
out vec3 world;
void main() { world = at; gl_Position = clipFromWorld * vec4(at, 1.0); }`;

export const SLAB_FRAGMENT = `#version 300 es
precision highp float;
precision highp int;
precision highp usampler2D;
${LIGHT}
in vec3 world;
uniform usampler2D slab;
uniform vec2 origin;
uniform float cell;
uniform float top;
uniform vec3 ground;
uniform vec3 area;
uniform vec3 yard;
uniform vec3 access;
uniform vec3 eye;
out vec4 colour;
float near_line(vec2 at, float width) {
  vec2 off = abs(fract(at + 0.5) - 0.5) / max(fwidth(at), vec2(1e-6));
  return 1.0 - smoothstep(width - 0.5, width + 0.5, min(off.x, off.y));
}
uint column(vec2 at) {
  return texelFetch(slab, clamp(ivec2(floor((at - origin) / cell)), ivec2(0), textureSize(slab, 0) - 1), 0).r;
}
vec3 tint(uint what) {
  uint kind = what & 7u;
  return kind == 2u ? area : kind == 3u ? yard : kind == 4u ? access : ground;
}
void main() {
  bool above = world.z > top - 0.001;
  uint what = column(world.xy);
  uint kind = what & 7u;
  if (kind == 0u) discard;
  vec3 normal = normalize(cross(dFdx(world), dFdy(world)));
  if (dot(normal, eye - world) < 0.0) normal = -normal;
  // Four samples per pixel, so that borders between areas are smooth.
  vec2 a1 = dFdx(world.xy) * 0.375, a2 = dFdy(world.xy) * 0.375;
  vec2 b1 = dFdx(world.xy) * 0.125, b2 = dFdy(world.xy) * 0.125;
  vec3 rgb = 0.25 * (tint(column(world.xy + a1 + b2)) + tint(column(world.xy - a1 - b2)) + tint(column(world.xy + b1 - a2)) + tint(column(world.xy - b1 + a2)));
  if (above) {
    float spread = length(fwidth(world.xy));
    if (kind == 3u) {
      float stripe = abs(fract((world.x + world.y) / 2.4) - 0.5) * 2.4;
      rgb = mix(rgb, rgb * 0.93, (1.0 - smoothstep(0.10, 0.10 + spread, stripe)) * (1.0 - smoothstep(0.2, 0.8, spread)));
    }
    if ((what & 8u) != 0u) {
      float a = abs(fract((world.x + world.y) / 2.0) - 0.5);
      float b = abs(fract((world.x - world.y) / 2.0) - 0.5);
      rgb = mix(rgb, vec3(0.72, 0.13, 0.10), step(min(a, b), 0.07) * 0.55);
    }
    rgb = mix(rgb, rgb * 0.88, near_line(world.xy / 5.0, 0.6) * 0.6);
  } else rgb *= 0.86;
  colour = vec4(shaded(rgb, world, normal), 1.0);
}`;

export const LINE_VERTEX = `#version 300 es
${ROW}
layout(location = 0) in vec2 corner;
layout(location = 1) in vec3 from;
layout(location = 2) in vec3 to;
layout(location = 3) in uvec2 ends;
layout(location = 4) in vec4 rgba;
layout(location = 5) in vec3 style;
uniform mat4 clipFromWorld;
uniform vec2 viewport;
uniform float pixels;
uniform float focal;
uniform float bias;
uniform float widen;
out vec4 ink;
out vec3 along;
flat out float dash;
void main() {
  int flags = int(row_texel(ends.x, 3).w);
  vec4 a = clipFromWorld * vec4(placed(ends.x, from), 1.0);
  vec4 b = clipFromWorld * vec4(placed(ends.y, to), 1.0);
  float da = a.z + a.w;
  float db = b.z + b.w;
  if ((flags & ${SHOWN}) == 0 || (da <= 0.0 && db <= 0.0)) { gl_Position = vec4(2.0, 2.0, 2.0, 1.0); return; }
  if (da < 0.0) a = mix(a, b, da / (da - db));
  else if (db < 0.0) b = mix(b, a, db / (db - da));
  vec2 sa = a.xy / a.w * viewport * 0.5;
  vec2 sb = b.xy / b.w * viewport * 0.5;
  float size = length(sb - sa);
  vec2 dir = size > 1e-4 ? (sb - sa) / size : vec2(1.0, 0.0);
  vec4 p = corner.x < 0.5 ? a : b;
  float width = max(style.x * pixels, style.y * focal / p.w) + widen * pixels;
  vec2 shift = vec2(-dir.y, dir.x) * corner.y * (width * 0.5 + 0.5) + dir * (corner.x - 0.5) * min(width, 2.0 * pixels);
  p.xy += shift / (viewport * 0.5) * p.w;
  p.z -= bias * p.w;
  ink = rgba;
  dash = style.z * pixels;
  along = vec3(corner.x * size, corner.y * (width * 0.5 + 0.5), 1.0) * p.w;
  ink.a *= min(1.0, width);
  gl_Position = p;
}`;

export const LINE_FRAGMENT = `#version 300 es
precision highp float;
in vec4 ink;
in vec3 along;
flat in float dash;
uniform vec4 override;
uniform float dashes;
out vec4 colour;
void main() {
  float at = along.x / along.z;
  float period = dashes > 0.0 ? dashes : dash;
  if (period > 0.0 && mod(at, period) > period * 0.55) discard;
  colour = override.a > 0.0 ? vec4(override.rgb, override.a * ink.a) : ink;
}`;
