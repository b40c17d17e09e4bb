// The work: the scene with its history, and which of its objects is selected. All views listen to it.

import { History } from "./history.js";
import { changed, find } from "./scene.js";

/** Events: "scene" (the scene changed), "selection". */
export class Work extends EventTarget {
  selected = null;

  #history;
  #kept;

  constructor(scene) {
    super();
    this.#history = new History(scene);
    this.#kept = scene;
  }

  get scene() {
    return this.#history.now;
  }

  get object() {
    return find(this.scene, this.selected) ?? null;
  }

  get canUndo() {
    return this.#history.canUndo;
  }

  get canRedo() {
    return this.#history.canRedo;
  }

  /** Whether there are unsaved changes. */
  get unsaved() {
    return this.scene !== this.#kept && this.scene.objects.length > 0;
  }

  /** Marks the scene as saved. */
  kept(scene) {
    this.#kept = scene;
  }

  /** The engine's numbers of all objects in the history. */
  get reachable() {
    return new Set(this.#history.states.flatMap((scene) => scene.objects.map(({ object }) => object)));
  }

  change(scene, join) {
    if (scene === this.scene) return;
    this.#history.change(scene, join);
    this.#tell();
  }

  /** Changes to a scene with a new object, which is selected. */
  add(scene) {
    this.change(scene);
    this.select(scene.objects.at(-1).key);
  }

  changeScene(parts, join) {
    this.change({ ...this.scene, ...parts }, join);
  }

  changeLight(parts, join) {
    this.changeScene({ light: { ...this.scene.light, ...parts } }, join);
  }

  /** Changes the selected object. */
  changeObject(parts, join) {
    if (this.object) this.change(changed(this.scene, this.selected, parts), join);
  }

  select(key) {
    if (key === this.selected) return;
    this.selected = key;
    this.dispatchEvent(new Event("selection"));
  }

  undo() {
    this.#history.undo();
    this.#tell();
  }

  redo() {
    this.#history.redo();
    this.#tell();
  }

  #tell() {
    if (!find(this.scene, this.selected)) this.selected = this.scene.objects.at(-1)?.key ?? null;
    this.dispatchEvent(new Event("scene"));
    this.dispatchEvent(new Event("selection"));
  }
}
