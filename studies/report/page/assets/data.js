"use strict";
// What the page brings along: arrays as base64, short ones as two bytes each, positions as deflated differences.

const DATA = JSON.parse(document.getElementById("data").textContent);
const byId = (id) => document.getElementById(id);
const MISSING = 65535;

/** Keeps a part of the page that lies in a file of its own; each of these files calls it once. */
function keepPiece(name, given) {
  DATA.pieces[name] = given;
}

/** A part of the page by name, from its file where it is not in here; null where that file is not there. A page of
 *  file:// may load scripts, and nothing else. */
function piece(name) {
  if (name in DATA.pieces) return Promise.resolve(DATA.pieces[name]);
  return new Promise((resolve) => {
    const script = document.createElement("script");
    script.onload = () => resolve(DATA.pieces[name] ?? null);
    script.onerror = () => resolve(null);
    script.src = `${DATA.folder}/${name}.js`;
    document.head.append(script);
  });
}

function bytesOf(text) {
  return Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
}

/** Values [any unit] of a series packed by pack.py; null where there is no number. */
function series(packed) {
  const bytes = bytesOf(packed.data), values = [];
  for (let i = 0; i < bytes.length; i += 2) {
    const level = bytes[i] + 256 * bytes[i + 1];
    values.push(level === MISSING ? null : packed.low + (packed.high - packed.low) * level / (MISSING - 1));
  }
  return values;
}

async function inflated(text) {
  const stream = new Blob([bytesOf(text)]).stream().pipeThrough(new DecompressionStream("deflate"));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

/** Frames of positions [m], each a Float32Array of x, y, z by node. The file has coordinate by coordinate, node by node,
 *  how many steps it moves from frame to frame; low bytes first, then high ones. */
async function frames(packed) {
  const [count, nodes] = packed.shape, total = 3 * nodes * count, bytes = await inflated(packed.data);
  const found = Array.from({ length: count }, () => new Float32Array(3 * nodes));
  let at = 0;
  for (let axis = 0; axis < 3; axis++) {
    for (let node = 0; node < nodes; node++) {
      let level = 0;
      for (let f = 0; f < count; f++, at++) {
        level += (bytes[at] | bytes[total + at] << 8) << 16 >> 16;
        found[f][3 * node + axis] = packed.low[axis] + packed.step * level;
      }
    }
  }
  return found;
}

async function indices(text) {
  return new Uint16Array((await inflated(text)).buffer);
}

/** Where `t` lies among ascending `times`: [i, share] between times[i] and times[i + 1], at the ends the end. */
function between(times, t) {
  let i = 0;
  while (i < times.length - 2 && times[i + 1] <= t) i++;
  if (times.length < 2) return [0, 0];
  return [i, Math.min(1, Math.max(0, (t - times[i]) / (times[i + 1] - times[i])))];
}

/** The array between two of `list` at the times `times`. */
function blended(list, times, t) {
  const [i, share] = between(times, t), a = list[i], b = list[Math.min(i + 1, list.length - 1)];
  return share === 0 ? a : a.map((value, k) => value + share * (b[k] - value));
}
