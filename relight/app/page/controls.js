// Sliders, switches and colours: each shows a value of the scene, its light or the selected object, and changes it.

import { $ } from "./dom.js";
import { lampAt, lampAzimuth } from "./scene.js";

const degrees = (value) => `${Math.round(value)}°`;
const percent = (value) => `${Math.round(100 * value)} %`;
const stops = (value) => `${value > 0 ? "+" : ""}${value.toFixed(1)}`;
const NO_GLOSS = [0.3, 60];

/** Controls by id: the owner of the value, how to read it, what a new value changes, and how to display it. */
const CONTROLS = {
  "height": { of: "object", read: ({ height }) => height, write: (height) => ({ height }), text: percent },
  "rotation": { of: "object", read: ({ rotation }) => rotation, write: (rotation) => ({ rotation }), text: degrees },
  "tint": { of: "object", read: ({ tint }) => hexOf(tint), write: (hex) => ({ tint: linearOf(hex) }) },
  "glossy": { of: "object", read: ({ gloss }) => gloss !== null, write: (on) => ({ gloss: on ? NO_GLOSS : null }) },
  "gloss": { of: "object", read: ({ gloss }) => (gloss ?? NO_GLOSS)[0], write: (part, { gloss }) => ({ gloss: [part, gloss[1]] }), text: percent },
  "smoothness": { of: "object", read: ({ gloss }) => (gloss ?? NO_GLOSS)[1], write: (smooth, { gloss }) => ({ gloss: [gloss[0], smooth] }), text: String },
  "exposure": { of: "object", read: ({ exposure }) => exposure, write: (exposure) => ({ exposure }), text: stops },
  "shadow": { of: "object", read: ({ shadow }) => shadow, write: (shadow) => ({ shadow }), text: percent },
  "fov": { of: "scene", read: ({ fov }) => fov, write: (fov) => ({ fov }), text: degrees },
  "down": { of: "scene", read: ({ down }) => down, write: (down) => ({ down }), text: degrees },
  "scene-exposure": { of: "scene", read: ({ exposure }) => exposure, write: (exposure) => ({ exposure }), text: stops },
  "match": { of: "scene", read: ({ match }) => match, write: (match) => ({ match }) },
  "balance": { of: "scene", read: ({ white_balance }) => white_balance === "auto", write: (auto) => ({ white_balance: auto ? "auto" : "adapted" }) },
  "shape": { of: "scene", read: ({ size }) => size.join("x"), write: (text) => ({ size: text.split("x").map(Number) }) },
  "light-angle": { of: "light", read: ({ angle }) => angle, write: (angle) => ({ angle }), text: degrees },
  "azimuth": { of: "light", read: lampAzimuth, write: lampAt, text: degrees },
  "elevation": { of: "light", read: ({ elevation }) => elevation, write: (elevation) => ({ elevation }), text: degrees },
  "colour": { of: "light", read: ({ colour }) => colour, write: (colour) => ({ colour }) },
  "size": { of: "light", read: ({ size }) => size, write: (size) => ({ size }), text: degrees },
  "ambient": { of: "light", read: ({ ambient }) => ambient, write: (ambient) => ({ ambient }), text: percent },
};

/** Binds all controls to the work, both ways. */
export function bindControls(work) {
  for (const [id, control] of Object.entries(CONTROLS)) {
    $(id).addEventListener("input", () => change(work, control, id));
  }
  $("tint-none").addEventListener("click", () => work.changeObject({ tint: [1, 1, 1] }));
  for (const kind of ["background", "lamp"]) $(`by-${kind}`).addEventListener("change", () => work.changeLight({ kind }));
  const show = () => showAll(work);
  work.addEventListener("scene", show);
  work.addEventListener("selection", show);
  show();
}

function change(work, { of, write }, id) {
  const source = sourceOf(work, of);
  if (!source) return;
  const parts = write(valueOf($(id)), source);
  if (of === "object") work.changeObject(parts, id);
  else if (of === "light") work.changeLight(parts, id);
  else work.changeScene(parts, id);
}

function sourceOf({ scene, object }, of) {
  return { scene, light: scene.light, object }[of];
}

function valueOf(input) {
  if (input.type === "checkbox") return input.checked;
  return input.type === "range" ? Number(input.value) : input.value;
}

function showAll(work) {
  for (const [id, { of, read, text }] of Object.entries(CONTROLS)) {
    const source = sourceOf(work, of);
    if (source) showValue($(id), read(source), text);
  }
  const { light } = work.scene;
  for (const kind of ["background", "lamp"]) $(`by-${kind}`).checked = light.kind === kind;
  $("lamp-tools").hidden = light.kind !== "lamp";
  $("gloss-tools").hidden = !work.object?.gloss;
  $("tint-none").disabled = !work.object || work.object.tint.every((value) => value === 1);
  for (const element of document.querySelectorAll("[data-needs=object]")) element.hidden = !work.object;
  for (const element of document.querySelectorAll("[data-needs=none]")) element.hidden = work.object !== null;
}

function showValue(input, value, text) {
  if (input.type === "checkbox") input.checked = value;
  else if (input.value !== String(value)) input.value = value;
  if (!text) return;
  $(`${input.id}-text`).textContent = text(value);
  input.setAttribute("aria-valuetext", text(value));
}

/** Linear light as a colour of the page. */
function hexOf(tint) {
  const encode = (value) => Math.round(255 * (value <= 0.0031308 ? 12.92 * value : 1.055 * value ** (1 / 2.4) - 0.055));
  return `#${tint.map((value) => encode(Math.min(1, value)).toString(16).padStart(2, "0")).join("")}`;
}

/** A colour of the page as linear light. */
function linearOf(hex) {
  const parts = [1, 3, 5].map((at) => parseInt(hex.slice(at, at + 2), 16) / 255);
  return parts.map((value) => (value <= 0.04045 ? value / 12.92 : ((value + 0.055) / 1.055) ** 2.4));
}
