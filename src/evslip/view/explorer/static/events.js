// Events of a sample, fetched in pieces of time and kept.
import {ask} from "./page.js";

const PIECE_US = 100000, MOST = 200000, KEPT = 40, BYTES = 9;

export class EventStore {
  constructor(position, start, end, arrived) {
    Object.assign(this, {position, start, end, arrived});
    this.pieces = new Map();
  }

  // Asks for what is missing of a span, and, when all of it is there, for what follows. Returns whether all is there.
  want(from, to) {
    const [first, last] = this.wanted = this.range(from, to);
    let complete = true;
    for (let number = first; number <= last; number++) complete = this.piece(number) != null && complete;
    if (complete) this.piece(last + 1);
    return complete;
  }

  // Calls visit(x, y, flags, weight) for each event with from <= t < to that is there. Where the server sent only some
  // of many, each stands for a weight of more than 1.
  forEach(from, to, visit) {
    const [first, last] = this.range(from, to);
    for (let number = first; number <= last; number++) {
      const piece = this.pieces.get(number);
      if (!piece?.t) continue;
      const begin = this.start + number * PIECE_US;
      for (let i = lower(piece, from - begin), end = lower(piece, to - begin); i < end; i++)
        visit(piece.x[i], piece.y[i], piece.flags[i], piece.weight);
    }
  }

  range(from, to) {
    return [Math.max(from, this.start), Math.min(to, this.end)].map((t) => Math.floor((t - this.start) / PIECE_US));
  }

  piece(number) {
    const kept = this.pieces.get(number);
    if (kept) return kept.t ? kept : null;
    const begin = this.start + number * PIECE_US;
    if (number < 0 || begin > this.end) return null;
    this.pieces.set(number, {});
    this.load(number, begin).catch((error) => {
      this.pieces.set(number, unpack(new ArrayBuffer(0), 0));
      this.arrived(error);
    });
    if (this.pieces.size > KEPT) this.pieces.delete(this.pieces.keys().next().value);
    return null;
  }

  async load(number, begin) {
    const span = `start_us=${begin}&end_us=${begin + PIECE_US}`;
    const answer = await ask(`/api/samples/${this.position}/events?${span}&most=${MOST}`);
    this.pieces.set(number, unpack(await answer.arrayBuffer(), Number(answer.headers.get("x-events"))));
    const [first, last] = this.wanted;
    if (first <= number && number <= last) this.arrived();
  }
}

function unpack(buffer, there) {
  const view = new DataView(buffer), count = Math.floor(buffer.byteLength / BYTES);
  const piece = {t: new Uint32Array(count), x: new Uint16Array(count), y: new Uint16Array(count), flags: new Uint8Array(count)};
  piece.weight = count ? there / count : 1;
  for (let i = 0, at = 0; i < count; i++, at += BYTES) {
    piece.t[i] = view.getUint32(at, true);
    piece.x[i] = view.getUint16(at + 4, true);
    piece.y[i] = view.getUint16(at + 6, true);
    piece.flags[i] = view.getUint8(at + 8);
  }
  return piece;
}

function lower(piece, t) {
  let low = 0, high = piece.t.length;
  while (low < high) {
    const middle = (low + high) >> 1;
    if (piece.t[middle] < t) low = middle + 1; else high = middle;
  }
  return low;
}
