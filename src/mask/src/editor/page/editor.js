// The editor: the line to the program that cuts, the frames of the turn, and the end.

import { isEnough, Sketcher } from "./sketcher.js";

const $ = (id) => document.getElementById(id);
/** Width of the frames that are shown while scrubbing, pixels. */
const SCRUB_WIDTH = 960;
/** Milliseconds without a change after which the mask is made at full size. */
const REST = 350;
/** Milliseconds until what could not be answered for now is asked again. */
const AGAIN = 2000;

const sketcher = new Sketcher($("canvas"));
let about;
/** The frame that is shown, and the one on which the mask is made. */
let shown = 0;
let made = null;

/** Whether the page is served by another program under a path of its own: the rig, which takes over again at the end. */
const within = location.pathname !== "/";

/** Asks for the recording that the page shows, so that an editor of another one answers nothing; throws an Error with its sentence, and `held` where it may answer later. */
async function request(path, options = {}) {
  const url = new URL(path, document.baseURI);
  if (about) url.searchParams.set("of", about.recording);
  let response;
  try {
    response = await fetch(url, options);
  } catch {
    throw new Error("The program does not answer: has it ended?");
  }
  if (response.ok) return response;
  if (response.status === 401) throw new Error("This page has no access: open the address that the program printed.");
  const problem = await response.json().catch(() => ({}));
  const error = new Error(problem.error ?? `The program answered with status ${response.status}.`);
  throw Object.assign(error, { held: response.status === 503 });
}

function send(path, sketch) {
  const headers = { "Content-Type": "application/json" };
  return request(path, { method: "POST", headers, body: JSON.stringify(sketch) });
}

function say(state, text) {
  $("state").dataset.state = state;
  $("state").textContent = text;
}

function warn(lines) {
  $("warnings").replaceChildren(...lines.map((text) => Object.assign(document.createElement("li"), { textContent: text })));
}

// The mask: one request at a time, always for the newest sketch.

let cutting = false;
/** Whether the turn is read before there is a mask. */
let reading = false;
let resting = 0;
/** The sketch that the outline shows, and whether accepting writes just this. */
let cutOf = null;
let exact = false;
let outline = null;

const canCut = (sketch) => sketch.auto || about.seeds || isEnough(sketch);

function changed() {
  const { frame } = sketcher.sketch;
  if (frame !== made) showFrame((made = frame));
  showOutline(outline, true);
  showTools();
  clearTimeout(resting);
  cut(true);
}

async function cut(draft) {
  const { sketch } = sketcher;
  if (cutting) return;
  if (!canCut(sketch)) {
    cutOf = null;
    showOutline(null);
    say("none", "nothing drawn");
    warn([]);
    return showTools();
  }
  cutting = true;
  reading = sketch.auto && cutOf?.auto !== true;
  say("busy", reading ? `reading the ${about.auto}` : "making the mask");
  showTools();
  try {
    const mask = await (await send(`api/v1/mask?draft=${draft}`, sketch)).json();
    if (sketcher.sketch === sketch) {
      [cutOf, exact] = [sketch, mask.exact];
      showOutline(new Path2D(mask.outline.map((corners) => `M${corners.map((corner) => corner.join(" ")).join("L")}Z`).join("")));
      warn(mask.warnings);
      const part = (100 * mask.area_px) / (about.width * about.height);
      say(mask.exact ? "ready" : "draft", `object ${part.toFixed(part < 1 ? 1 : 0)} % of frame`);
    }
  } catch (error) {
    if (sketcher.sketch === sketch) {
      cutOf = null;
      showOutline(null);
      say("wrong", "no mask");
      warn([error.message]);
      // The rig holds the editor while it captures.
      if (error.held) resting = setTimeout(() => cut(draft), AGAIN);
    }
  }
  cutting = reading = false;
  showTools();
  if (sketcher.sketch !== sketch) return cut(true);
  if (cutOf && !exact) resting = setTimeout(() => cut(false), REST);
}

/** Dark outside of the mask, and a line at its edge; of another colour while a newer mask is made. */
function showOutline(path, isStale = false) {
  outline = path;
  sketcher.view.setMask(path && ((context, pixel) => {
    const outside = new Path2D();
    outside.rect(0, 0, about.width, about.height);
    outside.addPath(path);
    context.fillStyle = "#0007";
    context.fill(outside, "evenodd");
    context.lineJoin = "round";
    for (const [colour, weight] of [["#000c", 3.5], [isStale ? "#ffd28a" : "#39ff6e", 1.6]]) {
      context.strokeStyle = colour;
      context.lineWidth = weight * pixel;
      context.stroke(path);
    }
  }));
}

// Frames: one request at a time, always for the newest place.

let fetching = false;
let wanted = 0;
let loaded = "";

