// Fire of heat (atlas.pixels: heat, heat4) for three.js. Needs heat.js beside it.
//
//   const fire = new FireHeat(atlas, page, ramp);    // campfire.json; textures of its PNG and ramp
//   fire.mesh.position.set(0, 1, -5);                 // the pivot of the fire; 1 unit = 1 px
//   fire.mesh.scale.setScalar(0.01);
//   scene.add(fire.mesh);
//   ...
//   fire.show(seconds * 24);                          // 2.5: heat of half frame 2, half frame 3
//   fire.set({ row: 1, threshold: 0.3 });             // another ramp of the PNG; the fire dies
//   fire.set({ ramp: other, row: 0 });                // a ramp of your own
//
// Colours are written as they are, as atlas.blend_space: srgb is meant: draw it to the canvas itself.

import * as THREE from "three";
import { HeatFrames, LOOK_UP } from "./heat.js";

const VERTEX = `
  varying vec2 at;
  uniform vec2 size;
  void main() {
    at = vec2(uv.x, 1.0 - uv.y) * size;
    gl_Position = projectionMatrix * modelViewMatrix * vec4(position, 1.0);
  }`;

const FRAGMENT = `
  varying vec2 at;
  ${LOOK_UP}
  void main() { gl_FragColor = colourAt(at); }`;

/** A texture as data: its values are no colours, and its first row is at the top. */
function asData(texture, format = THREE.RGBAFormat) {
  return Object.assign(texture, {
    format, colorSpace: THREE.NoColorSpace, flipY: false, premultiplyAlpha: false, generateMipmaps: false,
    minFilter: THREE.LinearFilter, needsUpdate: true,
  });
}

export class FireHeat {
  /** `animation`: its name in the JSON; the first one, if none is given. */
  constructor(atlas, page, ramp, animation) {
    this.frames = new HeatFrames(atlas, animation);
    const { size: [width, height], pivot: [x, y], pageSize } = this.frames;
    const format = this.frames.isOneChannel ? THREE.RedFormat : THREE.RGBAFormat;
    const uniforms = { page: asData(page, format), pageSize, size: [width, height], threshold: 0, row: 0 };
    const geometry = new THREE.PlaneGeometry(width, height);
    geometry.translate(width / 2 - x, y - height / 2, 0);
    this.mesh = new THREE.Mesh(geometry, new THREE.ShaderMaterial({
      vertexShader: VERTEX, fragmentShader: FRAGMENT, uniforms: {}, depthWrite: false, transparent: true,
      blending: THREE.CustomBlending, blendSrc: THREE.OneFactor, blendDst: THREE.OneMinusSrcAlphaFactor,
    }));
    this.set({ ...uniforms, ramp });
    this.show(0);
  }

  /** Show a moment, in frames. */
  show(moment) {
    this.set(this.frames.at(moment));
  }

  /** Change `ramp` (a texture), `row` of it, `threshold`. */
  set(values) {
    const { uniforms } = this.mesh.material;
    const made = values.ramp ? { ramp: asData(values.ramp), rows: values.ramp.image.height } : {};
    for (const [name, value] of Object.entries({ ...values, ...made })) uniforms[name] = { value };
  }
}
