"use strict";
// All rows are sent once. Sorting and filtering happen here; of the rows that are wanted only those
// that were scrolled to are drawn.

const STEP = 120;  // rows drawn at a time
const MOST = 6;  // runs compared at once, as the server allows
const COLUMNS = {  // field -> title, digits of a number, what a filter calls it
  name: ["Run"], created: ["Date"], title: ["Title"], protocol: ["Protocol"], mode: ["Mode"],
  fastest: ["Asked [rad/s]", 2, "speed"], rotor: ["Measured [rad/s]", 2, "measured"],
  distance: ["Distance [m]", 3], twin_distance: ["Twin [m]", 3, "twin"],
  error: ["Error [mm]", 1], noise: ["Noise [mm]", 3], status: ["Status"], passed: ["Expected", undefined, "expected"], verdict: ["Verdict"],
  tags: ["Tags"], operator: ["Operator"], model: ["Model"], shape: ["Shape"],
};
const SHOWN = ["name", "title", "mode", "fastest", "distance", "error", "status", "passed", "verdict"];
const at = (id) => document.getElementById(id);

let fields = [];
let rows = [];  // each an array in the order of `fields`
let texts = [];  // of each row, for words
let wanted = [];  // places of rows, in the order shown
let drawn = 0;
let sorted = { field: "name", down: true };  // a name begins with the date
let chosen = kept("columns", SHOWN);
const marked = new Set();

function kept(name, otherwise) {
  try { return JSON.parse(localStorage.getItem(`runs-${name}`)) || otherwise; }
  catch { return otherwise; }
}

function keep(name, value) {
  try { localStorage.setItem(`runs-${name}`, JSON.stringify(value)); } catch { /* not kept */ }
}

function place(field) { return fields.indexOf(field); }

function shown(row, field) {
  const value = row[place(field)];
  const digits = COLUMNS[field][1];
  if (value === null || value === "") return "–";
  if (digits !== undefined) return value.toFixed(digits);
  return field === "created" ? value.slice(0, 16).replace("T", " ") : String(value).trim();
}

// error>5 and the like; null for a word, a sentence for what cannot be meant
function condition(word) {
  const found = /^([a-z_]+)(<=|>=|<|>|=)(.*)$/i.exec(word);
  if (!found) return null;
  const [, name, sign, text] = found;
  const field = Object.keys(COLUMNS).find((one) => one === name || COLUMNS[one][2] === name);
  if (!field) {
    const names = Object.entries(COLUMNS).map(([one, column]) => column[2] || one);
    return `There is no column “${name}”; columns are ${names.join(", ")}.`;
  }
  const i = place(field);
  if (COLUMNS[field][1] === undefined) {
    if (sign !== "=") return (row) => sign.startsWith("<") ? row[i] < text : row[i] > text;
    return (row) => String(row[i]).toLowerCase().includes(text.toLowerCase());
  }
  if (text === "") return () => true;  // still being typed
  const number = Number(text);
  if (Number.isNaN(number)) return `“${text}” is no number: write ${name}${sign}17.`;
  const half = 0.5 * 10 ** -(text.split(".")[1] || "").length;  // 17 stands for what rounds to it
  return (row) => row[i] !== null && {
    "<": row[i] < number, ">": row[i] > number, "<=": row[i] <= number, ">=": row[i] >= number,
    "=": Math.abs(row[i] - number) <= half,
  }[sign];
}

function choose() {
  const words = at("filter").value.trim().split(/\s+/).filter(Boolean);
  const conditions = words.map(condition);
  const refused = conditions.find((one) => typeof one === "string");
  at("refused").hidden = !refused;
  at("refused").textContent = refused || "";
  const plain = words.filter((_, k) => conditions[k] === null).map((word) => word.toLowerCase());
  const tests = conditions.filter((one) => typeof one === "function");
  wanted = [];
  for (let k = 0; k < rows.length; k += 1) {
    if (plain.every((word) => texts[k].includes(word)) && tests.every((test) => test(rows[k]))) wanted.push(k);
  }
  order();
}

