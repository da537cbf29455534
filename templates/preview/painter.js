/**
 * Draws pages as a client blends them, pixel for pixel, on a WebGL2 canvas.
 *
 * Page bytes reach the shader as they are in the file: neither premultiplied nor colour-managed.
 *
 *   straight        rgb · a + background · (1 − a)
 *   premultiplied   rgb     + background · (1 − a)
 *   additive        rgb     + background
 *
 * on sRGB values where the client blends in sRGB, on light where it blends in linear space.
 */
class Painter {
  static ALPHA = { straight: 0, premultiplied: 1, additive: 2 };
  static MODE = { frame: 0, overlay: 1, difference: 2 };

  constructor(canvas, { alpha, blendSpace }) {
    this.canvas = canvas;
    this.blend = { alpha: Painter.ALPHA[alpha], linear: blendSpace === "linear" };
    const gl = canvas.getContext("webgl2", {
      alpha: false, antialias: false, depth: false, preserveDrawingBuffer: true,
    });
    if (!gl) throw new Error("this browser has no WebGL 2, which draws the pages exactly");
    this.gl = gl;
    this.program = new Program(gl, Painter.VERTEX, Painter.FRAGMENT);
    this.textures = new Map();
    this.flakes = gl.getExtension("EXT_color_buffer_float") && new FlakePainter(gl);
  }

  /** Keep the image of page `index`, an ImageBitmap whose alpha is not premultiplied. */
  keep(index, image) {
    const gl = this.gl;
    const largest = gl.getParameter(gl.MAX_TEXTURE_SIZE);
    if (Math.max(image.width, image.height) > largest) {
      throw new Error(`this graphics card shows pages up to ${largest} px; use atlas.max_size`);
    }
    const texture = gl.createTexture();
    gl.bindTexture(gl.TEXTURE_2D, texture);
    gl.pixelStorei(gl.UNPACK_COLORSPACE_CONVERSION_WEBGL, gl.NONE);
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA8, gl.RGBA, gl.UNSIGNED_BYTE, image);
    sampleNearest(gl);
    this.textures.set(index, texture);
    image.close();
  }

  /**
   * Draw one cell, or two over each other, on a canvas of `size`.
   *
   * A cell has page, x, y, width, height, turned and its left and top on the canvas, in px.
   * `backdrop` is {colour: [r, g, b] in 0..1, square: px of a checkerboard, or 0 for none}.
   * `flakes` is {rows, first, count, offset, scale} to add the light of, or nothing.
   */
  draw(cells, mode, size, backdrop, flakes = null) {
    const gl = this.gl;
    if (this.canvas.width !== size[0] || this.canvas.height !== size[1]) {
      [this.canvas.width, this.canvas.height] = size;
    }
    if (flakes) this.flakes.draw(flakes, size);
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    gl.viewport(0, 0, ...size);
    const program = this.program.use();
    cells.forEach((cell, i) => {
      gl.activeTexture(gl.TEXTURE0 + i);
      gl.bindTexture(gl.TEXTURE_2D, this.textures.get(cell.page));
      program.integers(`page${i}`, i);
      program.integers(`cells[${i}].place`, cell.x, cell.y, cell.width, cell.height);
      program.integers(`cells[${i}].offset`, cell.left, cell.top);
      program.integers(`cells[${i}].turned`, cell.turned ? 1 : 0);
    });
    gl.activeTexture(gl.TEXTURE2);
    gl.bindTexture(gl.TEXTURE_2D, flakes ? this.flakes.light : null);
    program.integers("flakes", 2);
    program.integers("lit", flakes ? 1 : 0);
    program.integers("mode", Painter.MODE[mode]);
    program.integers("alphaMode", this.blend.alpha);
    program.integers("linear", this.blend.linear ? 1 : 0);
    program.integers("canvas", ...size);
    program.integers("square", backdrop.square);
    gl.uniform3f(program.place("colour"), ...backdrop.colour);
    gl.drawArrays(gl.TRIANGLES, 0, 3);
  }

  static VERTEX = `#version 300 es
    void main() {  // one triangle that covers everything
      gl_Position = vec4(vec2(gl_VertexID % 2, gl_VertexID / 2) * 4.0 - 1.0, 0.0, 1.0);
    }`;

  static FRAGMENT = `#version 300 es
    precision highp float;
    precision highp int;
    precision highp sampler2D;

    struct Cell { ivec4 place; ivec2 offset; int turned; };
    uniform Cell cells[2];
    uniform sampler2D page0, page1, flakes;
    uniform int mode, alphaMode, linear, lit, square;
    uniform ivec2 canvas;
    uniform vec3 colour;
    out vec4 shown;

    vec3 toLight(vec3 v) {
      return mix(pow((v + 0.055) / 1.055, vec3(2.4)), v / 12.92, lessThanEqual(v, vec3(0.04045)));
    }
    vec3 toSrgb(vec3 v) {
      v = clamp(v, 0.0, 1.0);
      vec3 high = 1.055 * pow(max(v, 1e-9), vec3(1.0 / 2.4)) - 0.055;
      return mix(high, v * 12.92, lessThanEqual(v, vec3(0.0031308)));
    }

    /** The stored pixel of a cell at p; nothing outside of it. */
    vec4 stored(sampler2D page, Cell cell, ivec2 p) {
      ivec2 q = p - cell.offset, size = cell.place.zw;
      if (any(lessThan(q, ivec2(0))) || any(greaterThanEqual(q, size))) return vec4(0.0);
      if (cell.turned == 1) q = ivec2(size.y - 1 - q.y, q.x);  // it lies turned clockwise
      return texelFetch(page, cell.place.xy + q, 0);
    }

    vec3 blended(vec4 pixel, vec3 behind) {
      vec3 rgb = pixel.rgb;
      if (linear == 1) { rgb = toLight(rgb); behind = toLight(behind); }
      vec3 sum = (alphaMode == 0 ? rgb * pixel.a : rgb)
               + (alphaMode == 2 ? behind : behind * (1.0 - pixel.a));
      return linear == 1 ? toSrgb(sum) : clamp(sum, 0.0, 1.0);
    }

    float grey(vec3 v) { return dot(v, vec3(0.2126, 0.7152, 0.0722)); }

    void main() {
      ivec2 p = ivec2(gl_FragCoord.xy);
      vec3 light = lit == 1 ? texelFetch(flakes, p, 0).rgb : vec3(0.0);
      p.y = canvas.y - 1 - p.y;
      vec3 behind = colour;
      if (square > 0) behind = vec3(((p.x / square + p.y / square) % 2 == 0) ? 0.16 : 0.24);
      vec3 first = blended(stored(page0, cells[0], p), behind);
      if (lit == 1) {
        light /= max(1.0, max(light.r, max(light.g, light.b)));  // keeps its hue
        first = toSrgb(toLight(first) + light);
      }
      shown = vec4(first, 1.0);
      if (mode == 0) return;
      vec3 second = blended(stored(page1, cells[1], p), behind);
      if (mode == 1) shown.rgb = vec3(grey(second), vec2(grey(first)));
      else shown.rgb = min(4.0 * abs(first - second), 1.0);
    }`;
}
