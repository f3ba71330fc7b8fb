// The page of `evslip play`: draws messages as they come, and sends back what is pulled, pushed and moved.
import {Curves} from "./curves.js";
import {element, get, place} from "./page.js";
import {Picture, listen} from "./stream.js";

const KEY_PX = 60, SETTLE_MS = 500;
const WAYS = {ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1]};

const about = await get("/api/about");
const curves = new Curves(place("curves"), about.curves);
const stage = place("stage"), picture = new Picture(stage);
let paused = false, title = "";

const take = (head) => {
  if (head.title !== title) begin(head.title);
  curves.add(head.rows);
  pace(head);
};
const socket = listen(take, draw, "The program has ended. Start evslip play again, and load this page anew.");
const send = (command) => { if (socket.readyState === 1) socket.send(JSON.stringify(command)); };

// Another object: neither the last one's curves nor its settings are to be seen.
function begin(name) {
  title = name;
  curves.clear();
  moved.clear();
}

function draw(head, rest) {
  const words = picture.words(head.size), grey = new Uint8Array(rest, 0, words.length);
  // Paler than it is, so that events stand out.
  for (let k = 0; k < grey.length; k++) {
    const level = 60 + 0.72 * grey[k] | 0;
    words[k] = 0xff000000 | level << 16 | level << 8 | level;
  }
  picture.show(words, new Uint32Array(rest.slice(words.length)));
  curves.draw();
  place("title").textContent = head.title;
  place("state").textContent = head.lost ? "lost" : head.alarm ? "slip" : "";
  place("state").classList.toggle("slips", head.lost || head.alarm);
  // Another page may have paused the program, or this one, before it was loaded anew.
  paused = head.paused;
  place("pause").textContent = paused ? "go on" : "pause";
  show(head.settings);
}

// How fast simulated time goes.
const times = [];
function pace({rows, paused}) {
  if (paused) {
    times.length = 0;
    place("pace").textContent = "paused";
  }
  if (paused || !rows.length) return;
  times.push([performance.now() / 1e3, rows.at(-1)[0]]);
  if (times.length > 1 && times.at(-1)[1] < times.at(-2)[1]) times.splice(0, times.length - 1);
  if (times.length > 50) times.shift();
  if (times.length < 10) return;
  const share = (times.at(-1)[1] - times[0][1]) / (times.at(-1)[0] - times[0][0]);
  place("pace").textContent = `${share.toFixed(2)} x real time`;
}

// Settings: each as the program says it is, unless it is being moved. What comes just after tells of the time before.
const inputs = {}, moved = new Map();  // moved: times in ms until which an input shows what it was moved to
const settle = (name) => moved.set(name, performance.now() + SETTLE_MS);
for (const [name, {label, unit, names, least, most, step}] of Object.entries(about.settings)) {
  const id = `set-${name}`, output = element("output");
  const input = names ? element("select", {id}, ...names.map((one) => new Option(one)))
    : element("input", {id, type: "range", min: least, max: most, step});
  const value = () => names ? input.value : Number(input.value);
  input.addEventListener("input", () => {
    send({set: {[name]: value()}});
    output.value = names ? "" : `${input.value} ${unit}`;
    if (moved.get(name) !== Infinity) settle(name);
    if (name === "controller") enable();
  });
  // The list of a select takes the pointer away, and its release is never told.
  if (!names) input.addEventListener("pointerdown", () => moved.set(name, Infinity));
  place("settings").append(element("label", {}, element("span", {}, label), output, input));
  inputs[name] = {input, output, unit, names};
}
for (const name of ["pointerup", "pointercancel"]) addEventListener(name, () => {
  for (const [input, until] of moved) if (until === Infinity) settle(input);
});
const enable = () => { inputs.force_n.input.disabled = inputs.controller.input.value !== "off"; };
function show(settings) {
  for (const [name, {input, output, unit, names}] of Object.entries(inputs)) {
    if (moved.get(name) > performance.now() && !input.disabled) continue;
    if (input.value !== String(settings[name])) input.value = settings[name];  // an open list keeps what is marked in it
    output.value = names ? "" : `${+settings[name].toFixed(2)} ${unit}`;
  }
  enable();
}

// Pulling: from where the pointer went down to where it is, in pixels of the picture.
let from = null;
const pull = (x, y) => send({pull: [x, y]});
function arrow(event) {
  const line = place("shaft");
  line.style.visibility = event ? "visible" : "hidden";
  if (!event) return;
  for (const [name, value] of [["x1", from[0]], ["y1", from[1]], ["x2", event.offsetX], ["y2", event.offsetY]]) line.setAttribute(name, value);
}
stage.addEventListener("pointerdown", (event) => {
  stage.setPointerCapture(event.pointerId);
  from = [event.offsetX, event.offsetY];
});
stage.addEventListener("pointermove", (event) => {
  if (!from) return;
  const scale = stage.width / stage.clientWidth;
  pull(scale * (event.offsetX - from[0]), scale * (event.offsetY - from[1]));
  arrow(event);
});
for (const name of ["pointerup", "pointercancel"]) stage.addEventListener(name, () => {
  from = null;
  pull(0, 0);
  arrow(null);
});
const held = new Set();
function keys(event) {
  if (!WAYS[event.key]) return;
  event.preventDefault();
  if (event.type === "keydown") held.add(event.key); else held.delete(event.key);
  const sum = [...held].reduce(([x, y], key) => [x + WAYS[key][0], y + WAYS[key][1]], [0, 0]);
  if (!event.repeat) pull(KEY_PX * sum[0], KEY_PX * sum[1]);
}
stage.addEventListener("keydown", keys);
stage.addEventListener("keyup", keys);
stage.addEventListener("blur", () => { held.clear(); pull(0, 0); });

for (const button of document.querySelectorAll("[data-press]"))
  button.addEventListener("click", () => send({press: button.dataset.press}));
place("pause").addEventListener("click", () => send({pause: !paused}));
