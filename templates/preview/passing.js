/** How fire with several winds passes from animation to animation, along its graph of states. */

/** Where the fire goes on in another animation: {frame, to, entry}, or null where it stays. */
function wayOn() {
  if (!data.states) return null;
  const { loops, transitions } = data.states;
  const here = films.indexOf(film);
  const ways = transitions.filter(({ from }) => from === here);
  const now = loops.indexOf(here);
  if (now < 0) return film.repeat ? null : (ways[0] ?? null);
  const towards = loops[now + Math.sign(Number($("wind").value) - now)];
  return ways.find(({ to }) => towards !== here && loopAfter(to) === towards) ?? null;
}

/** The loop to which a transition leads. */
function loopAfter(transition) {
  return data.states.transitions.find(({ from }) => from === transition)?.to;
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

/** Let the slider say in which wind a chosen animation is, or ends. */
function tellWindOf(index) {
  if (!data.states) return;
  const { loops } = data.states;
  $("wind").value = loops.indexOf(loops.includes(index) ? index : loopAfter(index));
}

/** Let the next stronger wind blow; after the strongest the weakest. */
function nextWind() {
  if (!data.states) {
    say(hints("wind"));
    return;
  }
  $("wind").value = (Number($("wind").value) + 1) % data.states.levels.length;
  $("wind").dispatchEvent(new Event("input"));
}

$("wind")?.addEventListener("input", () => {
  refresh();
  say(`wind ${$("level").textContent}`);
});
