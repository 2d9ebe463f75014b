"use strict";
// Shared by the other scripts: page data, arrays, elements, number formats; sortable tables.

const page = JSON.parse(document.getElementById("page-data").textContent);
const TYPES = { f4: Float32Array, u1: Uint8Array, u2: Uint16Array, u4: Uint32Array, i2: Int16Array };
const decoded = new Map();

/** Return an array of the page by its number. */
function array(number) {
  if (!decoded.has(number)) decoded.set(number, inflated(page.arrays[number]));
  return decoded.get(number);
}

async function inflated({ type, data }) {
  const packed = Uint8Array.from(atob(data), (letter) => letter.charCodeAt(0));
  const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("deflate"));
  return new TYPES[type](await new Response(stream).arrayBuffer());
}

/** Create an element with properties and children; text is never parsed as markup. */
function element(tag, properties = {}, ...children) {
  const made = document.createElement(tag);
  for (const [key, value] of Object.entries(properties)) {
    if (key in made) made[key] = value;
    else made.setAttribute(key, value);
  }
  made.append(...children);
  return made;
}

/** Return a number with four significant digits. */
function shortNumber(value) {
  if (value === null || value === undefined || Number.isNaN(value)) return "–";
  const size = Math.abs(value);
  if (size >= 1e5 || (size > 0 && size < 1e-3)) return value.toExponential(2).replace(/\.?0*e\+?/, "e");
  return String(Number(value.toPrecision(4)));
}

/** Return the colour `[r, g, b]`, 0 to 255, at a position 0 to 1 of a colour scale. */
function colourAt(share, scale) {
  const stops = page.scales[scale];
  const place = Math.min(Math.max(share, 0), 1) * (stops.length - 1);
  const index = Math.min(Math.floor(place), stops.length - 2);
  const [low, high] = [stops[index], stops[index + 1]].map(channels);
  return low.map((one, k) => one + (place - index) * (high[k] - one));
}

function channels(colour) {
  return [1, 3, 5].map((first) => parseInt(colour.slice(first, first + 2), 16));
}

function sortable(table) {
  const body = table.tBodies[0];
  [...table.tHead.rows[0].cells].forEach((head, column) => {
    const button = element("button", { type: "button", className: "sort", title: "sort" }, ...head.childNodes);
    head.replaceChildren(button);
    button.addEventListener("click", () => {
      const direction = head.getAttribute("aria-sort") === "descending" ? 1 : -1;
      [...table.tHead.rows[0].cells].forEach((other) => other.removeAttribute("aria-sort"));
      head.setAttribute("aria-sort", direction === 1 ? "ascending" : "descending");
      const rows = [...body.rows].map((row) => [sortKey(row.cells[column].textContent), row]);
      rows.sort(([a], [b]) => direction * compared(a, b));
      body.append(...rows.map(([, row]) => row));
    });
  });
}

function sortKey(text) {
  const number = parseFloat(text.replace(/ /g, "").replace("–", ""));
  return Number.isNaN(number) ? text.trim() : number;
}

function compared(a, b) {
  if (typeof a === "number" && typeof b === "number") return a - b;
  if (typeof a === "number" || typeof b === "number") return typeof a === "number" ? 1 : -1;
  return a.localeCompare(b, undefined, { numeric: true });
}

document.querySelectorAll("table.sortable").forEach(sortable);

// Open folded sections while printing.
let unfolded = [];
addEventListener("beforeprint", () => {
  unfolded = [...document.querySelectorAll("details:not([open])")];
  unfolded.forEach((one) => (one.open = true));
});
addEventListener("afterprint", () => unfolded.forEach((one) => (one.open = false)));
