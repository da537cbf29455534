/** The page: its controls, its keys, and what is drawn when. */
const data = JSON.parse(document.getElementById("data").textContent);
const $ = (id) => document.getElementById(id);
const still = window.matchMedia("(prefers-reduced-motion: reduce)").matches;
const SMALL = 128; // px: up to here a picture is drawn pixel by pixel
const ZOOMS = [0.0625, 0.125, 0.25, 0.5, 1, 2, 3, 4, 6, 8, 12, 16];

const painter = makePainter();
const marks = new Marks($("marks"));
const films = data.animations.map((animation) => new Film(animation));
let film = films[0];
let zoom = "fit";
let sheetPage = 0;
let hovered = null;
let before = null;

function makePainter() {
  try {
    return new Painter($("picture"), data);
  } catch (error) {
    fail(error);
    throw error;
  }
}

function fail(error) {
  $("loading").hidden = false;
  $("loading").textContent = `Nothing can be shown: ${error.message}.`;
}

/** The bytes that an element holds as base64, which it then lets go. */
function bytesOf(id) {
  const text = atob($(id).textContent.trim());
  const bytes = new Uint8Array(text.length);
  for (let i = 0; i < text.length; i++) bytes[i] = text.charCodeAt(i);
  $(id).remove();
  return bytes;
}

async function load() {
  for (const [i, page] of data.pages.entries()) {
    const blob = new Blob([bytesOf(`page-${i}`)], { type: page.type });
    const asStored = { premultiplyAlpha: "none", colorSpaceConversion: "none" };
    painter.keep(i, await createImageBitmap(blob, asStored));
  }
  data.animations.forEach((animation, i) => {
    if (!animation.flakes) return;
    animation.flakes.rows = new Float32Array(bytesOf(`flakes-${i}`).buffer);
    let first = 0;
    animation.flakes.firsts = animation.flakes.counts.map((count) => (first += count) - count);
  });
  $("loading").hidden = true;
}

// What the controls say

const chosen = (name) => document.querySelector(`input[name="${name}"]:checked`).value;

function choose(name, value) {
  const input = document.querySelector(`input[name="${name}"][value="${value}"]`);
  if (!input || input.closest("[hidden]")) return;
  input.checked = true;
  input.dispatchEvent(new Event("change", { bubbles: true }));
}

function next(name) {
  const values = [...document.querySelectorAll(`input[name="${name}"]`)].map((each) => each.value);
  choose(name, values[(values.indexOf(chosen(name)) + 1) % values.length]);
}

const view = () => chosen("view");
const colour = () => (chosen("backdrop") === "own" ? $("own").value : chosen("backdrop"));

function backdrop(scale) {
  if (view() === "seam") return { colour: [0, 0, 0], square: 0 }; // so that grey means agreement
  if (colour() === "checker") return { colour: [0, 0, 0], square: Math.max(1, Math.round(10 / scale)) };
  const rgb = [1, 3, 5].map((i) => parseInt(colour().slice(i, i + 2), 16) / 255);
  return { colour: rgb, square: 0 };
}

// Sizes

const size = () => {
  if (view() !== "page") return film.animation.size;
  return [data.pages[sheetPage].width, data.pages[sheetPage].height];
};

function scaleNow() {
  if (zoom !== "fit") return zoom;
  const [width, height] = size();
  const room = Math.min(($("stage").clientWidth - 48) / width, ($("stage").clientHeight - 48) / height);
  // Whole numbers keep px square; what does not fit is made smaller as it must.
  return room >= 1 ? Math.min(Math.floor(room), 8) : Math.max(room, 0.02);
}

function zoomBy(steps) {
  const now = scaleNow();
  const larger = ZOOMS.filter((each) => each > now * 1.001);
  const smaller = ZOOMS.filter((each) => each < now * 0.999);
  zoom = (steps > 0 ? larger[0] : smaller.at(-1)) ?? now;
  refresh();
}

// Drawing

/** A frame as a cell, where it stands on the animation's stage. */
function cellOf(frame) {
  return { ...frame, left: frame.stage[0] + frame.trim[0], top: frame.stage[1] + frame.trim[1] };
}

