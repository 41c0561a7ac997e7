// What keys, pointer and buttons do to the replay; and the first picture.

function turnBy(yaw, pitch, zoom) {
  const camera = state.camera;
  camera.yaw += yaw;
  camera.pitch = Math.min(1.5, Math.max(-1.5, camera.pitch + pitch));
  camera.zoom = Math.min(6, Math.max(0.5, camera.zoom * zoom));
  draw();
}

function home() {
  state.camera = { ...FRONT };
  draw();
}

const KEYS = {
  ArrowLeft: () => turnBy(0.1, 0, 1), ArrowRight: () => turnBy(-0.1, 0, 1),
  ArrowUp: () => turnBy(0, -0.1, 1), ArrowDown: () => turnBy(0, 0.1, 1),
  "+": () => turnBy(0, 0, 1.15), "-": () => turnBy(0, 0, 1 / 1.15), Home: home, " ": () => play(!state.playing),
};

function listen() {
  const canvas = byId("canvas");
  canvas.addEventListener("keydown", (event) => {
    if (!KEYS[event.key] || event.ctrlKey || event.metaKey || event.altKey) return;
    event.preventDefault();
    KEYS[event.key]();
  });
  canvas.addEventListener("pointerdown", (event) => canvas.setPointerCapture(event.pointerId));
  canvas.addEventListener("pointermove", (event) => {
    if (event.buttons & 1) turnBy(-0.008 * event.movementX, 0.008 * event.movementY, 1);
  });
  byId("play").addEventListener("click", () => play(!state.playing));
  byId("home").addEventListener("click", home);
  byId("time").addEventListener("input", (event) => { play(false); goTo(event.target.value / event.target.max * state.given.duration); });
  byId("one-scale").addEventListener("change", () => { scaleColours(); draw(); });
  byId("chosen").addEventListener("change", (event) => { location.hash = `case=${event.target.value}`; });
  document.addEventListener("theme", draw);
  new ResizeObserver(draw).observe(canvas);
}

/** The list of cases, scene by scene. */
function listCases() {
  const groups = {};
  for (const [id, given] of Object.entries(DATA.cases)) {
    groups[given.scene] ??= Object.assign(document.createElement("optgroup"), { label: given.scene.replaceAll("_", " ") });
    groups[given.scene].append(new Option(given.replayed ? given.title : `${given.title} (no replay)`, id));
  }
  byId("chosen").append(...Object.values(groups));
}

function begin() {
  listCases();
  paint = painter(byId("canvas"));
  byId("ramp").style.background = `linear-gradient(90deg, ${RAMP.join(", ")})`;
  byId("viewer").hidden = false;
  listen();
}
