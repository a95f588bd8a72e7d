// What WebGL needs and does not bring: bytes, matrices, programs.

const bytes = (text) => Uint8Array.from(atob(text), (c) => c.charCodeAt(0));
const numbers = (text, Kind) => new Kind(bytes(text).buffer);

const sub = (a, b) => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
const add = (a, b, k = 1) => [a[0] + k * b[0], a[1] + k * b[1], a[2] + k * b[2]];
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const cross = (a, b) =>
  [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const size = (a) => Math.hypot(a[0], a[1], a[2]);
const unit = (a) => { const s = size(a) || 1; return [a[0] / s, a[1] / s, a[2] / s]; };

// Corners of a mesh's triangles, each with its normal: the mean, by area, of the faces around its
// point that meet at less than 35°. Points (0 to 1) are as the mesh has them, of `span`.
const creased = (mesh) => {
  const grid = numbers(mesh.position, Uint16Array);
  const faces = numbers(mesh.index, mesh.wide ? Uint32Array : Uint16Array);
  const point = (c) => [0, 1, 2].map((i) => mesh.span[i] * grid[3 * c + i] / 65535);
  const around = Array.from({ length: grid.length / 3 }, () => []);
  const areas = [], units = [];
  for (let f = 0; 3 * f < faces.length; f += 1) {
    const [a, b, c] = [0, 1, 2].map((k) => point(faces[3 * f + k]));
    areas.push(cross(sub(b, a), sub(c, a)));
    units.push(unit(areas[f]));
    for (let k = 0; k < 3; k += 1) around[faces[3 * f + k]].push(f);
  }
  const points = new Float32Array(3 * faces.length), normals = new Float32Array(3 * faces.length);
  faces.forEach((corner, k) => {
    const own = units[Math.floor(k / 3)];
    const near = around[corner].filter((f) => dot(own, units[f]) > Math.cos(35 * Math.PI / 180));
    normals.set(unit(near.reduce((sum, f) => add(sum, areas[f]), [0, 0, 0])), 3 * k);
    for (let i = 0; i < 3; i += 1) points[3 * k + i] = grid[3 * corner + i] / 65535;
  });
  return { points, normals };
};

// Matrices 4 × 4 by columns, as WebGL takes them.
const product = (a, b) => {
  const out = new Float32Array(16);
  for (let c = 0; c < 4; c += 1) {
    for (let r = 0; r < 4; r += 1) {
      let sum = 0;
      for (let k = 0; k < 4; k += 1) sum += a[4 * k + r] * b[4 * c + k];
      out[4 * c + r] = sum;
    }
  }
  return out;
};

const pose = (pos, quat) => {
  const s = Math.hypot(...quat) || 1;
  const [w, x, y, z] = quat.map((value) => value / s);
  return new Float32Array([
    1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y), 0,
    2 * (x * y - w * z), 1 - 2 * (x * x + z * z), 2 * (y * z + w * x), 0,
    2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y), 0,
    pos[0], pos[1], pos[2], 1,
  ]);
};

// A matrix that puts the z axis of a shape along a vector, and stretches it to its length.
const along = (pos, vector, thick) => {
  const z = unit(vector);
  const x = unit(cross(Math.abs(z[2]) < 0.9 ? [0, 0, 1] : [1, 0, 0], z));
  const y = cross(z, x);
  const s = size(vector);
  return new Float32Array([
    x[0] * thick, x[1] * thick, x[2] * thick, 0, y[0] * thick, y[1] * thick, y[2] * thick, 0,
    z[0] * s, z[1] * s, z[2] * s, 0, pos[0], pos[1], pos[2], 1,
  ]);
};

const program = (gl, vertex, fragment) => {
  const made = gl.createProgram();
  for (const [kind, text] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
    const shader = gl.createShader(kind);
    gl.shaderSource(shader, '#version 300 es\nprecision highp float;\n' + text);
    gl.compileShader(shader);
    if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS) && !gl.isContextLost()) {
      throw new Error(gl.getShaderInfoLog(shader));
    }
    gl.attachShader(made, shader);
  }
  gl.linkProgram(made);
  const places = {};
  return {
    use() { gl.useProgram(made); return this; },
    at(name) {
      if (!(name in places)) places[name] = gl.getUniformLocation(made, name);
      return places[name];
    },
    attribute: (name) => gl.getAttribLocation(made, name),
  };
};

const SHAPE_VERTEX = `
in vec3 position, normal;
uniform mat4 pose, view, lens; uniform vec3 low, span;
out vec3 seen, facing;
void main() {
  vec4 p = view * pose * vec4(low + span * position, 1.0);
  seen = p.xyz;
  facing = mat3(view) * mat3(pose) * normal;
  gl_Position = lens * p;
}`;

// Light from above and beside the eye: a soft key, a fill, a rim.
const SOLID_FRAGMENT = `
in vec3 seen, facing; uniform vec3 colour, up; out vec4 shown;
void main() {
  vec3 n = normalize(facing);
  if (dot(n, seen) > 0.0) n = -n;
  vec3 eye = normalize(-seen);
  float key = max(dot(n, normalize(vec3(-0.45, 0.75, 0.6))), 0.0);
  float sky = 0.5 + 0.5 * dot(n, up);
  float gloss = pow(max(dot(n, normalize(eye + normalize(vec3(-0.45, 0.75, 0.6)))), 0.0), 40.0);
  shown = vec4(colour * (0.34 + 0.26 * sky + 0.52 * key) + 0.10 * gloss, 1.0);
}`;

