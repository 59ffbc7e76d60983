// Start a run: pick a protocol, see its dry run, confirm. Only a click of a person confirms, and a
// confirmation holds once; what it starts is decided by the server. Loaded before panel.js.
"use strict";

const DRY_RUN_MS = 130000;       // somewhat longer than the server waits for it
const START_MS = 10000;
let where = "";                  // folder and bench
let confirmation = null;         // what confirms the dry run that is shown, once
let listedFor = null;            // the state in which the protocols were listed
let listed = "";                 // what was listed then
let picked = 0;                  // counts, so that a dry run that comes late is not shown
let wide = false;                // after a run the list is folded until somebody wants it

// Shown while no run is under way; after a run it begins with the list again.
function showStart() {
  const free = isLive() && !["alive", "silent"].includes(state.controller) && !isStarting();
  show("start", free);
  if (!isLive()) return;         // the link is lost for a moment: what was picked stays picked
  const key = free ? `${state.controller}/${state.pid}/${state.start ? state.start.title : ""}` : null;
  if (key === listedFor) return;
  if (listedFor === null || key === null) closePlan();
  listedFor = key;
  wide = false;
  if (free) listProtocols();
  fold();
}

function fold() {
  const folded = Boolean(state.title) && !wide;
  show("start-another", folded);
  show("protocols", !folded);
}

function isStarting() { return Boolean(state.start) && state.start.title === "Starting"; }

async function listProtocols() {
  let found;
  try {
    found = await (await fetch("protocols.json")).json();
  } catch { return; }            // the page says by itself that the panel is lost
  where = `${found.folder} on bench “${found.bench}”, ${found.supply}`;
  put("start-where", found.error ? "" : where);
  show("start-fault", Boolean(found.error));
  put("start-fault", found.error);
  const rows = JSON.stringify(found.rows);
  if (rows !== listed) at("protocols").replaceChildren(...found.rows.map(protocolItem));
  listed = rows;                 // a click that is under way stays on its button
  if (!found.error && !found.rows.length) put("start-where", `${found.folder} holds no protocol`);
}

function protocolItem(one) {
  const item = document.createElement("li");
  if (one.error) {
    item.append(made("b", one.title), made("span", "cannot be run", "tag bad"), ...faults(one.error));
    return item;
  }
  const button = made("button", "");
  button.type = "button";
  button.dataset.name = one.name;
  button.append(made("b", one.title), made("span", `${one.name}: ${one.modes.join(", ")}`, "quiet"),
    made("span", `${counted(one.runs, "run")}, ${about(one.seconds)}, ${counted(one.prompts, "prompt")}`, "number quiet"));
  button.addEventListener("click", () => pick(one));
  item.append(button);
  return item;
}

function made(kind, text, style) {
  const one = document.createElement(kind);
  one.textContent = text;
  if (style) one.className = style;
  return one;
}

// A fault as compilers show it: its words may be folded, the line of the file with its mark not.
function faults(text) {
  const parts = [];
  for (const line of text.split("\n")) {
    const kind = line.startsWith("    ") ? "PRE" : "P";
    const last = parts.at(-1);
    if (kind === "PRE" && last && last.tagName === kind) last.textContent += `\n${line.slice(4)}`;
    else parts.push(made(kind.toLowerCase(), kind === "PRE" ? line.slice(4) : line, "fault"));
  }
  return parts;
}

function about(seconds) {
  return seconds < 120 ? `${Math.round(seconds)} s` : seconds < 7200 ? `${Math.round(seconds / 60)} min` :
    `${(seconds / 3600).toFixed(1)} h`;
}

function counted(count, word) { return `${count} ${word}${count === 1 ? "" : "s"}`; }

function closePlan() {
  confirmation = null;
  picked += 1;
  show("plan", false);
  show("start-list", true);
}

async function pick(one) {
  closePlan();
  const mine = picked;
  show("start-list", false);
  show("plan", true);
  show("plan-shown", false);
  show("plan-says", false);
  put("plan-title", one.title);
  put("plan-place", `${one.name} from ${where}`);
  put("plan-waits", "Rehearsing on a simulated supply; nothing of the laboratory is touched …");
  at("plan-title").focus({ preventScroll: true });
  at("start").scrollIntoView({ block: "nearest" });
  const found = await post("dry-run", { name: one.name }, DRY_RUN_MS, { plan: null, text: "The dry run was not received." });
  if (mine !== picked) return;
  put("plan-waits", "");
  show("plan-says", Boolean(found.text));
  at("plan-says").replaceChildren(...faults(found.text || ""));
  if (found.plan) showPlan(found.plan, found.token);
}

