// The page beside the rig: shows the state as it comes and gives the rig its commands. All text from the
// rig goes in as text, never as markup.
import { follow, give } from "./link.js";
import { startPreview } from "./preview.js";
import { make } from "./elements.js";
import { shardOf, showProcessing, standing, startProcessing } from "./process.js";
import { listedSession, listSessions, openSession, refreshStages, sessionChanged } from "./sessions.js";

const $ = (id) => document.getElementById(id);

/** Longest name of an object, bytes. */
const LONGEST_NAME = 80;
/** How a take came out, in words and as a class. */
const VERDICTS = { clean: ["clean", "good"], noted: ["clean, but see below", "warn"], tolerated: ["usable, with dropped frames", "warn"], aborted: ["aborted", "bad"] };
const STOPPED = ["stopped", ""];
/** Controls that can be set here, and by how much a step moves them. */
const STEPS = [
  [/auto|dynamic|priority/, null],
  [/exposure/, (value) => Math.max(1, Math.round(Math.abs(value) * 0.1))],
  [/focus/, () => 5],
  [/gain/, () => 1],
  [/white_balance_temperature/, () => 100],
];
/** Milliseconds for which the big button takes no tap once a tap has made it another one: a second tap is meant for what it was. */
const DOUBLE_TAP = 1500;
let state = null;
let seenFault = -Infinity;
/** What the big button did when it was tapped, until it is another one, and until when it takes no tap. */
let tapped = null;
let calmUntil = -Infinity;

/** Gives a command; why the rig refuses it is shown. */
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
  // A rig that was started anew knows of no take; this page does.
  state = { ...next, last_take: next.last_take ?? before?.last_take ?? null };
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
  // Whoever stopped a take knows that it has ended.
  if (before && finished && !state.last_take.is_stopped) signal(state.last_take.verdict === "clean");
  showSettings();
  showLog();
  const jobs = JSON.stringify(before?.processing.jobs.map(({ number, step, status }) => [number, step, status]));
  showProcessing(state.processing, (ended) => {
    refresh();
    sessionChanged(ended.map(({ session }) => session));
  });
  showLast();
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
  const counts = busy ? [make("span", { text: `${frames} of ${wanted} frames · ` }), make("span", { text: `${dropped} dropped`, className: dropped > 0 ? "bad" : "" })] : [];
  $("counts").replaceChildren(...counts);
}

/** The object's name follows the time in a session's name. */
const objectOf = (session) => session.replace(/^\d{8}T\d{6}Z-/, "");

/** The last take: a tap opens it. */
function showLast() {
  const take = state.last_take;
  $("last").hidden = !take || alarmed();
  // Where the big button records it again, there is no second one.
  $("again").hidden = take?.verdict !== "tolerated" || state.advice.button.action !== "start";
  if (!take) return;
  const session = listedSession(take.session);
  $("last-shard").hidden = !session?.results?.extraction;
  $("last-shard").href = shardOf(take.session);
  const noted = take.verdict === "clean" && take.notes.length > 0;
  const [verdict, className] = take.is_stopped ? STOPPED : VERDICTS[noted ? "noted" : take.verdict];
  const [stage, stageClass] = session ? standing(session) : ["", ""];
  // A part that is replaced while a finger is on it swallows the tap.
  const key = JSON.stringify([take, stage]);
  if ($("last-open").dataset.key === key) return;
  $("last-open").dataset.key = key;
  $("last-open").replaceChildren(
    make("b", { text: objectOf(take.session) }),
    make("small", {}, make("span", { text: verdict, className }), make("span", { text: ` · ${take.frames} frames · ${take.dropped} dropped` })),
    make("small", { className: `reason ${noted ? "warn" : ""}`, text: take.reason ?? take.notes.join("; ") }),
    make("small", { className: `standing ${stageClass}`, text: stage }),
  );
}

/** The typed name as sessions can have it: whatever else stands between letters and digits becomes a dash. */
function nameOf(typed) {
  const dashed = typed.normalize("NFC").replace(/-*[^\p{Alphabetic}\p{N}\-_.][^\p{Alphabetic}\p{N}_.]*/gu, "-");
  return dashed.replace(/^[-.]+|[-.]+$/g, "");
}

/** Why an object cannot have this name, by the rule of the server; "" where it can. */
function wrongName(name, typed) {
  if (typed && !name) return "A name needs a letter or a digit.";
  return new TextEncoder().encode(name).length > LONGEST_NAME ? "This name is too long." : "";
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
  const name = nameOf($("object").value);
  const names = action === "start" || (action === "again" && name && name !== object);
  if (names) {
    if (!name) return { text: "Name the object", asks: true };
    if (wrongName(name)) return { text: "Shorten the name", asks: true };
    return { text: `Start ${name}`, command: { command: "start", object: name } };
  }
  return { text, stop: action === "stop", command: ACTIONS[action]?.(object) };
}

