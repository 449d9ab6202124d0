"use strict";
(() => {
  const table = document.getElementById("flights-table");
  if (!table) return;
  const body = table.tBodies[0];
  const rows = Array.from(body.rows);
  const heads = Array.from(table.tHead.rows[0].cells);
  const words = new Intl.Collator("en", { numeric: true });

  const valueOf = (row, column, numeric) => {
    const text = row.cells[column].textContent.trim();
    if (!numeric) return text === "—" ? "" : text;
    return parseFloat(text.replace("−", "-").replace(/[^-.\d]/g, ""));
  };
  const isMissing = (value) => value === "" || Number.isNaN(value);

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
    const button = document.createElement("button");
    button.type = "button";
    button.append(...head.childNodes);
    button.addEventListener("click", () => sort(column));
    head.append(button);
  });

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
