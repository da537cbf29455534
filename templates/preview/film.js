/** Which frame of an animation is shown when. Times in ms, positions in frames. */
class Film {
  /** `rests`: whether it stays at its end while it plays on, like a fire that is out. */
  constructor(animation, rests) {
    this.animation = animation;
    this.rests = rests;
    this.count = animation.frames.length;
    this.repeat = animation.loop;
    this.playing = false;
    this.speed = 1;
    this.time = 0;
    this.round = 0; // rounds that have passed: flakes repeat after several
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

  /** How much of the frame's time is over, 0..1. */
  get part() {
    return Math.min((this.time - this.start(this.index)) / this.frame.duration, 1);
  }

  get position() {
    return this.index + this.part;
  }

  /** The index of the frame into which this one passes: none after the last of what plays once. */
  get next() {
    if (this.index < this.count - 1) return this.index + 1;
    return this.animation.loop && this.repeat && this.count > 1 ? 0 : null;
  }

  /** The frame of the tracks that goes with this one. */
  get flakeFrame() {
    const { rounds } = this.animation.flakes;
    return (((this.round % rounds) + rounds) % rounds) * this.count + this.index;
  }

  start(index) {
    return index ? this.ends[index - 1] : 0;
  }

  /** Go to a position; those beyond the ends are of the next round, or of the one before. */
  seek(position) {
    const passed = Math.floor(position / this.count);
    const wrapped = position - passed * this.count;
    this.round += passed;
    const index = Math.floor(wrapped);
    this.time = this.start(index) + (wrapped - index) * this.animation.frames[index].duration;
  }

  /** Play, from the beginning if this is over and nothing goes on from here. */
  play(goesOn) {
    if (this.index === this.count - 1 && !this.repeat && !this.rests && !goesOn) this.time = 0;
    this.playing = true;
  }

  pause() {
    this.playing = false;
  }

  /** Time until frame `index` is over next. */
  until(index) {
    const end = this.ends[index];
    if (this.time < end) return end - this.time;
    return this.repeat ? this.duration - this.time + end : Infinity;
  }

  /** Let `elapsed` ms of the viewer's time go by. An animation that plays once stays at its end. */
  advance(elapsed) {
    if (!this.playing) return;
    this.time += elapsed * this.speed;
    if (this.time < this.duration) return;
    if (this.repeat) {
      this.round += Math.floor(this.time / this.duration);
      this.time %= this.duration;
    } else {
      this.seek(this.count - 1);
      this.playing = this.rests;
    }
  }
}
