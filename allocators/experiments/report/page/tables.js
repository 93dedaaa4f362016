"use strict";
// Tables that can be sorted, and filtered by each column; cells are inserted as text.

let DataTable;
const tables = new Map(); // by their elements

const text = (title, get) => ({ title, get, isText: true, show: (value) => value });
const number = (title, get, show = figure) => ({ title, get, show });

function dropTable(element) {
  tables.get(element)?.destroy();
  tables.delete(element);
}
// rows are arguments of the columns' `get`; missing values are last in either direction
function makeTable(element, columns, rows, { order = [], paging = false, filters = false, pick = null } = {}) {
  dropTable(element);
  element.replaceChildren();
  const head = add(element, "thead");
  const titles = add(head, "tr");
  columns.forEach((column) => add(titles, "th", column.title, { class: column.isText ? "text" : "" }));
  const fields = filters ? add(head, "tr") : null;
  if (fields) columns.forEach((column) => add(add(fields, "td"), "input", "", { type: "search", "aria-label": `filter ${column.title}` }));
  const table = new DataTable(element, {
    data: rows.map((row) => [row]), order, paging, pageLength: 25, deferRender: true, autoWidth: false, searching: true, info: paging, titleRow: 0,
    layout: { topStart: null, topEnd: null, bottomStart: paging ? ["info", "pageLength"] : null, bottomEnd: paging ? "paging" : null },
    columns: columns.map((column) => ({ className: column.isText ? "text" : "", type: column.isText ? "string" : "figure",
      data: ([row], kind) => {
        const value = column.get(row);
        return kind === "display" ? escaped(column.show(value)) : column.isText ? value : value ?? null;
      } })),
  });
  if (fields) [...fields.querySelectorAll("input")].forEach((input, i) => {
    let timer;
    input.onclick = (event) => event.stopPropagation();
    input.oninput = () => { clearTimeout(timer); timer = setTimeout(() => filter(table, i, columns[i], input.value.trim()), 150); };
  });
  if (pick) element.tBodies[0].onclick = (event) => {
    const data = table.row(event.target.closest("tr")).data();
    if (data) pick(data[0]);
  };
  element.classList.toggle("pickable", Boolean(pick));
  tables.set(element, table);
  return table;
}
const TESTS = { "<": (a, b) => a < b, "<=": (a, b) => a <= b, ">": (a, b) => a > b, ">=": (a, b) => a >= b, "=": (a, b) => a === b };
function filter(table, index, column, wanted) {
  const found = /^(<=|>=|<|>|=)\s*(-?[\d.]+(?:e-?\d+)?)\s*(%?)$/i.exec(wanted);
  const limit = found && Number(found[2]) / (found[3] ? 100 : 1);
  const passes = (value) => {
    if (found && !column.isText) return value !== null && value !== undefined && TESTS[found[1]](value, limit);
    if (wanted.toLowerCase() === "none" && !column.isText) return value === null || value === undefined;
    return String(column.show(value)).toLowerCase().includes(wanted.toLowerCase());
  };
  table.search.fixed(`column ${index}`, wanted ? (_, [row]) => passes(column.get(row)) : null).draw();
}
function orderFigures() {
  const missing = (value) => value === null || Number.isNaN(value);
  const order = (sign) => (a, b) => (missing(a) || missing(b) ? missing(a) - missing(b) : sign * (a - b));
  DataTable.ext.type.order["figure-asc"] = order(1);
  DataTable.ext.type.order["figure-desc"] = order(-1);
}