function showName() {
  const typed = $("object").value.trim();
  const name = nameOf(typed);
  const why = wrongName(name, typed);
  $("saved-as").textContent = `Saved as ${name}`;
  $("saved-as").hidden = name === typed || Boolean(why);
  $("wrong-name").textContent = why;
  $("wrong-name").hidden = !why;
  $("object").setAttribute("aria-invalid", Boolean(why));
}

function showGo() {
  showName();
  const { text, stop, asks, command } = action();
  if (tapped && command && command.command !== tapped) {
    tapped = null;
    calmUntil = performance.now() + DOUBLE_TAP;
    setTimeout(showGo, DOUBLE_TAP + 50);
  }
  $("go").textContent = text;
  $("go").disabled = !(command || asks) || performance.now() < calmUntil || document.body.className !== "";
  $("go").classList.toggle("stop", Boolean(stop));
  $("go").classList.toggle("asks", Boolean(asks));
}

/** The button that cannot start for want of a name leads to the field. */
function askName() {
  $("object").focus({ preventScroll: true });
  $("object").scrollIntoView({ block: "center" });
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

const signed = (degrees) => `${degrees < 0 ? "−" : "+"}${Math.abs(degrees).toFixed(0)}°`;

function showTable() {
  const { present, state: word, angle_deg: angle, degrees_per_second: speed, homed, battery_v: battery, fault } = state.table;
  const facts = [["State", present ? word || "unknown" : "none"]];
  if (present) {
    // While it turns to and fro, its angle is not asked for.
    const unseen = resting() ? "unknown" : "turning";
    facts.push(["Angle", angle === null ? unseen : `${angle.toFixed(1)}°`], ["Zero", homed ? "set" : "not set"]);
    if (speed) facts.push(["Speed", `${speed.toFixed(1)}°/s`]);
    if (battery !== null) facts.push(["Battery", `${battery.toFixed(1)} V`]);
    const { low_deg: low, high_deg: high } = state.table;
    if (homed && angle !== null && high !== null) facts.push(["Can turn by", `${signed(low - angle)} to ${signed(high - angle)}`]);
  }
  $("home").textContent = state.table.has_index ? "Home" : "Set zero here";
  $("table").replaceChildren(...facts.map(([name, value]) => make("div", {}, make("dd", { text: value }), make("dt", { text: name }))));
  warn("table-fault", alarmed() ? null : fault);
  for (const button of document.querySelectorAll("[data-jog], #home")) button.disabled = !present || !resting() || alarmed();
}

function showCamera() {
  const { present, name, mode, fps, controls, clipped, focus, fault } = state.camera;
  $("camera").textContent = present ? [name, mode].filter(Boolean).join(" · ") : "No camera";
  $("focus").textContent = focus === null ? "" : `sharpness ${focus.toFixed(0)}`;
  $("clipped").textContent = clipped === null ? "" : `overexposed ${(clipped * 100).toFixed(clipped < 0.1 ? 1 : 0)} %`;
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
  $("devices").textContent = [`Camera ${settings.camera}`, `turntable ${settings.turntable}`, `sessions in ${settings.root}`].join(" · ");
  const { size, fps, degrees_per_second: speed, max_dropped: dropped, retries } = settings;
  $("settings").textContent = [
    size?.join(" × ") ?? "largest frame size",
    `${fps} frames/s`,
    `${speed}°/s`,
    `${dropped || "no"} dropped frames allowed`,
    `${retries || "no"} ${retries === 1 ? "retry" : "retries"} after a failed take`,
  ].join(" · ");
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
    if (state) showLast();
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
$("object").addEventListener("change", () => {
  $("object").value = nameOf($("object").value) || $("object").value;
  showGo();
});
$("object-form").addEventListener("submit", (event) => {
  event.preventDefault();
  $("object").blur();
});
$("go").addEventListener("click", () => {
  const { asks, command } = action();
  if (asks) return askName();
  if (!command) return;
  tapped = command.command;
  order(command);
});
$("last-open").addEventListener("click", () => openSession(state.last_take.session).catch((problem) => say(problem.message)));
$("home").addEventListener("click", () => order({ command: "home" }));
$("again").addEventListener("click", () => {
  order({ command: "start", object: objectOf(state.last_take.session) });
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
