// An object is cut out of its photograph: a rectangle by a drag, strokes by a finger, or both by keys; the mask follows.

import { $, clamp, make } from "./dom.js";
import { History } from "./history.js";
import { attempt } from "./notices.js";
import { corners, View } from "./view.js";

const EMPTY = { rect: null, strokes: [] };
/** Distance at which a corner of the rectangle is taken hold of, pixels of the page. */
const REACH = { mouse: 12, pen: 16, touch: 26 };
/** Shorter drags draw no rectangle, pixels of the page. */
const SHORT = 6;
/** The way of the keys' cursor, parts of the photograph. */
const STEP = 0.01;
const HINTS = {
  rect: "Drag a rectangle around the object.",
  object: "Paint over what belongs to the object.",
  background: "Paint over what does not belong to it.",
  eraser: "Wipe strokes away.",
};

export class Cutter {
  #library;
  #view = new View($("cut-canvas"));
  #history = new History(EMPTY);
  #photo = null;
  #tool = "rect";
  #done = null;
  /** The sketch that the mask shows, and whether one is being made. */
  #cutOf = null;
  #cutting = false;
  #pointers = new Map();
  #doing = null;
  #anchor = null;
  #began = null;

  constructor(library) {
    this.#library = library;
    this.#listenToPointers($("cut-canvas"));
    this.#listenToTools();
    $("cut-canvas").addEventListener("keydown", (event) => this.#key(event));
    $("cut-canvas").addEventListener("blur", () => this.#showCross(null));
  }

  get isOpen() {
    return this.#done !== null;
  }

  /** Cuts a photograph; true when its mask is new, false when everything stays as it was. */
  open(photo) {
    this.#photo = photo;
    this.#history = new History(photo.sketch ?? EMPTY);
    this.#cutOf = photo.mask ? this.#history.now : null;
    this.#tool = photo.mask ? "object" : "rect";
    $("cut-name").textContent = photo.name;
    document.body.classList.add("cutting");
    this.#view.open(photo);
    this.#view.sketch = this.#history.now;
    this.#warn([]);
    this.#show();
    $("cut-canvas").focus({ preventScroll: true });
    return new Promise((resolve) => (this.#done = resolve));
  }

  /** Takes the last step back, or again. */
  step(by) {
    by < 0 ? this.#history.undo() : this.#history.redo();
    this.#changed();
  }

  #close(isNew) {
    document.body.classList.remove("cutting");
    const done = this.#done;
    this.#done = null;
    done(isNew);
  }

  #accept() {
    this.#library.cutAnew(this.#photo, this.#history.now);
    this.#close(true);
  }

  /** Back to the mask as it was, where there was one. */
  async #cancel() {
    const { sketch } = this.#photo;
    if (sketch && (this.#cutting || this.#cutOf !== sketch)) await attempt(() => this.#library.cut(this.#photo, sketch));
    this.#close(false);
  }

  #change(parts) {
    this.#history.change({ ...this.#history.now, ...parts });
    this.#changed();
  }

  #changed() {
    this.#view.sketch = this.#history.now;
    this.#view.draw();
    this.#show();
    this.#cut();
  }

  /** One mask at a time, always for the newest sketch. */
  async #cut() {
    if (this.#cutting) return;
    this.#cutting = true;
    while (this.isOpen && this.#cutOf !== this.#history.now && isEnough(this.#history.now)) await this.#cutOnce(this.#history.now);
    this.#cutting = false;
    this.#show();
  }

  async #cutOnce(sketch) {
    $("cut-state").textContent = "cutting …";
    try {
      const { warnings, seconds } = await this.#library.cut(this.#photo, sketch);
      this.#warn(warnings);
      $("cut-state").textContent = `${seconds.toFixed(2)} s`;
    } catch (error) {
      this.#photo.mask = null;
      this.#warn([error.message]);
      $("cut-state").textContent = "no mask";
    }
    this.#cutOf = sketch;
    this.#view.setMask(this.#photo.mask);
  }

  #warn(lines) {
    $("cut-warnings").replaceChildren(...lines.map((text) => make("li", { text })));
  }

