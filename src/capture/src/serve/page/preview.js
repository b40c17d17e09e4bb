// The live picture: fetched one by one at the pace of this page, drawn whole or as an enlarged piece, with
// clipped pixels striped where that is asked for.
import { request } from "./link.js";

/** Milliseconds between pictures, and between attempts where there is none. */
const PACE = 60;
const AGAIN = 1000;
/** Channel value from which a pixel counts as clipped, as in the extraction. */
const CLIPPED = 250;

const canvas = document.getElementById("preview");
const context = canvas.getContext("2d", { alpha: false, willReadFrequently: true });
const keys = { zoom: document.getElementById("zoom"), zebra: document.getElementById("zebra") };
const view = { zoom: false, zebra: false, x: 0.5, y: 0.5 };
let picture = null;
let number = 0;

/** The piece of the picture that is shown, in its pixels. */
function piece() {
  const { width, height } = picture;
  if (!view.zoom) return [0, 0, width, height];
  // Two pixels of the screen for one of the picture; of a small picture no less than half.
  const w = Math.min(canvas.width / 2, width / 2);
  const h = (w * height) / width;
  const inside = (at, size, whole) => Math.min(Math.max(at * whole - size / 2, 0), whole - size);
  return [inside(view.x, w, width), inside(view.y, h, height), w, h];
}

function draw() {
  if (!picture) return;
  const width = Math.round(canvas.clientWidth * Math.min(devicePixelRatio, 2));
  const height = Math.round((width * picture.height) / picture.width);
  if (canvas.width !== width || canvas.height !== height) Object.assign(canvas, { width, height });
  // Smoothing would hide single clipped pixels, and what the focus is like.
  context.imageSmoothingEnabled = !view.zoom && !view.zebra;
  context.drawImage(picture, ...piece(), 0, 0, width, height);
  if (view.zebra) stripe(width, height);
}

function stripe(width, height) {
  const image = context.getImageData(0, 0, width, height);
  const pixels = new Uint32Array(image.data.buffer);
  const bytes = image.data;
  for (let y = 0, at = 0; y < height; y += 1) {
    for (let x = 0; x < width; x += 1, at += 1) {
      const b = at * 4;
      if (bytes[b] >= CLIPPED && bytes[b + 1] >= CLIPPED && bytes[b + 2] >= CLIPPED) {
        pixels[at] = (x + y) & 8 ? 0xff2020e0 : 0xff000000;
      }
    }
  }
  context.putImageData(image, 0, 0);
}

function show(next) {
  picture?.close();
  picture = next;
  document.getElementById("no-picture").hidden = true;
  draw();
}

const pause = (time) => new Promise((done) => setTimeout(done, time));

async function run() {
  for (;;) {
    if (document.hidden) {
      await pause(AGAIN);
      continue;
    }
    try {
      const response = await request(`/api/v1/preview.jpg?after=${number}`);
      if (response.status === 200) {
        number = Number(response.headers.get("relit-frame"));
        show(await createImageBitmap(await response.blob()));
      }
      await pause(PACE);
    } catch (problem) {
      if (problem.status === 401) return;
      // The state's own line shows a lost connection; a damaged picture is followed by a better one.
      await pause(AGAIN);
    }
  }
}

function toggle(what) {
  view[what] = !view[what];
  keys[what].setAttribute("aria-pressed", view[what]);
  canvas.classList.toggle("zoomed", view.zoom);
  draw();
}

function move(dx, dy) {
  view.x = Math.min(Math.max(view.x + dx, 0), 1);
  view.y = Math.min(Math.max(view.y + dy, 0), 1);
  draw();
}

let pressed = null;
canvas.addEventListener("pointerdown", (event) => {
  pressed = { x: event.clientX, y: event.clientY, moved: false };
  canvas.setPointerCapture(event.pointerId);
});
canvas.addEventListener("pointermove", (event) => {
  if (!pressed || !view.zoom || !picture) return;
  const [dx, dy] = [event.clientX - pressed.x, event.clientY - pressed.y];
  if (!pressed.moved && Math.hypot(dx, dy) < 8) return;
  const [, , w, h] = piece();
  move((-dx / canvas.clientWidth) * (w / picture.width), (-dy / canvas.clientHeight) * (h / picture.height));
  pressed = { x: event.clientX, y: event.clientY, moved: true };
});
canvas.addEventListener("pointercancel", () => (pressed = null));
canvas.addEventListener("pointerup", (event) => {
  if (pressed && !pressed.moved) {
    if (!view.zoom) Object.assign(view, { x: event.offsetX / canvas.clientWidth, y: event.offsetY / canvas.clientHeight });
    toggle("zoom");
  }
  pressed = null;
});
canvas.addEventListener("keydown", (event) => {
  const step = { ArrowLeft: [-0.05, 0], ArrowRight: [0.05, 0], ArrowUp: [0, -0.05], ArrowDown: [0, 0.05] }[event.key];
  if (step && view.zoom) {
    event.preventDefault();
    move(...step);
  } else if (event.key === "Enter") toggle("zoom");
});
keys.zoom.addEventListener("click", () => toggle("zoom"));
keys.zebra.addEventListener("click", () => toggle("zebra"));
addEventListener("resize", draw);

/** Begins to show pictures, until the page is closed. */
export function startPreview() {
  run();
}
