// Filters and sorting. Without it all rows are shown, in the order of the report.
(() => {
  const form = document.getElementById("filter");
  form.hidden = false;
  const keys = ["case", "evidence", "verdict"];
  form.addEventListener("change", () => {
    const leftOut = one => keys.some(key => form[key].value && key in one.dataset && !one.dataset[key].split(" ").includes(form[key].value));
    for (const one of document.querySelectorAll("[data-case]")) one.hidden = leftOut(one);
    for (const table of document.querySelectorAll("table:has([data-case])")) table.hidden = !table.querySelector("[data-case]:not([hidden])");
  });
  form.reset();

  const value = (row, column) => {
    const cell = row.querySelector("tr")?.cells[column] ?? row.cells?.[column];
    return cell?.dataset.sort ?? cell?.textContent.trim() ?? "";
  };
  const compare = (one, other, sign) => {
    if (!one || !other) return !one - !other;  // What is empty comes last.
    const difference = Number(one) - Number(other);
    return sign * (Number.isNaN(difference) ? one.localeCompare(other) : difference);
  };
  for (const table of document.querySelectorAll("table.sortable")) {
    [...table.tHead.rows[0].cells].forEach((head, column) => head.addEventListener("click", () => {
      const upward = head.ariaSort !== "ascending";
      for (const each of table.tHead.rows[0].cells) each.ariaSort = null;
      head.ariaSort = upward ? "ascending" : "descending";
      const facts = table.classList.contains("facts");
      const parent = facts ? table : table.tBodies[0];
      const rows = [...(facts ? table.tBodies : parent.rows)];
      rows.sort((one, other) => compare(value(one, column), value(other, column), upward ? 1 : -1));
      parent.append(...rows);
    }));
  }
})();
