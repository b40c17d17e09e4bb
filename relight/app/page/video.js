// A short video in which the light rotates once: all pictures are rendered first, then played into the browser's recorder.

import { $, make, pixels } from "./dom.js";
import { attempt, calm, say } from "./notices.js";
import { download } from "./saving.js";
import { forEngine } from "./scene.js";

const RATE = 24;
const LONGEST = 640;
const KINDS = ["video/mp4;codecs=avc1.42E01F", "video/webm;codecs=vp9", "video/webm;codecs=vp8", "video/webm"];
/** A recorder that has not ended this long after its stop has failed, milliseconds. */
const LONGEST_END = 20_000;
const NO_RECORDER = "This browser cannot make videos: save a picture instead.";

export class Video {
  #work;
  #library;
  #making = false;

  constructor(work, library) {
    [this.#work, this.#library] = [work, library];
    $("video").addEventListener("click", () => (this.#making ? (this.#making = false) : attempt(() => this.#make())));
  }

  async #make() {
    calm();
    const { scene } = this.#work;
    if (scene.objects.length === 0) throw new Error("There is no object in the scene yet: add one first.");
    const type = kindOfVideo();
    this.#making = true;
    $("video-label").textContent = "Cancel";
    try {
      const frames = await this.#render(scene, RATE * Number($("video-seconds").value));
      if (this.#making) await this.#record(frames, type);
      else say("No video was made.");
    } finally {
      this.#making = false;
      $("video-label").textContent = "Make a video";
      $("video-progress").hidden = true;
    }
  }

  /** All pictures of the video, compressed so that they fit into a phone's memory. */
  async #render(scene, count) {
    say("Rendering the pictures of the video …");
    Object.assign($("video-progress"), { hidden: false, max: count, value: 0 });
    const frames = [];
    for (let index = 0; index < count && this.#making; index++) {
      const angle = scene.light.angle + (360 * index) / count;
      const turned = { ...scene, light: { ...scene.light, angle: ((angle + 180) % 360) - 180 } };
      const fields = { scene: forEngine(turned), longest: LONGEST, before: false };
      const { width, height, parts } = await this.#library.askBefore(scene.background, "render", fields);
      frames.push(await compressed(parts[0], width, height));
      $("video-progress").value = index + 1;
    }
    return frames;
  }

  async #record(frames, type) {
    say("Recording the video …");
    const file = await recorded(frames, type);
    // A browser may claim a format without an encoder, and record nothing.
    if (file.size === 0) throw new Error(NO_RECORDER);
    download(file);
    say("The video is saved.");
  }
}

function kindOfVideo() {
  const canRecord = typeof MediaRecorder === "function" && typeof HTMLCanvasElement.prototype.captureStream === "function";
  const type = canRecord && KINDS.find((kind) => MediaRecorder.isTypeSupported(kind));
  if (!type) throw new Error(NO_RECORDER);
  return type;
}

/** A picture with even sides, as video encoders require. */
async function compressed(rgba, width, height) {
  const canvas = new OffscreenCanvas(width - (width % 2), height - (height % 2));
  canvas.getContext("2d").putImageData(pixels(rgba, width, height), 0, 0);
  return canvas.convertToBlob({ type: "image/jpeg", quality: 0.95 });
}

/** Plays pictures into a recorder, each for its duration. */
async function recorded(frames, type) {
  const first = await createImageBitmap(frames[0]);
  const canvas = make("canvas", { width: first.width, height: first.height });
  const context = canvas.getContext("2d", { alpha: false });
  const stream = canvas.captureStream(RATE);
  const recorder = new MediaRecorder(stream, { mimeType: type, videoBitsPerSecond: 6e6 });
  const chunks = [];
  recorder.ondataavailable = ({ data }) => chunks.push(data);
  const ended = new Promise((resolve, reject) => {
    recorder.onstop = resolve;
    recorder.onerror = () => reject(new Error(NO_RECORDER));
  });
  context.drawImage(first, 0, 0);
  recorder.start();
  await play(frames, context);
  recorder.stop();
  const late = setTimeout(() => recorder.onerror(), LONGEST_END);
  await ended.finally(() => clearTimeout(late));
  stream.getTracks().forEach((track) => track.stop());
  const ending = type.startsWith("video/mp4") ? "mp4" : "webm";
  return new File(chunks, `relight.${ending}`, { type: type.split(";")[0] });
}

async function play(frames, context) {
  const began = performance.now();
  for (const [index, frame] of frames.entries()) {
    const image = await createImageBitmap(frame);
    await until(began + (1000 * index) / RATE);
    context.drawImage(image, 0, 0);
    image.close();
  }
  await until(began + (1000 * frames.length) / RATE);
}

const until = (time) => new Promise((resolve) => setTimeout(resolve, Math.max(0, time - performance.now())));
