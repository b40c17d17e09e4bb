// States of something, with every earlier one: a state is never changed, only replaced.

/** As many states can be taken back. */
const MOST = 100;
/** Changes of one kind within this time are one step, milliseconds. */
const TOGETHER = 1200;

export class History {
  #states;
  #at = 0;
  #join = null;
  #when = 0;

  constructor(state) {
    this.#states = [state];
  }

  get now() {
    return this.#states[this.#at];
  }

  get canUndo() {
    return this.#at > 0;
  }

  get canRedo() {
    return this.#at + 1 < this.#states.length;
  }

  /** Every state that can be come back to. */
  get states() {
    return this.#states;
  }

  /** Goes on to a state; what was undone is gone. Changes with the same `join` in quick succession are one step. */
  change(state, join = null) {
    const now = performance.now();
    const joined = join !== null && join === this.#join && now - this.#when < TOGETHER;
    this.#states.length = this.#at + 1;
    if (joined && this.#at > 0) this.#states.pop();
    this.#states.push(state);
    if (this.#states.length > MOST) this.#states.shift();
    this.#at = this.#states.length - 1;
    [this.#join, this.#when] = [join, now];
  }

  undo() {
    if (this.canUndo) this.#at -= 1;
    this.#join = null;
  }

  redo() {
    if (this.canRedo) this.#at += 1;
    this.#join = null;
  }
}
