// The stage: objects are selected and dragged by one pointer, sized and turned by two, by the wheel or by keys. Without an
// object, a panorama is turned.

import { $, clamp } from "./dom.js";
import { attempt } from "./notices.js";
import { duplicated, removed, reordered } from "./scene.js";

/** A pointer this near to an object's box still selects it, pixels of the page. */
const SLACK = { mouse: 4, pen: 12, touch: 24 };
const LEAST_HEIGHT = 0.02;
const MOST_HEIGHT = 2;
/** Steps of the keys: parts of the picture, ratio, degrees. */
const STEP = 0.01;
const RATIO = 1.05;
const TURN = 5;

export class Stage {
  #work;
  #rendering;
  #pointers = new Map();
  /** What the pointers do: "drag", "pinch", "turn" or nothing, and the change of the scene that this is. */
  #doing = null;
  #gesture = 0;

  constructor(work, rendering) {
    this.#work = work;
    this.#rendering = rendering;
    const stage = $("picture");
    stage.addEventListener("pointerdown", (event) => this.#down(event));
    stage.addEventListener("pointermove", (event) => this.#moved(event));
    for (const end of ["pointerup", "pointercancel"]) stage.addEventListener(end, (event) => this.#up(event));
    stage.addEventListener("wheel", (event) => this.#wheel(event), { passive: false });
    stage.addEventListener("keydown", (event) => this.#key(event));
    stage.addEventListener("contextmenu", (event) => event.preventDefault());
    rendering.addEventListener("picture", () => this.#mark());
    work.addEventListener("selection", () => this.#mark());
  }

  /** One name for all changes of a gesture: they are one step in the history. */
  get #join() {
    return `gesture ${this.#gesture}`;
  }

  #down(event) {
    if (event.button !== 0) return;
    const stage = $("picture");
    stage.setPointerCapture(event.pointerId);
    this.#pointers.set(event.pointerId, event);
    this.#gesture += 1;
    if (this.#pointers.size === 2) {
      this.#doing = "pinch";
      return;
    }
    const key = this.#at(event);
    if (key !== null) this.#work.select(key);
    this.#doing = key !== null ? "drag" : "turn";
  }

  #moved(event) {
    const before = this.#pointers.get(event.pointerId);
    if (!before) return;
    this.#pointers.set(event.pointerId, event);
    const { width, height } = $("picture").getBoundingClientRect();
    const [dx, dy] = [(event.clientX - before.clientX) / width, (event.clientY - before.clientY) / height];
    if (this.#doing === "drag") this.#move(dx, dy);
    if (this.#doing === "turn") this.#turn(dx);
    if (this.#doing === "pinch") this.#pinch(before, event, dx, dy);
  }

  #up(event) {
    this.#pointers.delete(event.pointerId);
    // The finger that stays after a pinch must not move the object.
    this.#doing = null;
  }

  #pinch(before, event, dx, dy) {
    const other = [...this.#pointers.values()].find(({ pointerId }) => pointerId !== event.pointerId);
    const object = this.#work.object;
    if (!other || !object) return;
    const way = (a) => [a.clientX - other.clientX, a.clientY - other.clientY];
    const [from, to] = [way(before), way(event)];
    const factor = Math.max(1, Math.hypot(...to)) / Math.max(1, Math.hypot(...from));
    const angle = ((Math.atan2(from[1], from[0]) - Math.atan2(to[1], to[0])) * 180) / Math.PI;
    const turn = ((angle + 540) % 360) - 180;
    this.#work.changeObject({ ...this.#placed(object, dx / 2, dy / 2), height: sized(object.height * factor), rotation: turned(object.rotation + turn) }, this.#join);
  }

  #move(dx, dy) {
    const object = this.#work.object;
    if (object) this.#work.changeObject(this.#placed(object, dx, dy), this.#join);
  }

  /** Looks around in a panorama; its light turns with it. */
  #turn(dx) {
    const { light, fov, size } = this.#work.scene;
    if (!this.#rendering.turns) return;
    const across = size[0] >= size[1] ? fov : (fov * size[0]) / size[1];
    this.#work.changeLight({ angle: turned(light.angle + dx * across) }, this.#join);
  }

  #placed({ at: [x, y] }, dx, dy) {
    return { at: [clamp(x + dx, 0, 1), clamp(y + dy, 0.02, 1.2)].map(round) };
  }

  #wheel(event) {
    const object = this.#work.object;
    if (!object) return;
    event.preventDefault();
    const way = event.deltaY * (event.deltaMode === 1 ? 16 : 1) + event.deltaX;
    if (event.shiftKey) this.#work.changeObject({ rotation: turned(object.rotation - way * 0.05) }, "wheel");
    else this.#work.changeObject({ height: sized(object.height * Math.exp(-way * 0.001)) }, "wheel");
  }

  #key(event) {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    const change = this.#keys[event.key];
    const object = this.#work.object;
    if (!change || !object) return;
    event.preventDefault();
    change(object, event.shiftKey ? 5 : 1);
  }

  #keys = {
    ArrowLeft: (object, times) => this.#nudge(object, -STEP * times, 0),
    ArrowRight: (object, times) => this.#nudge(object, STEP * times, 0),
    ArrowUp: (object, times) => this.#nudge(object, 0, -STEP * times),
    ArrowDown: (object, times) => this.#nudge(object, 0, STEP * times),
    "+": (object) => this.#byKey({ height: sized(object.height * RATIO) }),
    "=": (object) => this.#byKey({ height: sized(object.height * RATIO) }),
    "-": (object) => this.#byKey({ height: sized(object.height / RATIO) }),
    "[": (object) => this.#byKey({ rotation: turned(object.rotation + TURN) }),
    "]": (object) => this.#byKey({ rotation: turned(object.rotation - TURN) }),
    PageUp: ({ key }) => this.#work.change(reordered(this.#work.scene, key, 1)),
    PageDown: ({ key }) => this.#work.change(reordered(this.#work.scene, key, -1)),
    Delete: ({ key }) => this.#work.change(removed(this.#work.scene, key)),
    Backspace: ({ key }) => this.#work.change(removed(this.#work.scene, key)),
    d: ({ key }) => attempt(() => this.#work.add(duplicated(this.#work.scene, key))),
    n: ({ key }) => this.#next(key),
  };

  #nudge(object, dx, dy) {
    this.#byKey(this.#placed(object, dx, dy));
  }

  #byKey(parts) {
    this.#work.changeObject(parts, "keys");
  }

