// Opens preview pages in headless Chromium, as a person does, and prints what it saw.
//
// Each line of the input is a visit, {file, width, height, moves, steps}. `moves`: whether the viewer
// likes motion. A step is ["click", selector], ["press_at", selector, x, y], ["hover", selector, x, y],
// ["press", key], ["wait", ms], ["look"], ["pixels", selector], ["run", script] or ["screenshot"], a PNG
// in base64; the last four give a result. Each is answered by a line, {results, errors, requests}: errors and warnings of the page,
// and every address it asked for; or {failed}, why the visit could not be made.
//
// FIRE_ATLAS_NODE_MODULES names the node_modules; CHROMIUM another browser than /usr/bin/chromium.

import { createRequire } from "node:module";
import { join, resolve } from "node:path";
import { createInterface } from "node:readline";
import { pathToFileURL } from "node:url";

const modules = resolve(process.env.FIRE_ATLAS_NODE_MODULES);
const { chromium } = createRequire(join(modules, "x.js"))("playwright-core");

/** What the page shows and says, as a person sees or hears it. */
const look = () => {
  const text = (id) => document.getElementById(id).textContent.trim();
  const checked = (name) => document.querySelector(`input[name="${name}"]:checked`).value;
  const on = (id) => document.getElementById(id).checked;
  const picture = document.getElementById("picture");
  return {
    frame: Number(text("now")),
    of: text("of"),
    playing: document.getElementById("play").getAttribute("aria-pressed") === "true",
    caption: text("caption"),
    label: picture.getAttribute("aria-label"),
    said: text("said"),
    zoom: text("zoom"),
    fit: document.getElementById("fit").getAttribute("aria-pressed"),
    speed: document.getElementById("speed").value,
    value: document.getElementById("scrub").getAttribute("aria-valuetext"),
    size: [picture.width, picture.height],
    view: checked("view"), seam: checked("seam"), backdrop: checked("backdrop"), flakes: checked("flakes"),
    between: checked("between"), layer: checked("layer"), field: checked("field"),
    repeat: on("repeat"), outline: on("outline"), pixels: on("pixels"),
    focus: document.activeElement.id || document.activeElement.value,
  };
};

/** The pixels of a canvas as RGBA, top row first, in base64. */
const pixels = (selector) => {
  const source = document.querySelector(selector);
  const copy = new OffscreenCanvas(source.width, source.height).getContext("2d");
  copy.drawImage(source, 0, 0);
  const { data } = copy.getImageData(0, 0, source.width, source.height);
  let text = "";
  for (let i = 0; i < data.length; i += 8192) text += String.fromCharCode(...data.subarray(i, i + 8192));
  return { size: [source.width, source.height], rgba: btoa(text) };
};

async function take(page, [what, first, ...rest]) {
  switch (what) {
    case "click": return page.click(first);
    case "press": return page.keyboard.press(first);
    case "wait": return page.waitForTimeout(first);
    case "press_at": return page.click(first, { position: { x: rest[0], y: rest[1] } });
    case "hover": return page.hover(first, { position: { x: rest[0], y: rest[1] } });
    case "look": return page.evaluate(look);
    case "pixels": return page.evaluate(pixels, first);
    case "run": return page.evaluate(first);
    case "screenshot": return (await page.screenshot()).toString("base64");
    default: throw new Error(`no step ${what}`);
  }
}

async function visit(context, { file, width, height, moves, steps }) {
  const page = await context.newPage();
  await page.setViewportSize({ width, height });
  await page.emulateMedia({ reducedMotion: moves ? "no-preference" : "reduce" });
  const [results, errors, requests] = [[], [], []];
  page.on("pageerror", (error) => errors.push(error.message));
  page.on("console", (message) => {
    if (["error", "warning"].includes(message.type()) && !/GPU stall/.test(message.text())) {
      errors.push(message.text());
    }
  });
  page.on("request", (request) => requests.push(request.url()));
  try {
    await page.goto(pathToFileURL(file).href);
    await page.waitForSelector("body[data-ready]", { timeout: 20000 });
    for (const step of steps) {
      const result = await take(page, step);
      if (["look", "pixels", "run", "screenshot"].includes(step[0])) results.push(result);
    }
    return { results, errors, requests };
  } catch (error) {
    return { failed: [error.stack, ...errors].join("\n") };
  } finally {
    await page.close();
  }
}

const browser = await chromium.launch({
  executablePath: process.env.CHROMIUM || "/usr/bin/chromium",
  args: ["--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"],
});
// A page that stays open: the browser keeps its processes from visit to visit. Ours store nothing.
const context = await browser.newContext();
await context.newPage();
for await (const line of createInterface({ input: process.stdin })) {
  console.log(JSON.stringify(await visit(context, JSON.parse(line))));
}
await browser.close();
