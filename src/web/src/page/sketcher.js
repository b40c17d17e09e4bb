// A sketch of where an object is, over its picture: a rectangle by a drag, strokes by a finger, or both by keys. The app and the
// editor of masks draw with it. Buttons of the page say by `data-tool` and `data-sketch` what they are for.

import { History } from "./history.js";
import { corners, SketchView } from "./sketch-view.js";

export const EMPTY = { rect: null, strokes: [] };
/** Distance at which a corner of the rectangle is taken hold of, pixels of the page. */
const REACH = { mouse: 12, pen: 16, touch: 26 };
/** Shorter drags draw no rectangle, pixels of the page. */
const SHORT = 6;
/** The way of the keys' cursor, parts of the picture. */
const STEP = 0.01;
const TOOLS = { r: "rect", o: "object", b: "background", e: "eraser", h: "hand" };

const tools = () => document.querySelectorAll("[data-tool]");
const control = (name) => document.querySelector(`[data-sketch=${name}]`);

/** Events: "sketch" (it is another), "tool" (another tool is used). */
export class Sketcher extends EventTarget {
  tool = "rect";
  view;

  #canvas;
  #size = { width: 1, height: 1 };
  #history = new History(EMPTY);
  #pointers = new Map();
  /** What the pointers do: "draw", "rect", "move", "pinch" or nothing. */
  #doing = null;
  /** The corner of a rectangle that stays. */
  #anchor = null;
  #began = null;

  constructor(canvas) {
    super();
    this.#canvas = canvas;
    this.view = new SketchView(canvas);
    this.#listenToPointers(canvas);
    this.#listenToTools();
    canvas.addEventListener("blur", () => this.#showCross(null));
  }

  /** Begins with a sketch over a picture: { picture, width, height }. */
  open(picture, sketch, tool) {
    this.#size = picture;
    this.#history = new History(sketch);
    this.tool = tool;
    this.view.open(picture);
    this.view.sketch = sketch;
    this.#show();
  }

  get sketch() {
    return this.#history.now;
  }

  get canUndo() {
    return this.#history.canUndo;
  }

  change(parts) {
    this.#history.change({ ...this.sketch, ...parts });
    this.#changed();
  }

  /** Takes the last step back, or again. */
  step(by) {
    by < 0 ? this.#history.undo() : this.#history.redo();
    this.#changed();
  }

  #changed() {
    this.view.sketch = this.sketch;
    this.view.draw();
    this.#show();
    this.dispatchEvent(new Event("sketch"));
  }

