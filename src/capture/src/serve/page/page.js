// The page beside the rig: shows the state as it comes and gives the rig its commands. All text from the
// rig goes in as text, never as markup.
import { follow, give } from "./link.js";
import { startPreview } from "./preview.js";
import { make } from "./elements.js";
import { showProcessing, startProcessing } from "./process.js";
import { listSessions, openSession, refreshStages, sessionChanged } from "./sessions.js";

const $ = (id) => document.getElementById(id);

/** Longest name of an object, bytes. */
const LONGEST_NAME = 80;
const VERDICTS = { clean: "clean", tolerated: "kept, with dropped frames", aborted: "aborted" };
/** Controls that can be set here, and by how much a step moves them. */
const STEPS = [
  [/auto|dynamic|priority/, null],
  [/exposure/, (value) => Math.max(1, Math.round(Math.abs(value) * 0.1))],
  [/focus/, () => 5],
  [/gain/, () => 1],
  [/white_balance_temperature/, () => 100],
];
let state = null;
let seenFault = -Infinity;

/** Gives a command; what the rig has against it is shown. */
async function order(command) {
  try {
    show(await give(command));
    say("");
    return true;
  } catch (problem) {
    say(problem.message);
    return false;
  }
}

function say(sentence) {
  $("message").textContent = sentence;
  $("message").hidden = !sentence;
}

const resting = () => state.phase === "idle";

function show(next) {
  // Events and answers to commands come by two ways: an old state must not replace a newer one.
  if (state && next.version < state.version && state.version - next.version < 1e6) return;
  const before = state;
  state = next;
  showAlarm();
  showTake();
  showGo();
  showFaults();
  showTable();
  showCamera();
  showDisk();
  const finished = before && JSON.stringify(before.last_take) !== JSON.stringify(state.last_take);
  const folder = Boolean(before?.disk_fault) !== Boolean(state.disk_fault);
  if (!before || finished || folder || before.session !== state.session) refresh();
  if (before && finished) signal(state.last_take.verdict === "clean");
  showSettings();
  showLog();
  const jobs = JSON.stringify(before?.processing.jobs.map(({ number, step, status }) => [number, step, status]));
  showProcessing(state.processing, (ended) => {
    refresh();
    sessionChanged(ended.map(({ session }) => session));
  });
  if (before && jobs !== JSON.stringify(state.processing.jobs.map(({ number, step, status }) => [number, step, status]))) refreshStages();
}

/** The table is locked: this is said in one sentence, and there is one button. */
const alarmed = () => state.table.emergency_stop || state.table.locked;

function showAlarm() {
  $("alarm").textContent = alarmed() ? state.advice.explanation : "";
  $("alarm").hidden = !alarmed();
  if (alarmed()) {
    say("");
    // What led to it is in the log.
    seenFault = Math.max(seenFault, ...state.faults.map(({ t_us }) => t_us));
  }
}

let sound = null;

/** A browser lets a page make sounds only after somebody has touched it. */
function unmute() {
  sound ??= new AudioContext();
  if (sound.state === "suspended") sound.resume();
}

/** Says by sound and vibration that a take has ended: two rising tones for a clean one. */
function signal(clean) {
  navigator.vibrate?.(clean ? [150, 80, 150] : [600]);
  if (!sound) return;
  for (const [at, pitch] of clean ? [[0, 660], [0.18, 990]] : [[0, 330], [0.3, 220]]) {
    const [tone, volume] = [sound.createOscillator(), sound.createGain()];
    tone.frequency.value = pitch;
    volume.gain.value = 0.2;
    tone.connect(volume).connect(sound.destination);
    tone.start(sound.currentTime + at);
    tone.stop(sound.currentTime + at + 0.16);
  }
}

