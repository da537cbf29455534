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
 *
 * Between two frames, at `part` of the way, both are sampled, weighed by their alpha and mixed. With
 * motion vectors `mv`, `mvNext` of their cells they are sampled at
 *
 *   p − mv · part,   p + mvNext · (1 − part)
 *
 *   unity, unreal   mv = (rg · 2 − 1) · scale
 *   godot           mv = (rg · 255 − 128) / 127 · scale
 */
class Painter {
  static ALPHA = { straight: 0, premultiplied: 1, additive: 2 };
  static MODE = { frame: 0, overlay: 1, difference: 2, between: 3 };

  constructor(canvas, { alpha, blendSpace, motion }) {
    this.canvas = canvas;
    this.motion = motion;
    this.blend = { alpha: Painter.ALPHA[alpha], linear: blendSpace === "linear" };
    const gl = canvas.getContext("webgl2", {
      alpha: false, antialias: false, depth: false, preserveDrawingBuffer: true,
    });
    if (!gl) throw new Error("this browser has no WebGL 2, which draws the pages exactly");
    this.gl = gl;
    this.program = new Program(gl, Painter.VERTEX, Painter.FRAGMENT);
    this.textures = new Map();
    this.person = { key: "", texture: gl.createTexture() };
    this.flakes = gl.getExtension("EXT_color_buffer_float") && new FlakePainter(gl, this.blend);
  }

  /**
   * Keep the image of page `index` of a sheet (composed, flame, flakes, motion), an ImageBitmap whose
   * alpha is not premultiplied.
   */
  keep(sheet, index, image) {
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
    this.textures.set(`${sheet} ${index}`, texture);
    image.close();
  }

  /** Begin anew on a canvas of `size` px in one colour, [r, g, b] in 0..1. */
  begin(size, colour = [0, 0, 0]) {
    const gl = this.gl;
    if (this.canvas.width !== size[0] || this.canvas.height !== size[1]) {
      [this.canvas.width, this.canvas.height] = size;
    }
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    gl.clearColor(...colour, 1);
    gl.clear(gl.COLOR_BUFFER_BIT);
  }

  /**
   * Draw one cell, or two over each other or one passing into the other, in a box of the canvas.
   *
   * A cell has sheet, page, x, y, width, height, rotated and its left and top on the stage, in px;
   * `bounds` is the part of the page, left, top, right and bottom, that samples of it may come from.
   * `box` is {x, y, width, height, left, top}: where it is, and where the stage begins in it.
   * `backdrop` is {colour: [r, g, b] in 0..1, square: px of a checkerboard, or 0 for none, scene: what
   * `Scene.of` gives, or nothing}.
   * `flakes` is {rows, first, count, offset, scale, page, cells, tinted} to add the light of, or
   * nothing; `cells` of a texture lie on a page.
   * `between` is {part, vectors}: how much of the way is over, and whether it goes along vectors.
   */
  draw(cells, mode, box, backdrop, flakes = null, between = { part: 0, vectors: false }) {
    const gl = this.gl;
    const size = [box.width, box.height];
    if (flakes) this.flakes.draw(flakes, this.textures.get(`composed ${flakes.page}`) ?? null, size);
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    const bottom = this.canvas.height - box.y - box.height;
    gl.viewport(box.x, bottom, ...size);
    const program = this.program.use();
    const bind = (name, unit, texture) => {
      gl.activeTexture(gl.TEXTURE0 + unit);
      gl.bindTexture(gl.TEXTURE_2D, texture);
      program.integers(name, unit);
    };
    cells.forEach((cell, i) => {
      bind(`page${i}`, i, this.textures.get(`${cell.sheet} ${cell.page}`));
      bind(`motion${i}`, 3 + i, between.vectors ? this.textures.get(`motion ${cell.page}`) : null);
      program.integers(`cells[${i}].bounds`, ...cell.bounds);
      program.integers(`cells[${i}].place`, cell.x, cell.y, cell.width, cell.height);
      program.integers(`cells[${i}].offset`, cell.left, cell.top);
      program.integers(`cells[${i}].rotated`, cell.rotated ? 1 : 0);
    });
    bind("flakes", 2, flakes ? this.flakes.light : null);
    gl.uniform1f(program.place("part"), between.part);
    gl.uniform2f(program.place("scale"), ...(between.vectors ? this.motion.pixels : [0, 0]));
    gl.uniform2f(program.place("bytes"), this.motion?.zero ?? 0, this.motion?.span ?? 1);
    program.integers("lit", flakes ? 1 : 0);
    program.integers("mode", Painter.MODE[mode]);
    program.integers("alphaMode", this.blend.alpha);
    program.integers("linear", this.blend.linear ? 1 : 0);
    program.integers("corner", box.x, bottom);
    program.integers("box", ...size);
    program.integers("stage", box.left, box.top);
    program.integers("square", backdrop.square);
    program.integers("hasRoom", backdrop.scene ? 1 : 0);
    if (backdrop.scene) this.furnish(backdrop.scene, program);
    bind("person", 5, backdrop.scene ? this.person.texture : null);
    gl.uniform3f(program.place("colour"), ...backdrop.colour);
    gl.drawArrays(gl.TRIANGLES, 0, 3);
  }

