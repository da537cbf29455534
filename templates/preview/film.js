/** Which frame of an animation is shown when. Times in ms. */
class Film {
  constructor(animation) {
    this.animation = animation;
    this.count = animation.frames.length;
    this.repeat = animation.loop;
    this.playing = false;
    this.speed = 1;
    this.time = 0;
    let end = 0;
    this.ends = animation.frames.map((frame) => (end += frame.duration));
    this.duration = end;
  }

  get index() {
    const shown = this.ends.findIndex((end) => this.time < end);
    return shown < 0 ? this.count - 1 : shown;
  }

  get frame() {
    return this.animation.frames[this.index];
  }

  /** Show frame `index`; those beyond the ends are counted from the other end. */
  seek(index) {
    const wrapped = ((index % this.count) + this.count) % this.count;
    this.time = wrapped ? this.ends[wrapped - 1] : 0;
  }

  play() {
    if (this.index === this.count - 1 && !this.repeat) this.time = 0;
    this.playing = true;
  }

  pause() {
    this.playing = false;
  }

  /** Let `elapsed` ms of the viewer's time go by. An animation that plays once stops at its end. */
  advance(elapsed) {
    if (!this.playing) return;
    this.time += elapsed * this.speed;
    if (this.time < this.duration) return;
    if (this.repeat) {
      this.time %= this.duration;
    } else {
      this.seek(this.count - 1);
      this.playing = false;
    }
  }
}