function showTake() {
  const { phase, object, frames, frames_wanted: wanted, dropped, table } = state;
  const part = wanted > 0 ? Math.min(frames / wanted, 1) : 0;
  const busy = !resting();
  $("phase").textContent = state.advice.headline;
  const left = phase === "recording" && state.settings.degrees_per_second > 0 ? ` · ${Math.ceil(((1 - part) * 360) / state.settings.degrees_per_second)} s left` : "";
  $("what").textContent = object && busy ? `${object}${left}` : "";
  $("progress").hidden = !busy;
  $("progress").value = part;
  $("arc").setAttribute("stroke-dasharray", `${busy ? part * 100 : 0} 100`);
  const angle = table.angle_deg;
  $("hand").setAttribute("transform", `rotate(${angle ?? 0} 50 50)`);
  $("ring-text").textContent = phase === "recording" ? `${Math.floor(part * 100)} %` : angle === null ? "" : `${angle.toFixed(0)}°`;
  const counts = busy ? [make("span", { text: `${frames} / ${wanted} · ` }), make("span", { text: `${dropped} dropped`, className: dropped > 0 ? "bad" : "" })] : [];
  $("counts").replaceChildren(...counts);
  const take = state.last_take;
  $("last").hidden = !take || alarmed();
  // Where the big button captures it again, there is no second one.
  $("again").hidden = take?.verdict !== "tolerated" || state.advice.button.action !== "start";
  if (!take) return;
  const words = make("b", { text: VERDICTS[take.verdict] ?? take.verdict, className: take.verdict === "clean" ? "good" : "bad" });
  const rest = `: ${take.frames} frames, ${take.dropped} dropped, ${take.session}.${take.reason ? ` ${take.reason}` : ""}`;
  $("last-text").replaceChildren(words, rest);
}

/** Why an object cannot have this name, by the rule of the server; "" where it can. */
function wrongName(object) {
  if (object.startsWith(".")) return "A name does not begin with a dot.";
  if (!/^[\p{Alphabetic}\p{N}\-_.]*$/u.test(object)) return "A name has letters, digits, “-”, “_” and “.”, and no spaces.";
  if (new TextEncoder().encode(object).length > LONGEST_NAME) return "This name is too long.";
  return "";
}

/** The commands behind the advised actions; `start` needs a name. */
const ACTIONS = {
  stop: () => ({ command: "stop" }),
  reset: () => ({ command: "reset" }),
  again: (object) => ({ command: "start", object }),
};

/** What the big button does now: as the rig advises, with the name that stands in the field. */
function action() {
  if (!state) return { text: "Start" };
  const { text, action, object } = state.advice.button;
  const typed = $("object").value.trim();
  const names = action === "start" || (action === "again" && typed && typed !== object);
  if (names) {
    if (!typed) return { text: "Name the object" };
    if (wrongName(typed)) return { text: "Another name, please" };
    return { text: `Start ${typed}`, command: { command: "start", object: typed } };
  }
  return { text, stop: action === "stop", command: ACTIONS[action]?.(object) };
}

function showName() {
  const why = wrongName($("object").value.trim());
  $("wrong-name").textContent = why;
  $("wrong-name").hidden = !why;
  $("object").setAttribute("aria-invalid", Boolean(why));
}

function showGo() {
  showName();
  const { text, stop, command } = action();
  $("go").textContent = text;
  $("go").disabled = !command || document.body.className !== "";
  $("go").classList.toggle("stop", Boolean(stop));
}

function showFaults() {
  // What is wrong now is said above.
  const now = [state.camera.fault, state.table.fault, state.disk_fault];
  const faults = state.faults.filter(({ t_us, what }) => t_us > seenFault && !now.includes(what)).reverse();
  $("faults").hidden = faults.length === 0;
  const lines = faults.slice(0, 10).map(({ what }) => what);
  const same = [...$("fault-list").children].map((line) => line.textContent);
  if (lines.join("\n") !== same.join("\n")) $("fault-list").replaceChildren(...lines.map((text) => make("li", { text })));
}

