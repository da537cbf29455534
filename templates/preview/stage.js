/** What is drawn: sizes in px of the atlas; `scale` is CSS px for each. */
const size = () => {
  if (view() !== "page") return film.animation.size;
  return [data.pages[sheetPage].width, data.pages[sheetPage].height];
};

function scaleNow() {
  if (zoom !== "fit") return zoom;
  const [width, height] = size();
  const room = Math.min(($("stage").clientWidth - 48) / width, ($("stage").clientHeight - 48) / height);
  // Square pixels stay square at whole numbers; what does not fit is made smaller as it must.
  if (room >= 1 && $("pixels").checked) return Math.min(Math.floor(room), 8);
  return Math.min(Math.max(room, 0.02), 4);
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
  marks.begin(size(), scale);
  if (view() === "play") drawFrame(scale);
  else if (view() === "page") drawPage(scale, picture);
  else if (picture) drawSeam(scale);
}

function drawSeam(scale) {
  const { frames } = film.animation;
  const cells = [cellOf(frames[0]), cellOf(frames.at(-1))];
  painter.draw(cells, chosen("seam"), size(), backdrop(scale));
}

function drawFrame(scale) {
  const { frame, part } = film;
  const next = isFluid() && part > 0 ? following() : null;
  const { flakes } = film.animation;
  const how = flakes ? chosen("flakes") : "off";
  const at = flakes && film.flakeFrame;
  const light = how === "light" && {
    rows: flakes.rows, first: flakes.firsts[at], count: flakes.counts[at],
    offset: frame.stage, scale: data.scale,
    page: flakes.page, cells: flakes.cells, tinted: flakes.tinted,
  };
  const ground = backdrop(scale);
  if (next) {
    const between = { part, vectors: chosen("between") === "vectors" };
    painter.draw([frame, next].map(cellOf), "between", size(), ground, light || null, between);
  } else {
    painter.draw([cellOf(frame)], "frame", size(), ground, light || null);
  }
  const layer = chosen("field");
  if (film.animation.field?.layers[layer]) {
    film.animation.marks.draw(marks, layer, film.index, frame.stage, frame.source, data.scale);
  }
  if (how === "marks") marks.flakes(trail(flakes, at), frame.stage, data.scale);
  if ($("outline").checked) {
    const cell = cellOf(frame);
    marks.box(...frame.stage, ...frame.source, "rgb(255 255 255 / 0.35)");
    marks.box(cell.left, cell.top, cell.width, cell.height, "#ff9b45");
    marks.pivot(frame.stage[0] + frame.pivot[0], frame.stage[1] + frame.pivot[1]);
  }
}

function drawPage(scale, picture) {
  const [width, height] = size();
  const whole = {
    sheet: chosen("layer"), page: sheetPage, x: 0, y: 0, width, height, left: 0, top: 0,
    rotated: false, bounds: [0, 0, width, height],
  };
  if (picture) painter.draw([whole], "frame", size(), backdrop(scale));
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
