/** What is told beside the picture, for eyes and for screen readers. */
function tell() {
  const { animation, index, frame, count } = film;
  const isBetween = isFluid() && film.part > 0 && following() !== null;
  const way = wayOn();
  const next = way?.frame === index
    ? `${way.entry + 1} of ${data.animations[way.to].name}`
    : ((index + 1) % count) + 1;
  const frames = isBetween ? `between frames ${index + 1} and ${next}` : `frame ${index + 1}`;
  const place = `${frames} of ${count}`;
  $("now").textContent = isBetween ? (film.position + 1).toFixed(2) : `${index + 1}`;
  $("of").textContent = `of ${count}`;
  $("seconds").textContent = `${(film.time / 1000).toFixed(2)} s`;
  // Where frames pass into one another the bar has half steps, and in a loop one after the last.
  $("scrub").step = isFluid() ? 0.5 : 1;
  $("scrub").max = isFluid() && animation.loop && film.repeat && count > 1 ? count - 0.5 : count - 1;
  $("scrub").value = isFluid() ? film.position : index;
  $("scrub").setAttribute("aria-valuetext", place);
  const longest = Number($("scrub").max);
  $("scrub").style.setProperty("--done", longest ? Number($("scrub").value) / longest : 1);
  tellWanted();
  graphPicture?.mark();
  const name = isTogether ? `${animation.together.length} ${animation.kind} side by side` : animation.name;
  const withFlakes = animation.flakes && chosen("flakes") !== "off";
  $("caption").textContent = {
    play: isTogether ? name : withFlakes ? `${frame.name} · ${flakesTold()}` : frame.name,
    seam: chosen("seam") === "overlay"
      ? "Last frame in red, first in cyan: what is grey meets"
      : "Last frame against the first, four times the difference: what is black meets",
    page: hovered ? hovered.frame.name : data.pages[sheetPage].file,
  }[view()];
  const shown = {
    play: `${name}, ${place}${isBetween ? `, ${word("between")}` : ""}`,
    seam: `${animation.name}, last and first frame, ${chosen("seam")}`,
    page: `page ${data.pages[sheetPage].file} with the outlines of its frames`,
  }[view()];
  const field = animation.field?.layers[chosen("field")];
  if ($("field-legend")) {
    $("field-legend").hidden = !field;
    $("field-title").textContent = field?.title ?? "";
    $("field-longest").textContent = field?.longest ?? "";
  }
  const analysed = field && view() === "play" ? `, with ${field.title}` : "";
  const alone = chosen("layer") === "composed" ? "" : `, ${word("layer")} alone`;
  $("picture").setAttribute("aria-label", `${shown}${alone}${analysed}`);
  $("zoom").textContent = `${+(scaleNow() * 100).toFixed(scaleNow() < 0.1 ? 1 : 0)} %`;
}

/** How many flakes are shown, and in which of the rounds after which they repeat. */
function flakesTold() {
  const { counts, rounds } = film.animation.flakes;
  const at = film.flakeFrame;
  const round = rounds > 1 ? `, round ${Math.floor(at / film.count) + 1} of ${rounds}` : "";
  return `${counts[at]} flakes${round}`;
}

function say(text) {
  $("said").textContent = text;
}
