// Shaded triangles in WebGL2: one body beside the other in one canvas, under one camera.

// YlOrRd of C. Brewer, colorbrewer2.org: safe for colour-blind readers, darker is more.
const RAMP = ["#ffffcc", "#ffeda0", "#fed976", "#feb24c", "#fd8d3c", "#fc4e2a", "#e31a1c", "#bd0026", "#800026"];
const VEIL = "#7f93ab";

const VERTEX = `#version 300 es
in vec3 position; in vec3 normal; in float level;
uniform mat4 view; uniform mat3 turn;
out vec3 facing; out float value;
void main() { gl_Position = view * vec4(position, 1.0); facing = turn * normal; value = level; }`;
const FRAGMENT = `#version 300 es
precision highp float;
in vec3 facing; in float value;
uniform vec3 ramp[${RAMP.length}]; uniform vec3 plain; uniform float cover;
out vec4 colour;
void main() {
  vec3 n = normalize(facing) * (gl_FrontFacing ? 1.0 : -1.0);
  float light = 0.62 + 0.38 * max(0.0, dot(n, normalize(vec3(-0.35, 0.5, 0.8))));
  float place = clamp(value, 0.0, 1.0) * ${(RAMP.length - 1).toFixed(1)};
  int low = min(int(place), ${RAMP.length - 2});
  vec3 tint = value < 0.0 ? plain : mix(ramp[low], ramp[low + 1], place - float(low));
  colour = vec4(tint * light * cover, cover);
}`;

const rgb = (text) => [1, 3, 5].map((at) => parseInt(text.slice(at, at + 2), 16) / 255);

function program(gl) {
  const made = gl.createProgram();
  for (const [kind, source] of [[gl.VERTEX_SHADER, VERTEX], [gl.FRAGMENT_SHADER, FRAGMENT]]) {
    const shader = gl.createShader(kind);
    gl.shaderSource(shader, source);
    gl.compileShader(shader);
    gl.attachShader(made, shader);
  }
  gl.linkProgram(made);
  if (!gl.getProgramParameter(made, gl.LINK_STATUS)) throw new Error(gl.getProgramInfoLog(made));
  return made;
}

/** Normals at the nodes: the sum of those of the triangles around, each as long as twice its area. */
function normals(x, triangles) {
  const sum = new Float32Array(x.length);
  for (let k = 0; k < triangles.length; k += 3) {
    const [a, b, c] = [3 * triangles[k], 3 * triangles[k + 1], 3 * triangles[k + 2]];
    const [ux, uy, uz] = [x[b] - x[a], x[b + 1] - x[a + 1], x[b + 2] - x[a + 2]];
    const [vx, vy, vz] = [x[c] - x[a], x[c + 1] - x[a + 1], x[c + 2] - x[a + 2]];
    const [nx, ny, nz] = [uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx];
    for (const node of [a, b, c]) { sum[node] += nx; sum[node + 1] += ny; sum[node + 2] += nz; }
  }
  return sum;
}

/** Rows of a rotation: to the right, up and towards the eye, which looks at `yaw` from `pitch` above; z stays up. */
function rotation(yaw, pitch) {
  const [c, s, cp, sp] = [Math.cos(yaw), Math.sin(yaw), Math.cos(pitch), Math.sin(pitch)];
  return [[c, s, 0], [-s * sp, c * sp, cp], [s * cp, -c * cp, sp]];
}

/** Without perspective, so that lengths can be compared: matrices of the view, column by column. */
function matrices(camera, centre, radius, aspect) {
  const turn = rotation(camera.yaw, camera.pitch);
  const scale = camera.zoom / (1.06 * radius * Math.max(1, 1 / aspect));
  const per = [scale / aspect, scale, -scale / 4];
  const shift = turn.map((row, i) => -per[i] * (row[0] * centre[0] + row[1] * centre[1] + row[2] * centre[2]));
  const view = [0, 1, 2].flatMap((j) => [...turn.map((row, i) => per[i] * row[j]), 0]);
  return { view: [...view, ...shift, 1], turn: [0, 1, 2].flatMap((j) => turn.map((row) => row[j])) };
}

/** What draws bodies on a canvas; null where there is no WebGL2. */
function painter(canvas) {
  const gl = canvas.getContext("webgl2", { antialias: true, preserveDrawingBuffer: true });
  if (!gl) return null;
  const shaders = program(gl), at = (name) => gl.getUniformLocation(shaders, name);
  const names = { position: 3, normal: 3, level: 1 };
  const buffers = Object.fromEntries([...Object.keys(names), "triangles"].map((name) => [name, gl.createBuffer()]));
  gl.useProgram(shaders);
  gl.enable(gl.DEPTH_TEST);
  gl.enable(gl.BLEND);
  gl.blendFunc(gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
  gl.uniform3fv(at("ramp"), RAMP.flatMap(rgb));

  function fill(body) {
    const values = { position: body.x, normal: normals(body.x, body.triangles), level: body.levels };
    for (const [name, size] of Object.entries(names)) {
      const place = gl.getAttribLocation(shaders, name);
      gl.bindBuffer(gl.ARRAY_BUFFER, buffers[name]);
      gl.bufferData(gl.ARRAY_BUFFER, values[name], gl.DYNAMIC_DRAW);
      gl.enableVertexAttribArray(place);
      gl.vertexAttribPointer(place, size, gl.FLOAT, false, 0, 0);
    }
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, buffers.triangles);
    gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, body.triangles, gl.DYNAMIC_DRAW);
  }

  function drawOne(body, colour, cover) {
    gl.uniform3fv(at("plain"), rgb(colour));
    gl.uniform1f(at("cover"), cover);
    gl.depthMask(cover === 1);
    fill(body);
    gl.drawElements(gl.TRIANGLES, body.triangles.length, gl.UNSIGNED_SHORT, 0);
  }

  /** Each of `bodies` in a window of its own, with the `veils` around it, which hide nothing. */
  return function paint(bodies, veils, camera, centre, radius, plain) {
    const dots = Math.min(2, devicePixelRatio || 1);
    canvas.width = Math.max(2, Math.round(dots * canvas.clientWidth));
    canvas.height = Math.max(2, Math.round(dots * canvas.clientHeight));
    gl.clearColor(0, 0, 0, 0);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    const wide = Math.floor(canvas.width / bodies.length);
    const { view, turn } = matrices(camera, centre, radius, wide / canvas.height);
    gl.uniformMatrix4fv(at("view"), false, view);
    gl.uniformMatrix3fv(at("turn"), false, turn);
    bodies.forEach((body, i) => {
      gl.viewport(i * wide, 0, wide, canvas.height);
      drawOne(body, plain, 1);
      for (const veil of veils) drawOne(veil, VEIL, 0.3);
    });
    gl.depthMask(true);
  };
}
