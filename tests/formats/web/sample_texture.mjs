// Loads a compressed texture in headless Chromium, by three's KTX2Loader or PixiJS's loader of DDS,
// samples each of its levels on the GPU, texel by texel, and writes them as RGBA bytes:
// node sample_texture.mjs MODULES FILE OUT.
import { readFileSync, writeFileSync } from "node:fs";
import { createServer } from "node:http";
import { createRequire } from "node:module";
import { join, normalize } from "node:path";

const [, , modules, file, out] = process.argv;
const { chromium } = createRequire(join(modules, "x.js"))("playwright-core");

const THREE = `<!DOCTYPE html><script type="importmap">{"imports": {
  "three": "/three/build/three.module.js", "loaders/": "/three/examples/jsm/loaders/"
}}</script><script type="module">
import * as THREE from "three";
import { KTX2Loader } from "loaders/KTX2Loader.js";
const renderer = new THREE.WebGLRenderer();
const loader = new KTX2Loader().detectSupport(renderer);
const texture = await loader.loadAsync("/texture.ktx2");
Object.assign(texture, { minFilter: THREE.NearestMipmapNearestFilter, magFilter: THREE.NearestFilter });
const material = new THREE.RawShaderMaterial({
  glslVersion: THREE.GLSL3, blending: THREE.NoBlending, depthTest: false,
  uniforms: { map: { value: texture }, level: { value: 0 } },
  vertexShader: "in vec3 position; void main() { gl_Position = vec4(position.xy, 0.0, 1.0); }",
  fragmentShader: "precision highp float; uniform sampler2D map; uniform int level; out vec4 seen;" +
    "void main() { seen = texelFetch(map, ivec2(gl_FragCoord.xy), level); }",
});
const scene = new THREE.Scene();
const quad = new THREE.Mesh(new THREE.PlaneGeometry(2, 2), material);
quad.frustumCulled = false;
scene.add(quad);
const levels = texture.mipmaps.map(({ width, height }, level) => {
  const target = new THREE.WebGLRenderTarget(width, height);
  material.uniforms.level.value = level;
  renderer.setRenderTarget(target);
  renderer.render(scene, new THREE.Camera());
  const pixels = new Uint8Array(4 * width * height);
  renderer.readRenderTargetPixels(target, 0, 0, width, height, pixels);
  return [...pixels];
});
window.seen = { levels, sizes: texture.mipmaps.map(({ width, height }) => [width, height]),
  space: texture.colorSpace, premultiplied: texture.premultiplyAlpha };
</script>`;

const PIXI = `<!DOCTYPE html><script src="/pixi.js/dist/pixi.min.js"></script><script type="module">
PIXI.extensions.add(PIXI.loadDDS); // pixi.js/dds does
const texture = await PIXI.Assets.load("/texture.dds");
const { source } = texture;
source.alphaMode = "premultiplied-alpha";
Object.assign(source.style, { scaleMode: "nearest", mipmapFilter: "nearest" });
const app = new PIXI.Application();
await app.init({ preference: "webgl", backgroundAlpha: 0, antialias: false, autoStart: false,
  preserveDrawingBuffer: true });
const sprite = app.stage.addChild(new PIXI.Sprite(texture));
const sizes = source.resource.map((_, level) => [source.width >> level, source.height >> level]);
const { gl } = app.renderer;
const levels = sizes.map(([width, height], level) => {
  app.renderer.resize(width, height);
  sprite.scale.set(0.5 ** level);
  app.render();
  const pixels = new Uint8Array(4 * width * height);
  gl.bindFramebuffer(gl.FRAMEBUFFER, null);
  gl.readPixels(0, 0, width, height, gl.RGBA, gl.UNSIGNED_BYTE, pixels);
  const rows = [...Array(height).keys()].reverse();
  return rows.flatMap((row) => [...pixels.subarray(4 * width * row, 4 * width * (row + 1))]);
});
window.seen = { levels, sizes };
</script>`;

const server = createServer((request, response) => {
  const path = normalize(request.url);
  const type = path === "/" ? "text/html" : path.endsWith(".js") ? "text/javascript" : "";
  response.setHeader("Content-Type", type || "application/octet-stream");
  try {
    if (path === "/") response.end(file.endsWith(".dds") ? PIXI : THREE);
    else response.end(readFileSync(path.startsWith("/texture.") ? file : join(modules, path)));
  } catch {
    response.writeHead(404).end();
  }
});
await new Promise((listening) => server.listen(0, "127.0.0.1", listening));
const browser = await chromium.launch({
  executablePath: process.env.CHROMIUM || "/usr/bin/chromium",
  args: ["--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"],
});
const page = await browser.newPage();
page.on("pageerror", (error) => console.error(String(error)));
await page.goto(`http://127.0.0.1:${server.address().port}/`);
await page.waitForFunction(() => window.seen, null, { timeout: 60000 });
const { levels, ...seen } = await page.evaluate(() => window.seen);
writeFileSync(out, Buffer.concat(levels.map((level) => Buffer.from(level))));
console.log(JSON.stringify(seen));
await browser.close();
server.close();
