/**
 * How a fire that changes passes from animation to animation, along its graph of states.
 *
 * It stays in places that stand in a row: in its winds, or out and burning. The viewer wants one of
 * them, and the fire goes there through all in between, as soon as a frame comes from which it may.
 */
let wanted = 0;

/** The graph that the fire follows, or none: each of its variants has one. */
let states = data.graphs[0];

/** Follow the graph of the variant that is shown; nothing of it is shown where a fire is gone. */
function followGraphOf({ variant }) {
  const graph = data.graphs[variant ?? data.graphs.indexOf(states)];
  if (graph === states) return;
  states = graph;
  drawGraph();
}

/** Where the fire goes on in another animation: {frame, to, entry}, or null where it stays. */
function wayOn() {
  if (!states) return null;
  const { places, leads, transitions } = states;
  const here = films.indexOf(film);
  const now = places.indexOf(here);
  if (now < 0 && film.repeat) return null;
  const towards = now < 0 ? leads[here] : now + Math.sign(wanted - now);
  const ways = transitions
    .filter(({ from, to }) => from === here && leads[to] === towards)
    .map((way) => ({ ...way, frame: way.frame ?? film.index }));
  const sooner = (one, other) => (film.until(other.frame) < film.until(one.frame) ? other : one);
  return ways.length ? ways.reduce(sooner) : null;
}

/** The frame into which that of a shown animation passes: none after the last of what plays once. */
function following(animation = film.animation) {
  const way = wayOn();
  if (way?.frame === film.index) return films[way.to].animation.frames[way.entry];
  return film.next === null ? null : animation.frames[film.next];
}

/** Show the fire in another animation, `part` of a frame after it came there. */
function follow(way, part = 0) {
  show(way.to);
  film.seek(way.entry + part);
}

/** Let `elapsed` ms of the viewer's time go by. */
function advance(elapsed) {
  const way = wayOn();
  const wait = way ? film.until(way.frame) / film.speed : Infinity;
  if (!film.playing || elapsed < wait) {
    film.advance(elapsed);
    return;
  }
  follow(way);
  advance(elapsed - wait);
}

/** Want the place where a chosen animation is, or leads. */
function wantPlaceOf(index) {
  wanted = states?.leads[index] ?? 0;
}

/** Whether the fire is out: at the end of what puts it out. */
const isOut = () => film.rests && film.next === null;

/** What a fire that is lit and put out does, in words. */
function phaseTold() {
  const isLit = wanted === 1;
  if (isOut()) return isLit ? "is being lit" : "is out";
  switch (states.phases[films.indexOf(film)]) {
    case "ignite": return isLit ? "is being lit" : "is being lit, then goes out";
    case "burn": return isLit ? "burns" : `goes out after frame ${wayOn().frame + 1}`;
    default: return isLit ? "goes out, then is lit" : "goes out";
  }
}

/** Tell what is wanted, beside the controls that change it. */
function tellWanted() {
  if ($("wind")) {
    const { levels } = states;
    $("wind").value = wanted;
    $("level").textContent = levels[wanted];
    $("wind").setAttribute("aria-valuetext", levels[wanted]);
    $("wind").style.setProperty("--done", wanted / (levels.length - 1));
  }
  if ($("phase")) {
    $("phase").textContent = wanted ? "Put out" : "Light";
    $("phase-told").textContent = phaseTold();
  }
}

/** Let a wind blow, counted from the weakest. */
function blow(level) {
  wanted = level;
  refresh();
  say(`wind ${$("level").textContent}`);
}

/** Let the next stronger wind blow; after the strongest the weakest. */
function nextWind() {
  if ($("wind")) blow((wanted + 1) % states.levels.length);
  else say(hints("wind"));
}

/** Put a fire out that burns or is to burn, or else light it. */
function putOutOrLight() {
  if (!$("phase")) {
    say(hints("phase"));
    return;
  }
  wanted = 1 - wanted;
  refresh();
  say(`the fire ${phaseTold()}`);
}

$("wind")?.addEventListener("input", () => blow(Number($("wind").value)));
$("phase")?.addEventListener("click", putOutOrLight);
