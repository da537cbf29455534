/** Thin lines over the picture: frames on a page, the pivot, and where flakes are and come from. */
class Marks {
  static TRAIL = 6;

  constructor(canvas) {
    this.canvas = canvas;
    this.context = canvas.getContext("2d");
  }

  /** Begin anew over a picture of `size` px that is shown `zoom` times as large. */
  begin(size, zoom) {
    const sharp = window.devicePixelRatio || 1;
    const [width, height] = size.map((side) => Math.max(1, Math.round(side * zoom * sharp)));
    if (this.canvas.width !== width) this.canvas.width = width;
    if (this.canvas.height !== height) this.canvas.height = height;
    const context = this.context;
    context.setTransform(1, 0, 0, 1, 0, 0);
    context.clearRect(0, 0, width, height);
    // Chromium may drop a clear of the whole canvas after which nothing is drawn.
    context.fillRect(0, 0, 1, 1);
    context.clearRect(0, 0, 1, 1);
    context.scale(zoom * sharp, zoom * sharp);
    this.hair = 1 / zoom; // one CSS px
  }

  /** Draw on the stage in a box of the picture, {x, y, width, height, left, top}, and not beyond it. */
  within({ x, y, width, height, left, top }, drawOn) {
    const { context } = this;
    context.save();
    context.beginPath();
    context.rect(x, y, width, height);
    context.clip();
    context.translate(x + left, y + top);
    drawOn();
    context.restore();
  }

  /** A name in the upper left corner of a box, over [r, g, b] in 0..1. */
  label(text, { x, y }, [r, g, b]) {
    const { context, hair } = this;
    context.font = `${12 * hair}px ui-sans-serif, system-ui, sans-serif`;
    context.textBaseline = "top";
    context.fillStyle = 0.3 * r + 0.59 * g + 0.11 * b > 0.5 ? "#1b1d22" : "#c9ccd3";
    context.fillText(text, x + 8 * hair, y + 7 * hair);
  }

  box(x, y, width, height, colour, weight = 1) {
    this.context.strokeStyle = colour;
    this.context.lineWidth = weight * this.hair;
    this.context.strokeRect(x, y, width, height);
  }

  pivot(x, y) {
    const [context, reach] = [this.context, 9 * this.hair];
    context.strokeStyle = "#7fd4ff";
    context.lineWidth = 1.5 * this.hair;
    context.beginPath();
    context.moveTo(x - reach, y);
    context.lineTo(x + reach, y);
    context.moveTo(x, y - reach);
    context.lineTo(x, y + reach);
    context.stroke();
  }

  /** Ring every flake of `frames[0]`, and draw the way it came over the frames before. */
  flakes(frames, offset, scale) {
    const { context } = this;
    context.save();
    context.translate(...offset);
    context.scale(scale, scale);
    context.lineWidth = (1.25 * this.hair) / scale;
    const least = (2.5 * this.hair) / scale;
    for (const [id, flake] of frames[0] ?? []) {
      context.strokeStyle = flake.colour;
      context.beginPath();
      context.ellipse(
        flake.x, flake.y, Math.max((flake.size * flake.stretch) / 2, least),
        Math.max(flake.size / 2, least), flake.rotation, 0, 2 * Math.PI,
      );
      context.stroke();
      context.beginPath();
      context.moveTo(flake.x, flake.y);
      for (const earlier of frames.slice(1)) {
        const then = earlier.get(id);
        if (!then) break;
        context.lineTo(then.x, then.y);
      }
      context.globalAlpha = 0.45;
      context.stroke();
      context.globalAlpha = 1;
    }
    context.restore();
  }
}