function showTable() {
  const { present, state: word, angle_deg: angle, degrees_per_second: speed, homed, battery_v: battery, fault } = state.table;
  const facts = [["State", present ? word || "unknown" : "none"]];
  if (present) {
    facts.push(["Angle", angle === null ? "unknown" : `${angle.toFixed(1)}°`], ["Zero", homed ? "known" : "unknown"]);
    if (speed) facts.push(["Speed", `${speed.toFixed(1)}°/s`]);
    if (battery !== null) facts.push(["Battery", `${battery.toFixed(1)} V`]);
    const { low_deg: low, high_deg: high } = state.table;
    if (homed && angle !== null && high !== null) facts.push(["Cable wound", `${Math.abs(angle).toFixed(0)}° of ${(angle < 0 ? -low : high).toFixed(0)}°`]);
  }
  $("table").replaceChildren(...facts.map(([name, value]) => make("div", {}, make("dd", { text: value }), make("dt", { text: name }))));
  warn("table-fault", alarmed() ? null : fault);
  for (const button of document.querySelectorAll("[data-jog], #home")) button.disabled = !present || !resting() || alarmed();
}

function showCamera() {
  const { present, name, mode, fps, controls, clipped, focus, fault } = state.camera;
  $("camera").textContent = present ? [name, mode].filter(Boolean).join(" · ") : "No camera";
  $("focus").textContent = focus === null ? "" : `focus ${focus.toFixed(0)}`;
  $("clipped").textContent = clipped === null ? "" : `clipped ${(clipped * 100).toFixed(clipped < 0.1 ? 2 : 0)} %`;
  $("clipped").className = clipped > 0.005 ? "bad" : "";
  $("fps").textContent = fps === null ? "" : `${fps.toFixed(1)} frames/s`;
  warn("camera-fault", fault);
  $("preview").classList.toggle("stale", !present);
  const key = JSON.stringify([controls, resting()]);
  if ($("controls").dataset.key === key || $("controls").contains(document.activeElement) && document.activeElement.tagName === "INPUT") return;
  $("controls").dataset.key = key;
  const focused = document.activeElement?.dataset?.control;
  $("controls").replaceChildren(...controls.map(([control, value]) => line(control, value)));
  if (focused) document.querySelector(`[data-control="${CSS.escape(focused)}"]`)?.focus();
}

/** A control's line: with buttons where a step is known. */
function line(control, value) {
  const name = control.replace(/_(absolute|automatic)$/, "").replaceAll("_", " ");
  const step = STEPS.find(([pattern]) => pattern.test(control))?.[1]?.(value);
  if (!step) return make("p", { className: "fixed" }, make("span", { text: name }), make("span", { text: value }));
  const set = (to) => order({ command: "set-control", name: control, value: to });
  const disabled = !resting();
  const less = make("button", { type: "button", text: "−", ariaLabel: `Less ${name}`, disabled });
  const more = make("button", { type: "button", text: "+", ariaLabel: `More ${name}`, disabled });
  less.dataset.control = `${control} less`;
  more.dataset.control = `${control} more`;
  const input = make("input", { type: "number", step: 1, value, ariaLabel: name, inputMode: "numeric", disabled });
  less.addEventListener("click", () => set(value - step));
  more.addEventListener("click", () => set(value + step));
  input.addEventListener("change", () => {
    const to = input.valueAsNumber;
    input.blur();
    if (Number.isSafeInteger(to)) set(to);
  });
  return make("div", { className: "stepper" }, make("span", { text: name }), less, input, more);
}

function showDisk() {
  const { free_bytes: free, needed_bytes: needed } = state;
  const size = (bytes) => (bytes < 1e9 ? `${(bytes / 1e6).toFixed(0)} MB` : `${(bytes / 1e9).toFixed(1)} GB`);
  const takes = needed > 0 ? `, a take needs ${size(needed)}` : "";
  const wrong = state.disk_fault ?? (state.advice.headline === "Too little space" ? state.advice.explanation : null);
  $("disk").textContent = wrong ?? `${size(free)} free${takes}`;
  $("disk").className = wrong ? "bad" : "quiet";
  $("disk").hidden = !resting() && !wrong;
}

