/**
 * Adds up the light of flakes, linear and beyond white, from the rows of their tracks: capsules with
 * halos, as the formats' page says.
 */
class FlakePainter {
  static FLOATS = 11;
  static HALO_LIGHT = 0.004; // relative to the flake's
  static HALO_WIDTH = 4;
  static FAINTEST = 1e-4; // light, linear, below which a halo is not drawn

  constructor(gl) {
    this.gl = gl;
    this.program = new Program(gl, FlakePainter.VERTEX, FlakePainter.FRAGMENT);
    this.light = gl.createTexture();
    this.target = gl.createFramebuffer();
    this.buffer = gl.createBuffer();
    this.array = gl.createVertexArray();
    this.size = [0, 0];
    gl.bindVertexArray(this.array);
    gl.bindBuffer(gl.ARRAY_BUFFER, this.buffer);
    // Rows are id, x, y, size, stretch, rotation, tail, r, g, b, a.
    for (const [name, first, floats] of [["centre", 1, 2], ["shape", 3, 4], ["glow", 7, 4]]) {
      const place = gl.getAttribLocation(this.program.program, name);
      gl.enableVertexAttribArray(place);
      gl.vertexAttribPointer(place, floats, gl.FLOAT, false, 4 * FlakePainter.FLOATS, 4 * first);
      gl.vertexAttribDivisor(place, 1);
    }
    gl.bindVertexArray(null);
  }

  draw({ rows, first, count, offset, scale }, size) {
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
   * Light at a place of a capsule, relative to that at its head: its own, and its halo's. Lengths are in
   * half widths; `along` is half the segment.
   */
  static WEIGHTS = `
    vec2 weights(vec2 place, float along, float tail) {
      float nearest = clamp(place.x, -along, along);
      float away = dot(place - vec2(nearest, 0.0), place - vec2(nearest, 0.0));
      float core = max(1.0 - away, 0.0);
      float halo = max(1.0 - away / ${FlakePainter.HALO_WIDTH ** 2}.0, 0.0);
      float fall = mix(tail, 1.0, 0.5 + 0.5 * nearest / max(along, 1e-3));
      return fall * vec2(core * core, ${FlakePainter.HALO_LIGHT} * halo * halo);
    }
    vec2 placeOf(vec2 pixel, vec4 spot) {
      vec2 off = pixel - spot.xy;
      return vec2(dot(off, spot.zw), dot(off, vec2(-spot.w, spot.z)));
    }`;

  static VERTEX = `#version 300 es
    in vec2 centre;
    in vec4 shape;  // size, stretch, rotation, tail
    in vec4 glow;
    uniform vec2 canvas, offset;
    uniform float scale;
    flat out vec3 light;
    flat out vec4 spot;  // centre, px; along the flake, in half widths a px
    flat out vec2 segment;  // half its length, light at its tail
    ${FlakePainter.WEIGHTS}

    /** The pixels of a small flake add up to its light wherever it lies between them. */
    float evened(float along, float tail) {
      float rate = length(spot.zw);
      vec2 reach = (along * abs(spot.zw) / rate + 1.0) / rate;
      float sum = 0.0;
      for (float y = floor(spot.y - reach.y) + 0.5; y < spot.y + reach.y; y += 1.0) {
        for (float x = floor(spot.x - reach.x) + 0.5; x < spot.x + reach.x; x += 1.0) {
          sum += weights(placeOf(vec2(x, y), spot), along, tail).x;
        }
      }
      float whole = (0.5 + 0.5 * tail) * (along * 32.0 / 15.0 + 1.0471976) / (rate * rate);
      return whole / max(sum, 1e-6);
    }

    void main() {
      float radius = 0.5 * shape.x * scale;
      vec2 way = vec2(cos(shape.z), sin(shape.z));
      spot = vec4(offset + scale * centre, way / radius);
      segment = vec2(shape.y - 1.0, shape.w);
      light = glow.rgb * glow.a;
      float brightest = max(light.r, max(light.g, light.b));
      float reach = brightest * ${FlakePainter.HALO_LIGHT} > ${FlakePainter.FAINTEST} ? ${FlakePainter.HALO_WIDTH}.0 : 1.0;
      if (radius < 8.0) light *= evened(segment.x, segment.y);
      vec2 q = vec2(gl_VertexID % 2, gl_VertexID / 2) * 2.0 - 1.0;
      q *= radius * vec2(segment.x + reach, reach) + 0.5;
      vec2 p = spot.xy + q.x * way + q.y * vec2(-way.y, way.x);
      gl_Position = vec4((p / canvas * 2.0 - 1.0) * vec2(1.0, -1.0), 0.0, 1.0);
    }`;

  static FRAGMENT = `#version 300 es
    precision highp float;
    uniform vec2 canvas;
    flat in vec3 light;
    flat in vec4 spot;
    flat in vec2 segment;
    out vec4 shown;
    ${FlakePainter.WEIGHTS}
    void main() {
      vec2 pixel = vec2(gl_FragCoord.x, canvas.y - gl_FragCoord.y);
      vec2 weight = weights(placeOf(pixel, spot), segment.x, segment.y);
      shown = vec4(light * (weight.x + weight.y), 1.0);
    }`;
}