  #show() {
    const { rect, strokes } = this.sketch;
    for (const button of tools()) button.setAttribute("aria-pressed", button.dataset.tool === this.tool);
    this.#canvas.classList.toggle("hand", this.tool === "hand");
    control("undo").disabled = !this.#history.canUndo;
    control("redo").disabled = !this.#history.canRedo;
    control("clear").disabled = !rect && strokes.length === 0;
    control("size-text").textContent = `${Math.round(2 * this.#radius())} px`;
    control("size").disabled = !this.#paints;
  }

  get #paints() {
    return this.tool !== "rect" && this.tool !== "hand";
  }

  /** From one pixel to a fifth of the picture, in equal ratios. */
  #radius() {
    const most = Math.max(this.#size.width, this.#size.height) / 10;
    return round(0.5 * (2 * most) ** (Number(control("size").value) / 100));
  }

  #take(tool) {
    this.tool = tool;
    this.view.brush = null;
    this.#lift();
    this.#show();
    this.dispatchEvent(new Event("tool"));
  }

  #resize(by) {
    control("size").value = Number(control("size").value) + by;
    if (this.view.brush) this.view.brush.radius = this.#radius();
    this.view.draw();
    this.#show();
  }

  #listenToTools() {
    for (const button of tools()) button.addEventListener("click", () => this.#take(button.dataset.tool));
    control("size").addEventListener("input", () => this.#resize(0));
    const clicks = {
      undo: () => this.step(-1), redo: () => this.step(1), clear: () => this.change(EMPTY),
      closer: () => this.view.zoom(1.6), farther: () => this.view.zoom(1 / 1.6), fit: () => this.view.fit(),
    };
    for (const [name, click] of Object.entries(clicks)) control(name).addEventListener("click", click);
  }

  // Pointers: one draws, two move and zoom.

  #listenToPointers(canvas) {
    canvas.addEventListener("pointerdown", (event) => this.#down(event));
    canvas.addEventListener("pointermove", (event) => this.#moved(event));
    canvas.addEventListener("pointerup", (event) => this.#up(event));
    canvas.addEventListener("pointercancel", (event) => this.#up(event));
    canvas.addEventListener("pointerleave", () => this.#ring(null));
    canvas.addEventListener("contextmenu", (event) => event.preventDefault());
    canvas.addEventListener("wheel", (event) => {
      event.preventDefault();
      this.view.zoom(Math.exp(-event.deltaY * (event.deltaMode === 1 ? 0.05 : 0.0015)), event);
    }, { passive: false });
  }

  #down(event) {
    this.#canvas.setPointerCapture(event.pointerId);
    this.#pointers.set(event.pointerId, event);
    this.#showCross(null);
    if (this.#pointers.size > 1) {
      // What the first finger began was meant as a pinch.
      this.view.stroke = this.view.rect = null;
      this.#doing = "pinch";
      return this.view.draw();
    }
    this.#began = event;
    if (event.button === 1 || this.tool === "hand") this.#doing = "move";
    else if (event.button !== 0) this.#doing = null;
    else if (this.tool === "rect") this.#beginRect(event);
    else this.#beginStroke(this.view.place(event));
  }

  #beginRect(event) {
    this.#doing = "rect";
    const at = this.view.place(event);
    const { rect } = this.sketch;
    const reach = this.view.length(REACH[event.pointerType] ?? REACH.mouse);
    const near = rect ? corners(rect).findIndex(([x, y]) => Math.hypot(x - at[0], y - at[1]) < reach) : -1;
    this.#anchor = near >= 0 ? corners(rect)[(near + 2) % 4] : at;
  }

  #beginStroke(at) {
    this.#doing = "draw";
    this.view.stroke = { brush: this.tool, radius: this.#radius(), points: [at.map(round)] };
    this.view.draw();
  }

  #moved(event) {
    if (event.pointerType !== "touch") this.#ring(this.view.place(event));
    const before = this.#pointers.get(event.pointerId);
    if (!before) return;
    this.#pointers.set(event.pointerId, event);
    if (this.#doing === "move") this.view.move(event.clientX - before.clientX, event.clientY - before.clientY);
    if (this.#doing === "pinch") this.#pinch(before, event);
    if (this.#doing === "draw") {
      // Between two pictures of the screen the pointer may have moved many times.
      const events = event.getCoalescedEvents?.() ?? [];
      for (const each of events.length > 0 ? events : [event]) this.#extend(this.view.place(each).map(round));
    }
    if (this.#doing === "rect") this.view.rect = this.#between(this.#anchor, this.view.place(event));
    this.view.draw();
  }

  #extend(point) {
    const { points } = this.view.stroke;
    const last = points.at(-1);
    if (Math.hypot(point[0] - last[0], point[1] - last[1]) >= Math.max(0.5, this.view.length(1.5))) points.push(point);
  }

  #pinch(before, event) {
    const other = [...this.#pointers.values()].find(({ pointerId }) => pointerId !== event.pointerId);
    if (!other) return;
    const distance = (a) => Math.max(1, Math.hypot(a.clientX - other.clientX, a.clientY - other.clientY));
    const middle = { clientX: (event.clientX + other.clientX) / 2, clientY: (event.clientY + other.clientY) / 2 };
    this.view.move((event.clientX - before.clientX) / 2, (event.clientY - before.clientY) / 2);
    this.view.zoom(distance(event) / distance(before), middle);
  }

  #up(event) {
    if (!this.#pointers.delete(event.pointerId) || this.#pointers.size > 0) return;
    const [doing, { stroke, rect }] = [this.#doing, this.view];
    this.#doing = this.view.stroke = this.view.rect = null;
    if (event.type === "pointerup") {
      const way = Math.hypot(event.clientX - this.#began.clientX, event.clientY - this.#began.clientY);
      if (doing === "draw" && stroke) this.#draw(stroke);
      if (doing === "rect" && way >= SHORT) this.#frame(rect);
    }
    this.view.draw();
  }

  #draw(stroke) {
    this.change({ strokes: [...this.sketch.strokes, stroke] });
  }

  #frame(rect) {
    if (rect && rect[2] > 0 && rect[3] > 0) this.change({ rect });
  }

  /** The rectangle of whole pixels between two places, inside the picture. */
  #between(a, b) {
    const { width, height } = this.#size;
    const side = (p, q, most) => [p, q].map((value) => clamp(Math.round(value), 0, most)).sort((x, y) => x - y);
    const [[left, right], [top, bottom]] = [side(a[0], b[0], width), side(a[1], b[1], height)];
    return [left, top, right - left, bottom - top];
  }

  #ring(at) {
    this.view.brush = at && this.#paints ? { at, radius: this.#radius() } : null;
    this.view.draw();
  }

  // Keys. Each method says whether the key was one of its own.

  /** Tools, the brush's size and zoom. */
  toolKey({ key }) {
    const tool = TOOLS[key.toLowerCase()];
    if (tool && document.querySelector(`[data-tool=${tool}]`)) this.#take(tool);
    else if (key === "+" || key === "=") this.view.zoom(1.3);
    else if (key === "-") this.view.zoom(1 / 1.3);
    else if (key === "0") this.view.fit();
    else if (key === "[" || key === "]") this.#resize(key === "]" ? 4 : -4);
    else return false;
    return true;
  }

  /** Arrows move a cursor, space sets the rectangle's corners, or puts the brush down and lifts it. */
  cursorKey({ key, shiftKey }) {
    const way = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] }[key];
    if (way) this.#moveCross(way, shiftKey ? 5 : 1);
    else if (key === " " || key === "Enter") this.#press();
    else if (key === "Escape") this.#lift();
    else return false;
    return true;
  }

  #moveCross([dx, dy], times) {
    const { width, height } = this.#size;
    const [x, y] = this.view.cross ?? [width / 2, height / 2];
    const step = STEP * times * Math.max(width, height);
    this.#showCross([clamp(x + dx * step, 0, width), clamp(y + dy * step, 0, height)]);
    if (this.view.stroke) this.view.stroke.points.push(this.view.cross.map(round));
    if (this.#anchor && this.tool === "rect") this.view.rect = this.#between(this.#anchor, this.view.cross);
  }

  #showCross(at) {
    if (!at) this.#lift();
    this.view.cross = at;
    this.#ring(at);
  }

  /** What was begun by keys and not ended. */
  #lift() {
    this.#anchor = this.view.stroke = this.view.rect = null;
    this.view.draw();
  }

  #press() {
    const { cross, stroke, rect } = this.view;
    if (!cross) return this.#moveCross([0, 0], 0);
    if (this.#paints && !stroke) return this.#beginStroke(cross);
    if (this.tool === "rect" && !this.#anchor) {
      this.#anchor = cross;
      return undefined;
    }
    this.#lift();
    if (stroke) this.#draw(stroke);
    else this.#frame(rect);
    return undefined;
  }
}

/** Whether a sketch shows by itself where the object is. */
export const isEnough = ({ rect, strokes }) => rect !== null || strokes.some(({ brush }) => brush === "object");

const clamp = (value, least, most) => Math.min(Math.max(value, least), most);

/** A hundredth of a pixel is enough. */
const round = (value) => Math.round(value * 100) / 100;
