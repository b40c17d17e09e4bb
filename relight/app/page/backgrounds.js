// The background of the scene: a bundled panorama, or the user's own panorama or photograph.

import { $, make } from "./dom.js";
import { copyOf } from "./files.js";
import { takeFiles } from "./fields.js";
import { calm, say } from "./notices.js";

/** The bundled panoramas by their files. */
export const BUNDLED = { "room.hdr": "Room with a window", "studio.hdr": "Studio", "noon.hdr": "Noon", "evening.hdr": "Evening sun" };

export class Backgrounds {
  #work;
  #library;
  #rendering;
  #listed = "";

  constructor(work, library, rendering) {
    [this.#work, this.#library, this.#rendering] = [work, library, rendering];
    takeFiles("own-photo-file", (file) => this.open(file, "photo"));
    takeFiles("own-panorama-file", (file) => this.open(file, "panorama_file"));
    work.addEventListener("scene", () => this.#show());
    this.#show();
  }

  /** Sets the user's own file as the background. */
  async open(file, kind) {
    calm();
    say(`Opening ${file.name} …`);
    const background = await this.#library.openBackground(await copyOf(file), kind);
    this.#choose(background);
    say(`${background.name} is the background.`);
  }

  #choose({ key }) {
    this.#work.changeScene({ background: key });
  }

  #show() {
    const { background } = this.#work.scene;
    const isPanorama = this.#library.backgrounds.get(background).kind !== "photo";
    this.#rendering.turns = isPanorama;
    for (const element of document.querySelectorAll("[data-needs=panorama]")) element.hidden = !isPanorama;
    const listed = [background, ...this.#library.backgrounds.keys()].join();
    if (listed === this.#listed) return;
    this.#listed = listed;
    const held = document.activeElement?.closest("#backgrounds [data-key]")?.dataset.key;
    $("backgrounds").replaceChildren(...[...this.#library.backgrounds.values()].map((each) => this.#entry(each, background)));
    if (held) document.querySelector(`#backgrounds [data-key="${held}"]`)?.focus();
  }

  #entry(background, chosen) {
    const { key, name, small } = background;
    const picture = make("canvas", { width: small.width, height: small.height, aria: { hidden: true } });
    picture.getContext("2d").drawImage(small, 0, 0);
    const button = make("button", { type: "button", className: "place", aria: { pressed: key === chosen } }, picture, make("span", { text: name }));
    button.dataset.key = key;
    button.addEventListener("click", () => this.#choose(background));
    return make("li", {}, button);
  }
}