  /** Hand a scene to the program. */
  furnish({ unit, ground, edge, lamp, light, person }, program) {
    const gl = this.gl;
    Object.entries({ unit, ground, edge }).forEach(([name, px]) => gl.uniform1f(program.place(name), px));
    gl.uniform2f(program.place("lamp"), ...lamp);
    gl.uniform3f(program.place("lampLight"), ...light);
    if (this.person.key === person.key) return;
    this.person.key = person.key;
    gl.activeTexture(gl.TEXTURE0 + 5);
    gl.bindTexture(gl.TEXTURE_2D, this.person.texture);
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA8, gl.RGBA, gl.UNSIGNED_BYTE, person.canvas);
    sampleNearest(gl);
  }

  static VERTEX = `#version 300 es
    void main() {  // one triangle that covers everything
      gl_Position = vec4(vec2(gl_VertexID % 2, gl_VertexID / 2) * 4.0 - 1.0, 0.0, 1.0);
    }`;

  static FRAGMENT = `#version 300 es
    precision highp float;
    precision highp int;
    precision highp sampler2D;

    struct Cell { ivec4 place, bounds; ivec2 offset; int rotated; };
    uniform Cell cells[2];
    uniform sampler2D page0, page1, flakes, motion0, motion1;
    uniform int mode, alphaMode, linear, lit, square, hasRoom;
    uniform float part;
    uniform vec2 scale, bytes;
    uniform ivec2 corner, box, stage;  // of the box on the canvas, from below; its size; the stage in it
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

    ${Scene.GLSL}

    bool isIn(ivec2 p, ivec2 low, ivec2 high) {
      return all(greaterThanEqual(p, low)) && all(lessThan(p, high));
    }

    bool covers(Cell cell, ivec2 p) {
      return isIn(p, cell.offset, cell.offset + cell.place.zw);
    }

    /** What the client blends of the page at p; nothing beyond the cell's bounds. */
    vec4 texel(sampler2D page, Cell cell, ivec2 p) {
      ivec2 q = p - cell.offset;
      if (cell.rotated == 1) q = ivec2(cell.place.w - 1 - q.y, q.x);  // it lies rotated clockwise
      q += cell.place.xy;
      if (!isIn(q, cell.bounds.xy, cell.bounds.zw)) return vec4(0.0);
      vec4 pixel = texelFetch(page, q, 0);
      return linear == 1 ? vec4(toLight(pixel.rgb), pixel.a) : pixel;
    }

    vec4 weighed(vec4 pixel) {
      return alphaMode == 0 ? vec4(pixel.rgb * pixel.a, pixel.a) : pixel;
    }

    /** The frame at p; nothing outside of it. */
    vec4 still(sampler2D page, Cell cell, ivec2 p) {
      return covers(cell, p) ? weighed(texel(page, cell, p)) : vec4(0.0);
    }

    /** The frame at p plus so much of its motion there, between the pixels as a bilinear sampler. */
    vec4 moved(sampler2D page, sampler2D motion, Cell cell, ivec2 p, float way) {
      if (!covers(cell, p)) return vec4(0.0);
      vec2 rg = texelFetch(motion, cell.place.xy + p - cell.offset, 0).rg;
      vec2 mv = (rg * 255.0 - bytes.x) / bytes.y;
      vec2 at = vec2(p) + mv * scale * way;
      ivec2 q = ivec2(floor(at));
      vec2 f = at - vec2(q);
      return weighed(mix(
        mix(texel(page, cell, q), texel(page, cell, q + ivec2(1, 0)), f.x),
        mix(texel(page, cell, q + ivec2(0, 1)), texel(page, cell, q + ivec2(1)), f.x),
        f.y));
    }

    vec3 over(vec4 pixel, vec3 behind) {
      if (linear == 1) behind = toLight(behind);
      vec3 sum = pixel.rgb + (alphaMode == 2 ? behind : behind * (1.0 - pixel.a));
      return linear == 1 ? toSrgb(sum) : clamp(sum, 0.0, 1.0);
    }

    float grey(vec3 v) { return dot(v, vec3(0.2126, 0.7152, 0.0722)); }

    void main() {
      ivec2 p = ivec2(gl_FragCoord.xy) - corner;
      vec3 light = lit == 1 ? texelFetch(flakes, p, 0).rgb : vec3(0.0);
      p.y = box.y - 1 - p.y;
      vec3 behind = hasRoom == 1 ? toSrgb(room(vec2(p) + 0.5)) : colour;
      ivec2 tile = ivec2(gl_FragCoord.xy) / max(square, 1);
      if (square > 0) behind = vec3((tile.x + tile.y) % 2 == 0 ? 0.16 : 0.24);
      p -= stage;
      vec4 here = mode != 3 ? still(page0, cells[0], p) : mix(
        moved(page0, motion0, cells[0], p, -part), moved(page1, motion1, cells[1], p, 1.0 - part),
        part);
      vec3 first = over(here, behind);
      if (lit == 1) {
        // Film that shows y saw y / (1 - y): the flakes' light is added to that, then shown again.
        vec3 seen = toLight(first);
        vec3 added = light * (1.0 - min(seen, 254.0 / 255.0));
        first = toSrgb(max((seen + added) / (1.0 + added), seen));
      }
      shown = vec4(first, 1.0);
      if (mode == 0 || mode == 3) return;
      vec3 second = over(still(page1, cells[1], p), behind);
      if (mode == 1) shown.rgb = vec3(grey(second), vec2(grey(first)));
      else shown.rgb = min(4.0 * abs(first - second), 1.0);
    }`;
}
