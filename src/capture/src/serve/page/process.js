// What is made of sessions: the steps of the session in the player, the jobs, and the settings. The work is done by
// other programs of the rig's computer.
import { ask, request } from "./link.js";
import { make } from "./elements.js";

const $ = (id) => document.getElementById(id);
const path = (id) => `/api/v1/sessions/${encodeURIComponent(id)}`;
const STEPS = { mask: "Making the mask", check: "Checking the mask", extract: "Extracting" };
const DONE = { mask: "Mask", check: "Check", extract: "Extraction" };
const ORIGINS = { turn: "automatic", hints: "drawn by hand", hand: "from another program" };
const CHECKS = { fits: "the mask fits", wrong: "the mask is wrong", unknown: "not certain" };
const STATUS = { waiting: "waiting", running: "", held: "paused while the rig is busy" };

let processing = null;
/** The session in the player, as the server described it last. */
let shown = null;
let wanted = null;
let tell = () => {};

/** Asks for something to be done; what is in the way is told. */
async function order(method, where, body) {
  const options = { method, wait: 70_000 };
  if (body) Object.assign(options, { headers: { "Content-Type": "application/json" }, body: JSON.stringify(body) });
  try {
    const response = await request(where, options);
    tell("");
    return response;
  } catch (problem) {
    tell(problem.message);
    return null;
  }
}

/** The address of a session's samples in the data set. */
export const shardOf = (id) => `${path(id)}/shard.tar`;

export const isMissing = (step) => !processing || !(step === "extract" ? processing.has_extract_program : processing.has_mask_program);
const jobOf = (id) => processing?.jobs.find(({ session }) => session === id);

/** How a session stands, in words and with a class: for the list and its days. */
export function standing({ results, id }) {
  const job = jobOf(id);
  if (job?.status === "waiting") return [job === processing.jobs[0] ? "waiting until the rig rests" : "waiting for other sessions", "busy"];
  if (job) return [`${STEPS[job.step].toLowerCase()}…`, "busy"];
  if (!results) return ["", ""];
  const { stage, is_doubtful: doubtful } = results;
  if (doubtful === null) return ["no mask yet", ""];
  if (stage === "masked") return [doubtful ? "masked: please check the mask" : "masked", doubtful ? "warn" : ""];
  if (stage === "checked") return [doubtful ? "checked: the mask may be wrong" : "checked: the mask fits", doubtful ? "warn" : ""];
  return [doubtful ? "extracted: please look at the report" : "extracted: good", doubtful ? "warn" : "good"];
}

/** Shows the steps of a session; `say` tells what went wrong. */
export function showSteps(detail, say) {
  [shown, tell] = [detail, say];
  const { mask, check, extraction } = detail.results;
  step("mask", mask ? ORIGINS[mask.origin] : "none yet", mask ? (mask.warnings.length ? "warn" : "good") : "", mask?.warnings);
  const old = "outdated: the mask has changed since";
  if (!check) step("check", "not checked", "");
  else if (!check.is_current) step("check", old, "warn");
  else step("check", CHECKS[check.verdict] ?? check.verdict, check.verdict === "fits" ? "good" : "warn", check.reasons);
  if (!extraction) step("extract", "not extracted", "");
  else if (!extraction.is_current) step("extract", old, "warn");
  else step("extract", `${extraction.samples} samples, ${extraction.verdict}`, extraction.verdict === "good" && !extraction.is_lossy ? "good" : "warn", extraction.reasons);
  $("check-page").hidden = !check;
  $("check-page").href = `${path(detail.id)}/check.html`;
  $("player-shard").hidden = !extraction;
  $("player-shard").href = shardOf(detail.id);
  $("report-page").hidden = !extraction;
  $("report-page").href = `${path(detail.id)}/report.html`;
  showJob();
  begin();
}

function step(name, words, className, reasons = []) {
  Object.assign($(`${name}-text`), { textContent: words, className });
  $(`${name}-why`).replaceChildren(...reasons.slice(0, 4).map((text) => make("li", { text })));
}

/** The automatic mask is made at once, unless that was tried before. */
function begin() {
  const { id, status, results } = shown;
  const tried = processing?.finished.some(({ session }) => session === id);
  if (results.mask || status !== "complete" || wanted === id || tried || isMissing("mask") || jobOf(id)) return;
  wanted = id;
  queue("mask");
}

const queue = (...steps) => order("POST", `${path(shown.id)}/process`, { steps });

