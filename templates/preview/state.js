/** What the page holds, and what is chosen in it. */
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

const chosen = (name) => document.querySelector(`input[name="${name}"]:checked`).value;

function choose(name, value) {
  const input = document.querySelector(`input[name="${name}"][value="${value}"]`);
  if (!input || input.disabled || input.closest("[hidden]")) return;
  input.checked = true;
  input.dispatchEvent(new Event("change", { bubbles: true }));
}

function next(name) {
  const inputs = [...document.querySelectorAll(`input[name="${name}"]:enabled`)];
  const values = inputs.map((each) => each.value);
  choose(name, values[(values.indexOf(chosen(name)) + 1) % values.length]);
}

/** What is chosen, as the page calls it. */
function word(name) {
  const input = document.querySelector(`input[name="${name}"]:checked`);
  return input.parentElement.textContent.trim().toLowerCase();
}

const view = () => chosen("view");
/** Whether frames pass into one another, rather than each being held for its time. */
const isFluid = () => chosen("between") !== "hold";
const colour = () => (chosen("backdrop") === "own" ? $("own").value : chosen("backdrop"));

function backdrop(scale) {
  if (view() === "seam") return { colour: [0, 0, 0], square: 0 }; // so that grey means agreement
  if (colour() === "checker") return { colour: [0, 0, 0], square: Math.max(1, Math.round(10 / scale)) };
  const rgb = [1, 3, 5].map((i) => parseInt(colour().slice(i, i + 2), 16) / 255);
  return { colour: rgb, square: 0 };
}
