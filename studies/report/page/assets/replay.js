// The chosen case: its words, its histories, and its body beside that of the reference.

const FRONT = { yaw: 0.6, pitch: 0.35, zoom: 1 };
const SPEED = 1 / 8; // a replay takes eight seconds, however long the scene is
const state = { shown: null, given: null, marks: () => {}, camera: { ...FRONT }, t: 0, playing: false, last: 0 };
const calm = matchMedia("(prefers-reduced-motion: reduce)");
const plainColour = () => getComputedStyle(document.documentElement).getPropertyValue("--body").trim();
let paint = null;

/** Positions, triangles and errors of a packed replay, and the reference in its own shape. */
async function unpacked(replay) {
  const positions = await frames(replay.positions), triangles = await indices(replay.triangles);
  const shape = replay.reference && await piece(`reference-${replay.reference}`);
  const truth = shape && { ...shape, positions: await frames(shape.positions), triangles: await indices(shape.triangles) };
  const found = { ...replay, positions, triangles, truth, errors: null, shapes: shapes(replay) };
  if (replay.errors) {
    const values = Float32Array.from(series(replay.errors)), nodes = positions[0].length / 3;
    found.errors = replay.reached.map((t, k) => values.subarray(k * nodes, (k + 1) * nodes));
  }
  return found;
}

/** The middle of all frames and the radius that holds them from every side. */
function bounds(list) {
  const low = [Infinity, Infinity, Infinity], high = low.map((value) => -value);
  for (const frame of list) {
    frame.forEach((value, i) => { low[i % 3] = Math.min(low[i % 3], value); high[i % 3] = Math.max(high[i % 3], value); });
  }
  const centre = low.map((value, j) => (value + high[j]) / 2);
  let radius = 0;
  for (const x of list) {
    for (let i = 0; i < x.length; i += 3) {
      radius = Math.max(radius, Math.hypot(x[i] - centre[0], x[i + 1] - centre[1], x[i + 2] - centre[2]));
    }
  }
  return { centre, radius };
}

/** The moment that is drawn: for readers who want no motion that of the nearest recorded frame. */
function steadied(shown) {
  const nearer = (best, time) => (Math.abs(time - state.t) < Math.abs(best - state.t) ? time : best);
  return calm.matches ? shown.times.reduce(nearer) : state.t;
}

/** The body of the case, and that of the reference where there is one. */
function bodiesAt(shown, t) {
  const x = blended(shown.positions, shown.times, t), none = new Float32Array(x.length / 3).fill(-1);
  const levels = shown.errors ? blended(shown.errors, shown.reached, t).map((value) => value / shown.most) : none;
  const bodies = [{ x, triangles: shown.triangles, levels }];
  if (shown.truth) {
    const y = blended(shown.truth.positions, shown.truth.checkpoints, t);
    bodies.push({ x: y, triangles: shown.truth.triangles, levels: new Float32Array(y.length / 3).fill(-1) });
  }
  return bodies;
}

function draw() {
  if (state.given) {
    byId("time").value = byId("time").max * state.t / state.given.duration;
    const words = `${state.t.toFixed(2)} s of ${state.given.duration} s`;
    byId("clock").textContent = words;
    byId("time").setAttribute("aria-valuetext", words);
    state.marks(state.t);
  }
  const shown = state.shown, canvas = byId("canvas");
  if (!shown || !paint) return;
  paint(bodiesAt(shown, steadied(shown)), veilsAt(shown, steadied(shown)), state.camera, shown.centre, shown.radius, plainColour());
  canvas.dataset.shown = state.t.toFixed(3);
}

function goTo(t) {
  state.t = Math.min(state.given.duration, Math.max(0, t));
  draw();
}

function play(on) {
  state.playing = on;
  byId("play").textContent = on ? "Pause" : "Play";
  if (!on) return;
  if (state.t >= state.given.duration) state.t = 0;
  state.last = performance.now();
  requestAnimationFrame(step);
}

function step(now) {
  if (!state.playing) return;
  goTo(state.t + Math.max(0, now - state.last) / 1000 * SPEED * state.given.duration);
  state.last = Math.max(now, state.last);
  if (state.t >= state.given.duration) play(false);
  else requestAnimationFrame(step);
}

/** A round number of millimetres that is not below `metres`, in metres. */
function roundUp(metres) {
  const power = 10 ** Math.floor(Math.log10(1000 * metres)), parts = [1, 2, 3, 4, 5, 6, 8, 10];
  return parts.find((part) => part * power >= 1000 * metres * 0.999) * power / 1000;
}

