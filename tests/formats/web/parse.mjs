// Prints, as JSON, what PixiJS and Phaser understand of an atlas: `node parse.mjs campfire.json`.
//
// Both run their own unchanged parsers, without a browser: pages are never decoded, only measured
// by the size in their JSON. FIRE_ATLAS_NODE_MODULES names another node_modules than the one here.

import { readFileSync } from "node:fs";
import { createRequire } from "node:module";
import { dirname, join, resolve } from "node:path";
import { fileURLToPath, pathToFileURL } from "node:url";

const here = dirname(fileURLToPath(import.meta.url));
const modules = resolve(process.env.FIRE_ATLAS_NODE_MODULES || join(here, "node_modules"));
const pixi = (file) => import(pathToFileURL(join(modules, "pixi.js/lib", file)));
const phaser = (file) => createRequire(import.meta.url)(join(modules, "phaser/src/textures", file));

const readJson = (path) => JSON.parse(readFileSync(path, "utf8"));
const rectangle = (r) => [r.x, r.y, r.width, r.height];
const mapValues = (object, f) =>
  Object.fromEntries(Object.entries(object).map(([key, value]) => [key, f(value)]));

/** Load the first page and those it links to, as Assets.load does. */
async function readByPixi(path) {
  const { spritesheetAsset } = await pixi("spritesheet/spritesheetAsset.mjs");
  const { Texture } = await pixi("rendering/renderers/shared/texture/Texture.mjs");
  const { TextureSource } = await pixi("rendering/renderers/shared/texture/sources/TextureSource.mjs");

  const openPage = (json) => new Texture({ source: new TextureSource({ width: json.w, height: json.h }) });
  const open = async (src, data) => {
    const json = readJson(src);
    const loader = {
      load: async (asked) =>
        Array.isArray(asked)
          ? { [asked[0].src]: openPage(json.meta.size) }
          : open(asked.src, asked.data),
    };
    return spritesheetAsset.loader.parse(json, { src, data }, loader);
  };

  const first = await open(path, {});
  return [first, ...first.linkedSheets].map((sheet) => ({
    frames: mapValues(sheet.textures, (texture) => ({
      frame: rectangle(texture.frame),
      trim: texture.trim && rectangle(texture.trim),
      size: [texture.orig.width, texture.orig.height],
      anchor: [texture.defaultAnchor.x, texture.defaultAnchor.y],
    })),
    animations: mapValues(sheet.animations, (textures) => textures.map((texture) => texture?.label)),
  }));
}

/** Load one page, as load.atlas does. */
function readByPhaser(path) {
  globalThis.window ??= globalThis;
  globalThis.HTMLCanvasElement ??= class {};
  const Texture = phaser("Texture");
  const parse = phaser("parsers/JSONHash");

  const json = readJson(path);
  const manager = { game: { config: {}, renderer: null } };
  const image = { width: json.meta.size.w, height: json.meta.size.h };
  const texture = parse(new Texture(manager, "atlas", [image]), 0, json);
  const { __BASE, ...frames } = texture.frames;
  return {
    frames: mapValues(frames, (frame) => ({
      frame: [frame.cutX, frame.cutY, frame.cutWidth, frame.cutHeight],
      trim: frame.trimmed ? [frame.x, frame.y, frame.width, frame.height] : null,
      size: [frame.realWidth, frame.realHeight],
      anchor: [frame.pivotX, frame.pivotY],
    })),
    meta: texture.customData.meta,
  };
}

const path = process.argv[2];
const pages = [path, ...(readJson(path).meta.related_multi_packs ?? []).map((file) => join(dirname(path), file))];
console.log(JSON.stringify({ pixi: await readByPixi(path), phaser: pages.map(readByPhaser) }));
