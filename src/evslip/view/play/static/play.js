// The page of `evslip play`: draws messages as they come, and sends back what is pulled, pushed and moved.
import {Curves} from "/static/curves.js";

const place = (id) => document.getElementById(id);
const ON = 0xff3539e5, OFF = 0xffff6229, KEY_PX = 60;
const WAYS = {ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1]};

const about = await (await fetch("/api/about")).json();
const curves = new Curves(place("curves"), about.curves);
const stage = place("stage"), context = stage.getContext("2d", {willReadFrequently: true});
let image = null, words = null, newest = null, paused = false;

const socket = new WebSocket(`ws://${location.host}/api/stream`);
socket.binaryType = "arraybuffer";
const send = (command) => { if (socket.readyState === 1) socket.send(JSON.stringify(command)); };
const complain = (text) => { place("problem").textContent = text; };
socket.addEventListener("close", () => complain("The program has ended. Start evslip play again, and load this page anew."));
socket.addEventListener("message", ({data}) => {
  if (typeof data === "string") return complain(data);
  const length = new DataView(data).getUint32(0, true);
  const head = JSON.parse(new TextDecoder().decode(new Uint8Array(data, 4, length)));
  const pixels = head.size[0] * head.size[1];
  const grey = new Uint8Array(data, 4 + length, pixels);
  const events = new Uint32Array(data.slice(4 + length + pixels));
  curves.add(head.rows);
  pace(head.rows);
  if (newest === null) requestAnimationFrame(draw);
  newest = {head, grey, events};
});

function draw() {
  const {head, grey, events} = newest;
  newest = null;
  const [width, height] = head.size;
  if (stage.width !== width || stage.height !== height || !image) {
    [stage.width, stage.height] = [width, height];
    image = context.createImageData(width, height);
    words = new Uint32Array(image.data.buffer);
  }
  // Paler than it is, so that events stand out.
  for (let k = 0; k < grey.length; k++) {
    const level = 60 + 0.72 * grey[k] | 0;
    words[k] = 0xff000000 | level << 16 | level << 8 | level;
  }
  for (const event of events) words[(event >> 12 & 0xfff) * width + (event & 0xfff)] = event >> 24 & 1 ? ON : OFF;
  context.putImageData(image, 0, 0);
  curves.draw();
  place("title").textContent = head.title;
  place("state").textContent = head.lost ? "lost" : head.alarm ? "slip" : "";
  place("state").classList.toggle("slips", head.lost || head.alarm);
  show(head.settings);
}

// How fast simulated time goes.
const times = [];
function pace(rows) {
  times.push([performance.now() / 1e3, rows.at(-1)[0]]);
  if (times.length > 1 && times.at(-1)[1] < times.at(-2)[1]) times.splice(0, times.length - 1);
  if (times.length > 50) times.shift();
  if (times.length < 10) return;
  const share = (times.at(-1)[1] - times[0][1]) / (times.at(-1)[0] - times[0][0]);
  place("pace").textContent = `${share.toFixed(2)} x real time`;
}

// Settings: each as the program says it is, unless it is being moved.
const inputs = {};
for (const [name, {label, unit, names, least, most, step}] of Object.entries(about.settings)) {
  const holder = document.createElement("label"), text = document.createElement("span"), output = document.createElement("output");
  const input = document.createElement(names ? "select" : "input");
  text.textContent = label;
  if (names) for (const one of names) input.add(new Option(one));
  else Object.assign(input, {type: "range", min: least, max: most, step});
  input.id = `set-${name}`;
  const value = () => names ? input.value : Number(input.value);
  input.addEventListener("input", () => {
    send({set: {[name]: value()}});
    output.value = names ? "" : `${input.value} ${unit}`;
    if (name === "controller") enable();
  });
  holder.append(text, output, input);
  place("settings").append(holder);
  inputs[name] = {input, output, unit, names};
}
const enable = () => { inputs.force_n.input.disabled = inputs.controller.input.value !== "off"; };
function show(settings) {
  for (const [name, {input, output, unit, names}] of Object.entries(inputs)) {
    if (document.activeElement === input && !input.disabled) continue;
    input.value = settings[name];
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
place("pause").addEventListener("click", () => {
  paused = !paused;
  send({pause: paused});
  place("pause").textContent = paused ? "go on" : "pause";
});