function order() {
  const i = place(sorted.field), sign = sorted.down ? -1 : 1;
  const compare = new Intl.Collator(undefined, { numeric: true }).compare;
  const byNumber = COLUMNS[sorted.field][1] !== undefined, byDate = ["created", "name"].includes(sorted.field);
  wanted.sort((a, b) => {
    const x = rows[a][i], y = rows[b][i];
    if (x === y) return a - b;
    if (x === null || x === "") return 1;  // what is not known comes last, either way
    if (y === null || y === "") return -1;
    if (byNumber || byDate) return (x < y ? -1 : 1) * sign;
    return compare(x, y) * sign || a - b;
  });
  draw();
}

function draw() {
  heads();
  at("rows").replaceChildren();
  drawn = 0;
  more();
  at("count").textContent = wanted.length === rows.length ? `${rows.length}` : `${wanted.length} of ${rows.length}`;
}

function heads() {
  at("heads").replaceChildren(document.createElement("th"), ...chosen.map((field) => {
    const head = document.createElement("th"), button = document.createElement("button");
    const mine = field === sorted.field;
    button.textContent = COLUMNS[field][0] + (mine ? (sorted.down ? " ▼" : " ▲") : "");
    button.className = "sort";
    button.dataset.field = field;
    button.onclick = () => {
      sorted = { field, down: mine ? !sorted.down : COLUMNS[field][1] !== undefined || ["created", "name"].includes(field) };
      order();
    };
    head.setAttribute("aria-sort", mine ? (sorted.down ? "descending" : "ascending") : "none");
    if (COLUMNS[field][1] !== undefined) head.className = "number";
    head.append(button);
    return head;
  }), document.createElement("th"));
}

function more() {
  const next = wanted.slice(drawn, drawn + STEP);
  at("rows").append(...next.map((k) => line(rows[k])));
  drawn += next.length;
  at("more").textContent = drawn < wanted.length ? `${wanted.length - drawn} more: scroll on` : "";
}

function line(row) {
  const name = row[place("name")], tr = document.createElement("tr");
  const box = document.createElement("input");
  box.type = "checkbox";
  box.checked = marked.has(name);
  box.setAttribute("aria-label", `compare ${name}`);
  box.onchange = () => { box.checked ? marked.add(name) : marked.delete(name); offer(); };
  tr.insertCell().append(box);
  for (const field of chosen) {
    const cell = tr.insertCell();
    if (COLUMNS[field][1] !== undefined) cell.className = "number";
    if (field === "status" && row[place(field)] !== "complete") cell.className = "bad";
    if (field === "passed") cell.className = { pass: "pass", FAIL: "bad" }[row[place(field)]] || "";
    cell.append(field === "name" ? link(`runs/${encodeURIComponent(name)}/report.html`, name) : shown(row, field));
  }
  tr.insertCell().append(link(`trend?like=${encodeURIComponent(name)}`, "trend"));
  return tr;
}

function link(address, text) {
  const a = document.createElement("a");
  a.href = address;
  a.textContent = text;
  return a;
}

function offer() {
  const names = [...marked], button = at("compare");
  button.hidden = names.length === 0;
  button.textContent = names.length > MOST ? `At most ${MOST} at once` : `Compare ${names.length}`;
  if (names.length > MOST) button.removeAttribute("href");
  else button.href = `compare?${names.map((name) => `run=${encodeURIComponent(name)}`).join("&")}`;
}

function offerColumns() {
  at("columns").replaceChildren(...Object.keys(COLUMNS).map((field) => {
    const label = document.createElement("label"), box = document.createElement("input");
    box.type = "checkbox";
    box.dataset.column = field;
    box.checked = chosen.includes(field);
    box.onchange = () => {
      chosen = Object.keys(COLUMNS).filter((one) => one === field ? box.checked : chosen.includes(one));
      keep("columns", chosen);
      draw();
    };
    label.append(box, ` ${COLUMNS[field][0]}`);
    return label;
  }));
}

async function load() {
  const found = await fetch("list.json");
  if (!found.ok) { at("count").textContent = `cannot be read: ${await found.text()}`; return; }
  ({ fields, rows } = await found.json());
  texts = rows.map((row) => row.join(" ").toLowerCase());
  offerColumns();
  choose();
}

at("filter").oninput = choose;
addEventListener("scroll", () => {
  if (drawn < wanted.length && innerHeight + scrollY > document.body.scrollHeight - 600) more();
}, { passive: true });
load();
