// A sample's page.
import {drawCloud} from "./cloud.js";
import {complain, element, get, place} from "./page.js";
import {Player} from "./player.js";

const position = Number(location.pathname.split("/").at(-1));

function facts(rows) {
  for (const [name, value] of rows) {
    const cell = element("td", {}, value);
    place("facts").insertRow().append(element("th", {}, name), cell);
    if (name === "label") cell.classList.add(value);
    if (name === "doubt") cell.classList.add("warn");
  }
}

async function detection(player) {
  const found = await get(`/api/samples/${position}/detection`);
  const at = found.t_us.map(() => found.threshold);
  player.charts.curves.splice(2, 0, {name: "slip", unit: "probability", t_us: found.t_us, lines: {p: found.p_slip, threshold: at}});
  player.charts.draw();
  place("charts").dataset.detection = "yes";
}

async function start() {
  const [about, list] = await Promise.all([get(`/api/samples/${position}`), get("/api/items")]);
  document.title = `${about.name} \u2013 ${list.title}`;
  place("title").textContent = about.name;
  for (const [id, other] of [["previous", position - 1], ["next", position + 1]])
    if (other >= 0 && other < list.items.length) place(id).href = `/sample/${other}`; else place(id).remove();
  facts(about.facts);
  const player = new Player(position, about);
  player.clock.seek(about.onset_us ?? (about.start_us + about.end_us) / 2);
  const follow = (id) => () => { if (place(id)) location.href = place(id).href; };
  Object.assign(player.keys, {p: follow("previous"), n: follow("next")});
  place("make-cloud").addEventListener("click", () =>
    drawCloud(place("cloud"), position, about, player.clock.t).catch(complain));
  if (about.model) await detection(player);
}

start().catch(complain);
