// Plays atlases in real clients in headless Chromium and prints what each of them drew.
//
//   node play.mjs CASES.json OUT_FOLDER
//
// CASES.json is a list of {id, client, folder, json, title, premultiplied, size: [w, h], at: [x, y],
// zoom, meshes, loads}. For each, every frame of every animation is drawn with its pivot at `at` on a
// canvas of `size`, and written to OUT_FOLDER/<id>.rgba, frame after frame, as premultiplied RGBA bytes,
// top row first; what was found besides is printed as JSON, by id. Files are served on 127.0.0.1 alone.
// The client `page` is the case's own `index.html`, which defines `window.draw` too.
//
// FIRE_ATLAS_NODE_MODULES names another node_modules than the one here; CHROMIUM another browser
// than /usr/bin/chromium.

import { createReadStream, existsSync, readFileSync, statSync, writeFileSync } from "node:fs";
import { createServer } from "node:http";
import { createRequire } from "node:module";
import { dirname, extname, join, normalize, resolve } from "node:path";
import { fileURLToPath } from "node:url";

const here = dirname(fileURLToPath(import.meta.url));
const modules = resolve(process.env.FIRE_ATLAS_NODE_MODULES || join(here, "node_modules"));
const { chromium } = createRequire(join(modules, "x.js"))("playwright-core");

const SCRIPTS = {
  pixi: "/modules/pixi.js/dist/pixi.min.js",
  phaser: "/modules/phaser/dist/phaser.min.js",
  phaser360: "/modules/phaser360/dist/phaser.min.js",
  phaser370: "/modules/phaser370/dist/phaser.min.js",
  phaser4: "/modules/phaser4/dist/phaser.min.js",
};
const TYPES = {
  ".html": "text/html",
  ".js": "text/javascript",
  ".json": "application/json",
  ".png": "image/png",
  ".webp": "image/webp",
};

/** Serve `/modules/...`, `/<client>.html` and `/<case id>/...`. */
function serve(folders) {
  const server = createServer((request, response) => {
    const path = normalize(decodeURIComponent(new URL(request.url, "http://x").pathname));
    const [, first, ...rest] = path.split("/");
    if (first === "favicon.ico") {
      response.writeHead(204);
      response.end();
      return;
    }
    if (first === "melon") {
      response.writeHead(200, { "content-type": "text/html" });
      response.end(`<!doctype html><body><script type="module" src="/here/read_with_melon.js"></script></body>`);
      return;
    }
    if (first in SCRIPTS) {
      response.writeHead(200, { "content-type": "text/html" });
      const program = first === "pixi" ? "pixi" : "phaser";
      response.end(
        `<!doctype html><body><script src="${SCRIPTS[first]}"></script>` +
          `<script src="/here/draw_with_${program}.js"></script></body>`,
      );
      return;
    }
    const folder = { modules, here, ...folders }[first];
    const file = folder && join(folder, ...rest);
    if (!file || !existsSync(file) || !statSync(file).isFile()) {
      response.writeHead(404);
      response.end();
      return;
    }
    response.writeHead(200, { "content-type": TYPES[extname(file)] ?? "application/octet-stream" });
    createReadStream(file).pipe(response);
  });
  return new Promise((done) => server.listen(0, "127.0.0.1", () => done(server)));
}

async function play(context, port, job, outFolder) {
  const page = await context.newPage();
  const errors = [];
  page.on("pageerror", (error) => errors.push(error.message));
  page.on("console", (message) => {
    if (["error", "warning"].includes(message.type()) && !/GPU stall/.test(message.text())) {
      errors.push(message.text());
    }
  });
  page.on("response", (answer) => {
    if (answer.status() >= 400) errors.push(`${answer.status()} ${new URL(answer.url()).pathname}`);
  });
  const path = job.client === "page" ? `${job.id}/index.html` : job.client;
  await page.goto(`http://127.0.0.1:${port}/${path}`);
  await page.waitForFunction(() => window.draw);
  const drawn = await page.evaluate((asked) => window.draw(asked), job);
  await page.close();
  const frames = drawn.frames.map((text) => Buffer.from(text, "base64"));
  writeFileSync(join(outFolder, `${job.id}.rgba`), Buffer.concat(frames));
  return { ...drawn, frames: frames.length, errors };
}

const [, , casesFile, outFolder] = process.argv;
const cases = JSON.parse(readFileSync(casesFile, "utf8"));
const server = await serve(Object.fromEntries(cases.map((job) => [job.id, job.folder])));
const browser = await chromium.launch({
  executablePath: process.env.CHROMIUM || "/usr/bin/chromium",
  args: ["--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"],
});
// A page that stays open: the browser keeps its processes from case to case. None stores anything.
const context = await browser.newContext({ viewport: { width: 256, height: 256 } });
await context.newPage();
const results = {};
try {
  for (const job of cases) results[job.id] = await play(context, server.address().port, job, outFolder);
} finally {
  await browser.close();
  server.close();
}
console.log(JSON.stringify(results));
