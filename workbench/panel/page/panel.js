// The panel's page. It shows what the server sends and sends back STOP and answers; nothing here
// decides anything about a run. Everything is put into the page as text, never as HTML.
"use strict";

const SILENT_MS = 2000;          // without a word for so long the panel's own process is gone
const REPLY_MS = 3000;           // longest wait for the reply to STOP or an answer
const STALE_S = 2;               // what the server itself knows is so old: it looks no more
const TWICE_MS = 700;            // one press makes a pointer event and a click
const STATES = {
  idle: "No run", alive: "Running", silent: "Controller does not answer",
  gone: "Controller gone", ended: "Ended", lost: "Panel lost", replaced: "Not live",
};
const ALARMS = ["silent", "gone", "lost", "replaced"];
const LOST = {
  level: "alarm", title: "Panel lost",
  text: "The panel's own process does not answer, so this page shows the past and its STOP may reach " +
    "nobody. A run goes on without it: use Ctrl-C in its terminal, start the panel again, or use the switch on " +
    "the supply's front.",
};
const REPLACED = {
  level: "alarm", title: "Not live any more",
  text: "Too many pages are open, and newer ones took this one's place. STOP still works here. " +
    "Close some of them and load this page again.",
};

const at = (id) => document.getElementById(id);
const put = (id, text) => { const one = at(id); if (one.textContent !== text) one.textContent = text; };
const show = (id, shown) => { at(id).hidden = !shown; };

let state = { controller: "idle", run: null, question: null, banner: null };
let clocks = { elapsed_s: null, run_s: null, remaining_s: null, running: false, age_s: 0 };
let clocksCame = 0;
let heard = performance.now();
let replaced = false;
let dropped = false;              // the stream broke off; the browser tries again by itself
let readings = empty();
let runs = { rows: [], all: 0 };

function empty() { return { time_s: [], set_V: [], volts: [], amps: [] }; }
function isLost() {
  return !replaced && (dropped || clocks.age_s > STALE_S || performance.now() - heard > SILENT_MS);
}
// what the page shows is of now; otherwise it says of nothing that it is so
function isLive() { return !isLost() && !replaced; }
function digits(value, count) { return value === undefined || value === null ? "–" : value.toFixed(count); }

function duration(seconds) {
  if (seconds === null || seconds === undefined) return "–";
  const whole = Math.max(0, Math.round(seconds));
  const [hours, minutes, rest] = [Math.floor(whole / 3600), Math.floor(whole / 60) % 60, whole % 60];
  const two = (number) => String(number).padStart(2, "0");
  return hours ? `${hours}:${two(minutes)}:${two(rest)}` : `${minutes}:${two(rest)}`;
}

// ---- STOP ---------------------------------------------------------------------------------------

let pressed = -Infinity;

async function stop() {
  if (performance.now() - pressed < TWICE_MS) return;
  pressed = performance.now();
  at("stop").classList.add("pressed");
  put("stop-says", "STOP sent");
  try {
    const answer = await fetch("stop", { method: "POST", signal: AbortSignal.timeout(REPLY_MS) });
    put("stop-says", (await answer.json()).text);
  } catch {
    put("stop-says", "STOP was not received. Use the switch on the supply's front now.");
  }
  at("stop").classList.remove("pressed");
}

// it acts when it is pressed, as a real one does; the click is the keyboard's
at("stop").addEventListener("pointerdown", (event) => { if (event.button === 0) stop(); });
at("stop").addEventListener("click", stop);

// ---- prompts ------------------------------------------------------------------------------------

let asked = null;

function showPrompt() {
  const question = isLive() ? state.question : null;
  show("prompt", question !== null);
  if (question === null) { asked = null; return; }
  refuse(state.notice);
  if (asked === question.number) return;
  asked = question.number;
  put("prompt-text", question.text);
  show("prompt-picture", question.picture);
  if (question.picture) at("prompt-picture").src = `picture/${question.number}`;
  const input = at("prompt-input");
  const choices = question.choices || [];
  show("prompt-where", !state.started_here);
  show("prompt-choices", choices.length > 0);
  show("prompt-reply", choices.length === 0);
  at("prompt-choices").replaceChildren(...choices.map((choice) => {
    const button = document.createElement("button");
    button.type = "button";
    button.textContent = choice;
    button.addEventListener("click", () => answer(choice));
    return button;
  }));
  show("prompt-input", question.typed);
  input.value = "";
  input.placeholder = question.default;
  put("prompt-send", question.typed ? "Send" : "Confirm");
  allowAnswers(true);
  // no choice has the focus: a key that was meant for something else must not answer
  if (choices.length === 0 && document.activeElement === document.body) (question.typed ? input : at("prompt-send")).focus();
}

