// Pages of heat (atlas.pixels: heat, heat4): what three_heat.js, pixi_heat.js and phaser_heat.js share.

/** Looks colours up, GLSL ES 1.00: `colourAt(at)`, premultiplied; `at` is px from the frame's top left. */
export const LOOK_UP = `
  uniform sampler2D page;
  uniform sampler2D ramp;
  uniform vec2 pageSize;
  uniform vec4 here;         // on the page, px: left, top, width, height
  uniform vec4 next;
  uniform vec2 hereTrim;     // what is cut off the frame at its left and top, px
  uniform vec2 nextTrim;
  uniform vec4 hereChannel;  // 1 in the channel with the frame's heat
  uniform vec4 nextChannel;
  uniform float blend;       // 0: this frame, 1: the next
  uniform float threshold;   // heat that is taken away
  uniform float row;         // of the ramp
  uniform float rows;

  float heatOf(vec2 at, vec4 rect, vec2 trim, vec4 channel) {
    vec2 inside = step(trim, at) * step(at, trim + rect.zw);
    return inside.x * inside.y * dot(texture2D(page, (rect.xy + at - trim) / pageSize), channel);
  }

  vec4 colourAt(vec2 at) {
    float heat = mix(heatOf(at, here, hereTrim, hereChannel), heatOf(at, next, nextTrim, nextChannel), blend);
    heat = max(heat - threshold, 0.0);
    return texture2D(ramp, vec2((heat * 255.0 + 0.5) / 256.0, (row + 0.5) / rows));
  }`;

/** The frames of an animation of `atlas`, the JSON of a page; without a name, of its first one. */
export class HeatFrames {
  constructor(atlas, animation = Object.keys(atlas.animations)[0]) {
    if (atlas.meta.related_multi_packs?.length) throw new Error("several pages: raise atlas.max_size");
    this.frames = atlas.animations[animation].map((name) => atlas.frames[name]);
    if (this.frames.some(({ rotated }) => rotated)) throw new Error("rotated frames: set atlas.rotate to false");
    this.loops = atlas.meta.fireAtlas.loops[animation]; // else it ends with its last frame
    this.isOneChannel = atlas.meta.fireAtlas.heat.pixels === "heat"; // else all four have heat
    this.pageSize = [atlas.meta.size.w, atlas.meta.size.h];
    const { sourceSize, anchor } = this.frames[0];
    this.size = [sourceSize.w, sourceSize.h];
    this.pivot = [anchor.x * sourceSize.w, anchor.y * sourceSize.h];
  }

  /** Uniforms of a moment, in frames: 2.25 is a quarter of the way from frame 2 to frame 3. */
  at(moment) {
    const time = this.loops ? moment : Math.min(Math.max(moment, 0), this.frames.length - 1);
    const i = Math.floor(time);
    return { ...this.#uniforms(i, "here"), ...this.#uniforms(i + 1, "next"), blend: time - i };
  }

  #uniforms(i, name) {
    const { frame, spriteSourceSize: trim, channel = "r" } = this.frames.at(i % this.frames.length);
    return {
      [name]: [frame.x, frame.y, frame.w, frame.h],
      [`${name}Trim`]: [trim.x, trim.y],
      [`${name}Channel`]: [..."rgba"].map((each) => Number(each === channel)),
    };
  }
}
