// The matrix: attackers in rows, defenders in columns; sorted by any row or column, moved through with the arrow keys.

function makeMatrix(board, open) {
  const names = metricsOf(board);
  const state = { metric: names.includes("return") ? "return" : names[0], rows: { by: "sum", up: false },
    columns: { by: "sum", up: true }, at: [0, 0], chosen: null };
  const table = make("table", { class: "matrix", role: "grid", onkeydown: move });
  const caption = make("p", { class: "hint" });
  const select = make("select", { "aria-label": "Metric", onchange: () => { state.metric = select.value; draw(); } },
    names.map((name) => make("option", { value: name, selected: name === state.metric },
      name === "return" ? "return of the attacker" : words(name))));

  const value = (i, j) => board.cells[i][j].metrics?.[state.metric]?.mean ?? null;
  const defined = (values) => values.filter((each) => each !== null);
  const end = (choose, values) => (values.length ? choose(...values) : null);
  const least = (i) => end(Math.min, defined(board.defenders.map((_, j) => value(i, j))));
  const most = (j) => end(Math.max, defined(board.attackers.map((_, i) => value(i, j))));

  function order(players, sorting, key) {
    const places = players.map((_, place) => place);
    if (sorting.by === "name") places.sort((a, b) => players[a].name.localeCompare(players[b].name));
    else places.sort((a, b) => (key(a) ?? -Infinity) - (key(b) ?? -Infinity));
    return sorting.up ? places : places.reverse();
  }

  function sort(axis, by) {
    const sorting = state[axis];
    state[axis] = { by, up: sorting.by === by ? !sorting.up : by === "name" || axis === "columns" };
    draw();
    table.querySelector(`[data-sort="${axis} ${by}"]`)?.focus();
  }

  function header(axis, by, player, extra = {}) {
    const sorting = state[axis];
    const mark = sorting.by === by ? (sorting.up ? (axis === "rows" ? " ▲" : " ◀") : axis === "rows" ? " ▼" : " ▶") : "";
    const sorted = sorting.by === by ? (sorting.up ? "ascending" : "descending") : null;
    const what = axis === "rows" ? "rows" : "columns";
    return make("th", { scope: extra.scope, class: extra.class, "aria-sort": sorted },
      make("button", { type: "button", "data-sort": `${axis} ${by}`, title: `${(player.about || `${player.name}.`).replaceAll("`", "")} Click: sort the ${what}.`,
        onclick: () => sort(axis, by) }, make("span", {}, player.name, mark), note(player)));
  }

  function note(player) {
    const parts = [player.trained ? "trained" : "", player.share ? `plays ${Math.round(100 * player.share)} %` : ""];
    const text = parts.filter(Boolean).join(", ");
    return text && make("small", {}, text);
  }

  function draw() {
    const rows = order(board.attackers, state.rows, (i) => (state.rows.by === "sum" ? least(i) : value(i, state.rows.by)));
    const columns = order(board.defenders, state.columns, (j) => (state.columns.by === "sum" ? most(j) : value(state.columns.by, j)));
    const all = defined(rows.flatMap((i) => columns.map((j) => value(i, j))));
    const [low, high] = [Math.min(...all), Math.max(...all)];
    const head = make("tr", {}, header("rows", "name", { name: "attacker", about: "Sort the attackers by name." }, { class: "corner" }),
      columns.map((j) => header("rows", j, board.defenders[j], { scope: "col" })),
      header("rows", "sum", { name: "least", about: "What the attacker is sure of: the least over all defenders." }, { scope: "col", class: "sum" }));
    const body = rows.map((i, r) => make("tr", {}, header("columns", i, board.attackers[i], { scope: "row" }),
      columns.map((j, c) => cell(i, j, r, c, low, high)), make("td", { class: "sum" }, number(least(i)))));
    const foot = make("tr", {}, header("columns", "sum", { name: "most", about: "What the defender concedes at most, over all attackers." }, { scope: "row", class: "sum" }),
      columns.map((j) => make("td", { class: "sum" }, number(most(j)))), make("td", { class: "sum" }));
    table.replaceChildren(make("thead", {}, head), make("tbody", {}, body, foot));
    caption.textContent = `Click a cell to watch its episodes. Mean of ${board.episodes} episodes and its 95 % interval${state.metric === "return" && board.unit ? `, in ${board.unit}` : ""}. ` +
      "▲ best attacker against this defender, ▼ best defender against this attacker. A fuller bar means more.";
  }

  function cell(i, j, r, c, low, high) {
    const here = board.cells[i][j];
    const found = here.metrics?.[state.metric];
    if (!found) {
      const reason = here.metrics ? "has no such number" : here;
      return make("td", { class: "absent", title: reason }, make("span", {}, reason === "not played" ? reason : "cannot play"));
    }
    const share = high > low ? (found.mean - low) / (high - low) : 0;
    const marks = (found.mean === most(j) ? "▲" : "") + (found.mean === least(i) ? "▼" : "");
    const chosen = state.chosen && state.chosen[0] === i && state.chosen[1] === j;
    return make("td", { role: "gridcell" }, make("button", {
      type: "button", class: "cell", "--share": share.toFixed(3), "aria-pressed": chosen ? "true" : "false",
      tabindex: state.at[0] === r && state.at[1] === c ? 0 : -1, "data-at": `${r} ${c}`,
      "aria-label": `${board.attackers[i].name} against ${board.defenders[j].name}: ${number(found.mean)}`,
      onclick: () => choose(i, j),
    }, make("b", {}, number(found.mean), make("i", {}, marks)), make("small", {}, interval(found))));
  }

  function choose(i, j, asked = true) {
    state.chosen = [i, j];
    draw();
    state.at = table.querySelector(".cell[aria-pressed=true]").dataset.at.split(" ").map(Number);
    draw();
    if (asked) focusCell();
    open(i, j, state.metric, asked);
  }

  /** Open the first pair that has played, as nobody has asked for one; whether there is such a pair. */
  function first() {
    const pairs = order(board.attackers, state.rows, least).flatMap((i) => order(board.defenders, state.columns, most).map((j) => [i, j]));
    const found = pairs.find(([i, j]) => board.cells[i][j].metrics);
    if (found) choose(...found, false);
    return Boolean(found);
  }

  function focusCell() {
    table.querySelector(`[data-at="${state.at[0]} ${state.at[1]}"]`)?.focus({ preventScroll: false });
  }

  function move(event) {
    const by = { ArrowUp: [-1, 0], ArrowDown: [1, 0], ArrowLeft: [0, -1], ArrowRight: [0, 1] }[event.key];
    if (!by || !event.target.matches(".cell")) return;
    event.preventDefault();
    const wanted = [clamp(state.at[0] + by[0], 0, board.attackers.length - 1), clamp(state.at[1] + by[1], 0, board.defenders.length - 1)];
    const next = table.querySelector(`[data-at="${wanted[0]} ${wanted[1]}"]`);
    if (!next) return;
    table.querySelectorAll(".cell[tabindex='0']").forEach((each) => each.setAttribute("tabindex", -1));
    next.setAttribute("tabindex", 0);
    next.focus();
    state.at = wanted;
  }

  draw();
  return {
    root: make("div", {}, make("div", { class: "bar" }, make("label", {}, "Show ", select)),
      make("div", { class: "scroll", tabindex: -1 }, table), caption),
    choose,
    first,
  };
}

/** The metrics that any pair has. */
function metricsOf(board) {
  const cells = board.cells.flat().filter((cell) => cell.metrics);
  return [...new Set(cells.flatMap((cell) => Object.keys(cell.metrics)))];
}