function refuse(text) {
  put("prompt-refused", text || "");
  show("prompt-refused", Boolean(text));
}

function allowAnswers(allowed) {
  for (const button of at("prompt").querySelectorAll("button")) button.disabled = !allowed;
}

at("prompt").addEventListener("submit", (event) => {
  event.preventDefault();
  if (!at("prompt-reply").hidden) answer(at("prompt-input").value);
});

async function answer(text) {
  const question = asked;
  allowAnswers(false);
  try {
    const answer = await fetch("answer", {
      method: "POST", headers: { "content-type": "application/json" },
      body: JSON.stringify({ question, text }), signal: AbortSignal.timeout(REPLY_MS),
    });
    const said = await answer.json();
    if (!said.taken) refuse(said.text || "The answer was not taken.");
  } catch {
    refuse("The answer was not received. Try again, or answer in the run's terminal.");
  }
  if (asked === question) allowAnswers(true);
}

at("pause").addEventListener("click", async () => {
  at("pause").disabled = true;
  try {
    const reply = await fetch("pause", {
      method: "POST", headers: { "content-type": "application/json" },
      body: JSON.stringify({ on: !state.pausing }), signal: AbortSignal.timeout(REPLY_MS),
    });
    put("pause-says", (await reply.json()).text);
  } catch {
    put("pause-says", "That was not received.");
  }
  at("pause").disabled = false;
});

// ---- calling somebody who looks elsewhere ---------------------------------------------------------

const CALLS = {                   // tones [Hz], one after the other
  asks: [660, 880], ended: [660, 660, 440], trouble: [980, 620, 980, 620, 980, 620],
};
let sound = true;
let touched = null;               // by what: a browser lets no page sound that nobody has touched
let speaker = null;
let called = { question: null, end: "", trouble: "" };
let first = true;                 // what stood there when the page was opened calls nobody

function beep(tones) {
  const Speaker = window.AudioContext || window.webkitAudioContext;
  if (!sound || !touched || !Speaker) return;
  try {
    speaker = speaker || new Speaker();
    tones.forEach((tone, place) => {
      const [from, to] = [speaker.currentTime + 0.2 * place, speaker.currentTime + 0.2 * place + 0.16];
      const [source, gain] = [speaker.createOscillator(), speaker.createGain()];
      source.frequency.value = tone;
      gain.gain.setValueAtTime(0.0001, from);
      gain.gain.exponentialRampToValueAtTime(0.25, from + 0.02);
      gain.gain.exponentialRampToValueAtTime(0.0001, to);
      source.connect(gain);
      gain.connect(speaker.destination);
      source.start(from);
      source.stop(to);
    });
  } catch { /* without sound the title and the page still tell */ }
}

function call(kind, text) {
  beep(CALLS[kind]);
  if (sound && document.hidden && window.Notification && Notification.permission === "granted") {
    try { new Notification("Workbench panel", { body: text, tag: kind }); } catch { /* not everywhere */ }
  }
}

// Calls once for each prompt, each end and each trouble that was not there before.
function callIfNew(named, banner) {
  const run = state.run;
  const now = {
    question: isLive() && state.question ? state.question.number : null,
    end: `${state.controller === "ended" ? state.pid : ""}/${run && run.ended ? run.name : ""}`,
    trouble: ALARMS.includes(named) ? named : banner && banner.level === "alarm" ? banner.title : "",
  };
  const before = called;
  called = now;
  if (first) return;
  if (now.trouble && now.trouble !== before.trouble) call("trouble", banner ? banner.title : STATES[named]);
  else if (now.question !== null && now.question !== before.question) call("asks", state.question.text);
  else if (now.end !== before.end && now.end !== "/") call("ended", banner ? banner.title : "A run has ended");
}

at("sound").addEventListener("click", () => {
  if (touched === at("sound")) touched = window;   // the first touch of the page allows it
  else sound = !sound;
  at("sound").setAttribute("aria-pressed", String(sound));
  put("sound", sound ? "Sound on" : "Sound off");
  if (sound) beep([880]);
  if (sound && window.Notification && Notification.permission === "default") Notification.requestPermission();
});

