/** The page: it unpacks what it holds, and shows it again and again. */
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
  const asStored = { premultiplyAlpha: "none", colorSpaceConversion: "none" };
  for (const sheet of data.sheets) {
    for (const [i, page] of data.pages.entries()) {
      const blob = new Blob([bytesOf(`${sheet}-page-${i}`)], { type: page.type });
      painter.keep(sheet, i, await createImageBitmap(blob, asStored));
    }
  }
  data.animations.filter(({ field }) => field).forEach((animation, i) => {
    animation.marks = new FieldMarks(animation.field, new Int16Array(bytesOf(`field-${i}`).buffer));
  });
  data.animations.forEach((animation, i) => {
    if (!animation.flakes) return;
    animation.flakes.rows = new Float32Array(bytesOf(`flakes-${i}`).buffer);
    let first = 0;
    animation.flakes.firsts = animation.flakes.counts.map((count) => (first += count) - count);
  });
  if (!painter.flakes) document.querySelector("[name=flakes][value=light]").parentElement.remove();
  $("loading").hidden = true;
}

function refresh() {
  const scale = scaleNow();
  const [width, height] = layout(scale).size;
  const style = $("canvases").style;
  style.width = `${width * scale}px`;
  style.height = `${height * scale}px`;
  $("picture").classList.toggle("pixels", $("pixels").checked);
  $("stage").style.backgroundColor = around();
  // A scene fills the window, with parts of pixels at its edge.
  $("stage").style.overflow = isScene() && scale <= roomFor(leastSize()) ? "hidden" : "";
  $("stage").classList.toggle("together", isTogether);
  document.body.dataset.view = view();
  $("fit").setAttribute("aria-pressed", zoom === "fit" || (zoom === "first" && view() === "page"));
  $("play").setAttribute("aria-pressed", film.playing);
  $("play").title = `${film.playing ? "Pause" : "Play"} (space)`;
  draw();
  tell();
}

/** What the picture depends on while the player goes on. */
const moment = () => (isFluid() ? film.time : film.index);

function tick(now) {
  const shown = moment();
  const animation = film;
  const was = film.playing;
  advance(before === null ? 0 : now - before);
  before = now;
  if (film.playing !== was || film !== animation) refresh();
  else if (moment() !== shown) {
    draw(false);
    tell();
  }
  requestAnimationFrame(tick);
}

load().then(() => {
  $("pixels").checked = data.isPixelArt;
  data.animations.forEach((animation, index) => {
    animation.index = index;
  });
  pick(0, true);
  if (!still) film.play();
  refresh();
  requestAnimationFrame(tick);
  document.body.dataset.ready = "";
}, fail);
