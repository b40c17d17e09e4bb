// The page's record of the engine's photographs and backgrounds: names, pictures, masks and strokes.

import { canvasOf } from "./dom.js";
import { openable, asPixels } from "./files.js";

/** The longer side of a small picture in a list, pixels. */
const SMALL = 112;
/** A new object's height, and its largest part of the picture's width. */
const TALL = 0.5;
const WIDE = 0.6;
/** The largest enlargement of a new object. */
const ENLARGED = 16;

export class Library {
  /** Photographs by the engine's number: { object, name, kind, width, height, picture, mask, sketch, small, layers }. */
  photos = new Map();
  /** Backgrounds by the page's key: { key, name, kind, fields, parts, width, height, small }. */
  backgrounds = new Map();

  #engine;
  #number = 0;
  /** The engine's background. */
  #background = null;
  /** Resolves with the last request that uses the engine's background. */
  #asked = Promise.resolve();

  constructor(engine) {
    this.#engine = engine;
  }

  /** Opens a file as a photograph of an object. */
  async open(file) {
    const object = ++this.#number;
    const answer = await this.#ask(file, (name, parts) => this.#engine.ask("open_photo", { object, name }, parts),
      (fields, parts) => this.#engine.ask("open_pixels", { object, ...fields }, parts));
    const photo = { ...answer, object, name: file.name, sketch: null, layers: null };
    this.#take(photo, answer.parts);
    return photo;
  }

  /** Cuts a photograph by a sketch: { rect, strokes }, and auto where its plain background may show the object. */
  async cut(photo, { rect, strokes, auto = false }) {
    const answer = await this.#engine.ask("mask", { object: photo.object, rect, auto, strokes });
    photo.mask = answer.parts[0];
    return answer;
  }

  /** Decomposes a photograph, if that is not yet done. */
  async decompose(photo) {
    if (photo.layers) return photo.layers;
    const { parts, width, height, ...answer } = await this.#engine.ask("decompose", { object: photo.object });
    const bounds = boundsOf(photo).map((part, side) => (side % 2 ? (part * height) / photo.height : (part * width) / photo.width));
    photo.layers = { ...answer, pictures: parts.map((part) => cropped(canvasOf(part, width, height), bounds)) };
    return photo.layers;
  }

  /** Drops results of an older mask; lists show the new one. */
  cutAnew(photo, sketch) {
    Object.assign(photo, { sketch, layers: null, masked: true, small: smallOf(photo) });
  }

  /** Frees photographs that no scene uses any more. */
  async closeAllBut(reachable) {
    for (const object of [...this.photos.keys()]) {
      if (reachable.has(object)) continue;
      this.photos.delete(object);
      await this.#engine.ask("close", { object });
    }
  }

  /** Opens a file as a background, "photo" or "panorama_file", by a name for people. */
  async openBackground(file, kind, name = file.name) {
    let [fields, parts] = [{ kind, name: file.name }, [file]];
    const key = `background ${++this.#number}`;
    const answer = await this.#inTurn(async () => {
      const opened = await this.#ask(file, (_, bytes) => this.#engine.ask("background", { kind, name: file.name }, (parts = bytes)),
        (read, bytes) => this.#engine.ask("background", (fields = { kind: pixelKind(kind), ...read }), (parts = bytes)));
      this.#background = key;
      return opened;
    });
    const { width, height } = answer;
    const background = { key, name, kind, fields, parts, width, height, small: canvasOf(answer.parts[0], 96, 48) };
    this.backgrounds.set(key, background);
    return background;
  }

  /** Sends a request for a scene, with that scene's background in the engine. */
  askBefore(key, op, fields) {
    return this.#inTurn(async () => {
      if (this.#background !== key) {
        const { fields: chosen, parts } = this.backgrounds.get(key);
        await this.#engine.ask("background", chosen, parts);
        this.#background = key;
      }
      return this.#engine.ask(op, fields);
    });
  }

  /** Runs an action after all earlier ones. */
  #inTurn(work) {
    const done = this.#asked.then(work);
    this.#asked = done.catch(() => {});
    return done;
  }

  #take(photo, [picture, mask]) {
    photo.picture = canvasOf(picture, photo.width, photo.height);
    photo.mask = mask ?? null;
    photo.small = smallOf(photo);
    this.photos.set(photo.object, photo);
  }

  /** Gives a file to the engine as it is; as pixels, if only the browser can read it. */
  async #ask(file, asFile, asRead) {
    const known = await openable(file);
    if (known) return asFile(file.name, [file]);
    const { fields, rgba } = await asPixels(file);
    return asRead(fields, [rgba]);
  }
}

/** The place of a new object: high, but not too wide, and next to the others. */
export function placeFor(photo, scene) {
  const [, , w, h] = boundsOf(photo);
  const [width, height] = scene.size;
  const beside = [0.5, 0.28, 0.72, 0.4, 0.6][scene.objects.length % 5];
  return { at: [beside, 0.9], height: Math.min(TALL, (WIDE * width * h) / (w * height), (ENLARGED * h) / height) };
}

/** The bounding box of a photograph's mask. */
export function boundsOf({ mask, width, height }) {
  if (!mask) return [0, 0, width, height];
  let [left, top, right, bottom] = [width, height, -1, -1];
  for (let y = 0, at = 0; y < height; y++) {
    for (let x = 0; x < width; x++, at++) {
      if (mask[at] < 128) continue;
      left = Math.min(left, x);
      right = Math.max(right, x);
      top = Math.min(top, y);
      bottom = y;
    }
  }
  return right < 0 ? [0, 0, width, height] : [left, top, right - left + 1, bottom - top + 1];
}

/** A small picture of the object alone. */
function smallOf(photo) {
  const [x, y, w, h] = boundsOf(photo);
  const scale = SMALL / Math.max(w, h);
  const [width, height] = [w, h].map((side) => Math.max(1, Math.round(side * scale)));
  const small = new OffscreenCanvas(width, height);
  const context = small.getContext("2d");
  context.drawImage(photo.picture, x, y, w, h, 0, 0, width, height);
  if (photo.mask) {
    context.globalCompositeOperation = "destination-in";
    context.drawImage(maskCanvas(photo), x, y, w, h, 0, 0, width, height);
  }
  return small;
}

/** The part of a picture in a rectangle. */
function cropped(picture, [x, y, w, h]) {
  const part = new OffscreenCanvas(Math.max(1, Math.round(w)), Math.max(1, Math.round(h)));
  part.getContext("2d").drawImage(picture, x, y, w, h, 0, 0, part.width, part.height);
  return part;
}

/** The mask as a canvas that is opaque on the object. */
function maskCanvas({ mask, width, height }) {
  const rgba = new Uint8ClampedArray(4 * mask.length);
  mask.forEach((value, index) => (rgba[4 * index + 3] = value));
  const canvas = new OffscreenCanvas(width, height);
  canvas.getContext("2d").putImageData(new ImageData(rgba, width, height), 0, 0);
  return canvas;
}

const pixelKind = (kind) => (kind === "photo" ? "photo_pixels" : kind);
