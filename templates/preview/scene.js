/**
 * A room behind a fire, which lights it: a floor, a wall, and a person for scale.
 *
 * A box of the canvas shows it from a little above: floor and wall are a stage's height (`unit`) times
 * DEPTH apart. The fire is a small lamp over the floor, where its light track has it or where its
 * frames are brightest; light falls off with the square of the distance, and with the cosine of its
 * angle. Its light is 1 in the mean of the animation, or of the first loop of a fire that changes, so
 * that any fire lights the room.
 */
class Scene {
  static PERSON = 1.6; // height of the person, of the stage's
  static DEPTH = 0.8;
  static RISE = 0.26; // from the fire's foot to the wall's, on the screen
  static FRONT = 0.22; // floor before the foot, at least
  static AIR = 0.1; // over the person's head

  /** Where the fire's foot is on its stage: at the pivot, or below what flies. */
  static foot({ size: [, height], frames: [{ stage, pivot }] }) {
    const y = stage[1] + pivot[1];
    return [stage[0] + pivot[0], y > 0.6 * height ? y : height];
  }

  /** How far the person stands from the fire's foot, in px to the right. */
  static distance({ size: [width, height] }) {
    return 0.4 * width + 0.34 * height;
  }

  /** Room for stage and person: [left of the foot, above it, right of it, below it]. */
  static room(animation) {
    const [width, height] = animation.size;
    const [x, y] = Scene.foot(animation);
    return [
      x, (Scene.PERSON + Scene.AIR) * height,
      Math.max(width - x, Scene.distance(animation) + 0.3 * height),
      Math.max(height - y, Scene.FRONT * height),
    ];
  }

  /** The least size of a box that shows stage and person. */
  static leastSize(animation) {
    const [left, above, right, below] = Scene.room(animation);
    return [Math.ceil(left + right), Math.ceil(above + below)];
  }

  /** Where an animation's stage begins in a box of `size`: with the person in the middle, and low. */
  static placeOf(animation, [width, height]) {
    const [x, y] = Scene.foot(animation);
    const [left, above, right, below] = Scene.room(animation);
    const [across, down] = [width - left - right, height - above - below];
    return [Math.floor(left + across / 2 - x), Math.floor(above + 0.6 * down - y)];
  }

  /** What the painter needs of a box to draw the room behind `frame`, the animation's `index`-th. */
  static of(box, frame, index) {
    const { animation } = box;
    const [x, y] = Scene.foot(animation);
    const [r, g, b, lampX, lampY] = animation.light[index];
    const ground = box.top + y;
    const unit = animation.size[1];
    return {
      unit, ground, edge: ground - Scene.RISE * unit,
      lamp: [box.left + frame.stage[0] + lampX, box.top + frame.stage[1] + lampY],
      light: [r, g, b],
      person: Scene.person(
        [box.width, box.height], box.left + x + Scene.distance(animation),
        ground - 0.06 * unit, Scene.PERSON * unit,
      ),
    };
  }

  /** A canvas of `size` with a person in green and its shade on the floor in red; the last is kept. */
  static person(size, x, feet, height) {
    const key = [...size, x, feet, height].join();
    if (Scene.drawn?.key === key) return Scene.drawn;
    const canvas = new OffscreenCanvas(...size);
    const context = canvas.getContext("2d");
    context.fillStyle = "#000000";
    context.fillRect(0, 0, ...size);
    context.globalCompositeOperation = "lighter";
    context.translate(x, feet);
    context.scale(height, height);
    const shade = context.createRadialGradient(0, 0, 0, 0, 0, 0.2);
    shade.addColorStop(0, "rgb(255 0 0)");
    shade.addColorStop(1, "rgb(0 0 0)");
    context.fillStyle = shade;
    context.save();
    context.scale(1, 0.2);
    context.fillRect(-0.2, -0.2, 0.4, 0.4);
    context.restore();
    context.fillStyle = "#00ff00";
    Scene.outline(context);
    Scene.drawn = { key, canvas };
    return Scene.drawn;
  }

