// Time lines: what each role did, saw and believed, under the picture and in step with it.

const FEW_ROWS = 6; // drawn as lines; more are drawn as a strip, a row for each
const TRACK_HEIGHT = 44;

function makeTracks(episode, seek) {
  const { attacker, defender } = episode.tracks;
  const groups = [
    ["What the attacker did", "attacker", attacker.actions, true],
    ["What the defender did", "defender", defender.actions, true],
    ["What the attacker believed", "attacker", attacker.beliefs, true],
    ["What the defender believed", "defender", defender.beliefs, true],
    ["What the attacker saw", "attacker", attacker.observations, false],
    ["What the defender saw", "defender", defender.observations, false],
  ].filter(([, , tracks]) => tracks.length);
  const views = [];
  const root = make("div", { class: "tracks" }, groups.map(([title, role, tracks, open]) => {
    const made = tracks.map((track) => makeTrack(track, role, seek));
    views.push(...made);
    const group = make("details", { open, class: role },
      make("summary", {}, title, make("span", { class: "count" }, ` ${tracks.length}`)),
      made.map((view) => view.root));
    group.addEventListener("toggle", () => made.forEach((view) => view.draw()));
    return group;
  }));
  const last = Math.max(episode.times.length - 1, 1);
  return {
    root,
    draw: () => views.forEach((view) => view.draw()),
    show: (place) => {
      root.style.setProperty("--at", place / last);
      views.forEach((view) => view.show(place));
    },
  };
}

function makeTrack(track, role, seek) {
  const canvas = make("canvas", { height: TRACK_HEIGHT });
  const value = make("output", { class: "value" });
  const plot = make("div", { class: "plot", onpointerdown: follow, onpointermove: follow }, canvas);
  const rows = track.count > 1 ? `${track.count} rows` : "";
  const label = make("div", { class: "label", title: track.about || null },
    make("b", {}, words(track.name)), make("span", {}, [track.unit, rows].filter(Boolean).join(", ")));
  let current = 0;

  function follow(event) {
    if (event.type === "pointermove" && !event.buttons) return;
    const box = plot.getBoundingClientRect();
    seek(Math.round(clamp((event.clientX - box.left) / box.width, 0, 1) * (track.rows[0].length - 1)));
  }

  return {
    root: make("div", { class: `track ${role}` }, label, plot, value),
    draw: () => canvas.clientWidth && (track.rows.length > FEW_ROWS ? drawStrip : drawLines)(canvas, track, role),
    show: (place) => {
      current = place;
      value.value = valuesAt(track, current);
    },
  };
}

function physical(track, row, place) {
  return track.low + (track.rows[row][place] / track.steps) * (track.high - track.low);
}

function valuesAt(track, place) {
  const values = track.rows.map((_, row) => physical(track, row, place));
  if (values.length <= 3) return values.map((value) => number(value)).join("  ");
  const [low, high] = [Math.min(...values), Math.max(...values)].map((value) => number(value));
  return low === high ? low : `${low} to ${high}`;
}

function prepared(canvas) {
  const ratio = window.devicePixelRatio || 1;
  const [width, height] = [canvas.clientWidth, canvas.clientHeight];
  [canvas.width, canvas.height] = [Math.round(width * ratio), Math.round(height * ratio)];
  const context = canvas.getContext("2d");
  context.setTransform(ratio, 0, 0, ratio, 0, 0);
  return [context, width, height];
}

function drawLines(canvas, track, role) {
  const [context, width, height] = prepared(canvas);
  const [top, bottom] = [5, height - 5];
  if (track.low < 0 && track.high > 0) {
    context.fillStyle = ink("--grid");
    context.fillRect(0, bottom + (track.low / (track.high - track.low)) * (bottom - top), width, 1);
  }
  track.rows.forEach((row, k) => {
    const style = LINES[k % LINES.length];
    context.strokeStyle = track.rows.length === 1 ? ink(`--${role}`) : ink(style.color);
    context.setLineDash(style.dash);
    context.lineWidth = 1.6;
    context.beginPath();
    row.forEach((level, place) => {
      const x = (place / Math.max(row.length - 1, 1)) * width;
      const y = bottom - (level / track.steps) * (bottom - top);
      if (track.whole && place) context.lineTo(x, bottom - (row[place - 1] / track.steps) * (bottom - top));
      context.lineTo(x, y);
    });
    context.stroke();
  });
}

function drawStrip(canvas, track, role) {
  const [context, width, height] = prepared(canvas);
  const [rows, columns] = [track.rows.length, track.rows[0].length];
  const image = new OffscreenCanvas(columns, rows);
  const pixels = image.getContext("2d");
  const data = pixels.createImageData(columns, rows);
  const [from, to] = [ink("--strip-low"), ink(`--${role}-strong`)].map(channels);
  track.rows.forEach((row, r) => row.forEach((level, place) => {
    const share = level / track.steps;
    const at = 4 * (r * columns + place);
    for (let c = 0; c < 3; c++) data.data[at + c] = from[c] + share * (to[c] - from[c]);
    data.data[at + 3] = 255;
  }));
  pixels.putImageData(data, 0, 0);
  context.imageSmoothingEnabled = false;
  context.drawImage(image, 0, 0, width, height);
}

/** Red, green and blue of a colour such as #1c2430. */
function channels(color) {
  return [1, 3, 5].map((place) => parseInt(color.slice(place, place + 2), 16));
}
