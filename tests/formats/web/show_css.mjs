// Shows elements with classes of a style sheet in headless Chromium, and takes pictures of them:
//
//   node show_css.mjs MODULES SHOTS.json
//
// SHOTS.json is a list of {html, ratio, time, size: [w, h], file}. Of each, the HTML is shown on a
// transparent page with so many device pixels for each CSS pixel; all animations stand at `time`, ms;
// the upper left w x h CSS pixels are written to `file` as PNG. Prints a list with the errors of each.
import { readFileSync } from "node:fs";
import { createRequire } from "node:module";
import { dirname, join } from "node:path";
import { pathToFileURL } from "node:url";

const [, , modules, list] = process.argv;
const { chromium } = createRequire(join(modules, "x.js"))("playwright-core");
const browser = await chromium.launch({
  executablePath: process.env.CHROMIUM || "/usr/bin/chromium",
  args: ["--no-sandbox", "--allow-file-access-from-files"],
});
const faults = [];
const pages = new Map();
for (const { html, ratio, time, size, file } of JSON.parse(readFileSync(list, "utf8"))) {
  if (!pages.has(ratio)) {
    const context = await browser.newContext({ deviceScaleFactor: ratio, viewport: { width: 300, height: 200 } });
    pages.set(ratio, await context.newPage());
  }
  const page = pages.get(ratio), errors = [];
  const failed = (request) => errors.push(`no ${request.url()}`);
  page.on("requestfailed", failed);
  await page.goto(pathToFileURL(join(dirname(list), html)).href, { waitUntil: "load" });
  await page.evaluate(async (at) => {
    // Pictures of backgrounds are asked for with the first layout, which may come after `load`.
    for (const each of document.querySelectorAll("*")) {
      for (const [, url] of getComputedStyle(each).backgroundImage.matchAll(/url\("(.*?)"\)/g)) {
        await Object.assign(new Image(), { src: url }).decode();
      }
    }
    for (const each of document.getAnimations({ subtree: true })) {
      each.pause();
      each.currentTime = at;
    }
  }, time);
  await page.screenshot({ path: file, omitBackground: true, clip: { x: 0, y: 0, width: size[0], height: size[1] } });
  page.off("requestfailed", failed);
  faults.push(errors);
}
await browser.close();
console.log(JSON.stringify(faults));
