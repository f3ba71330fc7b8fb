// A picture, its curves and the clock that drives both; keys that every page shares.
import {Charts} from "./chart.js";
import {Clock} from "./clock.js";
import {EventStore} from "./events.js";
import {complain, place} from "./page.js";
import {Stage} from "./stage.js";

const SPEEDS = [0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1], PATIENCE_MS = 100;

export class Player {
  constructor(position, about) {
    Object.assign(this, {position, about});
    this.clock = new Clock(about.start_us, about.end_us, () => this.refresh());
    const arrived = (stale) => (error) => {
      if (error) complain(error);
      this.refresh(stale);
    };
    this.store = new EventStore(position, about.start_us, about.end_us, arrived(false));
    this.stage = new Stage(place("stage"), position, about, this.store, arrived(true));
    this.charts = new Charts(place("charts"), about, this.clock);
    this.controls();
    this.keys = {
      " ": () => this.clock.toggle(),
      ArrowRight: (event) => this.step(event.shiftKey ? 10 : 1),
      ArrowLeft: (event) => this.step(event.shiftKey ? -10 : -1),
      "+": () => this.faster(1), "=": () => this.faster(1), "-": () => this.faster(-1),
      Home: () => this.clock.seek(about.start_us), End: () => this.clock.seek(about.end_us),
    };
    addEventListener("keydown", (event) => this.key(event));
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => { this.charts.draw(); this.refresh(true); });
    this.charts.draw();
    this.refresh();
  }

  controls() {
    const {stage, clock, about} = this;
    place("view").value = stage.options.view;
    for (const option of place("view").options) option.disabled = option.value !== "events" && !about.frames;
    for (const option of place("color").options) option.disabled = option.value !== "polarity" && !about.bodies;
    for (const speed of SPEEDS) place("speed").add(new Option(speed === 1 ? "1" : `1/${Math.round(1 / speed)}`, speed));
    place("speed").value = clock.speed;
    place("speed").addEventListener("input", () => { clock.speed = Number(place("speed").value); });
    const choose = (id, set) => place(id).addEventListener("input", () => { set(place(id).value); this.refresh(true); });
    choose("view", (value) => { stage.options.view = value; });
    choose("color", (value) => { stage.options.color = value; });
    choose("window", (value) => { stage.options.window_us = 1000 * Number(value); });
    place("play").addEventListener("click", () => clock.toggle());
    for (const id of ["view", "color", "window", "speed"]) releaseAfterMouse(place(id));
    // The detail of a click is the number of clicks of the mouse, and 0 where a key made it.
    addEventListener("click", (event) => { if (event.detail) event.target.closest("button, summary")?.blur(); });
  }

  key(event) {
    if (event.ctrlKey || event.metaKey || event.altKey || event.target.closest("input, select, textarea")) return;
    if ([" ", "Enter"].includes(event.key) && event.target.closest("button, a, summary")) {
      if (event.repeat) event.preventDefault();
      return;
    }
    // With Caps Lock, letters are capitals.
    const act = this.keys[event.key] ?? this.keys[event.key.toLowerCase()];
    if (!act) return;
    event.preventDefault();
    // Held, an arrow steps on and on; what marks, deletes or plays is meant once.
    if (!event.repeat || event.key.startsWith("Arrow")) act(event);
  }

  step(number) {
    if (this.clock.playing) this.clock.toggle();
    this.clock.seek(this.clock.t + number * this.stage.options.window_us);
  }

  faster(way) {
    const next = SPEEDS.indexOf(this.clock.speed) + way;
    this.clock.speed = SPEEDS[Math.min(Math.max(next, 0), SPEEDS.length - 1)];
    place("speed").value = this.clock.speed;
  }

  // Many changes between two pictures of the screen are drawn once. What is seen stays until all of another time is
  // there, until it is stale (a part came that shall be seen while more is on its way), or until patience ends.
  refresh(stale = false) {
    this.stage.want(this.clock.t);
    this.stale ||= stale;
    if (this.due) return;
    this.due = true;
    requestAnimationFrame(() => {
      this.due = false;
      this.charts.head();
      place("play").textContent = this.clock.playing ? "pause" : "play";
      const complete = this.stage.want(this.clock.t);
      if (complete || this.stale || this.clock.playing) this.draw(complete);
      else this.patience ??= setTimeout(() => this.refresh(true), PATIENCE_MS);
    });
  }

  draw(complete) {
    const {t} = this.clock, {count, counted} = this.stage.draw(t);
    this.stale = false;
    clearTimeout(this.patience);
    this.patience = null;
    const many = `${counted ? "" : "about "}${count.toLocaleString("en")}`;
    place("now").textContent = `${((t - this.about.origin_us) / 1e6).toFixed(4)} s, ${many} events in ${this.stage.options.window_us / 1000} ms`;
    this.stage.canvas.dataset.complete = complete ? t : "";
  }
}

// After a choice with the mouse, keys belong to the player again; who chooses with keys may go on to choose.
function releaseAfterMouse(select) {
  let keyed = false;
  select.addEventListener("keydown", () => { keyed = true; });
  select.addEventListener("pointerdown", () => { keyed = false; });
  select.addEventListener("change", () => { if (!keyed) select.blur(); });
}
