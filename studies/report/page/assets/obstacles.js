// Obstacles as veils: planes as discs beside the body, spheres and capsules whole. Each moves as the scene says.

const ROUND = 32, DISC = 0.9, BEHIND = 0.01; // corners of a circle; of the radius of the body: that of a disc, its gap

/** A disc of radius 1 about the origin, across the unit vector n: positions and triangles. */
function disc(n) {
  const [u, v] = across(n), x = [0, 0, 0], triangles = [];
  for (let k = 0; k < ROUND; k++) {
    const [c, s] = [Math.cos(2 * Math.PI * k / ROUND), Math.sin(2 * Math.PI * k / ROUND)];
    for (let j = 0; j < 3; j++) x.push(c * u[j] + s * v[j]);
    triangles.push(0, 1 + k, 1 + (k + 1) % ROUND);
  }
  return { x, triangles };
}

/** A capsule from the origin to `span`; without length a ball. */
function capsule(radius, span) {
  const length = Math.hypot(...span), n = length ? span.map((value) => value / length) : [0, 0, 1];
  const [u, v] = across(n), rows = ROUND / 2, x = [], triangles = [];
  for (let i = 0; i <= rows; i++) {
    const angle = Math.PI * i / rows, end = i > rows / 2 ? 1 : 0;
    for (let k = 0; k < ROUND; k++) {
      const [c, s] = [Math.cos(2 * Math.PI * k / ROUND), Math.sin(2 * Math.PI * k / ROUND)];
      for (let j = 0; j < 3; j++) {
        x.push(radius * (Math.sin(angle) * (c * u[j] + s * v[j]) - Math.cos(angle) * n[j]) + end * span[j]);
      }
      if (i === rows) continue;
      const [a, b] = [i * ROUND + k, i * ROUND + (k + 1) % ROUND];
      triangles.push(a, b, a + ROUND, b, b + ROUND, a + ROUND);
    }
  }
  return { x, triangles };
}

/** Two unit vectors across the unit vector n, so that u × v = n. */
function across(n) {
  const other = Math.abs(n[0]) < 0.7 ? [1, 0, 0] : [0, 1, 0], u = cross(other, n), size = Math.hypot(...u);
  const unit = u.map((value) => value / size);
  return [unit, cross(n, unit)];
}

function cross(a, b) {
  return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
}

/** The shapes of a replay's obstacles, at rest at the origin. */
function shapes(given) {
  return given.obstacles.map((one) => (one.normal ? disc(one.normal) : capsule(one.radius, one.span)));
}

/** Where an obstacle is at time t; of a plane the point that is nearest to the middle of the body, a little behind so
 *  that what touches it stays in front. */
function placeOf(one, shown, t) {
  const at = blended(one.at, shown.times, t);
  if (!one.normal) return at;
  const gap = one.normal.reduce((sum, n, j) => sum + n * (shown.centre[j] - at[j]), BEHIND * shown.radius);
  return shown.centre.map((value, j) => value - gap * one.normal[j]);
}

/** The obstacles at time t as bodies to paint. */
function veilsAt(shown, t) {
  return shown.obstacles.map((one, number) => {
    const shape = shown.shapes[number], place = placeOf(one, shown, t), size = one.normal ? DISC * shown.radius : 1;
    const x = Float32Array.from(shape.x, (value, i) => place[i % 3] + size * value);
    return { x, triangles: Uint16Array.from(shape.triangles), levels: new Float32Array(x.length / 3).fill(-1) };
  });
}
