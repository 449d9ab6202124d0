"use strict";
(() => {
  const words = new Intl.Collator("en", { numeric: true });
  const isMissing = (value) => value === "" || Number.isNaN(value);

  const valueOf = (row, column, numeric) => {
    const text = row.cells[column].textContent.trim();
    if (!numeric) return text === "—" ? "" : text;
    const plain = text.replace(/−/g, "-").replace(/(\d)[\s:](?=\d)/g, "$1");
    return parseFloat((plain.match(/-?\d*\.?\d+(e[-+]?\d+)?/i) || [""])[0]);
  };

  const makeSortable = (table) => {
    const body = table.tBodies[0];
    const rows = Array.from(body.rows);
    const heads = Array.from(table.tHead.rows[0].cells);

    const sort = (column) => {
      const head = heads[column];
      const numeric = head.classList.contains("n");
      const sign = head.getAttribute("aria-sort") === "ascending" ? -1 : 1;
      heads.forEach((other) => other.removeAttribute("aria-sort"));
      head.setAttribute("aria-sort", sign > 0 ? "ascending" : "descending");
      const keyed = rows.map((row, place) => ({ row, place, value: valueOf(row, column, numeric) }));
      keyed.sort((a, b) => {
        const missing = isMissing(a.value) - isMissing(b.value);
        if (missing || isMissing(a.value)) return missing || a.place - b.place;
        const order = numeric ? a.value - b.value : words.compare(a.value, b.value);
        return sign * order || a.place - b.place;
      });
      body.append(...keyed.map((item) => item.row));
    };

    heads.forEach((head, column) => {
      if (!head.textContent.trim()) return;
      const button = document.createElement("button");
      button.type = "button";
      button.append(...head.childNodes);
      button.addEventListener("click", () => sort(column));
      head.append(button);
    });
  };

  document.querySelectorAll("main table").forEach((table) => {
    const isWhole = table.tHead && Array.from(table.tBodies[0].rows).every((row) => row.cells.length === table.tHead.rows[0].cells.length);
    if (isWhole && table.tBodies[0].rows.length > 1) makeSortable(table);
  });

  const table = document.getElementById("flights-table");
  if (!table) return;
  const rows = Array.from(table.tBodies[0].rows);
  const label = document.createElement("label");
  const field = document.createElement("input");
  const count = document.createElement("span");
  field.type = "search";
  count.setAttribute("role", "status");
  label.append("Filter ", field);
  const tools = document.createElement("p");
  tools.className = "tools";
  tools.append(label, " ", count);
  table.parentNode.before(tools);
  field.addEventListener("input", () => {
    const wanted = field.value.toLowerCase();
    let shown = 0;
    rows.forEach((row) => {
      row.hidden = !row.textContent.toLowerCase().includes(wanted);
      if (!row.hidden) shown += 1;
    });
    count.textContent = wanted ? `${shown} of ${rows.length} flights` : "";
  });
})();