for (const touch of ["pointerdown", "keydown"]) {
  window.addEventListener(touch, (event) => {
    if (touched) return;
    touched = event.target;
    put("sound", "Sound on");
  });
}

// ---- what the server says -----------------------------------------------------------------------

function showState() {
  const lost = isLost();
  const named = lost ? "lost" : replaced ? "replaced" : state.controller;
  put("state", (!lost && !replaced && isStarting() ? "Starting" : STATES[named]) + (state.others ? `, and ${state.others} more; STOP stops them all` : ""));
  document.body.classList.toggle("past", named !== "alive");
  at("lamp").className = "lamp" + (ALARMS.includes(named) ? " alarm" : named === "alive" ? " alive" : "");
  put("title", state.title || "Workbench panel");
  put("place", state.title ? `${state.protocol} on bench ${state.bench}, ${state.operator ? `operator ${state.operator}, ` : ""}process ${state.pid}` :
    "Start a run below, or in a terminal: workbench run PROTOCOL --bench BENCH. It appears here.");
  const begun = !["alive", "silent"].includes(state.controller) && state.start;
  const banner = lost ? LOST : replaced ? REPLACED : begun || state.banner;
  const asks = isLive() && state.question;
  const head = asks ? "Answer needed" : banner && named !== "alive" ? banner.title : STATES[named];
  document.title = `${head}${state.title ? ` – ${state.title}` : ""}`;
  show("banner", Boolean(banner));
  if (banner) {
    at("banner").className = `banner ${banner.level}`;
    put("banner-title", banner.title);
    put("banner-text", banner.text);
  }
  const run = state.run;
  put("run-place", run ? `Run ${run.number} of ${run.of}` : "Run");
  put("run-name", run ? [run.mode, run.asked, run.name].filter(Boolean).join(", ") : "");
  put("phase", !isLive() ? "Not known" :
    state.question ? "Waiting for an answer" : (state.phase || STATES[state.controller]).replace(/^run \d+ of \d+: /, ""));
  const output = outputNow();
  put("output", output.text || "–");
  at("output").className = `value ${output.level}`;
  show("notice", isLive() && Boolean(state.notice) && !state.question);
  put("notice", state.notice || "");
  document.body.classList.toggle("no-run", isLive() && (!state.title || isStarting()));
  document.body.classList.toggle("idle", isLive() && !state.title && !isStarting());
  show("pause", isLive() && state.controller === "alive");
  put("pause", state.pausing ? "Pauses after this run; press to go on" : "Pause after this run");
  at("pause").setAttribute("aria-pressed", String(Boolean(state.pausing)));
  showReadouts();
  showTwin();
  showPrompt();
  showStart();
  showResult();
  callIfNew(named, banner);
}

// What is not heard of any more is not known, whatever was said last.
function outputNow() {
  if (isLive()) return state.output || { level: "", text: "" };
  return { level: state.run ? "alarm" : "", text: "Not known" };
}

function showLog() {
  const rows = (state.log || []).map(([time, text]) => row([[time === null ? "before" : `${digits(time, 2)} s`, "number"], [text]]));
  at("log").replaceChildren(...rows.reverse());
}

function row(cells) {
  const made = document.createElement("tr");
  for (const [content, kind] of cells) {
    const cell = made.insertCell();
    cell.append(content);
    if (kind) cell.className = kind;
  }
  return made;
}

function showRuns() {
  const going = ["alive", "silent"].includes(state.controller) && state.run && !state.run.ended;
  const current = going ? state.run.name : null;
  const status = isLive() && state.controller === "alive" ? ["running", "live"] : ["not known", "bad"];
  put("runs-count", !runs.all ? "none yet" : runs.all > runs.rows.length ? `newest ${runs.rows.length} of ${runs.all}` : "");
  at("runs").replaceChildren(...runs.rows.map((run) => {
    let report = "–";
    if (run.report) {
      report = document.createElement("a");
      report.href = `runs/${encodeURIComponent(run.name)}/report.html`;
      report.target = "_blank";
      report.rel = "noopener";
      report.textContent = "report";
      report.setAttribute("aria-label", `report of ${run.name}`);
    }
    return row([
      [run.name], [run.title], run.name === current ? status :
        [run.status, run.status === "complete" ? "" : "bad"],
      [digits(run.real_m, 3), "number"], [digits(run.twin_m, 3), "number"],
      [digits(run.error_mm, 1), "number"],
      run.passed === null ? ["–"] : run.passed ? ["pass", "pass"] : ["FAIL", "bad"], [report],
    ]);
  }));
}