  /** The right half of a person of height 1 from the neck down, feet at the origin, y up. */
  static HALF = [
    [0.026, 0.9], [0.028, 0.862], [0.05, 0.846], [0.1, 0.832], [0.124, 0.806], [0.134, 0.75],
    [0.141, 0.67], [0.149, 0.59], [0.15, 0.52], [0.154, 0.45], [0.14, 0.425], [0.122, 0.43],
    [0.119, 0.53], [0.114, 0.61], [0.103, 0.69], [0.097, 0.735], [0.091, 0.665], [0.088, 0.61],
    [0.094, 0.54], [0.099, 0.475], [0.097, 0.39], [0.089, 0.295], [0.088, 0.22], [0.078, 0.07],
    [0.095, 0.03], [0.095, 0], [0.03, 0], [0.026, 0.03], [0.027, 0.09], [0.022, 0.2],
    [0.017, 0.3], [0.008, 0.43], [-0.004, 0.46], [-0.004, 0.46],
  ];

  /** Fill a person of height 1 whose feet are at the origin. */
  static outline(context) {
    context.beginPath();
    context.ellipse(0, -0.936, 0.045, 0.06, 0, 0, 2 * Math.PI);
    context.fill();
    for (const side of [-1, 1]) {
      context.beginPath();
      context.moveTo(0, -0.9);
      Scene.HALF.slice(1).forEach(([x, y], i) => {
        const [fromX, fromY] = Scene.HALF[i];
        context.quadraticCurveTo(side * fromX, -fromY, (side * (fromX + x)) / 2, -(fromY + y) / 2);
      });
      context.lineTo(0, -0.458);
      context.fill();
    }
  }

  /** The light that the room shows at `p`, linear; toLight and toSrgb are the painter's. */
  static GLSL = `
    uniform sampler2D person;
    uniform float unit, ground, edge;
    uniform vec2 lamp;
    uniform vec3 lampLight;

    float chance(vec2 v) { return fract(sin(dot(v, vec2(12.9898, 78.233))) * 43758.5453); }

    /** Bright stones, each a little different, with dark joints: of rows of \`size\`, every other shifted. */
    float stones(vec2 at, vec2 size, float pixel) {
      vec2 v = at / size;
      v.x += 0.5 * mod(floor(v.y), 2.0);
      vec2 off = (0.5 - abs(fract(v) - 0.5)) * size;
      float joint = smoothstep(0.0, 2.0 * max(0.006, pixel), min(off.x, off.y));
      return mix(0.55, 0.86 + 0.28 * chance(floor(v)), joint);
    }

    vec3 room(vec2 p) {
      float x = (p.x - lamp.x) / unit, height = max((ground - lamp.y) / unit, 0.25), pixel = 1.0 / unit;
      float depth = float(${Scene.DEPTH}), lit, stone;
      vec3 surface, ray;  // from the lamp, in units; up and away are positive
      if (p.y > edge) {
        float away = depth * (ground - p.y) / (ground - edge);
        ray = vec3(x, -height, away);
        lit = height;
        stone = stones(vec2(p.x / unit + 0.13, away + 7.0), vec2(0.44, 0.34), pixel);
        surface = vec3(0.30, 0.28, 0.26);
      } else {
        ray = vec3(x, (edge - p.y) / unit - height, depth);
        lit = depth;
        stone = stones(vec2(p.x, edge - p.y) / unit, vec2(0.32, 0.17), pixel);
        surface = vec3(0.36, 0.34, 0.33);
      }
      vec3 seen = texelFetch(person, ivec2(p), 0).rgb;
      float reach = dot(ray, ray) + 0.03;  // flames are no point
      vec3 light = lampLight * 0.4 * lit / (reach * sqrt(reach)) * (1.0 - 0.7 * seen.r);
      vec3 bright = surface * stone * (light + vec3(0.018, 0.021, 0.030));
      vec2 inwards = normalize(p - lamp) * max(0.012 * unit, 1.0);
      float rim = 1.0 - texelFetch(person, ivec2(p - inwards), 0).g;
      return mix(bright, vec3(0.0012) + rim * 0.6 * light, seen.g);
    }`;
}
