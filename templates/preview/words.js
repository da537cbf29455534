/** What is told beside the picture, for eyes and for screen readers. */
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
