// Sorting and filtering a real table: the rows are moved and hidden, nothing is drawn anew.

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

function filterRows(text) {
  const words = text.toLowerCase().split(/\s+/).filter(Boolean);
  let shown = 0;
  for (const row of rows) {
    const said = row.textContent.toLowerCase();
    row.hidden = !words.every((word) => said.includes(word));
    shown += !row.hidden;
  }
  byId("count").textContent = shown === rows.length ? `${shown} cases` : `${shown} of ${rows.length} cases`;
}

document.querySelectorAll("#cases thead th").forEach((head, column) => {
  head.querySelector("button").addEventListener("click", () => sortBy(head, column));
});
byId("filter").addEventListener("input", (event) => filterRows(event.target.value));
