/** What the page holds, and what is chosen in it. */
const data = JSON.parse(document.getElementById("data").textContent);
const $ = (id) => document.getElementById(id);
const still = window.matchMedia("(prefers-reduced-motion: reduce)").matches;
const LARGE = 256; // px: from here on frames are shown at their own size at first, below twice as large
const ZOOMS = [0.0625, 0.125, 0.25, 0.5, 1, 2, 3, 4, 6, 8, 12, 16];

const painter = makePainter();
const marks = new Marks($("marks"));
const films = data.animations.map((animation, i) => new Film(animation, data.graphs.some(({ out }) => out === i)));
let film = films[0];
let isTogether = false; // whether all views of the fire are shown, side by side
let zoom = "first"; // or "fit", or a number
let sheetPage = 0;
let hovered = null;
let before = null;

const chosen = (name) => document.querySelector(`input[name="${name}"]:checked`).value;

function choose(name, value) {
  const input = document.querySelector(`input[name="${name}"][value="${value}"]`);
  if (!input || input.disabled || input.closest("[hidden]")) return;
  input.checked = true;
  input.dispatchEvent(new Event("change", { bubbles: true }));
}

function next(name) {
  const inputs = [...document.querySelectorAll(`input[name="${name}"]`)];
  const values = inputs.map((each) => each.value);
  choose(name, values[(values.indexOf(chosen(name)) + 1) % values.length]);
}

/** What is chosen, as the page calls it. */
function word(name) {
  const input = document.querySelector(`input[name="${name}"]:checked`);
  return input.parentElement.textContent.trim().toLowerCase();
}

/** What a recipe could have, for there to be more to choose from. */
function hints(name) {
  return [...document.querySelectorAll(`[data-hint="${name}"]`)]
    .map((each) => each.textContent.trim().replace(/\s+/g, " ")).join(". ");
}

const view = () => chosen("view");
/** Whether frames pass into one another, rather than each being held for its time. */
const isFluid = () => chosen("between") !== "hold";
const colour = () => (chosen("backdrop") === "own" ? $("own").value : chosen("backdrop"));
const isScene = () => view() === "play" && colour() === "scene";

/** What is behind a picture that is shown `scale` times as large. */
function backdrop(scale) {
  const [r, g, b] = [1, 3, 5].map((i) => parseInt(around().slice(i, i + 2), 16) / 255);
  const isChecker = view() !== "seam" && colour() === "checker";
  return { colour: [r, g, b], square: isChecker ? Math.max(1, Math.round(10 / scale)) : 0 };
}

/** The colour around the picture, and behind it if nothing else is. */
function around() {
  if (view() === "seam") return "#000000"; // so that grey means agreement
  return { checker: "#1a1b1f", scene: "#0b0b0d" }[colour()] ?? colour();
}
