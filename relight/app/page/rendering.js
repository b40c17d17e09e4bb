// The picture of the stage: requests layers from the engine, one request at a time and always for the newest scene. While something
// changes, the picture is small; at rest it is sharp. If only placements change, the current layers are moved.

import { clamp } from "./dom.js";
import { forEngine, lookOf } from "./scene.js";

/** The longer side of a picture while something changes, pixels. */
const DRAFT = 512;
const LEAST_DRAFT = 256;
/** Drafts that take longer are made smaller, milliseconds. */
const PATIENCE = 60;
/** Rest before new layers are made for new placements, and before a picture is made sharp, milliseconds. */
const PLACED = 150;
const STILL = 300;
const SHARPEST = 1280;

/** Events: "picture" (a new one is shown), "state" (at rest or not), "problem" (detail: a sentence). */
export class Rendering extends EventTarget {
  /** Where the objects stand in the picture that is shown: [{ key, box }], from back to front. */
  boxes = [];
  /** The engine's notes on the picture. */
  notes = [];
  width = 4;
  height = 3;

  #library;
  #work;
  #painter;
  #canvas;
  #draft = DRAFT;
  #changed = 0;
  #timer = 0;
  #running = false;
  /** The newest layers: { scene, look, sharp, layers }. */
  #shown = null;
  /** The newest picture of the objects as they were photographed: { scene, picture }. */
  #before = null;
  #wantsBefore = false;

  constructor(library, work, painter, canvas) {
    super();
    [this.#library, this.#work, this.#painter, this.#canvas] = [library, work, painter, canvas];
    work.addEventListener("scene", () => this.#sceneChanged());
    canvas.addEventListener("empty", () => this.refresh());
  }

  /** Makes the picture again, although the scene is the same. */
  refresh() {
    this.#shown = this.#before = null;
    this.#sceneChanged();
  }

  /** Shows the objects as they were photographed, or in the scene's light. */
  showBefore(before) {
    this.#wantsBefore = before;
    this.#show();
    this.#plan();
  }

  #sceneChanged() {
    this.#changed = performance.now();
    if (!this.#wantsBefore) this.#paint();
    this.#plan();
  }

  /** Whether the picture is that of the scene, in full sharpness. */
  get rests() {
    return !this.#running && this.#next() === null;
  }

  #plan() {
    clearTimeout(this.#timer);
    this.dispatchEvent(new Event("state"));
    if (this.#running) return;
    const next = this.#next();
    if (next) this.#timer = setTimeout(() => this.#make(next.sharp), Math.max(0, next.at - performance.now()));
  }

  /** What to make next, and when. */
  #next() {
    const { scene } = this.#work;
    if (this.#wantsBefore) return this.#before?.scene === scene ? null : { sharp: true, at: 0 };
    if (this.#shown?.scene === scene) return this.#shown.sharp ? null : { sharp: true, at: this.#changed + STILL };
    const moved = this.#painter.layered && this.#shown?.look === lookOf(scene);
    return moved ? { sharp: true, at: this.#changed + PLACED } : { sharp: false, at: 0 };
  }

  async #make(sharp) {
    this.#running = true;
    const { scene } = this.#work;
    try {
      if (this.#wantsBefore) await this.#makeBefore(scene);
      else await this.#makeLayers(scene, sharp);
    } catch (error) {
      this.#shown = { scene, look: lookOf(scene), sharp: true, layers: null };
      this.#before = { scene, picture: null };
      this.dispatchEvent(new CustomEvent("problem", { detail: error.message }));
    }
    this.#running = false;
    this.#plan();
  }

  async #makeBefore(scene) {
    const fields = { scene: forEngine(scene), longest: this.#sharpest(), before: true };
    const picture = await this.#library.askBefore(scene.background, "render", fields);
    this.#before = { scene, picture };
    if (this.#wantsBefore) this.#show();
  }

  async #makeLayers(scene, sharp) {
    const began = performance.now();
    const longest = sharp ? this.#sharpest() : this.#draft;
    const [op, more] = this.#painter.layered ? ["layers", {}] : ["render", { before: false }];
    const layers = await this.#library.askBefore(scene.background, op, { scene: forEngine(scene), longest, ...more });
    if (!sharp) this.#learn(performance.now() - began);
    this.#shown = { scene, look: lookOf(scene), sharp, layers };
    if (!this.#wantsBefore) this.#show();
  }

  /** Shows the current layers, or the picture from before, if it is the scene's. */
  #show() {
    const { scene, picture } = this.#wantsBefore ? this.#before ?? {} : { scene: this.#shown?.scene, picture: this.#shown?.layers };
    if (!picture || (this.#wantsBefore && scene !== this.#work.scene)) return;
    if (this.#wantsBefore || !this.#painter.layered) this.#painter.show(picture);
    else this.#painter.load(picture);
    this.#tell(picture, scene);
    if (!this.#wantsBefore) this.#paint();
  }

  /** Smaller drafts if they take long, larger ones if not. */
  #learn(took) {
    const factor = clamp(Math.sqrt(PATIENCE / took), 0.8, 1.1);
    this.#draft = Math.round(clamp(this.#draft * factor, LEAST_DRAFT, DRAFT));
  }

  #sharpest() {
    const { width, height } = this.#canvas.getBoundingClientRect();
    return Math.round(clamp(Math.max(width, height) * devicePixelRatio, DRAFT, SHARPEST));
  }

  #tell({ width, height, objects, notes }, scene) {
    [this.width, this.height, this.notes] = [width, height, notes ?? []];
    this.boxes = scene.objects.map(({ key }, index) => ({ key, box: boxOf(objects[index]) }));
    this.dispatchEvent(new Event("picture"));
  }

  /** Paints the current layers in the scene's placement. */
  #paint() {
    if (!this.#painter.layered || !this.#shown?.layers) return;
    const { scene, layers } = this.#shown;
    const { width, height } = layers;
    const moves = [];
    this.boxes = [];
    for (const object of this.#work.scene.objects) {
      const layer = scene.objects.findIndex(({ key }) => key === object.key);
      if (layer < 0) continue;
      const move = moveOf(scene.objects[layer], object, width, height);
      moves.push({ layer, ...move });
      this.boxes.push({ key: object.key, box: movedBox(boxOf(layers.objects[layer]), move) });
    }
    this.#painter.paint(moves);
    this.dispatchEvent(new Event("picture"));
  }
}

const boxOf = ({ box, place, width, height }) => box ?? [...place, width, height];

/** The transformation of an object's layer from where it was made to its new place, pixels. */
function moveOf(from, to, width, height) {
  const foot = [from.at[0] * width, from.at[1] * height];
  const [dx, dy] = [to.at[0] * width - foot[0], to.at[1] * height - foot[1]];
  return { foot, dx, dy, scale: to.height / from.height, turn: to.rotation - from.rotation };
}

function movedBox([x, y, w, h], { foot, dx, dy, scale }) {
  return [foot[0] + dx + (x - foot[0]) * scale, foot[1] + dy + (y - foot[1]) * scale, w * scale, h * scale];
}
