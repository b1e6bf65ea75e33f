// Tables of the page of boards are sorted by a click on a heading, and the other way round by the next.
document.addEventListener("DOMContentLoaded", () => {
  if (!document.querySelector("#boards-of-challenge-v1")) return;
  for (const heading of document.querySelectorAll("table thead th")) {
    heading.style.cursor = "pointer";
    heading.addEventListener("click", () => {
      const body = heading.closest("table").tBodies[0];
      const column = heading.cellIndex;
      const down = (heading.dataset.down = heading.dataset.down === "1" ? "" : "1") === "1";
      const key = (row) => row.cells[column].textContent.trim();
      const order = (one, two) => {
        const [a, b] = [parseFloat(key(one)), parseFloat(key(two))];
        const found = Number.isNaN(a) || Number.isNaN(b) ? key(one).localeCompare(key(two)) : a - b;
        return down ? -found : found;
      };
      body.append(...[...body.rows].sort(order));
    });
  }
});