// Normal and depth, which the outline is found from.
const GHOST_FRAGMENT = `
in vec3 seen, facing; uniform float far; out vec4 shown;
void main() {
  vec3 n = normalize(facing);
  if (dot(n, seen) > 0.0) n = -n;
  float depth = clamp(-seen.z / far, 0.0, 0.999);
  float coarse = floor(depth * 255.0) / 255.0;
  shown = vec4(n.xy * 0.5 + 0.5, coarse, fract(depth * 255.0) * 0.996 + 0.004);
}`;

const WHOLE_VERTEX = `
out vec2 at;
void main() {
  at = vec2(gl_VertexID == 1 ? 2.0 : 0.0, gl_VertexID == 2 ? 2.0 : 0.0);
  gl_Position = vec4(at * 2.0 - 1.0, 0.0, 1.0);
}`;

// A faint fill, and a line wherever the neighbours are of another surface.
const OUTLINE_FRAGMENT = `
in vec2 at; uniform sampler2D ghost, solid; uniform vec2 pixel; uniform vec3 colour;
uniform float fill, line, far, jump, through; out vec4 shown;
float depth(vec4 t) { return t.a > 0.0 ? (t.b + (t.a - 0.004) / 0.996 / 255.0) * far : far * 2.0; }
void main() {
  vec4 here = texture(ghost, at);
  float d = depth(here), edge = 0.0;
  vec4 side[4];
  side[0] = texture(ghost, at + vec2(pixel.x, 0.0)); side[1] = texture(ghost, at - vec2(pixel.x, 0.0));
  side[2] = texture(ghost, at + vec2(0.0, pixel.y)); side[3] = texture(ghost, at - vec2(0.0, pixel.y));
  for (int k = 0; k < 4; k += 1) {
    bool in_here = here.a > 0.0, in_there = side[k].a > 0.0;
    if (in_here != in_there) edge = max(edge, 1.0);
    else if (in_here) {
      float bend = length(here.rg - side[k].rg);
      edge = max(edge, smoothstep(0.16, 0.34, bend) * 0.55);
      edge = max(edge, smoothstep(jump, 2.0 * jump, abs(d - depth(side[k]))));
    }
  }
  float inside = here.a > 0.0 ? fill * (0.55 + 0.9 * (1.0 - sqrt(max(0.0,
    1.0 - dot(here.rg * 2.0 - 1.0, here.rg * 2.0 - 1.0))))) : 0.0;
  // Over the other side the fill is fainter: what stands alone stands out.
  if (texture(solid, at).a > 0.0) inside *= through;
  float a = max(inside, edge * line);
  if (a < 0.01) discard;
  shown = vec4(colour * a, a);
}`;

const FLOOR_VERTEX = `
in vec2 corner; uniform mat4 view, lens; uniform vec3 centre; uniform float wide;
out vec2 ground, out_there;
void main() {
  out_there = corner; ground = centre.xy + corner * wide;
  gl_Position = lens * view * vec4(ground, centre.z, 1.0);
}`;

const FLOOR_FRAGMENT = `
in vec2 ground, out_there; uniform vec3 colour; uniform float cell, strength; out vec4 shown;
float grid(float c) {
  vec2 g = ground / c, w = fwidth(g);
  vec2 l = abs(fract(g - 0.5) - 0.5) / w;
  return (1.0 - min(min(l.x, l.y), 1.0)) * clamp(1.4 - 3.0 * max(w.x, w.y), 0.0, 1.0);
}
void main() {
  float fade = 1.0 - smoothstep(0.25, 1.0, length(out_there));
  float a = fade * strength * (0.16 + max(0.35 * grid(cell), 0.8 * grid(cell * 5.0)));
  shown = vec4(colour * a, a);
}`;

const LINE_VERTEX = `
in vec3 one, two; uniform mat4 view, lens; uniform vec2 screen; uniform float wide;
flat out int part;
void main() {
  part = gl_InstanceID;
  vec4 a = lens * view * vec4(one, 1.0), b = lens * view * vec4(two, 1.0);
  vec2 pa = a.xy / a.w * screen, pb = b.xy / b.w * screen;
  vec2 way = pb - pa;
  way = length(way) > 1e-4 ? normalize(way) : vec2(1.0, 0.0);
  vec2 aside = vec2(-way.y, way.x) * wide * ((gl_VertexID & 1) == 0 ? 1.0 : -1.0);
  vec4 p = gl_VertexID < 2 ? a : b;
  p.xy += (aside + way * wide * (gl_VertexID < 2 ? -0.3 : 0.3)) / screen * p.w;
  gl_Position = p;
}`;

const LINE_FRAGMENT = `
flat in int part; uniform vec4 colour; uniform int dash; out vec4 shown;
void main() {
  if (dash > 0 && (part / dash) % 2 == 1) discard;
  shown = vec4(colour.rgb * colour.a, colour.a);
}`;