function takeReadings(news) {
  if (news.first === 0) readings = empty();
  for (const name of Object.keys(readings)) if (news[name]) readings[name].push(...news[name]);
  showReadouts();
}

// A reading is of now only while the output is on and the run is heard of.
function showReadouts() {
  const now = isLive() && state.controller === "alive" && state.output && state.output.level === "live";
  const last = now ? readings.amps.length - 1 : -1;
  put("set", digits(readings.set_V[last], 2));
  put("volts", digits(readings.volts[last], 2));
  put("amps", digits(readings.amps[last], 3));
}

function showTwin() {
  const twin = isLive() ? state.live : null;
  show("twin", Boolean(twin));
  if (!twin) return;
  put("twin-error", digits(twin.error_mm, 1));
  put("twin-limit", twin.limit_mm ? `, limit ${twin.limit_mm} mm` : "");
  put("twin-latency", digits(twin.latency_ms, 0));
  put("twin-skipped", String(twin.skipped));
  put("twin-samples", String(twin.samples + twin.skipped));
  put("twin-lost", String(twin.lost));
  const meter = at("twin-meter");
  show("twin-meter", Boolean(twin.limit_mm));
  meter.max = 2 * (twin.limit_mm || 1);
  meter.high = twin.limit_mm || 1;
  meter.optimum = 0;
  meter.value = twin.error_mm || 0;
}

function listen() {
  const stream = new EventSource("events");
  const on = (name, take) => stream.addEventListener(name, (event) => {
    heard = performance.now();
    dropped = false;
    take(JSON.parse(event.data));
  });
  stream.addEventListener("error", () => { dropped = !replaced; tick(); });
  on("state", (news) => {
    // what was said of another run goes; what was said before the first state came is of this one
    const over = state.controller === "alive" && news.controller !== "alive";
    if (over || (state.pid !== undefined && news.pid !== state.pid)) put("stop-says", "");
    state = news;
    showState();
    first = false;
    showLog();
    showRuns();
  });
  on("clocks", (news) => { clocks = news; clocksCame = performance.now(); });
  on("runs", (news) => { runs = news; showRuns(); });
  on("readings", takeReadings);
  on("replaced", () => { replaced = true; stream.close(); showState(); showRuns(); });
}

// ---- times and plot -----------------------------------------------------------------------------

function now() {
  const since = clocks.running && !isLost() && !replaced ? (performance.now() - clocksCame) / 1000 : 0;
  const plus = (value, change) => (value === null || value === undefined ? null : value + change);
  const going = state.run && state.run.filming && !state.run.ended ? since : 0;
  if (!isLive()) return { elapsed: null, remaining: null, run: null };
  return {
    elapsed: plus(clocks.elapsed_s, since),
    remaining: plus(clocks.remaining_s, -going),
    run: plus(clocks.run_s, going),
  };
}

function niceStep(range, count) {
  const rough = range / count, power = 10 ** Math.floor(Math.log10(rough));
  return power * [1, 2, 5, 10].find((factor) => factor * power >= rough);
}

function niceTop(values, least) {
  const top = 1.08 * values.reduce((high, value) => Math.max(high, value), least);
  const step = niceStep(top, 4);
  return [Math.ceil(top / step) * step, step];
}

