// The list of samples: filtered, sorted, and completed in the background by what the files say.
import {complain, element, get, place} from "./page.js";

const number = (digits) => (value) => value == null ? "" : value.toLocaleString("en", {maximumFractionDigits: digits});
const grams = (kg) => kg == null ? "" : number(1)(1000 * kg);
const COLUMNS = [
  {key: "name", title: "sample", text: true},
  {key: "label", title: "label", text: true},
  {key: "doubt", title: "doubts", text: true},
  {key: "split", title: "split", text: true},
  {key: "mass_kg", title: "mass, g", show: grams},
  {key: "onset_mass_kg", title: "slips from, g", show: grams},
  {key: "onset_s", title: "onset, s", show: number(3)},
  {key: "turned_deg", title: "turned, deg", show: number(3)},
  {key: "slid_mm", title: "slid, mm", show: number(3)},
  {key: "events", title: "events", show: number(0)},
  {key: "motion", title: "motion", text: true},
  {key: "shape", title: "shape", text: true},
  {key: "texture", title: "texture", text: true},
];
let items = [];
let order = {key: "position", down: false};

function shown() {
  const words = place("filter").value.toLowerCase().split(/\s+/).filter(Boolean);
  const [split, label, doubtful] = [place("split").value, place("label").value, place("doubtful").checked];
  const found = items.filter((item) => (!split || item.split === split) && (!label || item.label === label)
    && (!doubtful || item.doubt)
    && words.every((word) => `${item.name} ${item.motion} ${item.shape} ${item.texture}`.toLowerCase().includes(word)));
  const sign = order.down ? -1 : 1;
  const missing = (value) => value == null || value === "";
  return found.sort((a, b) => {
    const [x, y] = [a[order.key], b[order.key]];
    if (missing(x) || missing(y)) return missing(x) - missing(y) || a.position - b.position;
    return sign * (typeof x === "string" ? x.localeCompare(y) : x - y) || a.position - b.position;
  });
}

function row(item) {
  return element("tr", {}, ...COLUMNS.map(({key, text, show}) => {
    const value = item[key];
    const shown = key === "name" ? element("a", {href: `/sample/${item.position}`}, value) : show ? show(value) : value ?? "";
    const cell = element("td", {className: text ? "text" : ""}, shown);
    if (key === "label" && value) cell.classList.add(value);
    if (key === "doubt" && value) cell.classList.add("warn");
    return cell;
  }));
}

function draw() {
  const found = shown();
  place("rows").replaceChildren(...found.map(row));
  place("count").textContent = `${found.length.toLocaleString("en")} of ${items.length.toLocaleString("en")} samples`;
  const doubts = items.filter((item) => item.doubt).length;
  place("doubts").textContent = doubts ? ` (${doubts.toLocaleString("en")})` : "";
}

function heads() {
  place("head").replaceChildren(...COLUMNS.map((column) => {
    const sorted = order.key === column.key;
    const button = element("button", {}, column.title + (sorted ? (order.down ? " \u25be" : " \u25b4") : ""));
    button.addEventListener("click", () => {
      order = {key: column.key, down: sorted ? !order.down : !column.text};
      heads();
      draw();
    });
    const head = element("th", {className: column.text ? "text" : ""}, button);
    if (sorted) head.setAttribute("aria-sort", order.down ? "descending" : "ascending");
    return head;
  }));
}

async function start() {
  const list = await get("/api/items");
  place("title").textContent = document.title = list.title;
  items = list.items.map(([name, split, label, events], position) => ({position, name, split, label, events}));
  for (const split of new Set(items.map((item) => item.split))) place("split").add(new Option(split));
  heads();
  draw();
  for (let first = 0; first < items.length;) {
    const facts = await get(`/api/facts?first=${first}`);
    for (const fact of facts) Object.assign(items[fact.position], fact);
    if (!facts.length) break;
    first = facts.at(-1).position + 1;
    draw();
  }
  document.body.dataset.complete = "yes";
}

for (const id of ["filter", "split", "label", "doubtful"]) place(id).addEventListener("input", draw);
start().catch(complain);
