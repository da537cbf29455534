/** How a fire is analysed: arrows and dots of one layer over the darkened frame. */
class FieldMarks {
  static NUMBERS = 4; // of a mark: x, y, and its vector or, of a candidate, its weight and 0

  constructor(field, rows) {
    this.field = field;
    this.rows = rows;
    this.firsts = {};
    let first = 0;
    for (const [layer, { counts }] of Object.entries(field.layers)) {
      this.firsts[layer] = counts.map((count) => (first += count) - count);
    }
  }

  /** Draw the marks of a frame on the canvas of `marks`, over a picture of `size` px at `offset`. */
  draw(marks, layer, frame, offset, size, scale) {
    const { context } = marks;
    const { counts } = this.field.layers[layer];
    context.fillStyle = `rgb(12 12 16 / ${layer === "blur" ? 0.25 : 0.58})`;
    context.fillRect(...offset, ...size);
    context.save();
    context.translate(...offset);
    context.scale(scale, scale);
    context.lineCap = "round";
    context.lineWidth = (1.25 * marks.hair) / scale;
    const first = this.firsts[layer][frame];
    for (let row = first; row < first + counts[frame]; row++) this.mark(context, layer, row);
    context.restore();
  }

  mark(context, layer, row) {
    const { units: [places, longest], reach, block } = this.field;
    const [x, y, dx, dy] = this.rows.subarray(row * FieldMarks.NUMBERS);
    const [left, top] = [x / places, y / places];
    const size = Math.hypot(dx, dy) / longest;
    context.strokeStyle = context.fillStyle = this.colour(size);
    context.beginPath();
    if (layer === "candidates") {
      context.arc(left, top, Math.max(0.8 * block * Math.sqrt(size), 0.2), 0, 2 * Math.PI);
      context.fill();
      return;
    }
    const [endX, endY] = [left + (dx / longest) * reach, top + (dy / longest) * reach];
    const tip = Math.min(reach / 4, 0.45 * size * reach);
    context.moveTo(left, top);
    context.lineTo(endX, endY);
    for (const turn of [2.6, -2.6]) {
      const angle = Math.atan2(dy, dx) + turn;
      context.moveTo(endX, endY);
      context.lineTo(endX + tip * Math.cos(angle), endY + tip * Math.sin(angle));
    }
    context.stroke();
  }

  /** The colour of a mark whose size is 0..1 of the longest. */
  colour(size) {
    const stops = this.field.colours.map((each) => [1, 3, 5].map((i) => parseInt(each.slice(i, i + 2), 16)));
    const at = Math.min(Math.max(size, 0), 1) * (stops.length - 1);
    const low = Math.min(Math.floor(at), stops.length - 2);
    const mixed = stops[low].map((v, i) => Math.round(v + (stops[low + 1][i] - v) * (at - low)));
    return `rgb(${mixed.join(" ")})`;
  }
}
