/** What the controls and keys do. */
function playOrPause() {
  if (film.playing) film.pause();
  else film.play(wayOn() !== null);
  before = null;
  say(film.playing ? "playing" : `paused at frame ${film.index + 1}`);
  refresh();
}

function seek(position) {
  film.pause();
  film.seek(position);
  refresh();
  say($("scrub").getAttribute("aria-valuetext"));
}

/** The whole number before or after `at`, which may be off by a rounding. */
const neighbour = (at, way) => (way < 0 ? Math.ceil(at - 1e-6) - 1 : Math.floor(at + 1e-6) + 1);
const step = (way) => move(neighbour(isFluid() ? film.position : film.index, way));
const halfStep = (way) => move(neighbour(2 * film.position, way) / 2);

/** Step to a position: on as the fire plays, into another animation where it goes on there. */
function move(position) {
  const way = wayOn();
  const end = way?.frame + 1;
  if (!way || film.position >= end || position < end) {
    seek(film.rests && !way ? Math.min(position, film.count - 1) : position);
    return;
  }
  film.pause();
  follow(way, position - end);
  refresh();
  say($("scrub").getAttribute("aria-valuetext"));
}

/** Make the next choice, told to those who do not see it, with what a recipe could have for more. */
function change(name) {
  next(name);
  say([word(name), hints(name)].filter(Boolean).join(". "));
}

/** Show all views of the fire, or the one that is chosen. */
function changeViews() {
  if (film.animation.together) pick(film.animation.index, !isTogether);
  say(film.animation.together ? $("animation").selectedOptions[0].text.trim() : hints("views"));
}

/** Show an animation from its beginning, playing as the one before did. */
function show(index) {
  const { playing, speed } = film;
  film.pause();
  film = films[index];
  followGraphOf(film.animation);
  film.speed = speed;
  film.seek(0);
  if (playing) film.play();
  const { animation } = film;
  isTogether &&= Boolean(animation.together);
  $("animation").value = isTogether ? `${animation.together[0]} on` : index;
  $("repeat").checked = film.repeat;
  $("flake-controls").hidden = !animation.flakes;
  for (const each of document.querySelectorAll("[data-animation]")) {
    each.hidden = each.dataset.animation !== String(index);
  }
}

function select(index) {
  show(index);
  before = null;
  wantPlaceOf(index);
  refresh();
}

/** Show an animation alone, or with the other views of its fire, from where the one before was. */
function pick(index, together) {
  const { position } = film;
  const isSameFire = film.animation.together?.includes(index);
  if (together !== isTogether) zoom = "first";
  isTogether = together;
  select(index);
  if (isSameFire) film.seek(position);
  refresh();
}

/** The animation in whose box the pointer is, where several are shown. */
function animationAt(event) {
  if (!isTogether || view() !== "play") return null;
  const area = $("marks").getBoundingClientRect();
  const { size, boxes } = layout(scaleNow());
  const x = ((event.clientX - area.left) / area.width) * size[0];
  const y = ((event.clientY - area.top) / area.height) * size[1];
  return boxes.find((box) => x >= box.x && x < box.x + box.width && y >= box.y && y < box.y + box.height)
    ?.animation;
}

/** The frame under the pointer on the page, with the number of its animation and its own. */
function frameAt(event) {
  if (view() !== "page") return null;
  const area = $("marks").getBoundingClientRect();
  const [width, height] = leastSize();
  const x = ((event.clientX - area.left) / area.width) * width;
  const y = ((event.clientY - area.top) / area.height) * height;
  for (const [number, animation] of data.animations.entries()) {
    for (const [index, frame] of animation.frames.entries()) {
      const [w, h] = lie(frame);
      const inside = x >= frame.x && x < frame.x + w && y >= frame.y && y < frame.y + h;
      if (inside && frame.page === sheetPage) return { number, index, frame };
    }
  }
  return null;
}

$("play").addEventListener("click", playOrPause);
$("back").addEventListener("click", () => step(-1));
$("on").addEventListener("click", () => step(1));
$("scrub").addEventListener("input", () => seek(Number($("scrub").value)));
$("speed").addEventListener("change", () => {
  film.speed = Number($("speed").value);
});
$("repeat").addEventListener("change", () => {
  film.repeat = $("repeat").checked;
  refresh();
});
$("animation").addEventListener("change", () => {
  const [index, others] = $("animation").value.split(" ");
  pick(Number(index), others === "on");
});
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
    if (input.name === "view") zoom = "first";
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
  const alone = animationAt(event);
  if (alone) pick(alone.index, false);
  const found = frameAt(event);
  if (!found) return;
  if (films[found.number] !== film) select(found.number);
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
  ArrowLeft: () => step(-1),
  ArrowRight: () => step(1),
  ",": () => halfStep(-1),
  ".": () => halfStep(1),
  Home: () => seek(0),
  End: () => seek(film.count - 1),
  "+": () => zoomBy(1),
  "=": () => zoomBy(1),
  "-": () => zoomBy(-1),
  0: () => $("fit").click(),
  1: () => choose("view", "play"),
  2: () => choose("view", "seam"),
  3: () => choose("view", "page"),
  a: () => change("field"),
  b: () => next("backdrop"),
  d: () => next("seam"),
  e: putOutOrLight,
  f: () => change("flakes"),
  l: () => change("layer"),
  m: () => change("between"),
  o: () => $("outline").click(),
  p: () => $("pixels").click(),
  r: () => $("repeat").click(),
  v: changeViews,
  w: nextWind,
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
