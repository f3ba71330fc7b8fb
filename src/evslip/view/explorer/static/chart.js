// Small plots over one time axis, with phases behind them and the playhead in front.
import {color} from "./page.js";

// Events have the colours that they have in the picture.
const OWN = {ON: "--on", OFF: "--off"}, LINES = ["--accent", "--slip"];
const HEIGHT = 74, LEFT = 66, RIGHT = 10, GAP = 15, FOOT = 20;

export class Charts {
  constructor(canvas, about, clock) {
    Object.assign(this, {canvas, about, clock, curves: about.curves, spans: []});
    this.context = canvas.getContext("2d");
    // An element of its own, so that moving it draws no curve again.
    this.playhead = canvas.nextElementSibling;
    let down = false;
    const seek = (event) => clock.seek(this.time(event.offsetX));
    canvas.addEventListener("pointerdown", (event) => { down = true; canvas.setPointerCapture(event.pointerId); seek(event); });
    canvas.addEventListener("pointermove", (event) => { if (down) seek(event); });
    for (const name of ["pointerup", "pointercancel"]) canvas.addEventListener(name, () => { down = false; });
    new ResizeObserver(() => this.draw()).observe(canvas.parentElement);
  }

  time(x) {
    const width = this.canvas.clientWidth - LEFT - RIGHT;
    return this.about.start_us + (x - LEFT) / width * (this.about.end_us - this.about.start_us);
  }

  x(t) {
    const width = this.canvas.clientWidth - LEFT - RIGHT;
    return LEFT + (t - this.about.start_us) / (this.about.end_us - this.about.start_us) * width;
  }

  draw() {
    const ratio = devicePixelRatio, width = this.canvas.parentElement.clientWidth;
    if (!width) return;
    const height = this.curves.length * (HEIGHT + GAP) + FOOT;
    this.canvas.style.height = `${height}px`;
    [this.canvas.width, this.canvas.height] = [Math.round(width * ratio), Math.round(height * ratio)];
    const context = this.context;
    context.scale(ratio, ratio);
    context.font = "11.5px system-ui, sans-serif";
    this.background(height);
    this.curves.forEach((curve, i) => this.curve(curve, GAP + i * (HEIGHT + GAP)));
    this.axis(height);
    this.head();
  }

  head() {
    this.playhead.style.transform = `translateX(${this.x(this.clock.t) - 1}px)`;
  }

  background(height) {
    const context = this.context;
    const band = (from, to, name, alpha) => {
      context.globalAlpha = alpha;
      context.fillStyle = color(name);
      const [a, b] = [from, to].map((t) => Math.min(Math.max(this.x(t), LEFT), this.canvas.clientWidth - RIGHT));
      context.fillRect(a, GAP, b - a, height - FOOT - GAP);
      context.globalAlpha = 1;
    };
    for (const [from, to] of this.about.held) band(from, to, "--hold", 0.07);
    for (const [from, to] of this.about.slips) band(from, to, "--slip", 0.16);
    for (const [from, to, name] of this.spans) band(from, to, `--${name}`, 0.3);
    context.fillStyle = color("--quiet");
    for (const [name, from, to] of this.about.phases) {
      const [a, b] = [Math.max(this.x(from), LEFT), Math.min(this.x(to), this.canvas.clientWidth - RIGHT)];
      if (b - a < 8) continue;
      context.globalAlpha = 0.5;
      context.fillRect(a, GAP, 1, height - FOOT - GAP);
      context.globalAlpha = 1;
      if (context.measureText(name).width < b - a - 6) context.fillText(name, a + 4, 11);
    }
  }

  curve({name, unit, t_us, lines}, top) {
    const context = this.context, values = Object.values(lines).flat();
    // No Math.max(...values): a call takes some 120,000 arguments at most.
    const least = values.reduce((a, b) => Math.min(a, b), 0);
    // What is always 0 lies at the foot of a strip from 0 to 1.
    const most = values.reduce((a, b) => Math.max(a, b), 0) || (least < 0 ? 0 : 1);
    const y = (value) => top + HEIGHT - 2 - (value - least) / (most - least) * (HEIGHT - 6);
    context.fillStyle = color("--quiet");
    context.textAlign = "right";
    context.fillText(short(most), LEFT - 6, top + 11);
    context.fillText(short(least), LEFT - 6, top + HEIGHT);
    context.fillStyle = color("--text");
    context.fillText(name, LEFT - 6, top + HEIGHT / 2);
    context.fillStyle = color("--quiet");
    context.fillText(unit, LEFT - 6, top + HEIGHT / 2 + 13);
    context.textAlign = "left";
    context.fillStyle = color("--line");
    context.fillRect(LEFT, top + HEIGHT, this.canvas.clientWidth - LEFT - RIGHT, 1);
    let at = LEFT + 6;
    Object.entries(lines).forEach(([key, line], k) => {
      context.strokeStyle = context.fillStyle = color(OWN[key] ?? LINES[k % LINES.length]);
      context.lineWidth = 1.3;
      context.beginPath();
      line.forEach((value, i) => context.lineTo(this.x(t_us[i]), y(value)));
      context.stroke();
      if (Object.keys(lines).length < 2) return;  // the curve's name is the line's
      context.fillText(key, at, top - 4);
      at += context.measureText(key).width + 14;
    });
  }

  axis(height) {
    const context = this.context, {start_us, end_us, origin_us} = this.about;
    const seconds = (end_us - start_us) / 1e6;
    const step = [0.001, 0.002, 0.005, 0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1, 2, 5, 10, 20, 60, 120, 300, 600]
      .find((size) => seconds / size <= Math.max(2, this.canvas.clientWidth / 90)) ?? 3600;
    context.fillStyle = color("--quiet");
    context.textAlign = "center";
    for (let t = Math.ceil((start_us - origin_us) / 1e6 / step) * step; t <= (end_us - origin_us) / 1e6; t += step)
      context.fillText(`${+t.toFixed(3)} s`, this.x(origin_us + 1e6 * t), height - 5);
    context.textAlign = "left";
  }
}

const short = (value) => value === 0 ? "0" : Math.abs(value) >= 1000 ? Math.round(value).toString() : (+value.toPrecision(3)).toString();
