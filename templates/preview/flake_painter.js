/**
 * Adds up the light of flakes, linear and beyond white, from the rows of their tracks: tapered streaks
 * with halos, or cells of a texture, as the formats' page says.
 */
class FlakePainter {
  static FLOATS = 12;
  static HALO_LIGHT = 0.004; // relative to the flake's
  static HALO_WIDTH = 2.5;
  static INTEGRAL = 1.0140310; // of a flake's light, for each half length times half width
  static FAINTEST = 1e-4; // light, linear, below which a halo is not drawn
  static CELLS = 64; // the most that a texture may have
  static SAMPLES = 4; // the most along a pixel's side, where a cell is drawn smaller

  /** `blend` says how pages are encoded: {alpha, linear}. */
  constructor(gl, blend) {
    this.gl = gl;
    this.blend = blend;
    this.program = new Program(gl, FlakePainter.VERTEX, FlakePainter.FRAGMENT);
    this.light = gl.createTexture();
    this.target = gl.createFramebuffer();
    this.buffer = gl.createBuffer();
    this.array = gl.createVertexArray();
    this.size = [0, 0];
    gl.bindVertexArray(this.array);
    gl.bindBuffer(gl.ARRAY_BUFFER, this.buffer);
    // Rows are id, x, y, size, stretch, rotation, tail, r, g, b, a, cell (-1: a streak).
    const inputs = [["centre", 1, 2], ["shape", 3, 4], ["glow", 7, 4], ["cell", 11, 1]];
    for (const [name, first, floats] of inputs) {
      const place = gl.getAttribLocation(this.program.program, name);
      gl.enableVertexAttribArray(place);
      gl.vertexAttribPointer(place, floats, gl.FLOAT, false, 4 * FlakePainter.FLOATS, 4 * first);
      gl.vertexAttribDivisor(place, 1);
    }
    gl.bindVertexArray(null);
  }

