// Marking intervals of slip and hold. Times in the file are seconds since the recording's first event.
import {Ended, ask, complain, element, get, place} from "./page.js";
import {Player} from "./player.js";

const KINDS = ["slip", "hold"];

class Labeller {
  constructor(player, {recording, version, intervals}) {
    Object.assign(this, {player, recording, version, intervals, past: [], future: [], begun: null});
    this.saving = Promise.resolve();
    // The browser asks before it leaves the page with a change that has not arrived.
    addEventListener("beforeunload", (event) => { if (this.unsaved) event.preventDefault(); });
    const origin = player.about.origin_us;
    // What lies before the first event has no time in the file.
    this.seconds = (t) => Math.max(0, Number(((t - origin) / 1e6).toFixed(6)));
    this.micros = (s) => origin + 1e6 * s;
    Object.assign(player.keys, {
      s: () => this.mark("slip"), h: () => this.mark("hold"), d: () => this.remove(), Delete: () => this.remove(),
      u: () => this.travel(this.past, this.future), r: () => this.travel(this.future, this.past),
      Escape: () => { this.begun = null; this.show(); },
      "]": () => this.jump(1), "[": () => this.jump(-1),
    });
    for (const id of [...KINDS, "delete", "undo", "redo"]) place(id).addEventListener("click", () => player.keys[id[0]]());
    place("again").addEventListener("click", () => this.store());
    this.show();
  }

  get now() { return this.seconds(this.player.clock.t); }

  mark(kind) {
    if (!this.begun || this.begun.kind !== kind) {
      this.begun = {kind, from: this.now};
      this.show();
      return;
    }
    const [from, to] = [this.begun.from, this.now].sort((a, b) => a - b);
    this.begun = null;
    if (from === to) this.show(); else this.change(insert(this.intervals, [from, to, kind]));
  }

  remove() {
    const rest = this.intervals.filter(([from, to]) => !(from <= this.now && this.now < to));
    if (rest.length < this.intervals.length) this.change(rest);
  }

  jump(way) {
    const edges = this.intervals.flatMap(([from, to]) => [from, to]).sort((a, b) => a - b);
    const next = way > 0 ? edges.find((edge) => edge > this.now + 1e-6) : edges.findLast((edge) => edge < this.now - 1e-6);
    if (next != null) this.player.clock.seek(this.micros(next));
  }

  change(intervals) {
    this.past.push(this.intervals);
    this.future = [];
    this.set(intervals);
  }

  travel(from, to) {
    if (!from.length) return;
    to.push(this.intervals);
    this.set(from.pop());
  }

  set(intervals) {
    this.intervals = intervals;
    this.unsaved = true;
    this.show();
    this.store();
  }

  store() {
    const {intervals} = this;
    place("saved").textContent = "saving";
    // One after the other, so that the last change is the one that stays.
    this.saving = this.saving.then(() => this.save(intervals)).catch((error) => {
      place("saved").textContent = "not saved";
      place("unsaved").hidden = !(error instanceof Ended);
      if (!(error instanceof Ended)) complain(error);
    });
  }

  async save(intervals) {
    // Another recording may be open at this address by now, or another page may have changed the file.
    const body = JSON.stringify({recording: this.recording, version: this.version, intervals});
    const answer = await ask("/api/labels", {method: "PUT", headers: {"content-type": "application/json"}, body});
    const {file, version} = await answer.json();
    this.version = version;
    if (intervals === this.intervals) {
      this.unsaved = false;
      place("saved").textContent = `saved in ${file}`;
    }
    place("unsaved").hidden = true;
    place("problem").textContent = "";
  }

  show() {
    const {charts} = this.player;
    charts.spans = this.intervals.map(([from, to, kind]) => [this.micros(from), this.micros(to), kind]);
    charts.draw();
    for (const kind of KINDS) place(kind).setAttribute("aria-pressed", String(this.begun?.kind === kind));
    place("hint").textContent = this.begun
      ? `${this.begun.kind} from ${this.begun.from.toFixed(3)} s: move on and press ${this.begun.kind[0]} again`
      : `${this.intervals.length} intervals`;
    place("intervals").replaceChildren(...this.intervals.map(([from, to, kind]) => this.row(from, to, kind)));
  }

  row(from, to, kind) {
    const link = element("button", {className: kind}, kind);
    link.addEventListener("click", () => this.player.clock.seek(this.micros(from)));
    const times = [from, to].map((time) => element("td", {}, time.toFixed(3)));
    return element("tr", {}, element("td", {className: "text"}, link), ...times);
  }
}

// The new interval wins: what it overlaps is cut back or split.
export function insert(intervals, [from, to, kind]) {
  const rest = intervals.flatMap(([a, b, other]) => {
    if (b <= from || a >= to) return [[a, b, other]];
    return [[a, from, other], [to, b, other]].filter(([start, end]) => start < end);
  });
  return [...rest, [from, to, kind]].sort((a, b) => a[0] - b[0]);
}

async function start() {
  const [about, list, known] = await Promise.all([get("/api/samples/0"), get("/api/items"), get("/api/labels")]);
  document.title = place("title").textContent = `label ${list.title}`;
  // The page shows the times that the file has.
  const player = new Player(0, {...about, origin_us: about.first_event_us});
  new Labeller(player, known);
  document.body.dataset.ready = "yes";
}

start().catch(complain);
