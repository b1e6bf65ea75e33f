// A pair: how its episodes came out, and the ones that can be watched.

const KINDS = ["median episode", "best for the attacker", "worst for the attacker"];

function makePair(board, i, j, metric) {
  const [attacker, defender, cell] = [board.attackers[i], board.defenders[j], board.cells[i][j]];
  const stage = make("div", { class: "stage", "aria-live": "polite" });
  const seeds = cell.takes.map((take) => take.seed);
  const found = cell.metrics[metric] ?? cell.metrics.return;
  let player = null;

  async function watch(seed) {
    const take = cell.takes.find((each) => each.seed === seed);
    chips.forEach((chip) => chip.setAttribute("aria-pressed", Number(chip.dataset.seed) === seed));
    player?.stop();
    stage.replaceChildren(make("p", { class: "hint" }, "Loading the episode …"));
    try {
      const episode = await loadEpisode(take.key);
      player = makePlayer(episode, `${attacker.name} against ${defender.name}, seed ${seed}`);
      stage.replaceChildren(player.root);
    } catch (error) {
      stage.replaceChildren(make("p", { class: "notice" }, `This episode cannot be shown. ${error.message}`));
    }
  }

  const chips = cell.takes.map((take, k) => make("button",
    { type: "button", class: "chip", "data-seed": take.seed, "aria-pressed": "false", onclick: () => watch(take.seed) },
    make("b", {}, `Seed ${take.seed}`), `${KINDS[k] ? `${KINDS[k]}, ` : ""}${number(cell.metrics.return.values[take.seed])}`));

  const root = make("section", { class: "pair card", "aria-label": "The chosen pair" },
    make("h3", {}, make("span", { class: "attacker" }, attacker.name), " against ", make("span", { class: "defender" }, defender.name)),
    [attacker, defender].map((player_) => player_.about && make("p", { class: "about" }, make("b", {}, player_.name), ": ", rich(player_.about))),
    make("h4", {}, `${words(metric)} over ${found.values.length} episodes`),
    makeDots(found, metric === "return" ? board.unit : "", seeds, watch),
    make("p", { class: "hint" }, "A dot is an episode. Rings can be watched. The diamond is the mean, the bar its 95 % interval."),
    make("details", {}, make("summary", {}, "All metrics of this pair"), makeMetrics(cell)),
    seeds.length ? make("div", { class: "chips", role: "group", "aria-label": "Episodes" }, chips) : make("p", { class: "notice" }, "No episode of this pair was recorded."),
    stage);
  if (seeds.length) watch(seeds[0]);
  return { root, stop: () => player?.stop(), redraw: () => player?.redraw() };
}

function makeMetrics(cell) {
  const rows = Object.entries(cell.metrics).map(([name, found]) => make("tr", {},
    make("th", { scope: "row" }, words(name)), make("td", {}, number(found.mean, 4)), make("td", {}, interval(found, 4))));
  return make("table", { class: "plain" },
    make("thead", {}, make("tr", {}, ["Metric", "Mean", "95 % interval"].map((text) => make("th", { scope: "col" }, text)))),
    make("tbody", {}, rows));
}
