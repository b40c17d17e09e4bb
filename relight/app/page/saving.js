// Saves pictures and scenes as downloads or through the browser's share sheet.

import { $ } from "./dom.js";
import { attempt, calm, say } from "./notices.js";
import { forEngine } from "./scene.js";

const TYPES = { png: "image/png", jpeg: "image/jpeg" };
const ENDS = { png: "png", jpeg: "jpg" };

export class Saving {
  #work;
  #library;

  constructor(work, library) {
    [this.#work, this.#library] = [work, library];
    for (const format of ["png", "jpeg"]) $(`save-${format}`).addEventListener("click", () => attempt(() => this.#save(format)));
    $("share").addEventListener("click", () => attempt(() => this.#share()));
    $("keep").addEventListener("click", () => attempt(() => this.#keep()));
    window.addEventListener("beforeunload", (event) => {
      if (work.unsaved) event.preventDefault();
    });
  }

  async #save(format) {
    download(await this.#picture(format));
    say("The picture is saved.");
  }

  /** Through the share sheet, if the browser has one for files, else as a download. */
  async #share() {
    const file = await this.#picture("jpeg");
    if (!navigator.canShare?.({ files: [file] })) {
      download(file);
      return say("This browser cannot share files: the picture is saved instead.");
    }
    try {
      await navigator.share({ files: [file] });
      return say("The picture is shared.");
    } catch (error) {
      if (error.name !== "AbortError") throw new Error("The browser did not share the picture: save it instead.");
      return say("");
    }
  }

  async #picture(format) {
    const scene = this.#ready();
    say("Rendering the picture in full size …");
    const { parts } = await this.#library.askBefore(scene.background, "save", { scene: forEngine(scene), format });
    return new File(parts, `relight.${ENDS[format]}`, { type: TYPES[format] });
  }

  async #keep() {
    const scene = this.#ready();
    say("Packing the scene …");
    const { parts } = await this.#library.askBefore(scene.background, "export", { scene: forEngine(scene), name: "scene" });
    download(new File(parts, "relight-scene.zip", { type: "application/zip" }));
    this.#work.kept(scene);
    say("The scene is saved, with its photographs.");
  }

  /** The scene, which has an object. */
  #ready() {
    calm();
    const { scene } = this.#work;
    if (scene.objects.length === 0) throw new Error("There is no object in the scene yet: add one first.");
    return scene;
  }
}

/** Saves a file as a download. */
export function download(file) {
  const link = document.createElement("a");
  link.href = URL.createObjectURL(file);
  link.download = file.name;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 60_000);
}
