/** A small picture of the graph of states: nodes in a row, and arrows from one to another. */
class GraphPicture {
  static HEIGHT = 22; // of a node, px
  static GAP = 18; // between nodes
  static TOP = 11; // over the nodes, for arrows from one to itself
  static BELOW = 12; // for an arrow from the last to the first

  /**
   * A node is {name, place, runs}, an arrow {from, to, runs} between the numbers of nodes: `runs` tells
   * whether it is what the fire now shows, `place` is one that may be wanted.
   */
  constructor(svg, nodes, arrows) {
    this.svg = svg;
    this.nodes = nodes;
    this.boxes = GraphPicture.boxes(nodes.map(({ name }) => name));
    const isBack = ({ from, to }) => Math.abs(from - to) > 1;
    const width = Math.ceil(this.boxes.at(-1).right + 1);
    const height = GraphPicture.TOP + GraphPicture.HEIGHT + (arrows.some(isBack) ? GraphPicture.BELOW : 1);
    svg.setAttribute("viewBox", `0 0 ${width} ${height}`);
    svg.setAttribute("width", width);
    svg.innerHTML = [
      ...arrows.map((arrow) => `<path d="${isBack(arrow) ? this.back(arrow) : this.straight(arrow, arrows)}"/>`),
      ...nodes.map((node, i) => this.drawn(node, this.boxes[i])),
    ].join("");
    this.parts = [...arrows, ...nodes].map((part, i) => ({ ...part, element: svg.children[i] }));
  }

  /** Where nodes of some names are, from left to right. */
  static boxes(names) {
    const context = new OffscreenCanvas(1, 1).getContext("2d");
    context.font = "600 12px ui-sans-serif, system-ui, sans-serif";
    let left = 1;
    return names.map((name) => {
      const right = left + Math.max(26, Math.ceil(context.measureText(name).width) + 12);
      const box = { left, right, middle: (left + right) / 2 };
      left = right + GraphPicture.GAP;
      return box;
    });
  }

  drawn({ name, loops }, { left, right, middle }) {
    const { TOP, HEIGHT } = GraphPicture;
    const again = loops ? `<path d="M${middle + 7} ${TOP}c5-13-19-13-14-1m-3.5-3l3.5 3l3-3.5"/>` : "";
    return `<g>${again}<rect x="${left}" y="${TOP}" width="${right - left}" height="${HEIGHT}" rx="6"/>
      <text x="${middle}" y="${TOP + 15}">${name}</text></g>`;
  }

  /** An arrow to a neighbour, beside the one that comes from there. */
  straight({ from, to }, arrows) {
    const comesBack = arrows.some((other) => other.from === to && other.to === from);
    const y = GraphPicture.TOP + GraphPicture.HEIGHT / 2 + (comesBack ? 5 * Math.sign(from - to) : 0);
    return from < to
      ? `M${this.boxes[from].right + 3} ${y}H${this.boxes[to].left - 3}m-4-3l4 3l-4 3`
      : `M${this.boxes[from].left - 3} ${y}H${this.boxes[to].right + 3}m4-3l-4 3l4 3`;
  }

  /** An arrow back, below all nodes. */
  back({ from, to }) {
    const bottom = GraphPicture.TOP + GraphPicture.HEIGHT;
    const [begin, end] = [this.boxes[from].middle, this.boxes[to].middle];
    return `M${begin} ${bottom + 2}v3q0 5-5 5H${end + 5}q-5 0-5-5v-3m-3 4l3-4l3 4`;
  }

  /** Mark what the fire now shows, and the place that is wanted. */
  mark() {
    for (const { element, runs, place } of this.parts) {
      element.classList.toggle("now", runs());
      element.classList.toggle("wanted", place === wanted);
    }
    const names = this.nodes.map(({ name }) => name).join(", ");
    const now = this.parts.find(({ runs }) => runs());
    this.svg.setAttribute("aria-label", `${names}; now: ${now?.name ?? "none of them"}`);
  }
}

const isShown = (index) => films[index] === film;

/** The winds in which a fire burns, and the transitions between them. */
function pictureOfWinds({ places, levels, leads, transitions }) {
  const nodes = levels.map((level, place) => ({
    name: level, place, loops: true, runs: () => isShown(places[place]),
  }));
  const arrows = transitions.filter(({ from }) => places.includes(from)).map(({ from, to }) => {
    const [before, after] = [places.indexOf(from), leads[to]];
    return { name: `${levels[before]} to ${levels[after]}`, from: before, to: after, runs: () => isShown(to) };
  });
  return new GraphPicture($("graph"), nodes, arrows);
}

/** A round: a fire is out, is lit, burns, and is put out. */
function pictureOfPhases({ phases }) {
  const names = ["out", "ignite", "burn", "extinguish"];
  const nodes = names.filter((name) => name === "out" || phases.includes(name)).map((name) => ({
    name, place: { out: 0, burn: 1 }[name], loops: name === "burn",
    runs: () => name === (isOut() ? "out" : phases[films.indexOf(film)]),
  }));
  const arrows = nodes.map((_, i) => ({ from: i, to: (i + 1) % nodes.length, runs: () => false }));
  return new GraphPicture($("graph"), nodes, arrows);
}

let graphPicture = null;

/** Draw the graph that the fire follows. */
function drawGraph() {
  if (data.graphs.length) graphPicture = (states.phases ? pictureOfPhases : pictureOfWinds)(states);
}

drawGraph();
