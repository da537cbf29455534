// Runs in the browser: what melonJS finds in the JSON of a page.

import { TextureAtlas } from "/modules/melonjs/build/index.js";

window.draw = async ({ id, json }) => {
  const data = await (await fetch(`/${id}/${json}`)).json();
  const image = new Image();
  image.src = `/${id}/${data.meta.image}`;
  await image.decode();
  const regions = new TextureAtlas(data, image, { cache: false }).getAtlas();
  const numbers = ({ offset, width, height, trim, sourceSize, anchorPoint }) => ({
    frame: [offset.x, offset.y, width, height],
    trim: trim ? [trim.x, trim.y, trim.w, trim.h] : null,
    size: [sourceSize.w, sourceSize.h],
    pivot: [anchorPoint.x * width, anchorPoint.y * height],
  });
  return {
    frames: [],
    regions: Object.fromEntries(Object.entries(regions).map(([name, region]) => [name, numbers(region)])),
  };
};
