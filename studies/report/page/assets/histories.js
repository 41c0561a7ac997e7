// Histories of one case as small charts: the case as a line, the reference as dots, the moment of the replay dashed.

const SVG = "http://www.w3.org/2000/svg";
const WIDE = 340, HIGH = 190, LEFT = 58, RIGHT = 8, TOP = 10, BOTTOM = 36;

function element(name, attributes, parent, text) {
  const made = document.createElementNS(SVG, name);
  for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
  if (text !== undefined) made.textContent = text;
  parent?.append(made);
  return made;
}

/** Round numbers that span [low, high], about `count` of them. */
function ticks(low, high, count) {
  const rough = (high - low) / count, power = 10 ** Math.floor(Math.log10(rough));
  const step = power * [1, 2, 5, 10].find((factor) => factor * power >= rough);
  const first = Math.ceil(low / step - 1e-9), last = Math.floor(high / step + 1e-9);
  return Array.from({ length: last - first + 1 }, (_, k) => (first + k) * step);
}

function label(value, size) {
  if (Math.abs(value) < 1e-9 * size) return "0";
  const text = size >= 1e5 || size < 1e-3 ? value.toExponential(1) : String(+value.toPrecision(3));
  return text.replace("-", "−");
}

function span(values) {
  const known = values.filter((value) => value !== null && Number.isFinite(value));
  const low = Math.min(0, ...known), high = Math.max(0, ...known);
  return high > low ? [low - 0.04 * (high - low) * (low < 0), high + 0.04 * (high - low)] : [low - 1, high + 1];
}

function axes(svg, [low, high], end, scaleX, scaleY) {
  element("path", { class: "axis", d: `M${LEFT} ${TOP}V${HIGH - BOTTOM}H${WIDE - RIGHT}` }, svg);
  const size = Math.max(-low, high);
  for (const value of ticks(low, high, 4)) {
    element("path", { class: "axis", d: `M${LEFT} ${scaleY(value)}H${WIDE - RIGHT}` }, svg);
    element("text", { x: LEFT - 5, y: scaleY(value) + 4, "text-anchor": "end" }, svg, label(value, size));
  }
  for (const value of ticks(0, end, 4)) {
    element("text", { x: scaleX(value), y: HIGH - BOTTOM + 15, "text-anchor": "middle" }, svg, label(value, end));
  }
  element("text", { x: (LEFT + WIDE - RIGHT) / 2, y: HIGH - 4, "text-anchor": "middle" }, svg, "time [s]");
}

/** One chart; gives what moves its mark of the moment. */
function history(parent, title, line, dots, end) {
  const figure = document.createElement("figure"), caption = document.createElement("figcaption");
  caption.textContent = title;
  figure.append(caption);
  parent.append(figure);
  const known = line.values.filter((value) => value !== null);
  const said = known.length ? `from ${label(known[0], 1)} to ${label(known[known.length - 1], 1)}` : "nothing known";
  const svg = element("svg", { viewBox: `0 0 ${WIDE} ${HIGH}`, role: "img", "aria-label": `${title}: ${said}` }, figure);
  const range = span([...line.values, ...(dots?.values ?? [])]);
  const scaleX = (t) => LEFT + (WIDE - LEFT - RIGHT) * t / end;
  const scaleY = (v) => TOP + (HIGH - TOP - BOTTOM) * (range[1] - v) / (range[1] - range[0]);
  axes(svg, range, end, scaleX, scaleY);
  let path = "", pen = "M";
  line.t.forEach((t, i) => {
    if (line.values[i] === null) pen = "M";
    else { path += `${pen}${scaleX(t).toFixed(1)} ${scaleY(line.values[i]).toFixed(1)}`; pen = "L"; }
  });
  element("path", { class: "case", d: path }, svg);
  dots?.values.forEach((value, i) => {
    if (value !== null) element("circle", { class: "truth", cx: scaleX(dots.t[i]), cy: scaleY(value), r: 4 }, svg);
  });
  const now = element("path", { class: "now", d: `M0 ${TOP}V${HIGH - BOTTOM}` }, svg);
  return (t) => now.setAttribute("transform", `translate(${scaleX(t)})`);
}

const TITLES = { volume: "Volume V/V₀ − 1 [%]", force: "Probed force [N]", frame: "Computing time of a frame [ms]" };

/** All histories of a case; gives what moves their marks to a time. */
function showHistories(parent, given) {
  parent.replaceChildren();
  const marks = [];
  for (const [name, title] of Object.entries(TITLES)) {
    if (!given.histories[name]) continue;
    const line = { t: series(given.histories[name].t), values: series(given.histories[name].values) };
    const truth = given.reference?.[name];
    const dots = truth && { t: given.reference.t, values: truth };
    marks.push(history(parent, title + (dots ? "; dots: reference" : ""), line, dots, given.duration));
  }
  return (t) => marks.forEach((mark) => mark(t));
}
