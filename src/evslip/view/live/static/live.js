// The page of `evslip live`: draws messages as they come.
import {Curves} from "./curves.js";
import {get, place} from "./page.js";
import {Picture, listen} from "./stream.js";

const STRIPS = [
  {name: "slip probability", unit: "", least: 0, most: 1, lines: [["p_slip", "--accent", "detector"]]},
  {name: "delay", unit: "ms", least: 0, most: 10, lines: [["delay_ms", "--accent", "of the answers"]]},
  {name: "events", unit: "million/s", least: 0, most: 0.1, lines: [["rate_mhz", "--accent", "received"]]},
];
const EMPTY = 0xffe8e8e8;

const about = await get("/api/about");
place("title").textContent = about.name;
const curves = new Curves(place("curves"), about.curves, STRIPS);
const picture = new Picture(place("stage"));

listen(({rows}) => curves.add(rows), draw, "The program has ended.");

function draw(head, rest) {
  picture.show(picture.words(head.size).fill(EMPTY), new Uint32Array(rest));
  curves.draw();
  const {counters} = head;
  place("state").textContent = head.over ? "over" : counters.connected === false ? "waiting for the source" : head.slip ? "slip" : "";
  place("state").classList.toggle("slips", head.slip && !head.over);
  place("counters").textContent = counters.line ?? "";
  place("alarms").textContent = counters.alarms ?? 0;
  place("problem").textContent = head.notes.at(-1) ?? "";
}
