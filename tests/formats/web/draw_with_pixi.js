// Runs in the browser: draws the frames of an atlas with PixiJS 8, as a game would.

/** The drawing buffer as premultiplied RGBA, top row first, in base64. */
function readBack(gl, width, height) {
  const bottomUp = new Uint8Array(width * height * 4);
  gl.bindFramebuffer(gl.FRAMEBUFFER, null);
  gl.readPixels(0, 0, width, height, gl.RGBA, gl.UNSIGNED_BYTE, bottomUp);
  let text = "";
  for (let y = height - 1; y >= 0; y--) {
    text += String.fromCharCode(...bottomUp.subarray(y * width * 4, (y + 1) * width * 4));
  }
  return btoa(text);
}

/** A frame as a mesh, as docs/engines/web.md has it. */
function meshOf(sheet, name) {
  const { anchor, sourceSize, vertices, verticesUV, triangles } = sheet.data.frames[name];
  const { size, scale } = sheet.data.meta;
  return new PIXI.Mesh({
    geometry: new PIXI.MeshGeometry({
      positions: new Float32Array(vertices.flatMap(([x, y]) => [
        (x - anchor.x * sourceSize.w) / scale, (y - anchor.y * sourceSize.h) / scale,
      ])),
      uvs: new Float32Array(verticesUV.flatMap(([x, y]) => [x / size.w, y / size.h])),
      indices: new Uint32Array(triangles.flat()),
    }),
    texture: new PIXI.Texture({ source: sheet.textures[name].source }),
  });
}

/** Single sprites by their names, and which of `known` are not there. */
function drawSprites(app, sheets, { sprites, known, at }) {
  const textures = Object.assign({}, ...sheets.map((sheet) => sheet.textures));
  const frames = sprites.map((name) => {
    const sprite = new PIXI.Sprite(textures[name]);
    sprite.anchor.copyFrom(sprite.texture.defaultAnchor);
    sprite.position.set(...at);
    app.stage.addChild(sprite);
    app.render();
    sprite.destroy();
    return readBack(app.renderer.gl, app.canvas.width, app.canvas.height);
  });
  const borders = Object.fromEntries(sprites.map((name) => {
    const { leftWidth, topHeight, rightWidth, bottomHeight } = new PIXI.NineSliceSprite(textures[name]);
    return [name, [leftWidth, topHeight, rightWidth, bottomHeight]];
  }));
  return { frames, missing: known.filter((name) => !(name in textures)), borders };
}

/** Load files one after the other, those of a list at once; return the sheets that are known then. */
async function load(loads, id, textureOptions) {
  const asked = (json) => ({ src: `/${id}/${json}`, data: { textureOptions } });
  const found = new Set();
  for (const step of loads) {
    const sheets = [step].flat().map(asked);
    const loaded = await PIXI.Assets.load(Array.isArray(step) ? sheets : sheets[0]);
    for (const sheet of loaded.textures ? [loaded] : Object.values(loaded)) {
      [sheet, ...sheet.linkedSheets].forEach((each) => found.add(each));
    }
  }
  return [...found];
}

window.draw = async (job) => {
  const { id, json, title, premultiplied, size, at, zoom, meshes } = job;
  const [width, height] = size;
  const app = new PIXI.Application();
  PIXI.TextureSource.defaultOptions.scaleMode = "nearest";
  await app.init({
    width, height, backgroundAlpha: 0, preference: "webgl", antialias: false, autoStart: false,
    preserveDrawingBuffer: true,
  });
  const textureOptions = premultiplied ? { alphaMode: "premultiplied-alpha" } : {};
  const sheets = await load(job.loads ?? [json], id, textureOptions);
  const [sheet] = sheets;
  if (job.sprites) return drawSprites(app, sheets, job);

  const parts = sheets.map((page) => page.animations[title] ?? []).filter((part) => part.length);
  const textures = parts.flat().sort((a, b) => (a.label < b.label ? -1 : 1));
  const durations = Object.assign({}, ...sheets.map((page) => page.data.frames));
  const sprite = new PIXI.AnimatedSprite(
    textures.map((texture) => ({ texture, time: durations[texture.label].duration })),
  );
  sprite.position.set(...at);
  sprite.scale.set(zoom);
  app.stage.addChild(sprite);

  const frames = textures.map((_, i) => {
    sprite.gotoAndStop(i);
    sprite.anchor.copyFrom(sprite.texture.defaultAnchor);
    const mesh = meshes ? meshOf(sheet, textures[i].label) : null;
    if (mesh) {
      sprite.visible = false;
      mesh.position.set(...at);
      mesh.scale.set(zoom);
      app.stage.addChild(mesh);
    }
    app.render();
    mesh?.destroy();
    return readBack(app.renderer.gl, width, height);
  });

  const played = [];
  sprite.gotoAndPlay(0);
  sprite.onFrameChange = (i) => played.push(textures[i].label);
  const tick = 1000 / 240;
  for (let t = 0; t < 1050 / 24 * (textures.length + 1); t += tick) sprite.update({ deltaTime: tick * 0.06 });
  return { version: PIXI.VERSION, frames, names: textures.map((t) => t.label), played, sheets: parts.length };
};