function showPlan(plan, token) {
  confirmation = token;
  put("plan-facts", `${counted(plan.runs.length, "run")}, about ${about(plan.seconds)} on the bench; ` +
    (plan.prompts ? `${counted(plan.prompts, "prompt")}, not counted` : "no prompts"));
  const labels = ["run", null, null, "rest [s]", "ramp [s]", "duration [s]", null, "expected"];
  at("plan-runs").replaceChildren(...plan.runs.map((run) => {
    const made = row([
      [String(run.number), "number"], [run.mode], [run.asked], [String(run.rest_s), "number"],
      [run.ramp_s === null ? "–" : String(run.ramp_s), "number"], [String(run.duration_s), "number"],
      [run.role], [run.expected.join("; ") || "–"],
    ]);
    labels.forEach((label, place) => { if (label) made.cells[place].dataset.label = label; });
    return made;
  }));
  const does = plan.operator.length ? plan.operator : ["Nothing: the protocol has no prompts."];
  at("plan-operator").replaceChildren(...does.map((line) => made("li", line)));
  at("plan-limits").replaceChildren(...Object.entries(plan.limits).map(([name, value]) => row([[name, "quiet"], [value]])));
  put("confirm-start", `Start ${counted(plan.runs.length, "run")}`);
  refuseStart("");
  show("plan-shown", true);
}

function refuseStart(text) {
  put("start-refused", text);
  show("start-refused", Boolean(text));
}

async function confirmStart(event) {
  if (!event.isTrusted || confirmation === null) return;   // a person, not a script
  if (!at("operator").value.trim()) {
    refuseStart("Type the operator's name first.");
    at("operator").focus();
    return;
  }
  const token = confirmation;
  at("confirm-start").disabled = true;
  const said = await post("start", { token, operator: at("operator").value }, START_MS,
    { started: false, text: "It was not received whether it started. See whether a run appears before you try again." });
  at("confirm-start").disabled = false;
  if (!said.started) { refuseStart(said.text); return; }
  closePlan();
  scrollTo(0, 0);
}

async function post(path, what, longest, otherwise) {
  try {
    const reply = await fetch(path, {
      method: "POST", headers: { "content-type": "application/json" },
      body: JSON.stringify(what), signal: AbortSignal.timeout(longest),
    });
    return reply.ok ? await reply.json() : { ...otherwise, text: await reply.text() };
  } catch { return otherwise; }
}

// ---- what came of it ----------------------------------------------------------------------------

function showResult() {
  const found = isLive() && !isStarting() ? state.result : null;
  show("result", Boolean(found));
  if (!found) return;
  const run = state.run;
  put("result-title", run && run.of > 1 ? `Result of run ${run.number} of ${run.of}` : "Result");
  const [words, style] = found.passed === null ? ["the protocol expects nothing", "quiet"] :
    found.passed ? ["pass: as expected", "pass"] : ["FAIL: not as expected", "fail"];
  put("verdict", words);
  at("verdict").className = `verdict ${style}`;
  at("judged").replaceChildren(...found.judged.map(([mark, passed, name, came, expected]) => {
    const item = made("li", `${name} ${came}, expected ${expected}`);
    item.prepend(made("b", mark, passed ? "pass" : "fail"));
    return item;
  }));
  show("judged", found.judged.length > 0);
  at("result-rows").replaceChildren(...found.rows.map(([name, real, twin, apart]) => row([
    [name], [real, "number"], [twin, "number"], [apart, "number"]])));
  put("result-error", found.error);
  const name = run ? encodeURIComponent(run.name) : "";
  show("result-report", found.report);
  at("result-report").href = `runs/${name}/report.html`;
  show("result-recording", found.recording);
  at("result-recording").href = `runs/${name}/recording`;
}

function prepareStart() {
  at("plan-back").addEventListener("click", closePlan);
  at("start-another").addEventListener("click", () => { wide = true; fold(); });
  at("confirm").addEventListener("submit", (event) => event.preventDefault());  // Enter starts no motor
  at("confirm-start").addEventListener("click", confirmStart);
  document.addEventListener("visibilitychange", () => {
    if (!document.hidden && !at("start").hidden && at("plan").hidden) listProtocols();
  });
}
