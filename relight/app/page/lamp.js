// The lamp: dragged on a dial of the sky, seen from above, and on the picture, around the selected object.

import { $, clamp } from "./dom.js";
import { lampAt, lampAzimuth } from "./scene.js";

/** The lamp's distance from the object on the picture, in parts of the picture's shorter side. */
const REACH = 0.42;
const RADIANS = Math.PI / 180;

export class Lamp {
  #work;
  #rendering;

  constructor(work, rendering) {
    this.#work = work;
    this.#rendering = rendering;
    drag($("dial"), (event) => this.#onDial(event));
    drag($("lamp"), (event) => this.#onPicture(event));
    work.addEventListener("scene", () => this.#show());
    work.addEventListener("selection", () => this.#show());
    rendering.addEventListener("picture", () => this.#show());
  }

  /** The centre of the dial is the zenith, its edge the horizon, its lower end the viewer's side. */
  #onDial(event) {
    const box = $("dial").getBoundingClientRect();
    const [x, y] = [(2 * (event.clientX - box.left)) / box.width - 1, (2 * (event.clientY - box.top)) / box.height - 1];
    const elevation = 90 * (1 - Math.min(1, Math.hypot(x, y)));
    this.#turn(Math.atan2(x, y) / RADIANS, elevation);
  }

  /** The lamp stays on its side of the object, in front or behind. */
  #onPicture(event) {
    const [x, y] = this.#aroundObject(event);
    const far = Math.hypot(x, y);
    const [right, up] = far > 1 ? [x / far, y / far] : [x, y];
    const front = Math.sqrt(Math.max(0, 1 - right * right - up * up)) * (this.#isBehind ? -1 : 1);
    this.#turn(Math.atan2(right, front) / RADIANS, Math.asin(clamp(up, -1, 1)) / RADIANS);
  }

  #turn(azimuth, elevation) {
    this.#work.changeLight({ kind: "lamp", ...lampAt(azimuth, this.#work.scene.light), elevation: Math.round(elevation) }, "lamp");
  }

  get #isBehind() {
    return Math.cos(lampAzimuth(this.#work.scene.light) * RADIANS) < -1e-6;
  }

  /** The pointer's position from the object's centre: to the right and up, 1 at the lamp's distance. */
  #aroundObject(event) {
    const box = $("picture").getBoundingClientRect();
    const scale = this.#rendering.width / box.width;
    const [x, y] = this.#middle();
    const reach = this.#reach();
    return [((event.clientX - box.left) * scale - x) / reach, (y - (event.clientY - box.top) * scale) / reach];
  }

  #reach() {
    return REACH * Math.min(this.#rendering.width, this.#rendering.height);
  }

  /** The centre of the selected object, or of the picture, in pixels; inside the picture, so that the lamp can be reached. */
  #middle() {
    const { width, height, boxes } = this.#rendering;
    const [x, y, w, h] = boxes.find(({ key }) => key === this.#work.selected)?.box ?? [0, 0, width, height];
    return [clamp(x + w / 2, 0.25 * width, 0.75 * width), clamp(y + h / 2, 0.4 * height, 0.6 * height)];
  }

  #show() {
    const { light } = this.#work.scene;
    const { kind, elevation, colour } = light;
    const azimuth = lampAzimuth(light);
    const [sin, cos] = [Math.sin(azimuth * RADIANS), Math.cos(azimuth * RADIANS)];
    const radius = 50 * (1 - clamp(elevation, 0, 90) / 90);
    place($("dial-lamp"), 50 + radius * sin, 50 + radius * cos, colour);
    $("dial-lamp").classList.toggle("below", elevation < 0);

    const flat = Math.cos(elevation * RADIANS);
    const [x, y] = this.#middle();
    const { width, height } = this.#rendering;
    const [left, top] = [x + this.#reach() * sin * flat, y - this.#reach() * Math.sin(elevation * RADIANS)];
    place($("lamp"), clamp((100 * left) / width, 4, 96), clamp((100 * top) / height, 5, 95), colour);
    $("lamp").classList.toggle("behind", cos < -1e-6);
    $("frame").classList.toggle("lit", kind === "lamp");
  }
}

function place(element, left, top, colour) {
  Object.assign(element.style, { left: `${left}%`, top: `${top}%` });
  element.style.setProperty("--colour", colour);
}

function drag(element, to) {
  element.addEventListener("pointerdown", (event) => {
    if (event.button !== 0) return;
    event.preventDefault();
    element.setPointerCapture(event.pointerId);
    to(event);
  });
  element.addEventListener("pointermove", (event) => {
    if (element.hasPointerCapture(event.pointerId)) to(event);
  });
}