function draw() {
  const scale = scaleNow();
  const frames = film.animation.frames;
  const seam = chosen("seam");
  marks.begin(size(), scale);
  if (view() === "page") drawPage(scale);
  else if (view() === "seam") {
    painter.draw([cellOf(frames[0]), cellOf(frames.at(-1))], seam, size(), backdrop(scale));
  } else drawFrame(scale);
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

function drawPage(scale) {
  const [width, height] = size();
  const whole = { page: sheetPage, x: 0, y: 0, width, height, left: 0, top: 0, turned: false };
  painter.draw([whole], "frame", size(), backdrop(scale));
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

// What is told

function tell() {
  const { animation, index, frame, count } = film;
  $("now").textContent = `${index + 1}`;
  $("of").textContent = `of ${count}`;
  $("seconds").textContent = `${(film.time / 1000).toFixed(2)} s`;
  $("scrub").value = index;
  $("scrub").setAttribute("aria-valuetext", `frame ${index + 1} of ${count}`);
  $("scrub").style.setProperty("--done", count > 1 ? index / (count - 1) : 1);
  const flakes = animation.flakes && chosen("flakes") !== "off" ? animation.flakes.counts[index] : null;
  $("caption").textContent = {
    play: flakes === null ? frame.name : `${frame.name} · ${flakes} flakes`,
    seam: chosen("seam") === "overlay"
      ? "Last frame in red, first in cyan: what is grey meets"
      : "Last frame against the first, four times the difference: what is black meets",
    page: hovered ? hovered.frame.name : data.pages[sheetPage].file,
  }[view()];
  $("picture").setAttribute("aria-label", {
    play: `${animation.name}, frame ${index + 1} of ${count}`,
    seam: `${animation.name}, last and first frame, ${chosen("seam")}`,
    page: `page ${data.pages[sheetPage].file} with the outlines of its frames`,
  }[view()]);
  $("zoom").textContent = `${+(scaleNow() * 100).toFixed(scaleNow() < 0.1 ? 1 : 0)} %`;
}

function say(text) {
  $("said").textContent = text;
}

function refresh() {
  const [width, height] = size();
  const scale = scaleNow();
  const style = $("canvases").style;
  style.width = `${width * scale}px`;
  style.height = `${height * scale}px`;
  $("picture").classList.toggle("pixels", $("pixels").checked);
  const around = view() === "seam" ? "#000000" : colour();
  $("stage").style.backgroundColor = around === "checker" ? "" : around;
  document.body.dataset.view = view();
  $("fit").setAttribute("aria-pressed", zoom === "fit");
  $("play").setAttribute("aria-pressed", film.playing);
  $("play").title = `${film.playing ? "Pause" : "Play"} (space)`;
  draw();
  tell();
}

function tick(now) {
  const shown = film.index;
  const was = film.playing;
  film.advance(before === null ? 0 : now - before);
  before = now;
  if (film.playing !== was) refresh();
  else if (film.index !== shown) {
    draw();
    tell();
  }
  requestAnimationFrame(tick);
}

// What the controls do

function playOrPause() {
  if (film.playing) film.pause();
  else film.play();
  before = null;
  say(film.playing ? "playing" : `paused at frame ${film.index + 1}`);
  refresh();
}

function seek(index) {
  film.pause();
  film.seek(index);
  say(`frame ${film.index + 1} of ${film.count}`);
  refresh();
}

function select(index) {
  const { playing, speed } = film;
  film.pause();
  film = films[index];
  film.speed = speed;
  film.seek(0);
  if (playing) film.play();
  before = null;
  const { animation } = film;
  $("scrub").max = film.count - 1;
  $("repeat").checked = film.repeat;
  $("flake-controls").hidden = !animation.flakes;
  for (const each of document.querySelectorAll("[data-animation]")) {
    each.hidden = each.dataset.animation !== String(index);
  }
  refresh();
}

/** The frame under the pointer on the page, with the number of its animation and its own. */
function frameAt(event) {
  if (view() !== "page") return null;
  const area = $("marks").getBoundingClientRect();
  const [width, height] = size();
  const x = ((event.clientX - area.left) / area.width) * width;
  const y = ((event.clientY - area.top) / area.height) * height;
  for (const [number, animation] of data.animations.entries()) {
    for (const [index, frame] of animation.frames.entries()) {
      const [w, h] = frame.turned ? [frame.height, frame.width] : [frame.width, frame.height];
      const inside = x >= frame.x && x < frame.x + w && y >= frame.y && y < frame.y + h;
      if (inside && frame.page === sheetPage) return { number, index, frame };
    }
  }
  return null;
}

$("play").addEventListener("click", playOrPause);
$("back").addEventListener("click", () => seek(film.index - 1));
$("on").addEventListener("click", () => seek(film.index + 1));
$("scrub").addEventListener("input", () => seek(Number($("scrub").value)));
$("speed").addEventListener("change", () => {
  film.speed = Number($("speed").value);
});
$("repeat").addEventListener("change", () => {
  film.repeat = $("repeat").checked;
});
$("animation").addEventListener("change", () => select(Number($("animation").value)));
$("sheet").addEventListener("change", () => {
  sheetPage = Number($("sheet").value);
  hovered = null;
  refresh();
});
$("larger").addEventListener("click", () => zoomBy(1));
$("smaller").addEventListener("click", () => zoomBy(-1));
$("fit").addEventListener("click", () => {
  zoom = "fit";
  refresh();
});
$("own").addEventListener("input", () => choose("backdrop", "own"));
for (const input of document.querySelectorAll("input[type=radio], #outline, #pixels")) {
  input.addEventListener("change", () => {
    if (input.name === "view") zoom = "fit";
    refresh();
  });
}
$("marks").addEventListener("pointermove", (event) => {
  const found = frameAt(event);
  if (found?.frame === hovered?.frame) return;
  hovered = found;
  refresh();
});
$("marks").addEventListener("pointerleave", () => {
  if (hovered) hovered = null;
  refresh();
});
$("marks").addEventListener("click", (event) => {
  const found = frameAt(event);
  if (!found) return;
  if (films[found.number] !== film) {
    $("animation").value = found.number;
    select(found.number);
  }
  seek(found.index);
});
$("stage").addEventListener("wheel", (event) => {
  if (!event.ctrlKey && !event.metaKey) return;
  event.preventDefault();
  zoomBy(-Math.sign(event.deltaY));
}, { passive: false });
new ResizeObserver(refresh).observe($("stage"));

const KEYS = {
  " ": playOrPause,
  ArrowLeft: () => seek(film.index - 1),
  ArrowRight: () => seek(film.index + 1),
  Home: () => seek(0),
  End: () => seek(film.count - 1),
  "+": () => zoomBy(1),
  "=": () => zoomBy(1),
  "-": () => zoomBy(-1),
  0: () => $("fit").click(),
  1: () => choose("view", "play"),
  2: () => choose("view", "seam"),
  3: () => choose("view", "page"),
  b: () => next("backdrop"),
  d: () => next("seam"),
  f: () => next("flakes"),
  o: () => $("outline").click(),
  p: () => $("pixels").click(),
  r: () => $("repeat").click(),
  "[": () => changeSpeed(-1),
  "]": () => changeSpeed(1),
};

function changeSpeed(steps) {
  const list = $("speed");
  const wanted = list.selectedIndex + steps;
  if (wanted < 0 || wanted >= list.options.length) return;
  list.selectedIndex = wanted;
  list.dispatchEvent(new Event("change"));
  say(`speed ${list.options[wanted].text}`);
}

/** Whether a control uses a key itself: space presses buttons, arrows move sliders and choices. */
function isOwnKey(target, key) {
  if (target.matches("select, input[type=color]")) return true;
  const moves = ["ArrowLeft", "ArrowRight", "Home", "End"].includes(key);
  if (target.matches("input[type=radio], input[type=range]")) return moves;
  return key === " " && target.matches("button, summary, input[type=checkbox]");
}

document.addEventListener("keydown", (event) => {
  const act = KEYS[event.key] ?? KEYS[event.key.toLowerCase()];
  if (!act || event.ctrlKey || event.metaKey || event.altKey) return;
  if (isOwnKey(event.target, event.key)) return;
  event.preventDefault();
  act();
});

load().then(() => {
  $("pixels").checked = Math.max(...film.animation.size) <= SMALL;
  select(0);
  if (!still) film.play();
  refresh();
  requestAnimationFrame(tick);
  document.body.dataset.ready = "";
}, fail);
