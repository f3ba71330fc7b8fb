// The page of `evslip live`: draws messages as they come.
import {Curves} from "/static/curves.js";

const STRIPS = [
  {name: "slip probability", unit: "", least: 0, most: 1, lines: [["p_slip", "--accent", "detector"]]},
  {name: "delay", unit: "ms", least: 0, most: 10, lines: [["delay_ms", "--accent", "of the answers"]]},
  {name: "events", unit: "million/s", least: 0, most: 0.1, lines: [["rate_mhz", "--accent", "received"]]},
];
const place = (id) => document.getElementById(id);
const ON = 0xff3539e5, OFF = 0xffff6229, EMPTY = 0xffe8e8e8;

const about = await (await fetch("/api/about")).json();
place("title").textContent = about.name;
const curves = new Curves(place("curves"), about.curves, STRIPS);
const stage = place("stage"), context = stage.getContext("2d");
let image = null, words = null, newest = null, over = false;

const socket = new WebSocket(`ws://${location.host}/api/stream`);
socket.binaryType = "arraybuffer";
socket.addEventListener("close", () => { place("problem").textContent = "The program has ended."; });
socket.addEventListener("message", ({data}) => {
  const length = new DataView(data).getUint32(0, true);
  const head = JSON.parse(new TextDecoder().decode(new Uint8Array(data, 4, length)));
  if (head.rows.length) curves.add(head.rows);
  if (newest === null) requestAnimationFrame(draw);
  newest = {head, events: new Uint32Array(data.slice(4 + length))};
});

function draw() {
  const {head, events} = newest;
  newest = null;
  const [width, height] = head.size;
  if (stage.width !== width || stage.height !== height || !image) {
    [stage.width, stage.height] = [width, height];
    image = context.createImageData(width, height);
    words = new Uint32Array(image.data.buffer);
  }
  words.fill(EMPTY);
  for (const event of events) words[(event >> 12 & 0xfff) * width + (event & 0xfff)] = event >> 24 & 1 ? ON : OFF;
  context.putImageData(image, 0, 0);
  curves.draw();
  const {counters} = head;
  place("state").textContent = head.over ? "over" : counters.connected === false ? "waiting for the source" : head.slip ? "slip" : "";
  place("state").classList.toggle("slips", head.slip && !head.over);
  place("counters").textContent = counters.line ?? "";
  place("alarms").textContent = counters.alarms ?? 0;
  place("problem").textContent = head.notes.at(-1) ?? "";
}