function scaleColours() {
  const shown = state.shown, own = shown?.errors && Math.max(1e-9, ...shown.errors.map((error) => Math.max(...error)));
  byId("bar").hidden = byId("shared").hidden = !own;
  if (!own) return;
  const all = byId("one-scale").checked ? Math.max(own, shown.largest) : own;
  shown.most = roundUp(all);
  byId("most").textContent = `${+(1000 * shown.most).toPrecision(3)} mm`;
}

function momentsOf(replay) {
  const later = replay.reached.filter((t) => t > 0).length, words = `at ${later} checkpoint${later === 1 ? "" : "s"}`;
  return later < replay.reached.length ? `at the start, ${words}` : words;
}

/** The last moment at which the reference is known and the case still runs: there the difference is. */
function fullLoad(given) {
  const end = given.replay ? given.replay.times[given.replay.times.length - 1] : given.duration;
  const reached = given.reference ? given.reference.t.filter((t) => t < 1.000001 * end) : [];
  return Math.min(given.duration, reached.length ? reached[reached.length - 1] : end);
}

function tellColours(given, truth) {
  const replay = given.replay, said = [];
  if (!replay.reference) said.push("No reference is stored for this scene, so the case stands alone.");
  else if (replay.comparable) said.push(`Colour: distance of each point from the same point of the reference, known ${momentsOf(replay)} and in proportion between them.`);
  else said.push("The body may turn or slip freely in this scene: single points are not comparable, and no error is coloured.");
  if (truth) said.push("The reference is drawn in its own shape; it moves in a straight line from checkpoint to checkpoint.");
  else if (replay.reference) said.push(`The reference cannot be drawn: its file is not in the folder ${DATA.folder} next to this page, or it has too many nodes.`);
  if (replay.straight) said.push(`So does ${given.entry ? "the entry" : "this case"}: of its positions those at checkpoints are stored, no others.`);
  said.push(`${replay.times.length} moments, rounded to ${replay.rounding} of the body's size.`);
  byId("colours").textContent = said.join(" ");
}

async function showReplay(given) {
  state.shown = null;
  delete byId("canvas").dataset.shown;
  byId("replay").hidden = !given.replay || !paint;
  const why = given.replay ? "This browser offers no WebGL2, so the moving body cannot be shown; the histories below do without." : given.why;
  byId("no-replay").textContent = given.replay && paint ? "" : why;
  if (!given.replay || !paint) return;
  const shown = await unpacked(given.replay);
  if (state.given !== given) return; // another case was chosen meanwhile
  tellColours(given, shown.truth);
  state.shown = { ...shown, ...bounds([...shown.positions, ...(shown.truth?.positions ?? [])]) };
  byId("names").replaceChildren(...[given.entry ?? "this case", "reference"].slice(0, shown.truth ? 2 : 1).map((name) => {
    const made = document.createElement("span");
    made.textContent = name;
    return made;
  }));
  byId("names").classList.toggle("only", !shown.truth);
  byId("canvas").setAttribute("aria-label", `${given.title}${shown.truth ? ", left; its reference, right" : ""}`);
  scaleColours();
}

function command(text) {
  const made = document.createElement("code");
  made.textContent = text;
  return made;
}

/** Words of a case, and the commands that make it again. */
function tellAbout(given) {
  const words = [`${given.about} `];
  if (given.entry) words.push("What hands it in: ", command(given.again));
  else words.push("To run it again: ", command(given.run), ", or bit for bit: ", command(given.again));
  byId("about").replaceChildren(...words);
}

/** Shows a case at full load. */
async function choose(id) {
  const head = DATA.cases[id];
  play(false);
  state.id = id;
  byId("chosen").value = id;
  document.querySelectorAll("#cases tr.chosen").forEach((row) => row.classList.remove("chosen"));
  document.querySelectorAll(`#cases a[href="#case=${id}"]`).forEach((link) => {
    const row = link.closest("tr"), frame = row.closest(".scroll");
    row.classList.add("chosen");
    frame.scrollTop = row.offsetTop - (frame.clientHeight - row.offsetHeight) / 2; // between its neighbours
  });
  tellAbout(head);
  const absent = { histories: {}, why: `Histories and replay of this case are in ${DATA.folder}/case-${id}.js next to this page, but that file is missing. Copy the folder along with the page.` };
  const given = { ...head, ...(await piece(`case-${id}`) ?? absent) };
  if (state.id !== id) return; // another case was chosen meanwhile
  Object.assign(state, { given, t: fullLoad(given) });
  state.marks = showHistories(byId("plots"), given);
  await showReplay(given);
  draw();
}