/** What is under way or came out last, in the player. */
function showJob() {
  if (!shown) return;
  const { id, results, status } = shown;
  const job = jobOf(id);
  $("job").hidden = !job;
  if (job) {
    $("job-text").textContent = [STEPS[job.step], STATUS[job.status]].filter(Boolean).join(": ");
    advance($("job-progress"), job);
    $("job-cancel").onclick = () => order("DELETE", `/api/v1/processing/jobs/${job.number}`);
  }
  const last = processing?.finished.findLast(({ session }) => session === id);
  const ends = { failed: "bad", cancelled: "quiet" };
  const className = job ? undefined : ends[last?.outcome];
  $("job-failed").hidden = !className;
  Object.assign($("job-failed"), { className: className ?? "", textContent: className ? `${DONE[last.step]}: ${last.what}` : "" });
  const ended = status === "complete" || status === "aborted";
  const idle = ended && !job;
  const [canMask, canExtract] = [idle && !isMissing("mask"), idle && !isMissing("extract")];
  for (const [button, on] of [["make-mask", canMask], ["edit-mask", idle], ["make-check", canMask && results.mask], ["make-extract", canExtract && results.mask]]) $(button).disabled = !on;
  $("make-mask").textContent = results.mask ? "Make again" : "Make";
  $("make-check").textContent = results.check ? "Check again" : "Check";
  $("make-extract").textContent = results.extraction ? "Extract again" : "Extract";
  const finished = results.stage === "extracted";
  // A take that ended early is extracted only by somebody who means it.
  $("make-all").hidden = finished || status !== "complete" || !canMask || !canExtract;
}

/** A bar that knows how far things are, or that something is being done. */
function advance(bar, { done, of, status }) {
  bar.hidden = status === "waiting";
  if (of > 0) bar.value = done / of;
  else bar.removeAttribute("value");
}

/** Takes in the newest state; `ended` is called where a job ended since. */
export function showProcessing(next, ended) {
  const last = processing?.finished.at(-1);
  const fresh = processing ? next.finished.filter(({ number, step }) => !processing.finished.some((old) => old.number === number && old.step === step)) : [];
  const key = JSON.stringify(next);
  if (processing && key === JSON.stringify(processing)) return;
  processing = next;
  showSettings();
  showQueue();
  showJob();
  if (shown) begin();
  if (fresh.length > 0 && fresh.at(-1) !== last) ended(fresh);
}

function showSettings() {
  const { when_done: whenDone, dataset_folder: folder } = processing;
  $("when-done").checked = whenDone;
  $("when-done").disabled = isMissing("mask");
  $("dataset-folder").textContent = folder;
  const missing = [isMissing("mask") && "relit-mask", isMissing("extract") && "relit-extract"].filter(Boolean);
  $("missing").hidden = missing.length === 0;
  $("missing").textContent = `${missing.join(" and ")} ${missing.length > 1 ? "are" : "is"} not installed on the rig’s computer. Install the package relit there and restart relit-capture, or process the sessions on another computer.`;
}

function showQueue() {
  const lines = processing.jobs.map((job) => {
    const cancel = make("button", { type: "button", text: "Cancel", ariaLabel: `Cancel: ${STEPS[job.step]} ${job.session}` });
    cancel.addEventListener("click", () => order("DELETE", `/api/v1/processing/jobs/${job.number}`));
    const bar = make("progress", { max: 1 });
    advance(bar, job);
    const text = [STEPS[job.step], STATUS[job.status]].filter(Boolean).join(": ");
    return make("li", {}, make("span", {}, make("b", { text: job.session.replace(/^\d{8}T\d{6}Z-/, "") }), make("small", { text }), bar), cancel);
  });
  $("jobs").replaceChildren(...lines);
}

/** Shows the steps of no session: what the player opens with next is not known yet. */
export function hideSteps() {
  shown = null;
  for (const part of ["job", "job-failed", "make-all", "check-page", "report-page", "player-shard"]) $(part).hidden = true;
  for (const button of ["make-mask", "edit-mask", "make-check", "make-extract"]) $(button).disabled = true;
  for (const name of ["mask", "check", "extract"]) step(name, "…", "");
}

async function edit() {
  const response = await order("POST", `${path(shown.id)}/edit`);
  if (response) location.assign((await response.json()).path);
}

async function configure(change) {
  const response = await order("PUT", "/api/v1/processing", change);
  if (!response) showSettings();
}

/** Sets up the buttons; `say` tells what went wrong where no session is shown. */
export function startProcessing(say) {
  hideSteps();
  $("make-mask").addEventListener("click", () => queue("mask"));
  $("edit-mask").addEventListener("click", edit);
  $("make-check").addEventListener("click", () => queue("check"));
  $("make-extract").addEventListener("click", () => queue("extract"));
  $("make-all").addEventListener("click", () => {
    const { mask, check } = shown.results;
    const steps = [!mask && "mask", !(mask && check?.is_current) && "check", "extract"];
    queue(...steps.filter(Boolean));
  });
  $("when-done").addEventListener("change", () => {
    tell = say;
    configure({ when_done: $("when-done").checked });
  });
}

/** The session as it is now. */
export const describe = (id) => ask(path(id));
