// The player of an episode: its picture, its controls and its time lines.

const SECONDS = 12; // that an episode takes at speed 1, however many pictures it has
const SPEEDS = [0.25, 0.5, 1, 2, 4];

function makePlayer(episode, caption) {
  const last = episode.times.length - 1;
  const canvas = episode.reel && make("canvas", { class: "picture", role: "img", "aria-label": caption });
  const slider = make("input", {
    type: "range", min: 0, max: last, value: 0, step: 1, "aria-label": "Moment of the episode",
    oninput: () => { pause(); show(Number(slider.value)); },
  });
  const button = make("button", { class: "play", type: "button", onclick: toggle }, "Play");
  const time = make("output", { class: "time" });
  const speed = make("select", { "aria-label": "Speed" },
    SPEEDS.map((each) => make("option", { value: each, selected: each === 1 }, `${each} ×`)));
  const step = (by, text, name) => make("button",
    { type: "button", "aria-label": name, title: name, onclick: () => { pause(); show(place + by); } }, text);
  const enlarge = canvas && make("button", { type: "button", class: "enlarge", onclick: () => canvas.requestFullscreen?.() }, "Full screen");
  const tracks = makeTracks(episode, (wanted) => { pause(); show(wanted); });
  let [place, timer, begun, from] = [0, 0, 0, 0];

  function show(wanted) {
    place = clamp(wanted, 0, last);
    if (canvas) drawPicture(canvas, episode.reel, place);
    slider.value = place;
    time.value = `${clock(episode.times[place])} of ${clock(episode.times[last])}`;
    slider.setAttribute("aria-valuetext", time.value);
    tracks.show(place);
  }

  function advance(now) {
    const wanted = from + Math.floor(((now - begun) / 1000) * (last / SECONDS) * Number(speed.value));
    if (wanted !== place) show(wanted);
    if (place >= last) pause();
    else timer = requestAnimationFrame(advance);
  }

  function play() {
    if (place >= last) show(0);
    [begun, from] = [performance.now(), place];
    button.textContent = "Pause";
    timer = requestAnimationFrame(advance);
  }

  function pause() {
    cancelAnimationFrame(timer);
    timer = 0;
    button.textContent = "Play";
  }

  function toggle() {
    if (timer) pause();
    else play();
  }

  speed.addEventListener("change", () => { [begun, from] = [performance.now(), place]; });

  const keys = {
    " ": toggle,
    ArrowLeft: () => { pause(); show(place - 1); },
    ArrowRight: () => { pause(); show(place + 1); },
    Home: () => { pause(); show(0); },
    End: () => { pause(); show(last); },
  };

  function press(event) {
    const own = event.target.matches("input, select, summary, a") || (event.key === " " && event.target.matches("button"));
    if (own || event.ctrlKey || event.metaKey || event.altKey || !keys[event.key]) return;
    event.preventDefault();
    keys[event.key]();
  }

  const root = make("div", { class: "player", tabindex: 0, role: "group", "aria-label": `Player: ${caption}`, onkeydown: press },
    canvas || make("p", { class: "notice" }, "This problem's viewer draws pixels only, so there is no picture here."),
    make("div", { class: "controls" }, button, step(-1, "◂", "One picture back"), step(1, "▸", "One picture on"),
      slider, time, speed, enlarge),
    make("p", { class: "hint" }, "Space plays and pauses. The arrow keys step. Click a time line to go there."),
    tracks.root);
  const resized = new ResizeObserver(() => { tracks.draw(); show(place); });
  resized.observe(root);
  canvas?.addEventListener("fullscreenchange", () => show(place));
  return { root, stop: () => { pause(); resized.disconnect(); }, redraw: () => { tracks.draw(); show(place); } };
}

/** Seconds as text: 12.3 s below ten minutes, 6:40 h in hours and minutes above. */
function clock(seconds) {
  if (seconds < 600) return `${seconds.toFixed(seconds % 1 ? 1 : 0)} s`;
  const minutes = Math.round(seconds / 60);
  return `${Math.floor(minutes / 60)}:${String(minutes % 60).padStart(2, "0")} h`;
}
