// Time in the recording, in microseconds, and how fast it runs.
export class Clock {
  constructor(start, end, changed) {
    Object.assign(this, {start, end, changed, t: start, speed: 0.1, playing: false});
  }

  seek(t) {
    this.t = Math.min(Math.max(t, this.start), this.end);
    this.changed();
  }

  toggle() {
    if (!this.playing && this.t >= this.end) this.t = this.start;
    this.playing = !this.playing;
    this.last = null;
    this.changed();
    if (this.playing) requestAnimationFrame((now) => this.tick(now));
  }

  tick(now) {
    if (!this.playing) return;
    // A page that was in the background does not leap.
    if (this.last != null) this.t += Math.min(now - this.last, 100) * 1000 * this.speed;
    this.last = now;
    if (this.t >= this.end) {
      this.t = this.end;
      this.playing = false;
    }
    this.changed();
    if (this.playing) requestAnimationFrame((next) => this.tick(next));
  }
}
