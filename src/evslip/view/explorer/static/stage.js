// The picture: what the camera sees, and over it the events of the last milliseconds.
import {ask} from "./page.js";

const word = (r, g, b) => (255 << 24 | b << 16 | g << 8 | r) >>> 0;
export const OFF = word(41, 98, 255), ON = word(229, 57, 53);
const UNKNOWN = word(128, 128, 128);
const BODY = [word(120, 130, 145), word(224, 123, 0), word(10, 143, 108), word(150, 90, 200)];
const CAUSE = [OFF, BODY[1], ON, BODY[3]];
const LIGHT = word(255, 255, 255), DARK = word(12, 14, 17);
const STEP_US = 2000, MOST_DOT = 16;

export class Stage {
  constructor(canvas, position, about, store, arrived) {
    Object.assign(this, {canvas, position, about, store, arrived});
    [canvas.width, canvas.height] = [about.width, about.height];
    // Its pixels are set one by one, which is quick where they are in the processor's memory.
    this.context = canvas.getContext("2d", {willReadFrequently: true});
    this.image = this.context.createImageData(about.width, about.height);
    this.words = new Uint32Array(this.image.data.buffer);
    this.frame = this.shown = this.wanted = null;
    this.asking = false;
    this.dot = 1;
    new ResizeObserver(() => this.fit()).observe(canvas);
    this.options = {view: about.frames ? "both" : "events", window_us: 10000, color: "polarity"};
  }

  // Asks for what is missing of a time: at once, for the server works while the screen waits for its next picture.
  // Returns whether all is there.
  want(t) {
    const {view, window_us} = this.options;
    const at = Math.round(t / STEP_US) * STEP_US, framed = view !== "events" && this.about.frames;
    if (framed) this.ask(at);
    const counted = view === "frame" || this.store.want(t - window_us, t);
    return counted && (!framed || this.shown === at);
  }

  // On a canvas that is shown smaller than it is, most single pixels would be lost: an event is as many pixels wide as
  // one of the screen.
  fit() {
    const {canvas} = this;
    const scale = devicePixelRatio * Math.min(canvas.clientWidth / canvas.width, canvas.clientHeight / canvas.height);
    canvas.classList.toggle("shrunk", scale < 1);
    const dot = scale > 0 ? Math.ceil(Math.min(1 / scale, MOST_DOT)) : 1;
    if (dot === this.dot) return;
    this.dot = dot;
    this.arrived();
  }

  // Returns how many events there are, and whether that is counted or estimated from those that were sent.
  draw(t) {
    const {view, window_us} = this.options, {words, dot} = this, {width, height} = this.canvas;
    if (view !== "events" && this.frame) words.set(this.frame[view]);
    else words.fill(matchMedia("(prefers-color-scheme: dark)").matches ? DARK : LIGHT);
    let count = 0, counted = true;
    if (view !== "frame") this.store.forEach(t - window_us, t, (x, y, flags, weight) => {
      const shade = this.color(flags), right = Math.min(x + dot, width), bottom = Math.min(y + dot, height);
      for (let row = y; row < bottom; row++) words.fill(shade, row * width + x, row * width + right);
      count += weight;
      counted &&= weight === 1;
    });
    this.context.putImageData(this.image, 0, 0);
    return {count: Math.round(count), counted};
  }

  color(flags) {
    if (this.options.color === "body") return BODY[(flags >> 1) & 7] ?? UNKNOWN;
    if (this.options.color === "cause") return CAUSE[(flags >> 4) & 3];
    return flags & 1 ? ON : OFF;
  }

  // One frame is asked for at a time; of those wished meanwhile, only the last.
  async ask(t) {
    this.wanted = t;
    if (this.asking || this.shown === t) return;
    this.asking = true;
    try {
      while (this.wanted !== this.shown) {
        const next = this.wanted;
        const answer = await ask(`/api/samples/${this.position}/frame?t_us=${next}`);
        const frame = await answer.arrayBuffer();
        this.frame = {frame: new Uint32Array(frame), both: pale(frame)};
        this.shown = next;
        this.arrived();
      }
    } catch (error) {
      // One frame that cannot be drawn speaks for all.
      this.about.frames = false;
      this.arrived(error);
    } finally {
      this.asking = false;
    }
  }
}

// Light grey, on which the colours of events stand out.
function pale(frame) {
  const bytes = new Uint8ClampedArray(frame.slice(0));
  for (let at = 0; at < bytes.length; at++) if (at % 4 < 3) bytes[at] = 70 + 0.7 * bytes[at];
  return new Uint32Array(bytes.buffer);
}
