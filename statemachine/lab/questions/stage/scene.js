// Both runs in one picture: the first solid, the second as a ghost over it.

const colour_of = (name) => {
  const probe = document.createElement('canvas').getContext('2d');
  probe.fillStyle = getComputedStyle(document.documentElement).getPropertyValue(name).trim();
  const text = probe.fillStyle;
  return [1, 3, 5].map((k) => parseInt(text.slice(k, k + 2), 16) / 255);
};

const decoded = (scene, frames) => scene.sides.map((side) => {
  const pos = numbers(side.pos, Uint16Array);
  const quat = numbers(side.quat, Int16Array);
  const count = side.contacts.count ? bytes(side.contacts.count) : new Uint8Array(frames);
  const first = new Uint32Array(frames + 1);
  for (let k = 0; k < frames; k += 1) first[k + 1] = first[k] + count[k];
  return {
    mesh: side.mesh,
    bodies: side.bodies,
    first,
    at: side.contacts.at ? numbers(side.contacts.at, Float32Array) : new Float32Array(0),
    tip: side.tip ? numbers(side.tip, Float32Array) : null,
    way: side.way ? numbers(side.way, Float32Array) : null,
    behind: side.behind ? numbers(side.behind, Uint16Array) : null,
    place(row, body) {
      const k = row * side.bodies + body;
      return [0, 1, 2].map((i) => scene.low[i] + scene.span[i] * pos[3 * k + i] / 65535);
    },
    turn(row, body) {
      const k = 4 * (row * side.bodies + body);
      return [quat[k], quat[k + 1], quat[k + 2], quat[k + 3]];
    },
  };
});

const strongest = (sides) => {
  let most = 0;
  for (const side of sides) {
    for (let k = 0; k < side.at.length; k += 6) {
      most = Math.max(most, Math.hypot(side.at[k + 3], side.at[k + 4], side.at[k + 5]));
    }
  }
  return most;
};

// An arrow of length 1 along z and of width 1, as corners of triangles with normals.
const arrow_shape = () => {
  const around = 20, profile = [[0.5, 0], [0.5, 0.72], [1.3, 0.72], [0, 1]];
  const points = [], normals = [];
  for (let p = 0; p + 1 < profile.length; p += 1) {
    const [[r, z], [s, y]] = [profile[p], profile[p + 1]];
    for (let k = 0; k < around; k += 1) {
      const [here, next] = [k, k + 1].map((at) => {
        const angle = (2 * Math.PI * at) / around, c = Math.cos(angle), d = Math.sin(angle);
        return { low: [r * c, r * d, z], high: [s * c, s * d, y],
          normal: unit([c, d, p === 2 ? 0.6 : p === 1 ? -9 : 0]) };
      });
      points.push(...here.low, ...next.low, ...here.high, ...next.low, ...next.high, ...here.high);
      for (const corner of [here, next, here, next, next, here]) normals.push(...corner.normal);
    }
  }
  return { points: new Float32Array(points), normals: new Float32Array(normals) };
};

class Scene {
  constructor(canvas, data, frames) {
    this.canvas = canvas;
    this.data = data;
    this.sides = decoded(data, frames);
    this.most = strongest(this.sides);
    this.frames = frames;
    this.show = { solid: true, ghost: true, marks: true, trails: true };
    this.row = 0;
    this.coarse = false;
    this.reset();
    const gl = canvas.getContext('webgl2',
      { antialias: true, alpha: true, premultipliedAlpha: true, preserveDrawingBuffer: true });
    if (!gl) throw new Error('no WebGL');
    this.gl = gl;
    this.build();
    canvas.addEventListener('webglcontextlost', (event) => event.preventDefault());
    canvas.addEventListener('webglcontextrestored', () => { this.build(); this.draw(); });
  }

  reset() {
    const c = this.data.camera;
    this.target = c.slice(0, 3);
    [this.distance, this.azimuth, this.elevation] = c.slice(3);
    this.near = false;
  }

  approach() {
    this.near = true;
    this.distance = this.data.near;
  }

