// Small helpers: elements, numbers, scales. Everything below is one script without any library.

const SVG = "http://www.w3.org/2000/svg";

/** An element with attributes; names that begin with "on" are listeners, children are nodes or text. */
function make(tag, attributes = {}, ...children) {
  const [name, space] = tag.startsWith("svg:") ? [tag.slice(4), SVG] : [tag, null];
  const element = space ? document.createElementNS(space, name) : document.createElement(name);
  for (const [key, value] of Object.entries(attributes)) {
    if (value === null || value === undefined || value === false) continue;
    if (key.startsWith("on")) element.addEventListener(key.slice(2), value);
    else if (key.startsWith("--")) element.style.setProperty(key, value);
    else element.setAttribute(key, value === true ? "" : value);
  }
  element.append(...children.flat().filter((child) => child !== null && child !== undefined && child !== ""));
  return element;
}

/** Text in which `names` between backticks are set as code. */
function rich(text) {
  return text.split("`").map((part, place) => (place % 2 ? make("code", {}, part) : part));
}

/** A number with so many significant digits, a true minus sign, and no needless zeros. */
function number(value, digits = 3) {
  if (value === null || value === undefined || Number.isNaN(value)) return "–";
  const size = Math.abs(value);
  const text = size >= 1e5 || (size > 0 && size < 1e-3) ? value.toExponential(1) : String(Number(value.toPrecision(digits)));
  return text.replace("-", "−");
}

function interval(found, digits = 3) {
  return found.low === null ? "" : `${number(found.low, digits)} to ${number(found.high, digits)}`;
}

/** Words from a name in code: velocity_error_all -> velocity error all. */
function words(name) {
  return name.replaceAll("_", " ");
}

/** Round values between two ends, about so many. */
function ticks(low, high, count = 5) {
  const span = high - low || Math.abs(high) || 1;
  const power = 10 ** Math.floor(Math.log10(span / count));
  const step = [1, 2, 5, 10].map((each) => each * power).find((each) => span / each <= count) ?? 10 * power;
  const first = Math.ceil(low / step - 1e-9);
  return Array.from({ length: Math.floor(high / step + 1e-9) - first + 1 }, (_, k) => (first + k) * step);
}

function clamp(value, low, high) {
  return Math.min(Math.max(value, low), high);
}

/** The value of a custom property of the page, such as a colour. */
function ink(name) {
  return getComputedStyle(document.documentElement).getPropertyValue(name).trim();
}

// Six kinds of line that differ in lightness and in pattern, so that they can be told apart without their hue.
const LINES = [
  { color: "--line-1", dash: [] },
  { color: "--line-2", dash: [7, 3] },
  { color: "--line-3", dash: [2, 3] },
  { color: "--line-4", dash: [10, 3, 2, 3] },
  { color: "--line-5", dash: [4, 4] },
  { color: "--line-6", dash: [1, 2] },
];