function showSettings() {
  const { settings } = state;
  $("devices").textContent = [settings.camera, settings.turntable, settings.root].filter(Boolean).join(" · ");
  const { size, fps, degrees_per_second: speed, max_dropped: dropped, retries } = settings;
  $("settings").textContent = `${size?.join(" × ") ?? "largest frames"} · ${fps} frames/s · ${speed}°/s · ${dropped} frames may be missing · a bad take is repeated ${retries} times`;
}

function showLog() {
  const lines = state.log.slice(-15).reverse();
  const key = JSON.stringify(lines);
  if ($("log").dataset.key === key) return;
  $("log").dataset.key = key;
  const time = (at) => new Date(at).toLocaleTimeString([], { timeStyle: "medium", hour12: false });
  $("log").replaceChildren(...lines.map(({ at, what }) => make("li", {}, make("span", { text: time(at) }), make("span", { text: what }))));
}

function warn(id, fault) {
  $(id).textContent = fault ?? "";
  $(id).hidden = !fault;
}

let listFault = "";

/** Says why there is no list, until there is one. */
function sayOfList(sentence) {
  const isShown = listFault && $("message").textContent === listFault;
  listFault = sentence;
  if (sentence || isShown) say(sentence);
}

/** Fetches what is on the disk: the list, and the names to suggest. */
async function refresh() {
  // Without a folder there is no list, and that is said already.
  if (state?.disk_fault) return sayOfList("");
  try {
    const names = await listSessions();
    $("objects").replaceChildren(...names.map((value) => make("option", { value })));
    sayOfList("");
  } catch (problem) {
    // The folder may have gone while the list was on its way.
    if (problem.status !== 0) sayOfList(state?.disk_fault ? "" : problem.message);
  }
}

function link(word, className) {
  if ($("link").textContent !== word) $("link").textContent = word;
  document.body.className = className;
}

$("object").addEventListener("input", showGo);
$("object-form").addEventListener("submit", (event) => {
  event.preventDefault();
  $("object").blur();
});
$("go").addEventListener("click", () => {
  const { command } = action();
  if (command) order(command);
});
$("home").addEventListener("click", () => order({ command: "home" }));
$("again").addEventListener("click", () => {
  // The object is what follows the time in a session's name.
  const object = state.last_take.session.replace(/^\d{8}T\d{6}Z-/, "");
  order({ command: "start", object });
});
document.addEventListener("pointerdown", unmute);
document.addEventListener("sessions-changed", refresh);
for (const button of document.querySelectorAll("[data-jog]")) {
  button.addEventListener("click", () => order({ command: "jog", degrees: Number(button.dataset.jog) }));
}
$("faults-seen").addEventListener("click", () => {
  seenFault = Math.max(...state.faults.map(({ t_us }) => t_us));
  showFaults();
});
$("unlock-page").addEventListener("submit", (event) => {
  event.preventDefault();
  location.assign(`/?token=${encodeURIComponent($("token").value.trim())}`);
});

startPreview();
startProcessing(say);
// The editor of masks comes back with the session's name.
if (location.hash) {
  const id = decodeURIComponent(location.hash.slice(1));
  history.replaceState(null, "", "/");
  openSession(id).catch((problem) => say(problem.message));
}
follow({
  state: (next) => {
    if (document.body.className === "lost") say("");
    link("connected", "");
    show(next);
  },
  lost: () => {
    // A rig that was started anew counts its states from the beginning.
    if (state) state.version = -1;
    link("connection lost", "lost");
    if (state) showGo();
  },
  locked: () => {
    link("locked", "locked");
    $("locked").hidden = false;
    // The address still has the token that was refused.
    $("wrong-token").hidden = !new URLSearchParams(location.search).has("token");
    history.replaceState(null, "", "/");
    $("rig").hidden = true;
    $("bar").hidden = true;
  },
});
