/** What is drawn: sizes in px of the atlas; `scale` is CSS px for each. */

/** The animations that are shown: all views of the fire, or one. */
function shown() {
  const views = isTogether && view() === "play" && film.animation.together;
  return views ? views.map((index) => data.animations[index]) : [film.animation];
}

/** The least size of the box in which an animation is shown. */
function leastBox() {
  if (view() === "page") return [data.pages[sheetPage].width, data.pages[sheetPage].height];
  return isScene() ? Scene.leastSize(film.animation) : film.animation.size;
}

/** How many times as large `size` px fill the stage, which has a rim where there is no scene. */
function roomFor([width, height]) {
  const rim = isScene() ? 0 : 48;
  const [across, down] = [$("stage").clientWidth - rim, $("stage").clientHeight - rim];
  return Math.max(Math.min(across / width, down / height), 0.02);
}

/** In how many columns views are shown: as many as leave them largest, in full rows if possible. */
function columns() {
  const [width, height] = leastBox();
  const { length } = shown();
  const rate = (count) => {
    const room = roomFor([width * count, height * Math.ceil(length / count)]);
    return length % count ? room * 0.9 : room;
  };
  return shown().map((_, i) => i + 1).reduce((best, count) => (rate(count) > rate(best) ? count : best));
}

/** The least size of what is shown. */
function leastSize() {
  const [width, height] = leastBox();
  return [width * columns(), height * Math.ceil(shown().length / columns())];
}

function scaleNow() {
  if (typeof zoom === "number") return zoom;
  const room = roomFor(leastSize());
  const isFirst = zoom === "first" && view() !== "page";
  // Square pixels stay square at whole numbers; what does not fit is made smaller as it must.
  if (room >= 1 && (isFirst ? data.isPixelArt : $("pixels").checked)) return Math.min(Math.floor(room), 8);
  if (!isFirst) return Math.min(room, 4);
  return room >= 2 && Math.max(...film.animation.size) < LARGE ? 2 : Math.min(room, 1);
}

/**
 * The boxes of the canvas, one for each animation, and its size. In a box the animation's stage
 * begins at `left` and `top`. A scene fills the window.
 */
function layout(scale) {
  const [animations, across] = [shown(), columns()];
  const down = Math.ceil(animations.length / across);
  let [width, height] = leastBox();
  if (isScene()) {
    width = Math.max(width, Math.ceil($("stage").clientWidth / scale / across));
    height = Math.max(height, Math.ceil($("stage").clientHeight / scale / down));
  }
  const inBox = isScene() ? Scene.placeOf(film.animation, [width, height]) : [0, 0];
  const boxes = animations.map((animation, i) => ({
    animation, x: (i % across) * width, y: Math.floor(i / across) * height, width, height,
    left: inBox[0], top: inBox[1],
  }));
  return { size: [width * across, height * down], boxes };
}

function zoomBy(steps) {
  const now = scaleNow();
  const larger = ZOOMS.filter((each) => each > now * 1.001);
  const smaller = ZOOMS.filter((each) => each < now * 0.999);
  zoom = (steps > 0 ? larger[0] : smaller.at(-1)) ?? now;
  refresh();
}

/** A frame as a cell of the chosen layer, where it stands on the animation's stage. */
function cellOf(frame) {
  const [width, height] = lie(frame);
  const page = data.pages[frame.page];
  // In a grid a client's sampler reads on in the page; a box that was cut out is read alone.
  const own = [frame.x, frame.y, frame.x + width, frame.y + height];
  const bounds = data.hasCells ? [0, 0, page.width, page.height] : own;
  const [left, top] = [frame.stage[0] + frame.trim[0], frame.stage[1] + frame.trim[1]];
  return { ...frame, sheet: chosen("layer"), bounds, left, top };
}

/** The size in which a frame lies on its page. */
function lie(frame) {
  return frame.rotated ? [frame.height, frame.width] : [frame.width, frame.height];
}

/** Draw what the view shows. `picture`: also what stays while the player goes on. */
function draw(picture = true) {
  const scale = scaleNow();
  const { size, boxes } = layout(scale);
  marks.begin(size, scale);
  if (view() === "play") {
    painter.begin(size, backdrop(scale).colour);
    boxes.forEach((box) => drawFrame(box, scale));
  } else if (view() === "page") drawPage(boxes[0], scale, picture);
  else if (picture) drawSeam(boxes[0], scale);
}

