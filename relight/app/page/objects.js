// The objects of the scene: added from files, listed, ordered, copied, removed; and the layers of a decomposed photograph.

import { $, make } from "./dom.js";
import { copyOf } from "./files.js";
import { placeFor } from "./library.js";
import { attempt, calm, say } from "./notices.js";
import { added, duplicated, newObject, removed, reordered } from "./scene.js";

const LAYERS = ["Albedo", "Shading", "Normals", "Highlight"];

export class Objects {
  #work;
  #library;
  #cutter;
  #rendering;
  #opening = false;
  /** The list as it is shown, as text. */
  #listed = "";
  /** The number of the layer that is shown large, or null. */
  #large = null;
  #layersOf = null;

  constructor(work, library, cutter, rendering) {
    [this.#work, this.#library, this.#cutter, this.#rendering] = [work, library, cutter, rendering];
    work.addEventListener("scene", () => this.#show());
    work.addEventListener("selection", () => this.#show());
    this.#listen();
    this.#show();
  }

  /** Adds the object of a file to the scene, after it is cut out. */
  async add(file) {
    if (this.#opening || this.#cutter.isOpen) throw new Error("Finish the object that is being cut out first.");
    calm();
    added(this.#work.scene, {});
    this.#opening = true;
    try {
      await this.#open(await copyOf(file));
    } finally {
      this.#opening = false;
    }
  }

  async #open(file) {
    say(`Opening ${file.name} …`);
    const photo = await this.#library.open(file);
    say(photo.reduced ? `${file.name} was reduced to ${photo.width} × ${photo.height} pixels.` : "");
    if (!photo.masked && !(await this.#cutter.open(photo))) {
      await this.#library.closeAllBut(this.#work.reachable);
      return say("");
    }
    await this.#decompose(photo);
    this.#work.add(added(this.#work.scene, newObject(photo.object, placeFor(photo, this.#work.scene))));
    await this.#library.closeAllBut(this.#work.reachable);
    return say(`${photo.name} is in the scene.`);
  }

  async #cutAgain() {
    const photo = this.#photo;
    if (!(await this.#cutter.open(photo))) return;
    await this.#decompose(photo);
    this.#show();
    this.#rendering.refresh();
  }

  async #decompose(photo) {
    if (photo.kind === "captured") return;
    say("Separating colour from light …");
    const { seconds } = await this.#library.decompose(photo);
    say(`Colour and light separated in ${seconds.toFixed(1)} s.`);
  }

  get #photo() {
    return this.#library.photos.get(this.#work.object?.object) ?? null;
  }

  #listen() {
    const change = (how) => () => attempt(() => this.#work.change(how(this.#work.scene, this.#work.selected)));
    $("forward").addEventListener("click", change((scene, key) => reordered(scene, key, 1)));
    $("backward").addEventListener("click", change((scene, key) => reordered(scene, key, -1)));
    $("duplicate").addEventListener("click", () => attempt(() => this.#work.add(duplicated(this.#work.scene, this.#work.selected))));
    $("remove").addEventListener("click", change(removed));
    $("cut-again").addEventListener("click", () => attempt(() => this.#cutAgain()));
    $("large-close").addEventListener("click", () => this.#enlarge(null));
  }

  #show() {
    this.#showList();
    this.#showActions();
    this.#showLayers();
  }

  #showList() {
    const { scene, selected } = this.#work;
    const listed = JSON.stringify([scene.objects.map(({ key, object }) => [key, object, this.#library.photos.get(object)?.sketch]), selected]);
    if (listed === this.#listed) return;
    this.#listed = listed;
    const held = document.activeElement?.closest("#objects [data-key]")?.dataset.key;
    $("objects").replaceChildren(...scene.objects.toReversed().map((object) => make("li", {}, this.#entry(object, selected))));
    if (held) document.querySelector(`#objects [data-key="${held}"]`)?.focus();
  }

  #entry({ key, object }, selected) {
    const photo = this.#library.photos.get(object);
    const button = make("button", { type: "button", className: "entry", aria: { pressed: key === selected } }, pictureOf(photo.small), make("span", { text: photo.name }));
    button.dataset.key = key;
    button.addEventListener("click", () => this.#work.select(key));
    return button;
  }

  #showActions() {
    const { scene, selected } = this.#work;
    const at = scene.objects.findIndex(({ key }) => key === selected);
    $("forward").disabled = at < 0 || at === scene.objects.length - 1;
    $("backward").disabled = at <= 0;
    $("cut-again").disabled = !this.#photo?.sketch;
    $("welcome").hidden = scene.objects.length > 0;
  }

  async #showLayers() {
    const photo = this.#photo;
    if (this.#layersOf === (photo?.layers ?? null) && photo?.layers) return;
    this.#enlarge(null);
    this.#layersOf = null;
    const layers = photo?.kind === "photo" && (await attempt(() => this.#library.decompose(photo)));
    if (photo !== this.#photo) return;
    this.#layersOf = layers || null;
    $("layers").replaceChildren(...(layers ? LAYERS.map((name, index) => this.#tile(layers, name, index)) : []));
    $("layers-note").textContent = layers?.glossy ? "It is partly overexposed, so highlights were separated." : "";
  }

  #tile({ pictures }, name, index) {
    const button = make("button", { type: "button", className: "tile", aria: { pressed: false } }, pictureOf(pictures[index]), make("span", { text: name }));
    button.addEventListener("click", () => this.#enlarge(this.#large === index ? null : index));
    return button;
  }

  /** Shows a layer on the stage, or none. */
  #enlarge(index) {
    this.#large = index;
    $("large").hidden = index === null;
    [...$("layers").children].forEach((tile, at) => tile.setAttribute("aria-pressed", at === index));
    if (index === null) return;
    const picture = this.#layersOf.pictures[index];
    Object.assign($("large-picture"), { width: picture.width, height: picture.height });
    $("large-picture").getContext("2d").drawImage(picture, 0, 0);
    $("large-picture").setAttribute("aria-label", `${LAYERS[index]} of ${this.#photo.name}`);
    $("large-name").textContent = LAYERS[index];
  }
}

/** A canvas of a picture's own. */
function pictureOf(source) {
  const canvas = make("canvas", { width: source.width, height: source.height, aria: { hidden: true } });
  canvas.getContext("2d").drawImage(source, 0, 0);
  return canvas;
}
