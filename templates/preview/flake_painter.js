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

  static VERTEX = `#version 300 es
    in vec2 centre;
    in vec4 shape;  // size, stretch, rotation, tail
    in vec4 glow;
    uniform vec2 canvas, offset;
    uniform float scale;
    out vec2 q;
    out vec3 light;
    flat out float along;
    flat out float tail;
    void main() {
      light = glow.rgb * glow.a;
      tail = shape.w;
      along = shape.y - 1.0;
      float brightest = max(light.r, max(light.g, light.b));
      float reach = brightest * ${FlakePainter.HALO_LIGHT} > ${FlakePainter.FAINTEST} ? ${FlakePainter.HALO_WIDTH}.0 : 1.0;
      q = (vec2(gl_VertexID % 2, gl_VertexID / 2) * 2.0 - 1.0) * vec2(along + reach, reach);
      vec2 way = vec2(cos(shape.z), sin(shape.z));
      vec2 p = offset + scale * (centre + 0.5 * shape.x * (q.x * way + q.y * vec2(-way.y, way.x)));
      gl_Position = vec4((p / canvas * 2.0 - 1.0) * vec2(1.0, -1.0), 0.0, 1.0);
    }`;

  /** Lengths are in half widths: `q` is the place from the middle, `along` half the segment. */
  static FRAGMENT = `#version 300 es
    precision highp float;
    in vec2 q;
    in vec3 light;
    flat in float along;
    flat in float tail;
    out vec4 shown;
    void main() {
      float nearest = clamp(q.x, -along, along);
      float away = dot(q - vec2(nearest, 0.0), q - vec2(nearest, 0.0));
      float core = max(1.0 - away, 0.0);
      float halo = max(1.0 - away / ${FlakePainter.HALO_WIDTH ** 2}.0, 0.0);
      float fall = 0.5 + 0.5 * nearest / max(along, 1e-3);
      shown = vec4(light * mix(tail, 1.0, fall) * (core * core + ${FlakePainter.HALO_LIGHT} * halo * halo), 1.0);
    }`;
}
