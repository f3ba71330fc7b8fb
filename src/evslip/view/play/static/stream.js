// Messages of a running program, and the picture that they bring.
import {complain} from "./page.js";
import {OFF, ON} from "./stage.js";

// Calls take(head) for each message, and draw(head, rest) for the newest when the screen is drawn next.
export function listen(take, draw, goodbye) {
  const socket = new WebSocket(`ws://${location.host}/api/stream`);
  let newest = null;
  socket.binaryType = "arraybuffer";
  socket.addEventListener("close", () => complain({message: goodbye}));
  socket.addEventListener("message", ({data}) => {
    if (typeof data === "string") return complain({message: data});
    const length = new DataView(data).getUint32(0, true);
    const head = JSON.parse(new TextDecoder().decode(new Uint8Array(data, 4, length)));
    take(head);
    if (newest === null) requestAnimationFrame(() => {
      const shown = newest;
      newest = null;
      draw(...shown);
    });
    newest = [head, data.slice(4 + length)];
  });
  return socket;
}

export class Picture {
  constructor(canvas) {
    this.context = canvas.getContext("2d", {willReadFrequently: true});
  }

  // Words of the pixels of a picture of this size, to be set one by one.
  words([width, height]) {
    const {canvas} = this.context;
    if (canvas.width !== width || canvas.height !== height || !this.image) {
      [canvas.width, canvas.height] = [width, height];
      this.image = this.context.createImageData(width, height);
    }
    return new Uint32Array(this.image.data.buffer);
  }

  show(words, events) {
    const {width} = this.image;
    for (const event of events) words[(event >> 12 & 0xfff) * width + (event & 0xfff)] = event >> 24 & 1 ? ON : OFF;
    this.context.putImageData(this.image, 0, 0);
  }
}
