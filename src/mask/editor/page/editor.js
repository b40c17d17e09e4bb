// The editor: tools, pointers and keys; the line to the program that cuts.

import { History, isEnough } from "./history.js";
import { View, corners } from "./view.js";

const $ = (id) => document.getElementById(id);
/** Width of the frames that are shown while scrubbing, pixels. */
const SCRUB_WIDTH = 960;
/** Milliseconds without a change after which the mask is made at full size. */
const REST = 350;
/** Milliseconds until what could not be answered for now is asked again. */
const AGAIN = 2000;
/** Distance at which a corner of the rectangle is taken hold of, pixels of the page. */
const REACH = { mouse: 12, pen: 16, touch: 26 };
/** Shorter drags draw no rectangle, pixels of the page. */
const SHORT = 6;

let about, history, view;
let tool = "rect";
let shown = 0;

/** Whether the page is served by another program under a path of its own: the rig, which takes over again at the end. */
const within = location.pathname !== "/";

/** Asks the program; throws an Error with its sentence, and `held` where it may answer later. */
async function request(path, options = {}) {
  let response;
  try {
    response = await fetch(path, options);
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
let resting = 0;
/** The sketch that the outline shows, and whether accepting writes just this. */
let cutOf = null;
let exact = false;

function changed() {
  view.sketch = history.now;
  view.stale = true;
  view.draw();
  showTools();
  clearTimeout(resting);
  cut(true);
}

async function cut(draft) {
  const sketch = history.now;
  if (cutting) return;
  if (!isEnough(sketch, about.seeds)) {
    cutOf = null;
    view.setOutline(null);
    say("none", "nothing drawn");
    warn([]);
    return showTools();
  }
  cutting = true;
  say("busy", sketch.auto && cutOf?.auto !== true ? "looking at the turn" : "cutting");
  try {
    const mask = await (await send(`api/v1/mask?draft=${draft}`, sketch)).json();
    if (history.now === sketch) {
      [cutOf, exact, view.stale] = [sketch, mask.exact, false];
      view.setOutline(mask.outline);
      warn(mask.warnings);
      const share = (100 * mask.area_px) / (about.width * about.height);
      say(mask.exact ? "ready" : "draft", `${share.toFixed(1)} %, ${(mask.ms / 1000).toFixed(2)} s`);
    }
  } catch (error) {
    if (history.now === sketch) {
      cutOf = null;
      view.setOutline(null);
      say("wrong", "no mask");
      warn([error.message]);
      // The rig holds the editor while it captures.
      if (error.held) resting = setTimeout(() => cut(draft), AGAIN);
    }
  }
  cutting = false;
  showTools();
  if (history.now !== sketch) return cut(true);
  if (cutOf && !exact) resting = setTimeout(() => cut(false), REST);
}

// Frames: one request at a time, always for the newest place.

let fetching = false;
let wanted = 0;
let loaded = "";

async function showFrame(number) {
  wanted = number;
  $("frame-text").textContent = `Frame ${number}`;
  $("scrub").value = number;
  $("cut-here").disabled = number === history.now.frame;
  if (fetching) return;
  fetching = true;
  while (loaded !== keyOf(wanted)) {
    const [number, width] = [wanted, widthOf(wanted)];
    try {
      const response = await request(`api/v1/frames/${number}?width=${width}`);
      view.image = await createImageBitmap(await response.blob());
      shown = number;
    } catch (error) {
      warn([error.message]);
    }
    loaded = `${number} ${width}`;
    view.draw();
    showHint();
  }
  fetching = false;
}

/** The mask's own frame is shown sharp. */
const widthOf = (number) => (number === history.now.frame ? about.width : Math.min(about.width, SCRUB_WIDTH));
const keyOf = (number) => `${number} ${widthOf(number)}`;

function showHint() {
  const { frame } = history.now;
  let hint = "";
  if (shown !== frame) hint = `Frame ${shown}. The mask is made on frame ${frame}.`;
  else if (!isEnough(history.now, about.seeds)) hint = about.turn ? "Draw a box around the object, or press “By the turn”." : "Draw a box around the object.";
  $("hint").textContent = hint;
  $("hint").hidden = !hint;
}

// Tools.

function showTools() {
  for (const button of document.querySelectorAll("[data-tool]")) button.setAttribute("aria-pressed", button.dataset.tool === tool);
  $("canvas").classList.toggle("hand", tool === "hand");
  $("undo").disabled = !history.canUndo;
  $("redo").disabled = !history.canRedo;
  $("auto").setAttribute("aria-pressed", history.now.auto);
  $("accept").disabled = cutOf !== history.now;
  $("clear").disabled = !history.now.rect && history.now.strokes.length === 0;
  $("size-text").textContent = `${Math.round(2 * radius())} px`;
  $("cut-here").disabled = wanted === history.now.frame;
  showHint();
}

/** The brush's radius, pixels of the frame: from one pixel to a fifth of the frame, in equal ratios. */
function radius() {
  const most = Math.max(about.width, about.height) / 10;
  return 0.5 * Math.pow(2 * most, Number($("size").value) / 100);
}

function take(name) {
  tool = name;
  if (name === "rect" || name === "hand") view.brush = null;
  view.draw();
  showTools();
}

function resize(by) {
  $("size").value = Number($("size").value) + by;
  if (view.brush) view.brush.radius = radius();
  view.draw();
  showTools();
}

function undo(step) {
  const { frame } = history.now;
  step < 0 ? history.undo() : history.redo();
  if (history.now.frame !== frame) showFrame(history.now.frame);
  changed();
}

// Pointers: one draws, two move and zoom.

const pointers = new Map();
/** What the pointers do: "draw", "rect", "move", "pinch" or nothing. */
let doing = null;
/** The corner of a rectangle that stays. */
let anchor = null;
let began = null;
let spaceHeld = false;

function down(event) {
  if (doing && event.pointerType !== "touch") return;
  $("canvas").setPointerCapture(event.pointerId);
  pointers.set(event.pointerId, event);
  if (pointers.size === 2) {
    // What the first finger began was meant as a pinch.
    view.stroke = view.rect = null;
    doing = "pinch";
    return view.draw();
  }
  if (pointers.size > 2) return;
  began = event;
  if (tool === "hand" || event.button === 1 || spaceHeld) doing = "move";
  else if (event.button !== 0) doing = null;
  else if (tool === "rect") beginRect(event);
  else beginStroke(event);
}

function beginRect(event) {
  doing = "rect";
  const at = view.place(event);
  const { rect } = history.now;
  const near = rect && corners(rect).findIndex(([x, y]) => Math.hypot(x - at[0], y - at[1]) < view.length(REACH[event.pointerType] ?? 12));
  anchor = rect && near >= 0 ? corners(rect)[(near + 2) % 4] : at;
}

function beginStroke(event) {
  doing = "draw";
  view.stroke = { brush: tool, radius: round(radius()), points: [view.place(event).map(round)] };
  view.draw();
}

function moved(event) {
  if (tool !== "rect" && tool !== "hand" && event.pointerType !== "touch") {
    view.brush = { at: view.place(event), radius: radius() };
    view.draw();
  }
  const before = pointers.get(event.pointerId);
  if (!before) return;
  pointers.set(event.pointerId, event);
  if (doing === "move") view.move(event.clientX - before.clientX, event.clientY - before.clientY);
  if (doing === "pinch") pinch(before, event);
  if (doing === "draw") {
    // Between two pictures of the screen the pointer may have moved many times.
    const events = event.getCoalescedEvents?.() ?? [];
    for (const each of events.length > 0 ? events : [event]) extend(view.place(each).map(round));
    view.draw();
  }
  if (doing === "rect") {
    view.rect = between(anchor, view.place(event));
    view.draw();
  }
}

function extend(point) {
  const { points } = view.stroke;
  const last = points[points.length - 1];
  if (Math.hypot(point[0] - last[0], point[1] - last[1]) >= Math.max(0.5, view.length(1.5))) points.push(point);
}

function pinch(before, event) {
  const other = [...pointers.values()].find(({ pointerId }) => pointerId !== event.pointerId);
  if (!other) return;
  const distance = (a) => Math.max(1, Math.hypot(a.clientX - other.clientX, a.clientY - other.clientY));
  const middle = { clientX: (event.clientX + other.clientX) / 2, clientY: (event.clientY + other.clientY) / 2 };
  view.move((event.clientX - before.clientX) / 2, (event.clientY - before.clientY) / 2);
  view.zoom(distance(event) / distance(before), middle);
}

function up(event) {
  if (!pointers.delete(event.pointerId)) return;
  if (pointers.size > 0) return;
  const done = doing;
  doing = null;
  const { stroke, rect } = view;
  view.stroke = view.rect = null;
  if (event.type === "pointercancel") return view.draw();
  if (done === "draw" && stroke) {
    history.change({ strokes: [...history.now.strokes, stroke] });
    changed();
  }
  const way = began ? Math.hypot(event.clientX - began.clientX, event.clientY - began.clientY) : 0;
  if (done === "rect" && rect && way >= SHORT && rect[2] > 0 && rect[3] > 0) {
    history.change({ rect });
    changed();
  }
  view.draw();
}

/** A hundredth of a pixel is enough. */
const round = (value) => Math.round(value * 100) / 100;

/** The rectangle of whole pixels between two places, inside the frame. */
function between(a, b) {
  const inside = (value, most) => Math.min(Math.max(Math.round(value), 0), most);
  const [left, right] = [a[0], b[0]].map((value) => inside(value, about.width)).sort((p, q) => p - q);
  const [top, bottom] = [a[1], b[1]].map((value) => inside(value, about.height)).sort((p, q) => p - q);
  return [left, top, right - left, bottom - top];
}

function listen() {
  const canvas = $("canvas");
  canvas.addEventListener("pointerdown", down);
  canvas.addEventListener("pointermove", moved);
  canvas.addEventListener("pointerup", up);
  canvas.addEventListener("pointercancel", up);
  canvas.addEventListener("pointerleave", () => {
    view.brush = null;
    view.draw();
  });
  canvas.addEventListener("contextmenu", (event) => event.preventDefault());
  canvas.addEventListener("wheel", (event) => {
    event.preventDefault();
    view.zoom(Math.exp(-event.deltaY * (event.deltaMode === 1 ? 0.05 : 0.0015)), event);
  }, { passive: false });
  for (const button of document.querySelectorAll("[data-tool]")) button.addEventListener("click", () => take(button.dataset.tool));
  $("size").addEventListener("input", () => resize(0));
  $("undo").addEventListener("click", () => undo(-1));
  $("redo").addEventListener("click", () => undo(1));
  $("closer").addEventListener("click", () => view.zoom(1.6));
  $("farther").addEventListener("click", () => view.zoom(1 / 1.6));
  $("fit").addEventListener("click", () => view.fit());
  $("scrub").addEventListener("input", () => showFrame(Number($("scrub").value)));
  $("cut-here").addEventListener("click", () => {
    history.change({ frame: wanted });
    showFrame(wanted);
    changed();
  });
  $("auto").addEventListener("click", () => {
    history.change({ auto: !history.now.auto });
    changed();
  });
  $("clear").addEventListener("click", () => {
    history.change({ rect: null, strokes: [] });
    changed();
  });
  $("accept").addEventListener("click", accept);
  $("discard").addEventListener("click", discard);
  document.addEventListener("keydown", key);
  document.addEventListener("keyup", (event) => {
    if (event.key === " ") spaceHeld = false;
  });
}

const TOOLS = { r: "rect", o: "object", b: "background", e: "eraser", h: "hand" };

function key(event) {
  const letter = event.key.toLowerCase();
  if ((event.ctrlKey || event.metaKey) && (letter === "z" || letter === "y")) {
    event.preventDefault();
    return undo(letter === "y" || event.shiftKey ? 1 : -1);
  }
  if (event.ctrlKey || event.metaKey || event.altKey) return;
  const onButton = ["BUTTON", "INPUT"].includes(document.activeElement?.tagName);
  if (letter === " " && !onButton) {
    event.preventDefault();
    spaceHeld = true;
  } else if (TOOLS[letter]) take(TOOLS[letter]);
  else if (letter === "[") resize(-4);
  else if (letter === "]") resize(4);
  else if (letter === "+" || letter === "=") view.zoom(1.3);
  else if (letter === "-") view.zoom(1 / 1.3);
  else if (letter === "0") view.fit();
  else if (event.key === "ArrowLeft" && !onButton) showFrame(Math.max(0, wanted - (event.shiftKey ? 10 : 1)));
  else if (event.key === "ArrowRight" && !onButton) showFrame(Math.min(about.frames - 1, wanted + (event.shiftKey ? 10 : 1)));
}

// The end.

async function accept() {
  const sketch = history.now;
  $("accept").disabled = true;
  say("busy", "writing");
  try {
    const written = await (await send("api/v1/accept", sketch)).json();
    end("accepted", "The mask is written", `${about.output}, ${written.area_px} pixels. ${CLOSED}`);
  } catch (error) {
    say("wrong", "not written");
    warn([error.message]);
    showTools();
  }
}

async function discard() {
  if (history.canUndo && !confirm("End without writing a mask?")) return;
  try {
    await request("api/v1/discard", { method: "POST" });
    end("discarded", "Nothing was written", CLOSED);
  } catch (error) {
    warn([error.message]);
  }
}

const CLOSED = within ? "" : "The program has ended; this page can be closed.";

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
  history = new History(about.sketch);
  view = new View($("canvas"), about.width, about.height);
  document.title = `relit mask: ${about.recording}`;
  $("title").textContent = about.recording;
  $("scrub").max = about.frames - 1;
  $("scrub").disabled = about.frames < 2;
  $("auto").disabled = !about.turn;
  if (about.sketch.rect) tool = "object";
  listen();
  showFrame(about.sketch.frame);
  changed();
}

begin();
