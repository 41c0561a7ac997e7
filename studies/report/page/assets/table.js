// Sorting and filtering a real table: the rows are moved and hidden, nothing is drawn again.

const rows = [...document.querySelectorAll("#cases tbody tr")];

function sortBy(head, column) {
  const rising = head.getAttribute("aria-sort") !== "ascending";
  for (const other of head.parentNode.children) other.removeAttribute("aria-sort");
  head.setAttribute("aria-sort", rising ? "ascending" : "descending");
  const key = (row) => row.children[column].dataset.sort ?? row.children[column].textContent;
  const numbers = head.dataset.kind === "number";
  const order = (a, b) => {
    const [p, q] = [key(a), key(b)];
    if (numbers && (p === "" || q === "")) return (p === "") - (q === ""); // what is not known comes last
    return (rising ? 1 : -1) * (numbers ? p - q : p.localeCompare(q, "en", { numeric: true }));
  };
  byId("cases").tBodies[0].append(...rows.sort(order));
}

const plainly = (text) => text.toLowerCase().replaceAll("_", " ");
const said = new Map(rows.map((row) => [row, plainly([...row.children].map((cell) => cell.textContent).join(" "))]));

/** A word with underscores stands for the words between them, one behind the other: implicit_volume. */
function filterRows(text) {
  const words = text.split(/\s+/).filter(Boolean).map(plainly);
  let shown = 0;
  for (const row of rows) {
    row.hidden = !words.every((word) => said.get(row).includes(word));
    shown += !row.hidden;
  }
  const all = rows.length === 1 ? "1 case" : `${rows.length} cases`;
  byId("count").textContent = shown === rows.length ? all : `${shown} of ${all}`;
  byId("no-rows").hidden = shown > 0;
  byId("no-rows").textContent = shown ? "" : `No case holds all of these words: ${words.join(", ")}. Fewer or shorter words find more.`;
}

document.querySelectorAll("#cases thead th").forEach((head, column) => {
  head.querySelector("button").addEventListener("click", () => sortBy(head, column));
});
byId("filter").addEventListener("input", (event) => filterRows(event.target.value));
