// The haze of a fire for three.js: the hot air bends what is behind it (maps.haze).
//
//   const haze = new FireHaze(renderer, atlas, texture);   // campfire.json, and campfire.haze.png
//   haze.mesh.position.set(0, 1, -5);                       // the pivot of the fire; 1 unit = 1 px
//   haze.mesh.scale.setScalar(0.01);
//   ...
//   haze.show(frame);                                       // as the fire does: 0, 1, 2 ...
//   haze.render(scene, camera);                             // the scene without the fire, bent
//   renderer.autoClear = false;
//   renderer.render(fire, camera);                          // the fire, drawn before it
//
// The texture is data: colorSpace THREE.NoColorSpace, generateMipmaps false, LinearFilter.

import * as THREE from "three";

const VERTEX = `
  varying vec2 onPage;
  uniform vec4 place; // of the frame, px of the page
  void main() {
    onPage = place.xy + vec2(uv.x, 1.0 - uv.y) * place.zw;
    gl_Position = projectionMatrix * modelViewMatrix * vec4(position, 1.0);
  }`;

const FRAGMENT = `
  varying vec2 onPage;
  uniform sampler2D haze;
  uniform sampler2D behind;
  uniform vec2 page;
  uniform vec2 screen;
  uniform float scale;
  uniform float strength;
  void main() {
    // 128 is no shift, exactly: there the picture stays as it is. Rows of the page go down.
    vec2 shift = (texture2D(haze, vec2(onPage.x, page.y - onPage.y) / page).rg * 255.0 - 128.0) / 127.0;
    if (max(abs(shift.x), abs(shift.y)) < 0.001) discard;
    // From px of the page to those of the screen, however the mesh is seen.
    mat2 pagePerPixel = mat2(dFdx(onPage), dFdy(onPage));
    vec2 moved = inverse(pagePerPixel) * (shift * scale * strength);
    gl_FragColor = texture2D(behind, (gl_FragCoord.xy + moved) / screen);
    #include <tonemapping_fragment>
    #include <colorspace_fragment>
  }`;

export class FireHaze {
  /** `atlas`: the JSON of the page that `texture`, its haze, belongs to. */
  constructor(renderer, atlas, texture) {
    this.renderer = renderer;
    this.frames = Object.values(atlas.frames);
    this.behind = new THREE.WebGLRenderTarget(1, 1, { type: THREE.HalfFloatType });
    const { w, h } = atlas.meta.size;
    this.material = new THREE.ShaderMaterial({
      vertexShader: VERTEX, fragmentShader: FRAGMENT, depthWrite: false, side: THREE.DoubleSide,
      uniforms: {
        haze: { value: texture }, behind: { value: this.behind.texture },
        page: { value: new THREE.Vector2(w, h) }, screen: { value: new THREE.Vector2() },
        scale: { value: atlas.meta.maps.find(({ kind }) => kind === "haze").scale },
        strength: { value: 1 }, place: { value: new THREE.Vector4() },
      },
    });
    this.mesh = new THREE.Group();
    this.quad = new THREE.Mesh(new THREE.PlaneGeometry(1, 1), this.material);
    this.mesh.add(this.quad);
    this.show(0);
  }

  /** Show the haze of a frame. */
  show(i) {
    const { frame, spriteSourceSize: trim, sourceSize: size, anchor } = this.frames[i];
    this.material.uniforms.place.value.set(frame.x, frame.y, frame.w, frame.h);
    this.quad.scale.set(frame.w, frame.h, 1);
    this.quad.position.set(
      trim.x + trim.w / 2 - anchor.x * size.w, anchor.y * size.h - (trim.y + trim.h / 2), 0,
    );
  }

  /** Draw `scene`, and before it the haze, which bends it. */
  render(scene, camera) {
    const { renderer, material, behind } = this;
    const screen = renderer.getDrawingBufferSize(material.uniforms.screen.value);
    behind.setSize(screen.x, screen.y);
    const [target, clears] = [renderer.getRenderTarget(), renderer.autoClear];
    renderer.setRenderTarget(behind);
    renderer.clear();
    renderer.render(scene, camera);
    renderer.setRenderTarget(target);
    renderer.render(scene, camera);
    renderer.autoClear = false;
    renderer.render(this.mesh, camera);
    renderer.autoClear = clears;
  }
}
