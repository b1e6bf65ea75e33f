// The page: a section for each problem, then learning curves and the paper beside ours.

const content = JSON.parse(document.getElementById("content").textContent);
const main = document.getElementById("main");
const open = { pair: null };

function makeBoard(board) {
  const place = make("div", { class: "place" });
  const matrix = makeMatrix(board, (i, j, metric, asked) => {
    open.pair?.stop();
    open.pair = makePair(board, i, j, metric);
    document.querySelectorAll(".place").forEach((each) => each.replaceChildren());
    place.replaceChildren(open.pair.root);
    if (!asked) return; // the page opens with a pair, and stays at its top
    history.replaceState(null, "", `#${address(board, i, j)}`);
    place.scrollIntoView({ behavior: matchMedia("(prefers-reduced-motion: reduce)").matches ? "auto" : "smooth", block: "nearest" });
  });
  const changed = Object.entries(board.overrides).map(([name, value]) => `${name} = ${value}`).join(", ");
  const section = make("section", { id: board.name, "aria-labelledby": `${board.name}-title` },
    make("h2", { id: `${board.name}-title` }, board.title),
    make("p", { class: "lead" }, rich(board.summary)),
    make("p", { class: "facts" }, [`Preset ${board.preset}`, changed, `${board.attackers.length} attackers`, `${board.defenders.length} defenders`,
      `${board.episodes} episodes each`].filter(Boolean).map((fact) => make("span", {}, fact))),
    makeRefused(board),
    board.missing ? make("p", { class: "notice" }, `${board.missing} of ${board.attackers.length * board.defenders.length} pairs have not been played. ` +
      "The others are shown. The same command without --kept plays the rest.") : null,
    board.few ? make("p", { class: "notice" }, board.few) : null,
    board.value ? make("p", { class: "value" }, "Value of the game: ", make("b", {}, number(board.value.mean, 4)),
      board.value.low === null ? "" : ` (${interval(board.value)})`, board.unit ? ` ${board.unit}` : "",
      ". It is the attacker's return when both sides draw from their best mixtures, shown as “plays” beside the names.") : null,
    make("div", { class: "card" }, matrix.root), place, makeLeftOut(board));
  return { section, matrix, board };
}

/** What stands behind # in a link to a pair. */
function address(board, i, j) {
  return [board.name, board.attackers[i].name, board.defenders[j].name].map(encodeURIComponent).join("/");
}

function makeRefused(board) {
  const refused = board.cells.flatMap((row, i) => row.map((cell, j) => [i, j, cell])).filter(([, , cell]) => !cell.metrics && cell !== "not played");
  if (!refused.length) return null;
  return make("details", { class: "left-out" },
    make("summary", {}, `${refused.length} pairs cannot play each other, so the game has no value here`),
    make("ul", {}, refused.map(([i, j, reason]) => make("li", {}, make("b", {}, `${board.attackers[i].name} against ${board.defenders[j].name}`), ": ", rich(reason)))));
}

function makeLeftOut(board) {
  if (!board.left_out.length) return null;
  return make("details", { class: "left-out" }, make("summary", {}, `${board.left_out.length} policies did not take part`),
    make("ul", {}, board.left_out.map((each) => make("li", {}, make("b", {}, `${each.role} ${each.name}`), ": ", rich(each.reason)))));
}

function makeLearning(curves) {
  const groups = Map.groupBy ? Map.groupBy(curves, (curve) => `${curve.problem} ${curve.role}`) : new Map([["", curves]]);
  return make("section", { id: "learning" }, make("h2", {}, "Learning curves"),
    make("p", { class: "lead" }, "The score on validation seeds, which neither training nor the tables above use. Lines of one kind are training seeds of one run."),
    [...groups].map(([name, members]) => make("div", { class: "card" }, make("h3", {}, name), makeCurves(members))));
}

function makePaper(sheets, [heading, lead]) {
  return make("section", { id: "paper" }, make("h2", {}, heading), make("p", { class: "lead" }, lead),
    sheets.map((sheet, k) => make("details", { class: "card sheet", open: k === 0 }, make("summary", {}, sheet.title),
      make("div", { class: "scroll", tabindex: 0 }, make("table", { class: "plain" },
        make("thead", {}, make("tr", {}, sheet.headings.map((text) => make("th", { scope: "col" }, text)))),
        make("tbody", {}, sheet.rows.map((row) => make("tr", {}, row.map((text, place) =>
          make(place < sheet.left ? "th" : "td", { scope: place < sheet.left ? "row" : null, class: verdict(text) }, text))))))),
      sheet.notes.map((text) => make("p", { class: "hint" }, rich(text))))));
}

/** How a cell agrees with the paper: it says nothing else, or says so at the end of its last line. */
function verdict(text) {
  const said = text.includes("\n") ? text.split(" ").at(-1) : text;
  return { reproduced: "good", match: "good", near: "fair", partly: "fair", "not reproduced": "poor", miss: "poor" }[said] ?? null;
}

const boards = content.boards.map(makeBoard);
const parts = [...boards.map(({ board }) => [board.name, board.title]),
  ...(content.curves.length ? [["learning", "Learning"]] : []), ...(content.sheets.length ? [["paper", "Tables"]] : [])];
document.getElementById("top").append(make("h1", {}, content.title), make("p", { class: "facts" }, content.facts.map((fact) => make("span", {}, fact))),
  parts.length > 1 ? make("nav", { "aria-label": "Parts" }, parts.map(([id, title]) => make("a", { href: `#${id}` }, title))) : "");
main.append(...boards.map(({ section }) => section));
if (content.curves.length) main.append(makeLearning(content.curves));
if (content.sheets.length) main.append(makePaper(content.sheets, content.about_sheets));
document.getElementById("foot").append(make("p", {}, content.foot));
const asked = decodeURIComponent(location.hash.slice(1));
if (!asked.includes("/")) boards.find(({ matrix }) => matrix.first());
for (const { matrix, board } of boards) {
  const pairs = board.cells.flatMap((row, i) => row.map((cell, j) => [i, j, cell]));
  const wanted = asked.includes("/") && pairs.find(([i, j, cell]) => cell.metrics && decodeURIComponent(address(board, i, j)) === asked);
  if (wanted) matrix.choose(wanted[0], wanted[1]);
}
matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => open.pair?.redraw());
