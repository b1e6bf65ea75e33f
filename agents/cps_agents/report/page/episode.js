// Episodes: files that hand themselves over when they are loaded, and pictures drawn from recorded shapes.

const TYPEFACE = "'Liberation Sans', Arimo, Arial, Helvetica, 'Nimbus Sans', sans-serif";
const SPRITE_SCALE = 1 / 4; // sprites are recorded four times too large
const waiting = new Map(); // key -> {resolve, reject}
const loaded = new Map(); // key -> promise of an episode

window.receiveEpisode = async (key, packed) => {
  const { resolve, reject } = waiting.get(key);
  try {
    const bytes = Uint8Array.from(atob(packed), (letter) => letter.charCodeAt(0));
    const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip"));
    resolve(unfold(await new Response(stream).json()));
  } catch (error) {
    reject(error);
  }
};

function loadEpisode(key) {
  if (!loaded.has(key)) {
    loaded.set(key, new Promise((resolve, reject) => {
      waiting.set(key, { resolve, reject });
      const failed = () => reject(new Error(`The file episodes/${key}.js is missing beside this page.`));
      document.head.append(make("script", { src: `episodes/${key}.js`, onerror: failed }));
    }));
  }
  return loaded.get(key);
}

/** The episode with every line whole and every picture as a list of shapes. */
function unfold(episode) {
  const { reel } = episode;
  if (!reel) return episode;
  for (const [place, shape] of reel.shapes.entries()) {
    if (!shape[0].endsWith("+")) continue;
    const [kind, color, base, kept, ...steps] = shape;
    const points = kept ? reel.shapes[base].slice(2, 2 + kept) : [];
    for (const step of steps) points.push(Math.round(10 * (points.at(-2) ?? 0) + step) / 10);
    reel.shapes[place] = [kind.slice(0, -1), color, ...points];
  }
  let [before, taken] = [[], 0];
  reel.pictures = reel.frames.map((pairs) => {
    const now = [];
    let end = 0;
    for (let k = 0; k < pairs.length; k += 2) {
      const [skipped, count] = [pairs[k], pairs[k + 1]];
      if (count) now.push(...before.slice(end + skipped, end + skipped + count));
      else now.push((taken += skipped));
      if (count) end += skipped + count;
    }
    before = now;
    return now;
  });
  return episode;
}

/** Draws picture `place` of a reel on a canvas, sharp at its size on the screen. */
function drawPicture(canvas, reel, place) {
  const [width, height] = reel.size;
  const scale = (canvas.clientWidth || width) * (window.devicePixelRatio || 1) / width;
  const pixels = [Math.round(width * scale), Math.round(height * scale)];
  if (canvas.width !== pixels[0] || canvas.height !== pixels[1]) [canvas.width, canvas.height] = pixels;
  const context = canvas.getContext("2d");
  context.setTransform(scale, 0, 0, scale, 0, 0);
  context.save();
  for (const shape of reel.pictures[place]) drawShape(context, reel, reel.shapes[shape]);
  context.restore();
}

function drawShape(context, reel, [kind, ...rest]) {
  const draw = SHAPES[kind];
  if (kind === "clip" || kind === "sprite") {
    draw(context, reel, ...rest);
    return;
  }
  context.fillStyle = context.strokeStyle = reel.colors[rest[0]];
  draw(context, ...rest.slice(1));
}

function trace(context, points, shift = 0) {
  context.beginPath();
  for (let k = 0; k < points.length; k += 2) context.lineTo(points[k] + shift, points[k + 1] + shift);
}

/** A box whose edges lie on whole pixels of the screen, so that neighbours leave no seam. */
function snapped(context, left, top, width, height) {
  const { a, e, f } = context.getTransform();
  const at = (value, shift) => (Math.round(value * a + shift) - shift) / a;
  const [x, y] = [at(left, e), at(top, f)];
  context.fillRect(x, y, Math.max(at(left + width, e) - x, 1 / a), Math.max(at(top + height, f) - y, 1 / a));
}

const SHAPES = {
  fill(context) {
    context.fillRect(0, 0, 1e4, 1e4);
  },
  box(context, left, top, width, height, radius, border) {
    if (!radius && !border) {
      snapped(context, left, top, width, height);
      return;
    }
    const inset = border / 2;
    context.beginPath();
    context.roundRect(left + inset, top + inset, width - border, height - border,
      Math.min(radius, width / 2, height / 2));
    context.lineWidth = border;
    if (border) context.stroke();
    else context.fill();
  },
  polygon(context, ...points) {
    trace(context, points);
    context.fill();
  },
  path(context, ...points) {
    trace(context, points, 0.5);
    context.lineWidth = 1.2;
    context.lineCap = "butt";
    context.lineJoin = "round";
    context.stroke();
  },
  line(context, thickness, ...points) {
    trace(context, points);
    context.lineWidth = thickness;
    context.lineCap = "round";
    context.stroke();
  },
  circle(context, radius, x, y) {
    context.beginPath();
    context.arc(x, y, radius, 0, 2 * Math.PI);
    context.fill();
  },
  dashes(context, left, top, width, height, period, length, phase) {
    for (let x = left + phase - period; x < left + width; x += period) {
      const [begin, end] = [Math.max(x, left), Math.min(x + length, left + width)];
      if (end > begin) context.fillRect(begin, top, end - begin, height);
    }
  },
  text(context, size, left, baseline, width, text) {
    context.font = `bold ${size}px ${TYPEFACE}`;
    context.fillText(text, left, baseline, width + 1);
  },
  sprite(context, reel, place, left, top) {
    context.save();
    context.translate(left, top);
    context.scale(SPRITE_SCALE, SPRITE_SCALE);
    for (const shape of reel.sprites[place].shapes) drawShape(context, reel, shape);
    context.restore();
  },
  clip(context, reel, ...box) {
    context.restore();
    context.save();
    if (!box.length) return;
    context.beginPath();
    context.rect(...box);
    context.clip();
  },
};