function drawPlot(runTime) {
  const canvas = at("plot"), scale = window.devicePixelRatio || 1;
  const [width, height] = [canvas.clientWidth, canvas.clientHeight];
  const [fullWidth, fullHeight] = [Math.round(width * scale), Math.round(height * scale)];
  if (canvas.width !== fullWidth || canvas.height !== fullHeight) {
    [canvas.width, canvas.height] = [fullWidth, fullHeight];
  }
  const pen = canvas.getContext("2d");
  pen.setTransform(scale, 0, 0, scale, 0, 0);
  pen.clearRect(0, 0, width, height);
  pen.font = '12px system-ui, "Segoe UI", Roboto, sans-serif';
  const style = getComputedStyle(document.documentElement);
  const colour = (name) => style.getPropertyValue(`--${name}`).trim();
  const last = readings.time_s.at(-1) || 0;
  const end = Math.max((state.run && state.run.seconds) || 10, last, runTime || 0);
  const box = { left: 56, right: width - 12, end, colour, pen };
  const split = Math.round(0.6 * (height - 34));
  const upper = { ...box, top: 14, bottom: split, unit: "V", lines: [
    [readings.set_V, "set", [5, 4], true], [readings.volts, "volts", [], false]] };
  const lower = { ...box, top: split + 22, bottom: height - 26, unit: "A", lines: [
    [readings.amps, "amps", [], false]] };
  drawAxes(upper, false, last ? 1 : 5);
  drawAxes(lower, true, last ? 0.1 : 0.5);
  if (runTime !== null && runTime > 0) {
    const x = box.left + ((box.right - box.left) * Math.min(runTime, end)) / end;
    pen.strokeStyle = colour("quiet");
    pen.lineWidth = 1;
    stroke(pen, [[x, upper.top], [x, lower.bottom]]);
  }
}

function drawAxes(box, named, least) {
  const { pen, left, right, top, bottom, end, colour } = box;
  const [high, step] = niceTop(box.lines.flatMap(([values]) => values.length ? [extreme(values)] : []), least);
  const x = (time) => left + ((right - left) * time) / end;
  const y = (value) => bottom - ((bottom - top) * value) / high;
  const across = niceStep(end, Math.max(2, (right - left) / 90));
  pen.lineWidth = 1;
  pen.strokeStyle = colour("grid");
  pen.fillStyle = colour("quiet");
  pen.textAlign = "right";
  pen.textBaseline = "middle";
  const decimals = Math.max(0, -Math.floor(Math.log10(step) + 1e-9));
  for (let value = 0; value < high + step / 2; value += step) {
    stroke(pen, [[left, y(value)], [right, y(value)]]);
    pen.fillText(value.toFixed(decimals), left - 8, y(value));
  }
  pen.textAlign = "center";
  pen.textBaseline = "top";
  for (let time = 0; time <= end + across / 1e6; time += across) {
    stroke(pen, [[x(time), top], [x(time), bottom]]);
    if (named && x(time) < right - 24) pen.fillText(String(Math.round(time * 100) / 100), x(time), bottom + 8);
  }
  pen.textAlign = "left";
  pen.fillText(box.unit, 4, top - 6);
  pen.textAlign = "right";
  if (named) pen.fillText("s", right, bottom + 8);
  for (const [values, name, dashes, stepped] of box.lines) {
    pen.strokeStyle = colour(name);
    pen.lineWidth = 2;
    pen.setLineDash(dashes);
    stroke(pen, path(values, x, y, stepped));
    pen.setLineDash([]);
  }
}

function extreme(values) { return values.reduce((high, value) => Math.max(high, value), 0); }

// One point a pixel is enough: of those that share one, the least and the greatest are kept.
function path(values, x, y, stepped) {
  const points = [];
  let column = null;
  const flush = () => {
    if (column === null) return;
    points.push([column.x, y(column.first)]);
    if (column.low < column.high) points.push([column.x, y(column.low)], [column.x, y(column.high)]);
    points.push([column.x, y(column.last)]);
  };
  values.forEach((value, place) => {
    const pixel = Math.round(2 * x(readings.time_s[place])) / 2;
    if (column !== null && column.x === pixel) {
      column.low = Math.min(column.low, value);
      column.high = Math.max(column.high, value);
      column.last = value;
      return;
    }
    const before = column;
    flush();
    if (stepped && before !== null) points.push([pixel, y(before.last)]);
    column = { x: pixel, first: value, last: value, low: value, high: value };
  });
  flush();
  return points;
}

function stroke(pen, points) {
  pen.beginPath();
  points.forEach(([x, y], place) => (place ? pen.lineTo(x, y) : pen.moveTo(x, y)));
  pen.stroke();
}

let wasLost = false;

function tick() {
  const { elapsed, remaining, run } = now();
  put("elapsed", duration(elapsed));
  put("remaining", duration(remaining));
  drawPlot(run);
  if (isLost() !== wasLost) { wasLost = isLost(); showState(); showRuns(); }
}

prepareStart();
listen();
showState();
tick();
setInterval(tick, 200);
window.addEventListener("resize", tick);
