// Curves of the last seconds, each in a strip of its own.
import {color} from "./page.js";

const STRIPS = [
  {name: "slip probability", unit: "", least: 0, most: 1, lines: [["p_slip", "--accent", "detector"]]},
  {name: "rotation", unit: "deg/s", least: 0, most: 20, lines: [["true_deg_s", "--slip", "true"], ["found_deg_s", "--accent", "detector"]]},
  {name: "slide", unit: "mm/s", least: 0, most: 10, lines: [["true_mm_s", "--slip", "true"], ["found_mm_s", "--accent", "detector"]]},
  {name: "grip force", unit: "N", least: 0, most: 4, lines: [["force_n", "--accent", "of the fingers"], ["least_n", "--slip", "least that holds"]]},
  {name: "angle in the hand", unit: "deg", least: 0, most: 5, lines: [["theta_deg", "--slip", "true"]]},
];
const HEIGHT = 74, GAP = 18, LEFT = 130, RIGHT = 10, SECONDS = 10;

export class Curves {
  constructor(canvas, names, strips = STRIPS) {
    Object.assign(this, {canvas, names, strips, rows: []});
    this.context = canvas.getContext("2d");
    this.column = Object.fromEntries(names.map((name, k) => [name, k]));
    new ResizeObserver(() => this.draw()).observe(canvas.parentElement);
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => this.draw());
  }

  add(rows) {
    // Time begins anew with every episode.
    if (rows.length && this.rows.length && rows[0][0] < this.rows.at(-1)[0]) this.rows = [];
    this.rows.push(...rows);
    const first = this.rows.findIndex((row) => row[0] > this.rows.at(-1)[0] - SECONDS);
    this.rows.splice(0, Math.max(first, 0));
  }

  clear() {
    this.rows = [];
  }

  draw() {
    const ratio = devicePixelRatio, width = this.canvas.clientWidth, {context} = this;
    if (!width) return;
    const height = this.strips.length * (HEIGHT + GAP) + GAP;
    this.canvas.style.height = `${height}px`;
    const size = [Math.round(width * ratio), Math.round(height * ratio)];
    if (this.canvas.width !== size[0] || this.canvas.height !== size[1]) [this.canvas.width, this.canvas.height] = size;
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    context.clearRect(0, 0, width, height);
    context.font = "12px system-ui, sans-serif";
    const end = Math.max(this.rows.at(-1)?.[0] ?? 0, SECONDS);
    const x = (t) => LEFT + (t - end + SECONDS) / SECONDS * (width - LEFT - RIGHT);
    this.strips.forEach((strip, k) => this.strip(strip, GAP + k * (HEIGHT + GAP), x, width));
  }

  strip({name, unit, least, most, lines}, top, x, width) {
    const {context, rows, column} = this;
    for (const [key] of lines) for (const row of rows) most = Math.max(most, row[column[key]] ?? 0);
    const y = (value) => top + HEIGHT - (value - least) / (most - least) * HEIGHT;
    context.fillStyle = color("--raised");
    context.fillRect(LEFT, top, width - LEFT - RIGHT, HEIGHT);
    context.fillStyle = color("--text");
    context.textAlign = "right";
    context.fillText(name, LEFT - 8, top + HEIGHT / 2);
    context.fillStyle = color("--quiet");
    context.fillText(unit, LEFT - 8, top + HEIGHT / 2 + 14);
    context.fillText(short(most), LEFT - 8, top + 10);
    context.fillText(short(least), LEFT - 8, top + HEIGHT);
    context.textAlign = "left";
    let at = LEFT + 6;
    for (const [key, shade, label] of lines) {
      if (rows.at(-1)?.[column[key]] == null) continue;  // a detector that estimates none
      context.strokeStyle = context.fillStyle = color(shade);
      context.lineWidth = 1.6;
      context.beginPath();
      for (const row of rows) context.lineTo(x(row[0]), y(row[column[key]]));
      context.stroke();
      context.fillText(label, at, top - 4);
      at += context.measureText(label).width + 14;
    }
  }
}

const short = (value) => Math.abs(value) >= 100 ? Math.round(value).toString() : (+value.toPrecision(2)).toString();
