// Cuts an object out of its photograph by a sketch; the mask follows.

import { $, make, pixels } from "./dom.js";
import { attempt } from "./notices.js";
import { EMPTY, isEnough, Sketcher } from "./sketcher.js";

const HINTS = {
  rect: "Draw a box around the object.",
  object: "Paint over what belongs to the object.",
  background: "Paint over what does not belong to the object.",
  eraser: "Erase strokes.",
};
const FOUND = "Found by its plain background. If it is wrong, correct it with a brush, or drag a rectangle.";
/** The sketch of a photograph whose plain background shows the object. */
const BY_BACKGROUND = { ...EMPTY, auto: true };
const OUTSIDE = [12, 12, 16, 170];
const EDGE = [255, 214, 120, 255];

export class Cutter {
  #library;
  #sketcher = new Sketcher($("cut-canvas"));
  #photo = null;
  #done = null;
  /** The sketch of the current mask, and whether one is being made. */
  #cutOf = null;
  #cutting = false;

  constructor(library) {
    this.#library = library;
    this.#sketcher.addEventListener("sketch", () => this.#cut());
    this.#sketcher.addEventListener("tool", () => this.#show());
    $("cut-canvas").addEventListener("keydown", (event) => this.#key(event));
    $("cut-done").addEventListener("click", () => this.#accept());
    $("cut-cancel").addEventListener("click", () => this.#cancel());
  }

  get isOpen() {
    return this.#done !== null;
  }

  /** Cuts a photograph; true when its mask is new, false when everything stays as it was. */
  async open(photo) {
    const found = photo.mask || photo.sketch ? null : await this.#find(photo);
    return this.#draw(photo, photo.sketch ?? found ?? EMPTY);
  }

  /** The sketch of a photograph that needs no strokes; null if the user has to mark the object. */
  async #find(photo) {
    try {
      await this.#library.cut(photo, BY_BACKGROUND);
      return BY_BACKGROUND;
    } catch {
      return null;
    }
  }

  #draw(photo, sketch) {
    this.#photo = photo;
    $("cut-name").textContent = photo.name;
    document.body.classList.add("cutting");
    this.#sketcher.open(photo, sketch, photo.sketch ? "object" : "rect");
    this.#cutOf = photo.mask ? this.#sketcher.sketch : null;
    this.#showMask();
    this.#warn([]);
    this.#show();
    $("cut-canvas").focus({ preventScroll: true });
    return new Promise((resolve) => (this.#done = resolve));
  }

  /** Undoes or redoes the last step. */
  step(by) {
    this.#sketcher.step(by);
  }

  #close(isNew) {
    document.body.classList.remove("cutting");
    const done = this.#done;
    this.#done = null;
    done(isNew);
  }

  #accept() {
    this.#library.cutAnew(this.#photo, this.#sketcher.sketch);
    this.#close(true);
  }

  /** Restores the earlier mask, if there was one. */
  async #cancel() {
    const { sketch } = this.#photo;
    if (sketch && (this.#cutting || this.#cutOf !== sketch)) await attempt(() => this.#library.cut(this.#photo, sketch));
    this.#close(false);
  }

  /** One mask at a time, always for the newest sketch. */
  async #cut() {
    this.#show();
    if (this.#cutting) return;
    this.#cutting = true;
    while (this.isOpen && this.#cutOf !== this.#sketcher.sketch && canCut(this.#sketcher.sketch)) await this.#cutOnce(this.#sketcher.sketch);
    this.#cutting = false;
    this.#show();
  }

  async #cutOnce(sketch) {
    $("cut-state").textContent = "making the mask …";
    try {
      const { warnings, seconds } = await this.#library.cut(this.#photo, sketch);
      this.#warn(warnings);
      $("cut-state").textContent = `mask made in ${seconds.toFixed(1)} s`;
    } catch (error) {
      this.#photo.mask = null;
      this.#warn([error.message]);
      $("cut-state").textContent = "no mask";
    }
    this.#cutOf = sketch;
    this.#showMask();
  }

  #warn(lines) {
    $("cut-warnings").replaceChildren(...lines.map((text) => make("li", { text })));
  }

  #show() {
    const { auto, rect, strokes } = this.#sketcher.sketch;
    $("cut-hint").textContent = auto && !rect && strokes.length === 0 ? FOUND : HINTS[this.#sketcher.tool];
    $("cut-done").disabled = this.#cutting || !this.#photo.mask || this.#cutOf !== this.#sketcher.sketch;
  }

  #showMask() {
    const cover = this.#photo.mask && overlay(this.#photo);
    this.#sketcher.view.setMask(cover && ((context) => context.drawImage(cover, 0, 0)));
  }

  #key(event) {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    if (this.#sketcher.cursorKey(event) || this.#sketcher.toolKey(event)) event.preventDefault();
  }
}

const canCut = (sketch) => sketch.auto || isEnough(sketch);

/** Dark outside of the mask, and a line at its edge. */
function overlay({ mask, width, height }) {
  const rgba = new Uint8Array(4 * mask.length);
  const inside = (at) => mask[at] >= 128;
  for (let y = 0, at = 0; y < height; y++) {
    for (let x = 0; x < width; x++, at++) {
      if (inside(at)) continue;
      const edge = (x > 0 && inside(at - 1)) || (x + 1 < width && inside(at + 1)) || (y > 0 && inside(at - width)) || (y + 1 < height && inside(at + width));
      rgba.set(edge ? EDGE : OUTSIDE, 4 * at);
    }
  }
  const canvas = new OffscreenCanvas(width, height);
  canvas.getContext("2d").putImageData(pixels(rgba, width, height), 0, 0);
  return canvas;
}