  #next(key) {
    const { objects } = this.#work.scene;
    const at = objects.findIndex((object) => object.key === key);
    this.#work.select(objects[(at + 1) % objects.length].key);
  }

  /** The object under a pointer: the foremost, or the one whose box is near. */
  #at(event) {
    const box = $("picture").getBoundingClientRect();
    const scale = this.#rendering.width / box.width;
    const [x, y] = [(event.clientX - box.left) * scale, (event.clientY - box.top) * scale];
    const slack = (SLACK[event.pointerType] ?? SLACK.mouse) * scale;
    const boxes = this.#rendering.boxes.toReversed();
    const under = (room) => boxes.find(({ box: [left, top, w, h] }) => x > left - room && x < left + w + room && y > top - room && y < top + h + room);
    return (under(0) ?? under(slack))?.key ?? null;
  }

  /** The frame around the selected object. */
  #mark() {
    const mark = $("selection");
    const found = this.#rendering.boxes.find(({ key }) => key === this.#work.selected);
    mark.hidden = !found;
    if (!found) return;
    const { width, height } = this.#rendering;
    const [x, y, w, h] = found.box;
    Object.assign(mark.style, { left: `${(100 * x) / width}%`, top: `${(100 * y) / height}%`, width: `${(100 * w) / width}%`, height: `${(100 * h) / height}%` });
  }
}

const sized = (height) => round(clamp(height, LEAST_HEIGHT, MOST_HEIGHT));
const turned = (degrees) => round(((((degrees + 180) % 360) + 360) % 360) - 180);
const round = (value) => Math.round(value * 1e4) / 1e4;
