// Fire of heat (atlas.pixels: heat, heat4) for Phaser 3 and 4 with WebGL. Needs heat.js beside it.
//
//   // preload
//   this.load.json("fire", "campfire.json");
//   this.load.image("page", "campfire.png");
//   this.load.image("ramp", "campfire.ramp.png");
//   // create
//   const picture = (key) => this.textures.get(key).getSourceImage();
//   this.fire = new FireHeat(this, 400, 300, this.cache.json.get("fire"), picture("page"), picture("ramp"));
//   this.add.existing(this.fire);                              // 400, 300: its pivot
//   // update
//   this.fire.show(seconds * 24);                              // 2.5: heat of half frame 2, half frame 3
//   this.fire.set({ row: 1, threshold: 0.3 });                 // another ramp of the PNG; the fire dies
//   this.fire.set({ ramp: picture("other"), row: 0 });         // a ramp of your own

import Phaser from "phaser";
import { HeatFrames, LOOK_UP } from "./heat.js";

const VERTEX = `
  attribute vec2 corner;
  uniform vec2 size;
  uniform vec2 pivot;
  uniform vec2 screen;
  uniform mat3 placed;
  varying vec2 at;
  void main() {
    at = corner * size;
    vec2 px = (placed * vec3(at - pivot, 1.0)).xy;
    gl_Position = vec4(vec2(2.0, -2.0) * px / screen + vec2(-1.0, 1.0), 0.0, 1.0);
  }`;

const FRAGMENT = `
  precision highp float;
  varying vec2 at;
  uniform float opacity;
  ${LOOK_UP}
  void main() { gl_FragColor = colourAt(at) * opacity; }`;

/** Compile and link. */
function programOf(gl) {
  const program = gl.createProgram();
  for (const [type, source] of [[gl.VERTEX_SHADER, VERTEX], [gl.FRAGMENT_SHADER, FRAGMENT]]) {
    const shader = gl.createShader(type);
    gl.shaderSource(shader, source);
    gl.compileShader(shader);
    gl.attachShader(program, shader);
  }
  gl.linkProgram(program);
  if (!gl.getProgramParameter(program, gl.LINK_STATUS)) throw new Error(gl.getProgramInfoLog(program));
  return program;
}

/** Upload an image as it is: what Phaser makes of it has colours that are multiplied by alpha. */
function textureOf(gl, image, format = gl.RGBA) {
  const texture = gl.createTexture();
  gl.bindTexture(gl.TEXTURE_2D, texture);
  gl.pixelStorei(gl.UNPACK_PREMULTIPLY_ALPHA_WEBGL, false);
  gl.pixelStorei(gl.UNPACK_FLIP_Y_WEBGL, false);
  gl.texImage2D(gl.TEXTURE_2D, 0, format, format, gl.UNSIGNED_BYTE, image);
  gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_WRAP_S, gl.CLAMP_TO_EDGE);
  gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_WRAP_T, gl.CLAMP_TO_EDGE);
  gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, gl.LINEAR);
  gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MAG_FILTER, gl.LINEAR);
  return texture;
}

export class FireHeat extends Phaser.GameObjects.Extern {
  /** `page`, `ramp`: images. `animation`: its name in the JSON; the first one, if none is given. */
  constructor(scene, x, y, atlas, page, ramp, animation) {
    super(scene);
    this.setPosition(x, y);
    this.gl = scene.sys.renderer.gl;
    this.frames = new HeatFrames(atlas, animation);
    const { size, pivot, pageSize } = this.frames;
    this.values = { size, pivot, pageSize, threshold: 0, row: 0 };
    this.program = programOf(this.gl);
    this.page = textureOf(this.gl, page, this.frames.isOneChannel ? this.gl.LUMINANCE : this.gl.RGBA);
    this.quad = this.gl.createBuffer();
    this.gl.bindBuffer(this.gl.ARRAY_BUFFER, this.quad);
    this.gl.bufferData(this.gl.ARRAY_BUFFER, new Float32Array([0, 0, 1, 0, 0, 1, 1, 1]), this.gl.STATIC_DRAW);
    this.set({ ramp });
    this.show(0);
  }

  /** Show a moment, in frames. */
  show(moment) {
    this.set(this.frames.at(moment));
  }

  /** Change `ramp` (an image), `row` of it, `threshold`. */
  set({ ramp, ...values }) {
    if (ramp) {
      this.gl.deleteTexture(this.ramp ?? null);
      this.ramp = textureOf(this.gl, ramp);
      values.rows = ramp.height;
    }
    Object.assign(this.values, values);
  }

  /** Phaser calls it. */
  render(renderer, camera, { a, b, c, d, e, f }) {
    const { gl, program } = this;
    gl.useProgram(program);
    const where = (name) => gl.getUniformLocation(program, name);
    gl.uniformMatrix3fv(where("placed"), false, [a, b, 0, c, d, 0, e, f, 1]);
    const screen = [renderer.width, renderer.height];
    for (const [name, value] of Object.entries({ ...this.values, screen, opacity: this.alpha })) {
      const values = [value].flat();
      gl[`uniform${values.length}fv`](where(name), values);
    }
    [this.page, this.ramp].forEach((texture, unit) => {
      gl.activeTexture(gl.TEXTURE0 + unit);
      gl.bindTexture(gl.TEXTURE_2D, texture);
      gl.uniform1i(where(unit ? "ramp" : "page"), unit);
    });
    gl.bindBuffer(gl.ARRAY_BUFFER, this.quad);
    const corner = gl.getAttribLocation(program, "corner");
    gl.enableVertexAttribArray(corner);
    gl.vertexAttribPointer(corner, 2, gl.FLOAT, false, 0, 0);
    gl.enable(gl.BLEND);
    gl.blendFunc(gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
    gl.drawArrays(gl.TRIANGLE_STRIP, 0, 4);
  }
}
