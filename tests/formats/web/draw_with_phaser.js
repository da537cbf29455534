// Runs in the browser: draws the frames of an atlas with Phaser 3 or 4, as a game would.

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

/** Load by the loader that the file's name asks for. */
function load(scene, { id, json, title, sprites }) {
  const url = `/${id}/${json}`;
  if (json.endsWith(".phaser.json")) {
    scene.load.multiatlas(title, url, `/${id}/`);
    if (!sprites) scene.load.animation(`${title}-animations`, url);
  } else if (json.endsWith(".aseprite.json")) {
    scene.load.aseprite(title, url.replace(".aseprite.json", ".png"), url);
  } else {
    scene.load.atlas(title, url.replace(/(\.array)?\.json$/, ".png"), url);
    scene.load.json("names", url);
  }
}

/** The animation, as the game's code would get it from what was loaded. */
function animation(scene, { json, title }) {
  if (json.endsWith(".aseprite.json")) {
    for (const made of scene.anims.createFromAseprite(title)) made.repeat = -1;
  }
  const { animations, frames } = scene.cache.json.get("names") ?? {};
  if (animations) {
    const of = (name) => frames[name] ?? frames.find((frame) => frame.filename === name);
    scene.anims.create({
      key: title,
      frames: animations[title].map((name) => ({ key: title, frame: name, duration: of(name).duration })),
      repeat: -1,
    });
  }
  return scene.anims.get(title);
}

window.draw = (job) =>
  new Promise((done, failed) => {
    const [width, height] = job.size;
    const scene = {
      preload() {
        this.load.on("loaderror", (file) => failed(new Error(`cannot load ${file.key}`)));
        load(this, job);
      },
      create() {
        setTimeout(() => done(record(this, job)), 0);
      },
    };
    const game = new Phaser.Game({
      type: Phaser.WEBGL, width, height, transparent: true, banner: false, pixelArt: true, scene,
      audio: { noAudio: true }, render: { preserveDrawingBuffer: true, antialias: false },
    });

    /** Single sprites by their names, and which of `known` are not there. */
    function drawSprites(running, { title, sprites, known, at }) {
      const names = new Set(running.textures.get(title).getFrameNames());
      const sprite = running.add.sprite(at[0], at[1], title);
      game.loop.stop();
      let now = performance.now();
      const frames = sprites.map((name) => {
        sprite.setTexture(title, name);
        game.step((now += 16), 16);
        return readBack(game.renderer.gl, width, height);
      });
      const borders = Object.fromEntries(sprites.map((name) => {
        const { leftWidth, topHeight, rightWidth, bottomHeight } = running.add.nineslice(0, 0, title, name);
        return [name, [leftWidth, topHeight, rightWidth, bottomHeight]];
      }));
      return { frames, missing: known.filter((name) => !names.has(name)), borders };
    }

    function record(running, { at }) {
      if (job.sprites) return drawSprites(running, job);
      const burn = animation(running, job);
      const sprite = running.add.sprite(at[0], at[1], job.title);
      game.loop.stop();
      let now = performance.now();
      const frames = burn.frames.map(({ frame }) => {
        sprite.setTexture(job.title, frame.name);
        game.step((now += 16), 16);
        return readBack(game.renderer.gl, width, height);
      });
      const played = [];
      sprite.on("animationupdate", (_, { frame }) => played.push(frame.name));
      const tick = 1000 / 240;
      let elapsed = 0, round = null;
      sprite.on("animationrepeat", () => (round ??= elapsed + tick));
      sprite.play(job.title);
      for (; elapsed < (1050 / 24) * (burn.frames.length + 1); elapsed += tick) sprite.anims.update(elapsed, tick);
      return {
        version: Phaser.VERSION,
        frames,
        names: burn.frames.map(({ frame }) => frame.name),
        durations: burn.frames.map(({ duration }) => duration),
        repeat: burn.repeat,
        round,
        played,
      };
    }
  });
