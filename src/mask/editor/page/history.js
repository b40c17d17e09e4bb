// What was drawn, with every earlier state of it: a sketch is never changed, only replaced.

export class History {
  #sketches;
  #at = 0;

  constructor(sketch) {
    this.#sketches = [sketch];
  }

  /** The sketch as it is. */
  get now() {
    return this.#sketches[this.#at];
  }

  get canUndo() {
    return this.#at > 0;
  }

  get canRedo() {
    return this.#at + 1 < this.#sketches.length;
  }

  /** Replaces parts of the sketch; what was undone is gone. */
  change(parts) {
    this.#sketches.length = this.#at + 1;
    this.#sketches.push({ ...this.now, ...parts });
    this.#at += 1;
  }

  undo() {
    if (this.canUndo) this.#at -= 1;
  }

  redo() {
    if (this.canRedo) this.#at += 1;
  }
}

/** Whether there is anything by which an object can be found. */
export function isEnough(sketch, hasSeeds) {
  return sketch.auto || hasSeeds || sketch.rect !== null || sketch.strokes.some(({ brush }) => brush === "object");
}