async function showFrame(number) {
  wanted = number;
  $("frame-text").textContent = `Frame ${number}`;
  $("scrub").value = number;
  showTools();
  if (fetching) return;
  fetching = true;
  while (loaded !== keyOf(wanted)) {
    const [number, width] = [wanted, widthOf(wanted)];
    try {
      const response = await request(`api/v1/frames/${number}?width=${width}`);
      sketcher.view.show(await createImageBitmap(await response.blob()));
      shown = number;
    } catch (error) {
      warn([error.message]);
    }
    loaded = `${number} ${width}`;
    showTools();
  }
  fetching = false;
}

/** The mask's own frame is shown sharp. */
const widthOf = (number) => (number === sketcher.sketch.frame ? about.width : Math.min(about.width, SCRUB_WIDTH));
const keyOf = (number) => `${number} ${widthOf(number)}`;

function showTools() {
  const { sketch } = sketcher;
  $("auto").setAttribute("aria-pressed", sketch.auto);
  $("accept").disabled = cutOf !== sketch;
  $("cut-here").disabled = wanted === sketch.frame;
  let hint = "";
  if (shown !== sketch.frame) hint = `Frame ${shown}. The mask is made on frame ${sketch.frame}.`;
  else if (reading && about.auto === "turn") hint = "Reading the turn, which can take minutes. What you draw is used afterwards.";
  else if (!canCut(sketch)) hint = about.auto ? "Draw a box around the object, or press “Automatic”." : "Draw a box around the object.";
  $("hint").textContent = hint;
  $("hint").hidden = !hint;
}

function listen() {
  sketcher.addEventListener("sketch", changed);
  $("scrub").addEventListener("input", () => showFrame(Number($("scrub").value)));
  $("cut-here").addEventListener("click", () => sketcher.change({ frame: wanted }));
  $("auto").addEventListener("click", () => sketcher.change({ auto: !sketcher.sketch.auto }));
  $("accept").addEventListener("click", accept);
  $("discard").addEventListener("click", discard);
  document.addEventListener("keydown", key);
}

function key(event) {
  const letter = event.key.toLowerCase();
  if ((event.ctrlKey || event.metaKey) && (letter === "z" || letter === "y")) {
    event.preventDefault();
    return sketcher.step(letter === "y" || event.shiftKey ? 1 : -1);
  }
  if (event.ctrlKey || event.metaKey || event.altKey || sketcher.toolKey(event)) return;
  const way = { ArrowLeft: -1, ArrowRight: 1 }[event.key];
  const onButton = ["BUTTON", "INPUT"].includes(document.activeElement?.tagName);
  if (way && !onButton) showFrame(Math.min(Math.max(0, wanted + way * (event.shiftKey ? 10 : 1)), about.frames - 1));
}

// The end.

async function accept() {
  $("accept").disabled = true;
  say("busy", "saving");
  try {
    const written = await (await send("api/v1/accept", sketcher.sketch)).json();
    end("accepted", "Mask saved", `${about.output}, ${written.area_px} pixels. ${CLOSED}`);
  } catch (error) {
    say("wrong", "not saved");
    warn([error.message]);
    showTools();
  }
}

async function discard() {
  if (sketcher.canUndo && !confirm("Close without saving the mask?")) return;
  try {
    await request("api/v1/discard", { method: "POST" });
    end("discarded", "Nothing was saved", CLOSED);
  } catch (error) {
    warn([error.message]);
  }
}

const CLOSED = within ? "" : "The program has ended. You can close this page.";

function end(state, title, text) {
  say(state, state);
  $("end-back").hidden = !within;
  if (about) $("end-back").href = `../#${encodeURIComponent(about.recording)}`;
  // What was asked for is done: the rig shows the session.
  if (within && state !== "wrong") location.replace($("end-back").href);
  $("end-title").textContent = title;
  $("end-text").textContent = text;
  $("end").hidden = false;
}

async function begin() {
  try {
    about = await (await request("api/v1/recording")).json();
  } catch (error) {
    say("wrong", "no access");
    return end("wrong", "The editor cannot be opened", error.message);
  }
  const { recording, width, height, frames, sketch } = about;
  sketcher.open({ picture: null, width, height }, sketch, sketch.rect ? "object" : "rect");
  // Of a session's name, the object is what follows the time.
  const object = recording.replace(/^\d{8}T\d{6}Z-/, "");
  document.title = `relit mask: ${object}`;
  Object.assign($("title"), { textContent: object, title: recording });
  $("scrub").max = frames - 1;
  $("scrub").disabled = frames < 2;
  $("auto").disabled = !about.auto;
  if (about.auto === "background") $("auto").title = "Find the object by its plain background";
  listen();
  changed();
}

begin();