function drawSeam(box, scale) {
  const { frames } = film.animation;
  const cells = [cellOf(frames[0]), cellOf(frames.at(-1))];
  painter.begin([box.width, box.height]);
  painter.draw(cells, chosen("seam"), box, backdrop(scale));
}

/** Draw the frame of a box's animation that is now shown, with all that lies over it. */
function drawFrame(box, scale) {
  const { animation } = box;
  const frame = animation.frames[film.index];
  const next = isFluid() && film.part > 0 ? following(animation) : null;
  const { flakes } = animation;
  const how = flakes ? chosen("flakes") : "off";
  const at = flakes && film.flakeFrame;
  const light = how === "light" ? {
    rows: flakes.rows, first: flakes.firsts[at], count: flakes.counts[at],
    offset: [box.left + frame.stage[0], box.top + frame.stage[1]], scale: data.scale,
    page: flakes.page, cells: flakes.cells, tinted: flakes.tinted,
  } : null;
  const ground = backdrop(scale);
  if (isScene()) ground.scene = Scene.of(box, frame, film.index);
  if (next) {
    const between = { part: film.part, vectors: chosen("between") === "vectors" };
    painter.draw([frame, next].map(cellOf), "between", box, ground, light, between);
  } else {
    painter.draw([cellOf(frame)], "frame", box, ground, light);
  }
  marks.within(box, () => drawMarks(animation, frame, how === "marks" ? trail(flakes, at) : null));
  if (isTogether) marks.label(animation.name, box, ground.colour);
}

function drawMarks(animation, frame, flakes) {
  const layer = chosen("field");
  if (animation.field?.layers[layer]) {
    animation.marks.draw(marks, layer, film.index, frame.stage, frame.source, data.scale);
  }
  if (flakes) marks.flakes(flakes, frame.stage, data.scale);
  if ($("outline").checked) {
    const cell = cellOf(frame);
    marks.box(...frame.stage, ...frame.source, "rgb(255 255 255 / 0.35)");
    marks.box(cell.left, cell.top, cell.width, cell.height, "#ff9b45");
    marks.pivot(frame.stage[0] + frame.pivot[0], frame.stage[1] + frame.pivot[1]);
  }
}

function drawPage(box, scale, picture) {
  const { width, height } = box;
  const whole = {
    sheet: chosen("layer"), page: sheetPage, x: 0, y: 0, width, height, left: 0, top: 0,
    rotated: false, bounds: [0, 0, width, height],
  };
  if (picture) {
    painter.begin([width, height]);
    painter.draw([whole], "frame", box, backdrop(scale));
  }
  const outline = (frame, ...how) => marks.box(frame.x, frame.y, ...lie(frame), ...how);
  for (const { frames } of data.animations) {
    for (const frame of frames) {
      if (frame.page === sheetPage) outline(frame, "rgb(127 212 255 / 0.45)");
    }
  }
  if (hovered) outline(hovered.frame, "#ffffff", 2);
  if (film.frame.page === sheetPage) outline(film.frame, "#ff9b45", 2);
}

/** The flakes of frame `index` of the tracks and of those before it, the last first, by id. */
function trail(flakes, index) {
  const frames = [];
  const all = flakes.counts.length;
  for (let back = 0; back <= Marks.TRAIL; back++) {
    const i = index - back;
    if (i < 0 && !film.animation.loop) break;
    frames.push(flakesOf(flakes, (i + all) % all));
    if (all <= back + 1) break;
  }
  return frames;
}

function flakesOf({ rows, firsts, counts }, index) {
  const { FLOATS } = FlakePainter;
  const found = new Map();
  for (let row = firsts[index]; row < firsts[index] + counts[index]; row++) {
    const [id, x, y, size, stretch, rotation, , r, g, b] = rows.subarray(row * FLOATS);
    const most = Math.max(r, g, b, 1e-6);
    const [red, green, blue] = [r, g, b].map((v) => Math.round(255 * (0.35 + (0.65 * v) / most)));
    found.set(id, { x, y, size, stretch, rotation, colour: `rgb(${red} ${green} ${blue})` });
  }
  return found;
}
