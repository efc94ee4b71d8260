// Tables that a click on a heading sorts, and charts and tables as files.
(() => {
  const numberOf = text => {
    const number = parseFloat(text.replace(/,/g, ""));
    return Number.isNaN(number) ? undefined : number;
  };
  const sortBy = (table, at, isDescending) => {
    const isNumber = table.tHead.rows[0].cells[at].classList.contains("n");
    const rows = [...table.tBodies[0].rows].map(row => {
      const text = row.cells[at].textContent;
      return { row, value: isNumber ? numberOf(text) : text.toLowerCase() };
    });
    const known = rows.filter(({ value }) => value !== undefined);
    known.sort((one, other) => (one.value < other.value ? -1 : one.value > other.value ? 1 : 0) * (isDescending ? -1 : 1));
    const unknown = rows.filter(({ value }) => value === undefined); // these are last, whichever way
    table.tBodies[0].append(...[...known, ...unknown].map(({ row }) => row));
  };
  for (const table of document.querySelectorAll("table.sortable")) {
    [...table.tHead.rows[0].cells].forEach((heading, at) => {
      const button = document.createElement("button");
      button.type = "button";
      button.title = "Sort by it; again: the other way";
      button.append(...heading.childNodes);
      heading.append(button);
      button.addEventListener("click", () => {
        const first = heading.classList.contains("n") ? "descending" : "ascending"; // the highest numbers first
        const other = first === "ascending" ? "descending" : "ascending";
        const order = heading.getAttribute("aria-sort") === first ? other : first;
        for (const cell of table.tHead.rows[0].cells) cell.removeAttribute("aria-sort");
        heading.setAttribute("aria-sort", order);
        sortBy(table, at, order === "descending");
      });
    });
  }

  // Many rows are searched by their words.
  const MANY = 15;
  for (const table of document.querySelectorAll("table.sortable")) {
    const rows = [...table.tBodies[0].rows];
    if (rows.length <= MANY) continue;
    const search = document.createElement("input");
    search.type = "search";
    search.className = "rows";
    search.placeholder = "rows with these words";
    search.setAttribute("aria-label", "Only rows with these words");
    search.addEventListener("input", () => {
      const words = search.value.toLowerCase().split(/\s+/);
      for (const row of rows) row.hidden = !words.every(word => row.textContent.toLowerCase().includes(word));
    });
    table.before(search);
  }

  // A chart by itself has no page whose colours it could take.
  const COLOURS = { "currentColor": "#1c1f23", "var(--grid)": "#e4e4e4" };
  const svgOf = figure => {
    let text = new XMLSerializer().serializeToString(figure.querySelector("svg"));
    for (const [inPage, alone] of Object.entries(COLOURS)) text = text.replaceAll(inPage, alone);
    return text;
  };
  document.addEventListener("click", event => {
    const button = event.target.closest(".save");
    if (!button) return;
    const { kind, text } = button.dataset;
    const named = button.closest("[data-name]");
    const type = kind === "svg" ? "image/svg+xml" : "text/csv";
    const link = document.createElement("a");
    link.href = URL.createObjectURL(new Blob([kind === "svg" ? svgOf(named) : text], { type }));
    link.download = `${named.dataset.name.replace(/[^\p{L}\p{N}.-]+/gu, "-")}.${kind}`;
    link.click();
    setTimeout(() => URL.revokeObjectURL(link.href), 60_000);
  });
})();
