// Loads a KTX2 file by three's KTX2Loader in headless Chromium, samples each of its levels on the
// GPU, texel by texel, and writes them as RGBA bytes: node sample_ktx2.mjs MODULES FILE OUT.
import { readFileSync, writeFileSync } from "node:fs";
import { createServer } from "node:http";
import { createRequire } from "node:module";
import { join, normalize } from "node:path";

const [, , modules, file, out] = process.argv;
const { chromium } = createRequire(join(modules, "x.js"))("playwright-core");

const PAGE = `<!DOCTYPE html><script type="importmap">{"imports": {
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

const server = createServer((request, response) => {
  const path = normalize(request.url);
  const type = path === "/" ? "text/html" : path.endsWith(".js") ? "text/javascript" : "";
  response.setHeader("Content-Type", type || "application/octet-stream");
  try {
    if (path === "/") response.end(PAGE);
    else response.end(readFileSync(path === "/texture.ktx2" ? file : join(modules, path)));
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