  /** `page` is the texture of the page that has the `cells` of a texture of flakes. */
  draw({ rows, first, count, offset, scale, cells, tinted }, page, size) {
    const gl = this.gl;
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.target);
    if (size[0] !== this.size[0] || size[1] !== this.size[1]) this.resize(size);
    gl.viewport(0, 0, ...size);
    gl.clearColor(0, 0, 0, 0);
    gl.clear(gl.COLOR_BUFFER_BIT);
    const program = this.program.use();
    gl.uniform2f(program.place("canvas"), ...size);
    gl.uniform2f(program.place("offset"), ...offset);
    gl.uniform1f(program.place("scale"), scale);
    gl.activeTexture(gl.TEXTURE0);
    gl.bindTexture(gl.TEXTURE_2D, page);
    program.integers("page", 0);
    program.integers("tinted", tinted ? 1 : 0);
    program.integers("straight", this.blend.alpha === 0 ? 1 : 0);
    program.integers("linear", this.blend.linear ? 1 : 0);
    cells.forEach((cell, i) => {
      program.integers(`places[${i}]`, cell.x, cell.y, cell.width, cell.height);
      program.integers(`rotated[${i}]`, cell.rotated ? 1 : 0);
    });
    gl.bindVertexArray(this.array);
    gl.bindBuffer(gl.ARRAY_BUFFER, this.buffer);
    const { FLOATS } = FlakePainter;
    const frame = rows.subarray(FLOATS * first, FLOATS * (first + count));
    gl.bufferData(gl.ARRAY_BUFFER, frame, gl.STREAM_DRAW);
    gl.enable(gl.BLEND);
    gl.blendFunc(gl.ONE, gl.ONE);
    gl.drawArraysInstanced(gl.TRIANGLE_STRIP, 0, 4, count);
    gl.disable(gl.BLEND);
    gl.bindVertexArray(null);
  }

  resize(size) {
    const gl = this.gl;
    this.size = [...size];
    gl.bindTexture(gl.TEXTURE_2D, this.light);
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA16F, ...size, 0, gl.RGBA, gl.HALF_FLOAT, null);
    sampleNearest(gl);
    gl.framebufferTexture2D(
      gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.TEXTURE_2D, this.light, 0,
    );
  }

  /**
   * Light at a place of a streak, relative to that at its head: its own, and its halo's. Lengths are in
   * half widths; `longer` is how much longer than wide it is.
   */
  static WEIGHTS = `
    float soft(vec2 at, float tail) {
      float inside = max(1.0 - abs(at.x * at.x * at.x) - at.y * at.y, 0.0);
      return mix(tail, 1.0, 0.5 + 0.5 * at.x) * inside * inside * inside;
    }
    vec2 weights(vec2 place, float longer, float tail) {
      float wide = float(${FlakePainter.HALO_WIDTH});
      float core = soft(place / vec2(longer + 1.0, 1.0), tail);
      float halo = soft(place / vec2(longer + wide, wide), tail);
      return vec2(core, ${FlakePainter.HALO_LIGHT} * halo);
    }
    vec2 placeOf(vec2 pixel, vec4 spot) {
      vec2 off = pixel - spot.xy;
      return vec2(dot(off, spot.zw), dot(off, vec2(-spot.w, spot.z)));
    }`;

  static VERTEX = `#version 300 es
    in vec2 centre;
    in vec4 shape;  // size, stretch, rotation, tail
    in vec4 glow;
    in float cell;
    uniform vec2 canvas, offset;
    uniform float scale;
    uniform ivec4 places[${FlakePainter.CELLS}];
    uniform int rotated[${FlakePainter.CELLS}];
    flat out ivec4 place;  // of the cell on its page; no width: a streak
    flat out int turned;
    flat out vec4 axes;  // along and across the flake, px of the cell for each of the canvas
    flat out vec3 light;
    flat out vec4 spot;  // centre, px; along the flake, in half widths a px
    flat out vec2 streak;  // how much longer than wide, in half widths; light at its tail
    ${FlakePainter.WEIGHTS}

    /** The pixels of a small flake add up to its light wherever it lies between them. */
    float evened(float longer, float tail) {
      float rate = length(spot.zw);
      vec2 reach = ((longer + 1.0) * abs(spot.zw) + abs(spot.wz)) / (rate * rate);
      float sum = 0.0;
      for (float y = floor(spot.y - reach.y) + 0.5; y < spot.y + reach.y; y += 1.0) {
        for (float x = floor(spot.x - reach.x) + 0.5; x < spot.x + reach.x; x += 1.0) {
          sum += weights(placeOf(vec2(x, y), spot), longer, tail).x;
        }
      }
      float whole = (0.5 + 0.5 * tail) * (longer + 1.0) * ${FlakePainter.INTEGRAL} / (rate * rate);
      return whole / max(sum, 1e-6);
    }

    void main() {
      float radius = 0.5 * shape.x * scale;
      vec2 way = vec2(cos(shape.z), sin(shape.z));
      spot = vec4(offset + scale * centre, way / radius);
      streak = vec2(shape.y - 1.0, shape.w);
      light = glow.rgb * glow.a;
      vec2 q = vec2(gl_VertexID % 2, gl_VertexID / 2) * 2.0 - 1.0;
      place = ivec4(0);
      if (cell >= 0.0) {
        place = places[int(cell)];
        turned = rotated[int(cell)];
        vec2 across = vec2(-way.y, way.x), pixels = vec2(place.zw);
        vec2 half_size = radius * vec2(shape.y, 1.0);
        vec2 fine = pixels / (2.0 * half_size);
        axes = vec4(way * fine.x, across * fine.y);
        q *= half_size * (1.0 + 1.0 / pixels) + 1.0;
        vec2 corner = spot.xy + q.x * way + q.y * across;
        gl_Position = vec4((corner / canvas * 2.0 - 1.0) * vec2(1.0, -1.0), 0.0, 1.0);
        return;
      }
      float brightest = max(light.r, max(light.g, light.b));
      float reach = brightest * ${FlakePainter.HALO_LIGHT} > ${FlakePainter.FAINTEST} ? ${FlakePainter.HALO_WIDTH} : 1.0;
      if (radius < 8.0) light *= evened(streak.x, streak.y);
      q *= radius * vec2(streak.x + reach, reach) + 0.5;
      vec2 p = spot.xy + q.x * way + q.y * vec2(-way.y, way.x);
      gl_Position = vec4((p / canvas * 2.0 - 1.0) * vec2(1.0, -1.0), 0.0, 1.0);
    }`;

  static FRAGMENT = `#version 300 es
    precision highp float;
    precision highp int;
    precision highp sampler2D;
    uniform vec2 canvas;
    uniform sampler2D page;
    uniform int tinted, straight, linear;
    flat in ivec4 place;
    flat in int turned;
    flat in vec4 axes;
    flat in vec3 light;
    flat in vec4 spot;
    flat in vec2 streak;
    out vec4 shown;
    ${FlakePainter.WEIGHTS}

    vec3 toLight(vec3 v) {
      return mix(pow((v + 0.055) / 1.055, vec3(2.4)), v / 12.92, lessThanEqual(v, vec3(0.04045)));
    }

    /** What a pixel of the cell shows over black; of a mask, its brightest channel. */
    vec3 texel(ivec2 at) {
      if (any(lessThan(at, ivec2(0))) || any(greaterThanEqual(at, place.zw))) return vec3(0.0);
      if (turned == 1) at = ivec2(place.w - 1 - at.y, at.x);  // it lies rotated clockwise
      vec4 pixel = texelFetch(page, place.xy + at, 0);
      vec3 seen = toLight(straight == 1 && linear == 0 ? pixel.rgb * pixel.a : pixel.rgb);
      if (straight == 1 && linear == 1) seen *= pixel.a;
      return tinted == 1 ? vec3(max(seen.r, max(seen.g, seen.b))) : seen;
    }

    vec3 between(vec2 at) {
      ivec2 corner = ivec2(floor(at));
      vec2 f = at - vec2(corner);
      return mix(
        mix(texel(corner), texel(corner + ivec2(1, 0)), f.x),
        mix(texel(corner + ivec2(0, 1)), texel(corner + ivec2(1)), f.x),
        f.y);
    }

    /** The mean over a pixel: of as many samples as it covers pixels of the cell. */
    vec3 picture(vec2 off) {
      float finest = max(length(axes.xy), length(axes.zw));
      int count = clamp(int(ceil(finest - 1e-3)), 1, ${FlakePainter.SAMPLES});
      vec3 sum = vec3(0.0);
      for (int i = 0; i < count * count; i++) {
        vec2 d = off + (vec2(i % count, i / count) + 0.5) / float(count) - 0.5;
        sum += between(vec2(dot(d, axes.xy), dot(d, axes.zw)) + vec2(place.zw - 1) * 0.5);
      }
      return sum / float(count * count);
    }

    void main() {
      vec2 pixel = vec2(gl_FragCoord.x, canvas.y - gl_FragCoord.y);
      if (place.z > 0) {
        vec3 value = light * picture(pixel - spot.xy);
        vec3 painted = min(value, 254.0 / 255.0);
        shown = vec4(tinted == 1 ? value : painted / (1.0 - painted), 1.0);
        return;
      }
      vec2 weight = weights(placeOf(pixel, spot), streak.x, streak.y);
      shown = vec4(light * (weight.x + weight.y), 1.0);
    }`;
}
