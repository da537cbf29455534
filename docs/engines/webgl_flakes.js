/**
 * Flies the flakes of a fire over its flame, with WebGL 2 and no library.
 *
 *   const flakes = new FlakePlayer(gl, await (await fetch("campfire.flakes.json")).json());
 *   flakes.draw(2.5, round, flame); // half way from frame 2 to frame 3 of the animation
 *
 * All light is added up in a texture of half floats, linear, and shown once: each channel x as
 * x / (1 + x). `flame` is a texture of the canvas' size with the frame as it is shown over black,
 * premultiplied and sRGB, or nothing. What is drawn is premultiplied sRGB.
 */
export class FlakePlayer {
  static COLUMNS = ["x", "y", "vx", "vy", "size", "stretch", "rotation", "tail", "r", "g", "b", "a"];

  constructor(gl, tracks) {
    if (!gl.getExtension("EXT_color_buffer_float")) throw new Error("cannot draw into half floats");
    this.gl = gl;
    this.fps = tracks.fps;
    this.size = tracks.size;
    this.rounds = tracks.rounds;
    this.count = tracks.frame_count / tracks.rounds; // frames of the animation
    const places = FlakePlayer.COLUMNS.map((name) => tracks.columns.indexOf(name));
    this.frames = tracks.frames.map(({ rows }) =>
      new Float32Array(rows.flatMap((row) => places.map((place) => row[place]))));
    const { halo } = tracks.light;
    this.sum = program(gl, FlakePlayer.FLAKE(...halo), FlakePlayer.LIGHT(...halo));
    this.show = program(gl, FlakePlayer.WHOLE, FlakePlayer.SHOWN);
    this.array = gl.createVertexArray();
    gl.bindVertexArray(this.array);
    gl.bindBuffer(gl.ARRAY_BUFFER, (this.buffer = gl.createBuffer()));
    ["motion", "shape", "glow"].forEach((name, i) => {
      const place = gl.getAttribLocation(this.sum, name);
      gl.enableVertexAttribArray(place);
      gl.vertexAttribPointer(place, 4, gl.FLOAT, false, 48, 16 * i);
      gl.vertexAttribDivisor(place, 1);
    });
    gl.bindVertexArray(null);
    this.light = gl.createTexture();
    gl.bindTexture(gl.TEXTURE_2D, this.light);
    gl.texStorage2D(gl.TEXTURE_2D, 1, gl.RGBA16F, gl.drawingBufferWidth, gl.drawingBufferHeight);
    gl.bindFramebuffer(gl.FRAMEBUFFER, (this.target = gl.createFramebuffer()));
    gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.TEXTURE_2D, this.light, 0);
    this.none = gl.createTexture();
    gl.bindTexture(gl.TEXTURE_2D, this.none);
    gl.texStorage2D(gl.TEXTURE_2D, 1, gl.RGBA8, 1, 1);
  }

  /** Draw frame `time`, with the part that has passed of it, of the animation's n-th round from 0. */
  draw(time, round = 0, flame = null) {
    const gl = this.gl;
    const frame = Math.min(Math.floor(time), this.count - 1);
    const rows = this.frames[(round % this.rounds) * this.count + frame];
    gl.viewport(0, 0, gl.drawingBufferWidth, gl.drawingBufferHeight);
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.target);
    gl.clearColor(0, 0, 0, 0);
    gl.clear(gl.COLOR_BUFFER_BIT);
    gl.useProgram(this.sum);
    gl.uniform2f(gl.getUniformLocation(this.sum, "size"), ...this.size);
    gl.uniform2f(gl.getUniformLocation(this.sum, "canvas"), gl.drawingBufferWidth, gl.drawingBufferHeight);
    gl.uniform1f(gl.getUniformLocation(this.sum, "passed"), (time - frame) / this.fps);
    gl.bindVertexArray(this.array);
    gl.bindBuffer(gl.ARRAY_BUFFER, this.buffer);
    gl.bufferData(gl.ARRAY_BUFFER, rows, gl.STREAM_DRAW);
    gl.enable(gl.BLEND);
    gl.blendFunc(gl.ONE, gl.ONE);
    gl.drawArraysInstanced(gl.TRIANGLE_STRIP, 0, 4, rows.length / FlakePlayer.COLUMNS.length);
    gl.disable(gl.BLEND);
    gl.bindVertexArray(null);
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    gl.useProgram(this.show);
    [["light", this.light], ["flame", flame ?? this.none]].forEach(([name, texture], unit) => {
      gl.activeTexture(gl.TEXTURE0 + unit);
      gl.bindTexture(gl.TEXTURE_2D, texture);
      gl.uniform1i(gl.getUniformLocation(this.show, name), unit);
    });
    gl.uniform1i(gl.getUniformLocation(this.show, "hasFlame"), flame ? 1 : 0);
    gl.drawArrays(gl.TRIANGLES, 0, 3);
  }

  /** Lengths in half widths: place, and how much longer than wide. Light of a flake, and of its halo. */
  static WEIGHTS = (light, width) => `
    float soft(vec2 at, float tail) {
      float inside = max(1.0 - abs(at.x * at.x * at.x) - at.y * at.y, 0.0);
      return mix(tail, 1.0, 0.5 + 0.5 * at.x) * inside * inside * inside;
    }
    vec2 weights(vec2 place, vec2 streak) {
      vec2 halo = place / (vec2(streak.x, 0.0) + float(${width}));
      return vec2(soft(place / vec2(streak.x + 1.0, 1.0), streak.y), float(${light}) * soft(halo, streak.y));
    }
    vec2 placeOf(vec2 pixel, vec4 spot) {
      vec2 off = pixel - spot.xy;
      return vec2(dot(off, spot.zw), dot(off, vec2(-spot.w, spot.z)));
    }`;

  /** A quad as large as the flake and its halo, whose pixels add up to its light wherever it lies. */
  static FLAKE = (light, width) => `#version 300 es
    in vec4 motion; // x, y, vx, vy
    in vec4 shape; // size, stretch, rotation, tail
    in vec4 glow;
    uniform vec2 size, canvas;
    uniform float passed;
    flat out vec3 full;
    flat out vec4 spot; // centre, px; along the flake, in half widths a px
    flat out vec2 streak; // how much longer than wide, in half widths; light at its tail
    ${FlakePlayer.WEIGHTS(light, width)}
    float evened() {
      float rate = length(spot.zw), sum = 0.0;
      vec2 reach = ((streak.x + 1.0) * abs(spot.zw) + abs(spot.wz)) / (rate * rate);
      for (float y = floor(spot.y - reach.y) + 0.5; y < spot.y + reach.y; y += 1.0) {
        for (float x = floor(spot.x - reach.x) + 0.5; x < spot.x + reach.x; x += 1.0) {
          sum += weights(placeOf(vec2(x, y), spot), streak).x;
        }
      }
      // 1.0140310: the integral of (1 - |u|^3 - v^2)^3 where that is above 0.
      float whole = (0.5 + 0.5 * streak.y) * (streak.x + 1.0) * 1.0140310 / (rate * rate);
      return whole / max(sum, 1e-6);
    }
    void main() {
      float scale = canvas.y / size.y, radius = 0.5 * shape.x * scale;
      vec2 way = vec2(cos(shape.z), sin(shape.z));
      spot = vec4((motion.xy + motion.zw * passed) * scale, way / radius);
      streak = vec2(shape.y - 1.0, shape.w);
      full = glow.rgb * glow.a * (radius < 8.0 ? evened() : 1.0);
      vec2 q = vec2(gl_VertexID % 2, gl_VertexID / 2) * 2.0 - 1.0;
      q *= radius * (vec2(streak.x, 0.0) + float(${width})) + 0.5;
      vec2 p = spot.xy + mat2(way, -way.y, way.x) * q;
      gl_Position = vec4((p / canvas * 2.0 - 1.0) * vec2(1.0, -1.0), 0.0, 1.0);
    }`;

  static LIGHT = (light, width) => `#version 300 es
    precision highp float;
    uniform vec2 canvas;
    flat in vec3 full;
    flat in vec4 spot;
    flat in vec2 streak;
    out vec4 sum;
    ${FlakePlayer.WEIGHTS(light, width)}
    void main() {
      vec2 pixel = vec2(gl_FragCoord.x, canvas.y - gl_FragCoord.y);
      vec2 weight = weights(placeOf(pixel, spot), streak);
      sum = vec4(full * (weight.x + weight.y), 0.0);
    }`;

  static WHOLE = `#version 300 es
    void main() { gl_Position = vec4(vec2(gl_VertexID % 2, gl_VertexID / 2) * 4.0 - 1.0, 0.0, 1.0); }`;

  static SHOWN = `#version 300 es
    precision highp float;
    precision highp sampler2D;
    uniform sampler2D light, flame;
    uniform bool hasFlame;
    out vec4 shown;
    vec3 toLight(vec3 v) {
      return mix(pow((v + 0.055) / 1.055, vec3(2.4)), v / 12.92, lessThanEqual(v, vec3(0.04045)));
    }
    vec3 toSrgb(vec3 v) {
      vec3 high = 1.055 * pow(max(v, 1e-9), vec3(1.0 / 2.4)) - 0.055;
      return mix(high, v * 12.92, lessThanEqual(v, vec3(0.0031308)));
    }
    void main() {
      ivec2 p = ivec2(gl_FragCoord.xy);
      // The flame's rows begin at the top, as those of an image do.
      vec4 behind = hasFlame ? texelFetch(flame, ivec2(p.x, textureSize(flame, 0).y - 1 - p.y), 0) : vec4(0.0);
      // What is shown of y / (1 - y) is y. The flakes' light is added to that.
      vec3 seen = toLight(behind.rgb);
      vec3 added = texelFetch(light, p, 0).rgb * (1.0 - min(seen, 254.0 / 255.0));
      vec3 colour = toSrgb(max((seen + added) / (1.0 + added), seen));
      shown = vec4(colour, max(behind.a, max(colour.r, max(colour.g, colour.b))));
    }`;
}

function program(gl, vertex, fragment) {
  const made = gl.createProgram();
  for (const [kind, source] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
    const shader = gl.createShader(kind);
    gl.shaderSource(shader, source);
    gl.compileShader(shader);
    gl.attachShader(made, shader);
  }
  gl.linkProgram(made);
  if (!gl.getProgramParameter(made, gl.LINK_STATUS)) throw new Error(gl.getProgramInfoLog(made));
  return made;
}