  build() {
    const gl = this.gl;
    this.solid = program(gl, SHAPE_VERTEX, SOLID_FRAGMENT);
    this.ghost = program(gl, SHAPE_VERTEX, GHOST_FRAGMENT);
    this.outline = program(gl, WHOLE_VERTEX, OUTLINE_FRAGMENT);
    this.floor = program(gl, FLOOR_VERTEX, FLOOR_FRAGMENT);
    this.line = program(gl, LINE_VERTEX, LINE_FRAGMENT);
    this.meshes = this.data.meshes.map((mesh) => this.shape(creased(mesh)));
    this.arrow = this.shape(arrow_shape());
    this.square = gl.createVertexArray();
    gl.bindVertexArray(this.square);
    gl.bindBuffer(gl.ARRAY_BUFFER, gl.createBuffer());
    gl.bufferData(gl.ARRAY_BUFFER, new Float32Array([-1, -1, 1, -1, -1, 1, 1, 1]), gl.STATIC_DRAW);
    gl.enableVertexAttribArray(this.floor.attribute('corner'));
    gl.vertexAttribPointer(this.floor.attribute('corner'), 2, gl.FLOAT, false, 0, 0);
    this.nothing = gl.createVertexArray();
    this.ways = this.sides.map((side) => side.way && this.way(side.way));
    this.layers = null;
  }

  shape({ points, normals }) {
    const gl = this.gl, array = gl.createVertexArray();
    gl.bindVertexArray(array);
    for (const [name, values] of [['position', points], ['normal', normals]]) {
      gl.bindBuffer(gl.ARRAY_BUFFER, gl.createBuffer());
      gl.bufferData(gl.ARRAY_BUFFER, values, gl.STATIC_DRAW);
      for (const made of [this.solid, this.ghost]) {
        // Both programs take the same places: they share their vertex shader.
        const place = made.attribute(name);
        gl.enableVertexAttribArray(place);
        gl.vertexAttribPointer(place, 3, gl.FLOAT, false, 0, 0);
      }
    }
    return { array, count: points.length / 3 };
  }

  way(points) {
    const gl = this.gl, array = gl.createVertexArray();
    gl.bindVertexArray(array);
    gl.bindBuffer(gl.ARRAY_BUFFER, gl.createBuffer());
    gl.bufferData(gl.ARRAY_BUFFER, points, gl.STATIC_DRAW);
    for (const [name, offset] of [['one', 0], ['two', 12]]) {
      const place = this.line.attribute(name);
      gl.enableVertexAttribArray(place);
      gl.vertexAttribPointer(place, 3, gl.FLOAT, false, 12, offset);
      gl.vertexAttribDivisor(place, 1);
    }
    return array;
  }

  // Each side's surfaces are drawn into a layer of its own, of the size of the canvas.
  resize() {
    const gl = this.gl, box = this.canvas.getBoundingClientRect();
    if (!box.width) return false;
    const fine = Math.min(Math.max(2, window.devicePixelRatio || 1), 2200 / box.width);
    const sharp = this.coarse ? 1 : fine;
    const width = Math.round(box.width * sharp), height = Math.round(box.height * sharp);
    this.sharp = sharp;
    if (this.layers && this.canvas.width === width && this.canvas.height === height) return true;
    for (const { texture, buffer, depth } of this.layers || []) {
      gl.deleteTexture(texture);
      gl.deleteFramebuffer(buffer);
      gl.deleteRenderbuffer(depth);
    }
    this.canvas.width = width;
    this.canvas.height = height;
    this.layers = [0, 1].map(() => this.new_layer(width, height));
    return true;
  }

