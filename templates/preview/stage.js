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

/** A frame as a cell, where it stands on the animation's stage. */
function cellOf(frame) {
  return { ...frame, left: frame.stage[0] + frame.trim[0], top: frame.stage[1] + frame.trim[1] };
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
  const { index, frame } = film;
  const { flakes } = film.animation;
  const how = flakes ? chosen("flakes") : "off";
  const light = how === "light" && {
    rows: flakes.rows, first: flakes.firsts[index], count: flakes.counts[index],
    offset: frame.stage, scale: data.scale,
  };
  painter.draw([cellOf(frame)], "frame", size(), backdrop(scale), light || null);
  if (how === "marks") marks.flakes(trail(flakes, index), frame.stage, data.scale);
  if ($("outline").checked) {
    const cell = cellOf(frame);
    marks.box(...frame.stage, ...frame.source, "rgb(255 255 255 / 0.35)");
    marks.box(cell.left, cell.top, cell.width, cell.height, "#ff9b45");
    marks.pivot(frame.stage[0] + frame.pivot[0], frame.stage[1] + frame.pivot[1]);
  }
}

function drawPage(scale, picture) {
  const [width, height] = size();
  const whole = { page: sheetPage, x: 0, y: 0, width, height, left: 0, top: 0, turned: false };
  if (picture) painter.draw([whole], "frame", size(), backdrop(scale));
  const lie = (frame) => {
    const [w, h] = frame.turned ? [frame.height, frame.width] : [frame.width, frame.height];
    return [frame.x, frame.y, w, h];
  };
  for (const { frames } of data.animations) {
    for (const frame of frames) {
      if (frame.page === sheetPage) marks.box(...lie(frame), "rgb(127 212 255 / 0.45)");
    }
  }
  if (hovered) marks.box(...lie(hovered.frame), "#ffffff", 2);
  if (film.frame.page === sheetPage) marks.box(...lie(film.frame), "#ff9b45", 2);
}

/** The flakes of frame `index` and of those before it, the last first, by id. */
function trail(flakes, index) {
  const frames = [];
  for (let back = 0; back <= Marks.TRAIL; back++) {
    const i = index - back;
    if (i < 0 && !film.animation.loop) break;
    const at = (i + film.count) % film.count;
    frames.push(flakesOf(flakes, at));
    if (film.count <= back + 1) break;
  }
  return frames;
}

function flakesOf({ rows, firsts, counts }, index) {
  const { FLOATS } = FlakePainter;
  const found = new Map();
  for (let row = firsts[index]; row < firsts[index] + counts[index]; row++) {
    const [id, x, y, , , size, stretch, rotation, r, g, b] = rows.subarray(row * FLOATS);
    const most = Math.max(r, g, b, 1e-6);
    const [red, green, blue] = [r, g, b].map((v) => Math.round(255 * (0.35 + (0.65 * v) / most)));
    found.set(id, { x, y, size, stretch, rotation, colour: `rgb(${red} ${green} ${blue})` });
  }
  return found;
}
