// Loads compressed textures in headless Chromium, by three's loaders of KTX2 and DDS or PixiJS's of DDS,
// samples each of their levels on the GPU, texel by texel, and writes them to FILE.rgba as RGBA bytes:
// node sample_textures.mjs MODULES FILE... , of files called FORMAT.CLIENT.ENDING with CLIENT three or
// pixi. Prints a list, for each file its {sizes} or {errors}.
import { readFileSync, writeFileSync } from "node:fs";
import { createServer } from "node:http";
import { createRequire } from "node:module";
import { join, normalize } from "node:path";

const [, , modules, ...files] = process.argv;
const { chromium } = createRequire(join(modules, "x.js"))("playwright-core");

const THREE = `<!DOCTYPE html><script type="importmap">{"imports": {
  "three": "/three/build/three.module.js", "loaders/": "/three/examples/jsm/loaders/"
}}</script><script type="module">
import * as THREE from "three";
import { DDSLoader } from "loaders/DDSLoader.js";
import { KTX2Loader } from "loaders/KTX2Loader.js";
const renderer = new THREE.WebGLRenderer();
const loaders = { dds: new DDSLoader(), ktx2: new KTX2Loader().detectSupport(renderer) };
const material = new THREE.RawShaderMaterial({
  glslVersion: THREE.GLSL3, blending: THREE.NoBlending, depthTest: false,
  uniforms: { map: { value: null }, level: { value: 0 } },
  vertexShader: "in vec3 position; void main() { gl_Position = vec4(position.xy, 0.0, 1.0); }",
  fragmentShader: "precision highp float; uniform sampler2D map; uniform int level; out vec4 seen;" +
    "void main() { seen = texelFetch(map, ivec2(gl_FragCoord.xy), level); }",
});
const scene = new THREE.Scene();
const quad = new THREE.Mesh(new THREE.PlaneGeometry(2, 2), material);
quad.frustumCulled = false;
scene.add(quad);
window.sample = async (url) => {
  const texture = await loaders[url.split(".").pop()].loadAsync(url);
  Object.assign(texture, { minFilter: THREE.NearestMipmapNearestFilter, magFilter: THREE.NearestFilter });
  material.uniforms.map.value = texture;
  const sizes = texture.mipmaps.map(({ width, height }) => [width, height]);
  const levels = sizes.map(([width, height], level) => {
    const target = new THREE.WebGLRenderTarget(width, height);
    material.uniforms.level.value = level;
    renderer.setRenderTarget(target);
    renderer.render(scene, new THREE.Camera());
    const pixels = new Uint8Array(4 * width * height);
    renderer.readRenderTargetPixels(target, 0, 0, width, height, pixels);
    return [...pixels];
  });
  return { levels, sizes };
};
</script>`;

const PIXI = `<!DOCTYPE html><script src="/pixi.js/dist/pixi.min.js"></script><script type="module">
PIXI.extensions.add(PIXI.loadDDS); // pixi.js/dds does
const app = new PIXI.Application();
await app.init({ preference: "webgl", backgroundAlpha: 0, antialias: false, autoStart: false,
  preserveDrawingBuffer: true });
const { gl } = app.renderer;
window.sample = async (url) => {
  const texture = await PIXI.Assets.load(url);
  const { source } = texture;
  source.alphaMode = "premultiplied-alpha";
  Object.assign(source.style, { scaleMode: "nearest", mipmapFilter: "nearest" });
  app.stage.removeChildren();
  const sprite = app.stage.addChild(new PIXI.Sprite(texture));
  const sizes = source.resource.map((_, level) => [source.width >> level, source.height >> level]);
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
  return { levels, sizes };
};
</script>`;

const server = createServer((request, response) => {
  const path = normalize(request.url);
  const page = { "/three": THREE, "/pixi": PIXI }[path];
  const type = page ? "text/html" : path.endsWith(".js") ? "text/javascript" : "";
  response.setHeader("Content-Type", type || "application/octet-stream");
  const [, folder, number] = path.split(/[/.]/);
  try {
    response.end(page ?? readFileSync(folder === "textures" ? files[number] : join(modules, path)));
  } catch {
    response.writeHead(404).end();
  }
});
await new Promise((listening) => server.listen(0, "127.0.0.1", listening));
const browser = await chromium.launch({
  executablePath: process.env.CHROMIUM || "/usr/bin/chromium",
  args: ["--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"],
});

async function open(client) {
  const page = await browser.newPage();
  page.on("pageerror", (error) => console.error(String(error)));
  await page.goto(`http://127.0.0.1:${server.address().port}/${client}`);
  await page.waitForFunction(() => window.sample, null, { timeout: 60000 });
  return page;
}

const clients = { three: await open("three"), pixi: await open("pixi") };
const found = [];
for (const [number, file] of files.entries()) {
  const [, client, ending] = file.split(".");
  try {
    const url = `/textures/${number}.${ending}`;
    const { levels, sizes } = await clients[client].evaluate((url) => window.sample(url), url);
    writeFileSync(`${file}.rgba`, Buffer.concat(levels.map((level) => Buffer.from(level))));
    found.push({ sizes });
  } catch (error) {
    found.push({ errors: String(error) });
  }
}
console.log(JSON.stringify(found));
await browser.close();
server.close();