  new_layer(width, height) {
    const gl = this.gl, texture = gl.createTexture();
    gl.bindTexture(gl.TEXTURE_2D, texture);
    gl.texStorage2D(gl.TEXTURE_2D, 1, gl.RGBA8, width, height);
    for (const [name, value] of [[gl.TEXTURE_MIN_FILTER, gl.NEAREST],
      [gl.TEXTURE_MAG_FILTER, gl.NEAREST], [gl.TEXTURE_WRAP_S, gl.CLAMP_TO_EDGE],
      [gl.TEXTURE_WRAP_T, gl.CLAMP_TO_EDGE]]) gl.texParameteri(gl.TEXTURE_2D, name, value);
    const buffer = gl.createFramebuffer();
    gl.bindFramebuffer(gl.FRAMEBUFFER, buffer);
    gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.TEXTURE_2D, texture, 0);
    const depth = gl.createRenderbuffer();
    gl.bindRenderbuffer(gl.RENDERBUFFER, depth);
    gl.renderbufferStorage(gl.RENDERBUFFER, gl.DEPTH_COMPONENT24, width, height);
    gl.framebufferRenderbuffer(gl.FRAMEBUFFER, gl.DEPTH_ATTACHMENT, gl.RENDERBUFFER, depth);
    return { texture, buffer, depth };
  }

  look() {
    if (this.near && this.sides[0].tip) {
      const [a, b] = this.sides.map((side) => side.tip.subarray(3 * this.row, 3 * this.row + 3));
      this.target = [0, 1, 2].map((k) => (a[k] + b[k]) / 2);
    }
    const ce = Math.cos(this.elevation);
    const back = [ce * Math.cos(this.azimuth), ce * Math.sin(this.azimuth),
      Math.sin(this.elevation)];
    const right = [-Math.sin(this.azimuth), Math.cos(this.azimuth), 0];
    const up = cross(back, right);
    const eye = add(this.target, back, this.distance);
    this.view = new Float32Array([right[0], up[0], back[0], 0, right[1], up[1], back[1], 0,
      right[2], up[2], back[2], 0, -dot(right, eye), -dot(up, eye), -dot(back, eye), 1]);
    const far = this.distance + 12 * this.data.extent, close = this.distance * 0.02;
    // A picture higher than wide opens wider, so that its width shows as much; 1.45 as in scene.py.
    const tall = Math.min(1, this.canvas.width / this.canvas.height / 1.45);
    const f = tall / Math.tan(this.data.opening / 2), aspect = this.canvas.width / this.canvas.height;
    this.lens = new Float32Array([f / aspect, 0, 0, 0, 0, f, 0, 0, 0, 0,
      (far + close) / (close - far), -1, 0, 0, (2 * far * close) / (close - far), 0]);
    this.up = unit([right[2], up[2], back[2]]);
    this.far = this.distance + 2.5 * this.data.extent;
  }

  draw() {
    const gl = this.gl;
    if (gl.isContextLost() || !this.resize()) return;
    this.look();
    const paper = colour_of('--paper'), ink = colour_of('--ink');
    this.hues = [colour_of('--one'), colour_of('--two')];
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    gl.viewport(0, 0, this.canvas.width, this.canvas.height);
    gl.clearColor(0, 0, 0, 0);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    gl.enable(gl.DEPTH_TEST);
    gl.disable(gl.BLEND);
    if (this.show.solid) this.draw_solid(paper);
    gl.enable(gl.BLEND);
    gl.blendFunc(gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
    if (this.data.floor !== null) this.draw_floor(ink);
    if (this.show.solid) this.draw_outline(0, ink.map((v, k) => 0.5 * v + 0.5 * this.hues[0][k]), 0, 0.7);
    if (this.show.trails) this.draw_ways();
    if (this.show.ghost) this.draw_outline(1, this.hues[1], 0.42, 1);
    if (this.show.marks) this.draw_contacts();
  }

  shapes(made, side, colours) {
    const gl = this.gl, run = this.sides[side], mesh = this.data.meshes[run.mesh];
    const built = this.meshes[run.mesh];
    gl.uniformMatrix4fv(made.at('view'), false, this.view);
    gl.uniformMatrix4fv(made.at('lens'), false, this.lens);
    gl.uniform3fv(made.at('low'), mesh.low);
    gl.uniform3fv(made.at('span'), mesh.span);
    gl.bindVertexArray(built.array);
    for (const [body, first, count, r, g, b] of mesh.parts) {
      // What never moves is the same on both sides: drawn once, it only hides what is behind it.
      const seen = !(side === 1 && this.show.solid && !this.data.moving[body]);
      gl.colorMask(seen, seen, seen, seen);
      if (colours) gl.uniform3fv(made.at('colour'), colours(r, g, b));
      gl.uniformMatrix4fv(made.at('pose'), false,
        pose(run.place(this.row, body), run.turn(this.row, body)));
      gl.drawArrays(gl.TRIANGLES, first, count);
    }
    gl.colorMask(true, true, true, true);
  }

  draw_solid(paper) {
    const gl = this.gl, made = this.solid.use(), hue = this.hues[0];
    gl.uniform3fv(made.at('up'), this.up);
    const dark = paper[0] < 0.4;
    this.shapes(made, 0, (r, g, b) => {
      // Light and dark as the model has it, in the hue of the side.
      const light = 0.3 * r + 0.59 * g + 0.11 * b;
      const base = dark ? 0.42 + 0.5 * light : 0.34 + 0.62 * light;
      return hue.map((v) => base * (0.3 + 0.7 * (dark ? 0.4 + 0.6 * v : 0.36 + 0.64 * v)));
    });
  }

  draw_floor(ink) {
    const gl = this.gl, made = this.floor.use();
    gl.uniformMatrix4fv(made.at('view'), false, this.view);
    gl.uniformMatrix4fv(made.at('lens'), false, this.lens);
    const extent = this.data.extent, cell = 10 ** Math.floor(Math.log10(extent / 5));
    const c = this.data.camera;
    gl.uniform3f(made.at('centre'), c[0], c[1], this.data.floor);
    gl.uniform1f(made.at('wide'), 3.5 * extent);
    gl.uniform1f(made.at('cell'), cell);
    gl.uniform1f(made.at('strength'), 0.5);
    gl.uniform3fv(made.at('colour'), ink);
    gl.depthMask(false);
    gl.bindVertexArray(this.square);
    gl.drawArrays(gl.TRIANGLE_STRIP, 0, 4);
    gl.depthMask(true);
  }

  draw_outline(side, colour, fill, line) {
    const gl = this.gl, made = this.ghost.use();
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.layers[side].buffer);
    gl.clearColor(0, 0, 0, 0);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    gl.disable(gl.BLEND);
    gl.uniform1f(made.at('far'), this.far);
    this.shapes(made, side, null);
    gl.enable(gl.BLEND);
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    const over = this.outline.use();
    gl.activeTexture(gl.TEXTURE0);
    gl.bindTexture(gl.TEXTURE_2D, this.layers[side].texture);
    gl.uniform1i(over.at('ghost'), 0);
    gl.activeTexture(gl.TEXTURE1);
    gl.bindTexture(gl.TEXTURE_2D, this.layers[0].texture);
    gl.uniform1i(over.at('solid'), 1);
    gl.uniform1f(over.at('through'), side && this.show.solid ? 0.3 : 1);
    const wide = side ? 1.1 * this.sharp : 0.5 * this.sharp;
    gl.uniform2f(over.at('pixel'), wide / this.canvas.width, wide / this.canvas.height);
    gl.uniform3fv(over.at('colour'), colour);
    gl.uniform1f(over.at('fill'), fill);
    gl.uniform1f(over.at('line'), line);
    gl.uniform1f(over.at('far'), this.far);
    gl.uniform1f(over.at('jump'), 0.012 * this.data.extent);
    gl.disable(gl.DEPTH_TEST);
    gl.bindVertexArray(this.nothing);
    gl.drawArrays(gl.TRIANGLES, 0, 3);
    gl.enable(gl.DEPTH_TEST);
  }

  draw_ways() {
    const gl = this.gl, made = this.line.use();
    gl.uniformMatrix4fv(made.at('view'), false, this.view);
    gl.uniformMatrix4fv(made.at('lens'), false, this.lens);
    gl.uniform2f(made.at('screen'), this.canvas.width / 2, this.canvas.height / 2);
    gl.disable(gl.DEPTH_TEST);
    this.ways.forEach((way, side) => {
      if (!way || !this.show[side ? 'ghost' : 'solid']) return;
      gl.bindVertexArray(way);
      gl.uniform1i(made.at('dash'), side ? 4 : 0);
      for (const [count, strength, wide] of [
        [this.sides[side].way.length / 3 - 1, 0.35, 0.6], [this.sides[side].behind[this.row], 1, 1]]) {
        gl.uniform1f(made.at('wide'), wide * this.sharp);
        gl.uniform4f(made.at('colour'), ...this.hues[side], strength);
        if (count) gl.drawArraysInstanced(gl.TRIANGLE_STRIP, 0, 4, count);
      }
    });
    gl.enable(gl.DEPTH_TEST);
  }

  // An arrow from each contact along the force there; its length is as its root.
  draw_contacts() {
    const gl = this.gl, made = this.solid.use();
    gl.uniformMatrix4fv(made.at('view'), false, this.view);
    gl.uniformMatrix4fv(made.at('lens'), false, this.lens);
    gl.uniform3f(made.at('low'), 0, 0, 0);
    gl.uniform3f(made.at('span'), 1, 1, 1);
    gl.uniform3fv(made.at('up'), this.up);
    gl.clear(gl.DEPTH_BUFFER_BIT);
    gl.bindVertexArray(this.arrow.array);
    const extent = this.near ? 0.7 * this.distance : this.data.extent;
    this.sides.forEach((run, side) => {
      if (!this.show[side ? 'ghost' : 'solid']) return;
      gl.uniform3fv(made.at('colour'), this.hues[side].map((v) => 1.05 * v));
      for (let k = run.first[this.row]; k < run.first[this.row + 1]; k += 1) {
        const at = run.at.subarray(6 * k, 6 * k + 3), force = run.at.subarray(6 * k + 3, 6 * k + 6);
        const strength = size(force);
        if (!strength) continue;
        const long = extent * 0.4 * Math.sqrt(strength / this.most);
        const vector = unit(force).map((v) => v * long);
        gl.uniformMatrix4fv(made.at('pose'), false, along(at, vector, 0.008 * extent));
        gl.drawArrays(gl.TRIANGLES, 0, this.arrow.count);
      }
    });
  }
}
