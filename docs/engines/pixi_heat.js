// Fire of heat (atlas.pixels: heat, heat4) for PixiJS 8 with WebGL. Needs heat.js beside it.
//
//   const data = { alphaMode: "premultiplied-alpha" };         // pages and ramps are data: as they are
//   const page = await PIXI.Assets.load({ src: "campfire.png", data });
//   const ramp = await PIXI.Assets.load({ src: "campfire.ramp.png", data });
//   const fire = new FireHeat(await (await fetch("campfire.json")).json(), page, ramp);
//   fire.position.set(400, 300);                               // its pivot
//   app.stage.addChild(fire);
//   ...
//   fire.show(seconds * 24);                                   // 2.5: heat of half frame 2, half frame 3
//   fire.set({ row: 1, threshold: 0.3 });                      // another ramp of the PNG; the fire dies
//   fire.set({ ramp: other, row: 0 });                         // a ramp of your own

import { Mesh, MeshGeometry, Shader } from "pixi.js";
import { HeatFrames, LOOK_UP } from "./heat.js";

const VERTEX = `
  attribute vec2 aPosition;
  attribute vec2 aUV;
  uniform mat3 uProjectionMatrix;
  uniform mat3 uWorldTransformMatrix;
  uniform mat3 uTransformMatrix;
  varying vec2 at;
  void main() {
    at = aUV;
    mat3 matrix = uProjectionMatrix * uWorldTransformMatrix * uTransformMatrix;
    gl_Position = vec4((matrix * vec3(aPosition, 1.0)).xy, 0.0, 1.0);
  }`;

const FRAGMENT = `
  precision highp float;
  varying vec2 at;
  uniform vec4 uColor;
  ${LOOK_UP}
  void main() { gl_FragColor = colourAt(at) * uColor; }`;

const TYPES = {
  pageSize: "vec2<f32>", here: "vec4<f32>", next: "vec4<f32>", hereTrim: "vec2<f32>", nextTrim: "vec2<f32>",
  hereChannel: "vec4<f32>", nextChannel: "vec4<f32>", blend: "f32", threshold: "f32", row: "f32", rows: "f32",
};

export class FireHeat extends Mesh {
  /** `animation`: its name in the JSON; the first one, if none is given. */
  constructor(atlas, page, ramp, animation) {
    const frames = new HeatFrames(atlas, animation);
    const { size: [width, height], pivot: [x, y], pageSize } = frames;
    const corners = [0, 0, width, 0, width, height, 0, height];
    const first = { pageSize, ...frames.at(0), threshold: 0, row: 0, rows: ramp.source.height };
    const heat = Object.fromEntries(
      Object.entries(TYPES).map(([name, type]) => [name, { value: first[name], type }]),
    );
    if (frames.isOneChannel) page.source.format = "r8unorm";
    page.source.scaleMode = ramp.source.scaleMode = "linear";
    super({
      geometry: new MeshGeometry({
        positions: new Float32Array(corners.map((corner, i) => corner - (i % 2 ? y : x))),
        uvs: new Float32Array(corners),
        indices: new Uint32Array([0, 1, 2, 0, 2, 3]),
      }),
      shader: Shader.from({
        gl: { vertex: VERTEX, fragment: FRAGMENT },
        resources: { page: page.source, ramp: ramp.source, heat },
      }),
    });
    this.frames = frames;
  }

  /** Show a moment, in frames. */
  show(moment) {
    this.set(this.frames.at(moment));
  }

  /** Change `ramp` (a texture), `row` of it, `threshold`. */
  set({ ramp, ...values }) {
    const { resources } = this.shader;
    if (ramp) {
      ramp.source.scaleMode = "linear";
      resources.ramp = ramp.source;
      values.rows = ramp.source.height;
    }
    Object.assign(resources.heat.uniforms, values);
  }
}
