"use strict";
(() => {
  const byId = id => document.getElementById(id);
  const body = byId("rows").tBodies[0];
  const heads = [...byId("rows").tHead.rows[0].cells];
  const rows = [...body.rows];
  // Columns whose best is the smallest or the first; of all others it is the largest.
  const RISING = new Set(["model", "task", "shown", "engine", "by", "cost", "read", "written", "seconds"]);
  let order = { key: "pairs", falling: true };

  const valueOf = (row, key) => row.querySelector(`[data-key="${key}"]`).dataset.value;
  const isText = key => !heads.find(head => head.dataset.key === key).classList.contains("n");
  const compare = (one, other, { key, falling }) => {
    const [first, second] = [valueOf(one, key), valueOf(other, key)];
    if (first === "" || second === "") return (first === "") - (second === ""); // what is not known comes last
    const difference = isText(key) ? first.localeCompare(second) : Number(first) - Number(second);
    return falling ? -difference : difference;
  };

  const sort = () => {
    // Rows are in the page's own order, which decides between equal ones.
    body.append(...[...rows].sort((one, other) => compare(one, other, order)));
    for (const head of heads) {
      if (head.dataset.key === order.key) head.setAttribute("aria-sort", order.falling ? "descending" : "ascending");
      else head.removeAttribute("aria-sort");
    }
    const choice = byId("order");
    choice.value = [...choice.options].some(option => option.value === order.key) ? order.key : "";
  };

  const filter = () => {
    const words = byId("search").value.toLowerCase().split(/\s+/).filter(Boolean);
    const task = byId("task").value;
    let shown = 0;
    for (const row of rows) {
      const text = row.textContent.toLowerCase();
      row.hidden = (task && row.dataset.task !== task) || (row.classList.contains("published") && !byId("published").checked)
        || !words.every(word => text.includes(word));
      shown += !row.hidden;
    }
    byId("count").textContent = `${shown} of ${rows.length} rows`;
    byId("none").hidden = shown > 0;
  };

  const sortBy = (key, falling) => { order = { key, falling }; sort(); };
  for (const head of heads) {
    const { key } = head.dataset;
    head.firstElementChild.addEventListener("click", () => sortBy(key, order.key === key ? !order.falling : !RISING.has(key)));
  }
  byId("order").addEventListener("change", event => sortBy(event.target.value, !RISING.has(event.target.value)));
  for (const id of ["search", "task", "published"]) byId(id).addEventListener("input", filter);
  byId("filters").addEventListener("submit", event => event.preventDefault());

  sort();
  filter();
})();