  #show() {
    const sketch = this.#history.now;
    for (const button of document.querySelectorAll("[data-brush]")) button.setAttribute("aria-pressed", button.dataset.brush === this.#tool);
    $("cut-hint").textContent = HINTS[this.#tool];
    $("cut-undo").disabled = !this.#history.canUndo;
    $("cut-redo").disabled = !this.#history.canRedo;
    $("cut-clear").disabled = !sketch.rect && sketch.strokes.length === 0;
    $("cut-done").disabled = this.#cutting || !this.#photo.mask || this.#cutOf !== sketch;
    $("brush-text").textContent = `${Math.round(2 * this.#radius())} px`;
    $("brush-size").disabled = this.#tool === "rect";
  }

  /** From one pixel to a fifth of the photograph, in equal ratios. */
  #radius() {
    const most = Math.max(this.#photo.width, this.#photo.height) / 10;
    return round(0.5 * (2 * most) ** (Number($("brush-size").value) / 100));
  }

  #take(tool) {
    this.#tool = tool;
    this.#view.brush = null;
    this.#anchor = this.#view.stroke = null;
    this.#view.draw();
    this.#show();
  }

  #listenToTools() {
    for (const button of document.querySelectorAll("[data-brush]")) button.addEventListener("click", () => this.#take(button.dataset.brush));
    $("brush-size").addEventListener("input", () => this.#show());
    $("cut-undo").addEventListener("click", () => this.step(-1));
    $("cut-redo").addEventListener("click", () => this.step(1));
    $("cut-clear").addEventListener("click", () => this.#change(EMPTY));
    $("cut-closer").addEventListener("click", () => this.#view.zoom(1.6));
    $("cut-farther").addEventListener("click", () => this.#view.zoom(1 / 1.6));
    $("cut-fit").addEventListener("click", () => this.#view.fit());
    $("cut-done").addEventListener("click", () => this.#accept());
    $("cut-cancel").addEventListener("click", () => this.#cancel());
  }

  #listenToPointers(canvas) {
    canvas.addEventListener("pointerdown", (event) => this.#down(event));
    canvas.addEventListener("pointermove", (event) => this.#moved(event));
    canvas.addEventListener("pointerup", (event) => this.#up(event));
    canvas.addEventListener("pointercancel", (event) => this.#up(event));
    canvas.addEventListener("pointerleave", () => this.#ring(null));
    canvas.addEventListener("contextmenu", (event) => event.preventDefault());
    canvas.addEventListener("wheel", (event) => {
      event.preventDefault();
      this.#view.zoom(Math.exp(-event.deltaY * (event.deltaMode === 1 ? 0.05 : 0.0015)), event);
    }, { passive: false });
  }

  #down(event) {
    $("cut-canvas").setPointerCapture(event.pointerId);
    this.#pointers.set(event.pointerId, event);
    this.#showCross(null);
    if (this.#pointers.size > 1) {
      // What the first finger began was meant as a pinch.
      this.#view.stroke = this.#view.rect = null;
      this.#doing = "pinch";
      return this.#view.draw();
    }
    this.#began = event;
    if (event.button === 1) this.#doing = "move";
    else if (event.button !== 0) this.#doing = null;
    else if (this.#tool === "rect") this.#beginRect(event);
    else this.#beginStroke(this.#view.place(event));
  }

  #beginRect(event) {
    this.#doing = "rect";
    const at = this.#view.place(event);
    const { rect } = this.#history.now;
    const reach = this.#view.length(REACH[event.pointerType] ?? REACH.mouse);
    const near = rect ? corners(rect).findIndex(([x, y]) => Math.hypot(x - at[0], y - at[1]) < reach) : -1;
    this.#anchor = near >= 0 ? corners(rect)[(near + 2) % 4] : at;
  }

  #beginStroke(at) {
    this.#doing = "draw";
    this.#view.stroke = { brush: this.#tool, radius: this.#radius(), points: [at.map(round)] };
    this.#view.draw();
  }

  #moved(event) {
    if (this.#tool !== "rect" && event.pointerType !== "touch") this.#ring(this.#view.place(event));
    const before = this.#pointers.get(event.pointerId);
    if (!before) return;
    this.#pointers.set(event.pointerId, event);
    if (this.#doing === "move") this.#view.move(event.clientX - before.clientX, event.clientY - before.clientY);
    if (this.#doing === "pinch") this.#pinch(before, event);
    if (this.#doing === "draw") {
      // Between two pictures of the screen the pointer may have moved many times.
      const events = event.getCoalescedEvents?.() ?? [];
      for (const each of events.length > 0 ? events : [event]) this.#extend(this.#view.place(each).map(round));
    }
    if (this.#doing === "rect") this.#view.rect = this.#between(this.#anchor, this.#view.place(event));
    this.#view.draw();
  }

  #extend(point) {
    const { points } = this.#view.stroke;
    const last = points.at(-1);
    if (Math.hypot(point[0] - last[0], point[1] - last[1]) >= Math.max(0.5, this.#view.length(1.5))) points.push(point);
  }

  #pinch(before, event) {
    const other = [...this.#pointers.values()].find(({ pointerId }) => pointerId !== event.pointerId);
    if (!other) return;
    const distance = (a) => Math.max(1, Math.hypot(a.clientX - other.clientX, a.clientY - other.clientY));
    const middle = { clientX: (event.clientX + other.clientX) / 2, clientY: (event.clientY + other.clientY) / 2 };
    this.#view.move((event.clientX - before.clientX) / 2, (event.clientY - before.clientY) / 2);
    this.#view.zoom(distance(event) / distance(before), middle);
  }

  #up(event) {
    if (!this.#pointers.delete(event.pointerId) || this.#pointers.size > 0) return;
    const [doing, { stroke, rect }] = [this.#doing, this.#view];
    this.#doing = this.#view.stroke = this.#view.rect = null;
    if (event.type === "pointerup") {
      const way = Math.hypot(event.clientX - this.#began.clientX, event.clientY - this.#began.clientY);
      if (doing === "draw" && stroke) this.#draw(stroke);
      if (doing === "rect" && way >= SHORT) this.#frame(rect);
    }
    this.#view.draw();
  }

  #draw(stroke) {
    this.#change({ strokes: [...this.#history.now.strokes, stroke] });
  }

  #frame(rect) {
    if (rect && rect[2] > 0 && rect[3] > 0) this.#change({ rect });
  }

  /** The rectangle of whole pixels between two places, inside the photograph. */
  #between(a, b) {
    const { width, height } = this.#photo;
    const side = (p, q, most) => [p, q].map((value) => clamp(Math.round(value), 0, most)).sort((x, y) => x - y);
    const [[left, right], [top, bottom]] = [side(a[0], b[0], width), side(a[1], b[1], height)];
    return [left, top, right - left, bottom - top];
  }

  #ring(at) {
    this.#view.brush = at && this.#tool !== "rect" ? { at, radius: this.#radius() } : null;
    this.#view.draw();
  }

  // Keys: arrows move a cursor, space sets the rectangle's corners, or puts the brush down and lifts it.

  #key(event) {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    const way = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] }[event.key];
    const tool = { r: "rect", o: "object", b: "background", e: "eraser" }[event.key.toLowerCase()];
    if (way) this.#moveCross(way, event.shiftKey ? 5 : 1);
    else if (event.key === " " || event.key === "Enter") this.#press();
    else if (event.key === "+" || event.key === "=") this.#view.zoom(1.3);
    else if (event.key === "-") this.#view.zoom(1 / 1.3);
    else if (event.key === "[" || event.key === "]") this.#resize(event.key === "]" ? 4 : -4);
    else if (event.key === "Escape") this.#lift();
    else if (tool) this.#take(tool);
    else return;
    event.preventDefault();
  }

  #resize(by) {
    $("brush-size").value = Number($("brush-size").value) + by;
    this.#show();
  }

  #moveCross([dx, dy], times) {
    const { width, height } = this.#photo;
    const [x, y] = this.#view.cross ?? [width / 2, height / 2];
    const step = STEP * times * Math.max(width, height);
    this.#showCross([clamp(x + dx * step, 0, width), clamp(y + dy * step, 0, height)]);
    if (this.#view.stroke) this.#view.stroke.points.push(this.#view.cross.map(round));
    if (this.#anchor && this.#tool === "rect") this.#view.rect = this.#between(this.#anchor, this.#view.cross);
    this.#view.draw();
  }

  #showCross(at) {
    if (!at) this.#lift();
    this.#view.cross = at;
    this.#view.brush = at && this.#tool !== "rect" ? { at, radius: this.#radius() } : null;
    this.#view.draw();
  }

  /** What was begun by keys and not ended. */
  #lift() {
    this.#anchor = this.#view.stroke = this.#view.rect = null;
    this.#view.draw();
  }

  #press() {
    const { cross, stroke, rect } = this.#view;
    if (!cross) return this.#moveCross([0, 0], 0);
    if (this.#tool !== "rect" && !stroke) return this.#beginStroke(cross);
    if (this.#tool === "rect" && !this.#anchor) {
      this.#anchor = cross;
      return undefined;
    }
    this.#lift();
    if (stroke) this.#draw(stroke);
    else this.#frame(rect);
    return undefined;
  }
}

/** Whether there is anything by which an object can be found. */
const isEnough = ({ rect, strokes }) => rect !== null || strokes.some(({ brush }) => brush === "object");

/** A hundredth of a pixel is enough. */
const round = (value) => Math.round(value * 100) / 100;
