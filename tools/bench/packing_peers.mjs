// Packs rectangles with the packers of npm: `node packing_peers.mjs MODULES < asked.json`.
//
// Asked: {sizes: [[w, h], ...], max, gap, rotate}. Answer: {name: {pages: [[w, h], ...], seconds}}.

import { readFileSync } from "node:fs";
import { createRequire } from "node:module";
import { join } from "node:path";
import { pathToFileURL } from "node:url";

const require = createRequire(join(process.argv[2], "x.js"));
const { sizes, max, gap, rotate } = JSON.parse(readFileSync(0, "utf8"));

const maxrects = join(process.argv[2], "maxrects-packer/dist/maxrects-packer.mjs");
const { MaxRectsPacker } = await import(pathToFileURL(maxrects));

/** Size of what is used of a page. */
const extent = (rects) => [
  Math.max(...rects.map((r) => r.x + r.w)) - Math.min(...rects.map((r) => r.x)),
  Math.max(...rects.map((r) => r.y + r.h)) - Math.min(...rects.map((r) => r.y)),
];

function freeTexPacker(packer, packerMethod) {
  const PackProcessor = require("free-tex-packer-core/PackProcessor");
  const images = Object.fromEntries(
    sizes.map(([width, height], i) => [String(i).padStart(5, "0"), { width, height, _base64: String(i) }]),
  );
  let pages;
  PackProcessor.pack(
    images,
    { width: max, height: max, padding: gap / 2, allowRotation: rotate, packer, packerMethod },
    (sheets) => {
      pages = sheets.map((rects) =>
        extent(rects.map(({ frame, rotated }) => ({ ...frame, w: rotated ? frame.h : frame.w, h: rotated ? frame.w : frame.h }))),
      );
    },
    (error) => {
      throw new Error(error.description);
    },
  );
  return pages;
}

function maxRectsPacker() {
  const packer = new MaxRectsPacker(max, max, gap, { smart: true, pot: false, square: false, allowRotation: rotate });
  packer.addArray(sizes.map(([width, height]) => ({ width, height })));
  return packer.bins.map((bin) =>
    extent(bin.rects.map((r) => ({ x: r.x, y: r.y, w: r.width, h: r.height }))),
  );
}

const packers = require("free-tex-packer-core/packers");
const peers = {
  "free-tex-packer": () => freeTexPacker(packers.list.find((p) => p.type === "MaxRectsBin"), "BestShortSideFit"),
  "free-tex-packer optimal": () => freeTexPacker(packers.list.find((p) => p.type === "OptimalPacker"), "Automatic"),
  "maxrects-packer": maxRectsPacker,
};
const answers = {};
for (const [name, pack] of Object.entries(peers)) {
  const start = performance.now();
  const pages = pack();
  answers[name] = { pages, seconds: (performance.now() - start) / 1000 };
}
console.log(JSON.stringify(answers));
