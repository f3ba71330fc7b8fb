// The picture: what the camera sees, and over it the events of the last milliseconds.
const BODY = [[120, 130, 145], [224, 123, 0], [10, 143, 108], [150, 90, 200]];
const CAUSE = [[41, 98, 255], [224, 123, 0], [229, 57, 53], [150, 90, 200]];
const UNKNOWN = [128, 128, 128];
const STEP_US = 2000;

export class Stage {
  constructor(canvas, position, about, store, arrived) {
    Object.assign(this, {canvas, position, about, store, arrived});
    [canvas.width, canvas.height] = [about.width, about.height];
    this.context = canvas.getContext("2d", {willReadFrequently: true});
    this.frame = null;
    this.wanted = null;
    this.asking = false;
    this.options = {view: about.frames ? "both" : "events", window_us: 10000, color: "polarity"};
  }

  draw(t) {
    const {view, window_us} = this.options;
    const {width, height} = this.canvas;
    const context = this.context;
    const dark = matchMedia("(prefers-color-scheme: dark)").matches;
    context.fillStyle = dark ? "#0c0e11" : "#ffffff";
    context.fillRect(0, 0, width, height);
    if (view !== "events" && this.about.frames) {
      this.ask(Math.round(t / STEP_US) * STEP_US);
      if (this.frame) context.drawImage(this.frame, 0, 0, width, height);
    }
    if (view === "frame") return 0;
    const image = context.getImageData(0, 0, width, height);
    if (view === "both") fade(image.data);
    const pixels = image.data;
    let count = 0;
    this.store.forEach(t - window_us, t, (x, y, flags) => {
      const [r, g, b] = this.color(flags);
      const at = 4 * (y * width + x);
      pixels[at] = r; pixels[at + 1] = g; pixels[at + 2] = b;
      count++;
    });
    this.store.ahead(t);
    context.putImageData(image, 0, 0);
    return count;
  }

  color(flags) {
    if (this.options.color === "body") return BODY[(flags >> 1) & 7] ?? UNKNOWN;
    if (this.options.color === "cause") return CAUSE[(flags >> 4) & 3];
    return flags & 1 ? [229, 57, 53] : [41, 98, 255];
  }

  // One frame is asked for at a time; of those wished meanwhile, only the last.
  async ask(t) {
    this.wanted = t;
    if (this.asking || this.shown === t) return;
    this.asking = true;
    try {
      while (this.wanted !== this.shown) {
        const next = this.wanted;
        const answer = await fetch(`/api/samples/${this.position}/frame?t_us=${next}`);
        if (!answer.ok) throw new Error(await answer.text());
        this.frame = await createImageBitmap(await answer.blob());
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

// Pale grey, on which the colours of events stand out.
function fade(pixels) {
  for (let at = 0; at < pixels.length; at += 4)
    for (let c = 0; c < 3; c++) pixels[at + c] = 70 + 0.7 * pixels[at + c];
}
