// Files that somebody brings: by a field behind a button, dropped or pasted. What comes before the engine is there is kept.

import { $ } from "./dom.js";
import { copyOf } from "./files.js";
import { attempt, say } from "./notices.js";

/** The field of what is dropped or pasted. */
const ANY = "photo-file";

/** What to do with a file, by field. */
const takers = new Map();
/** Files that came before they could be taken: { field, name, copy }. Null from when they are taken at once. */
let waiting = [];

/** Listens to all fields, to the buttons before them, and to what is dropped or pasted. */
export function listen() {
  for (const button of document.querySelectorAll("[data-opens]")) button.addEventListener("click", () => $(button.dataset.opens).click());
  for (const field of fields()) {
    field.addEventListener("change", () => {
      const [file] = field.files;
      field.value = "";
      if (file) arrived(field.id, file);
    });
  }
  document.addEventListener("dragover", (event) => event.preventDefault());
  document.addEventListener("drop", (event) => {
    event.preventDefault();
    const [file] = event.dataTransfer.files;
    if (file) arrived(ANY, file);
  });
  document.addEventListener("paste", (event) => {
    const [file] = event.clipboardData.files;
    if (file) arrived(ANY, file);
  });
}

/** Says what to do with the files of a field. */
export function takeFiles(field, take) {
  takers.set(field, take);
}

/** Takes the files that came before, one after the other, and from now on each as it comes. */
export async function takeWaiting() {
  const files = waiting;
  waiting = null;
  for (const { field, copy } of files) await attempt(async () => takers.get(field)(await copy));
}

/** Takes no file, ever: says why. */
export function refuseFiles(why) {
  const refuse = () => {
    throw new Error(why);
  };
  for (const { id } of fields()) takeFiles(id, refuse);
  return takeWaiting();
}

const fields = () => document.querySelectorAll("input[type=file]");

function arrived(field, file) {
  if (!waiting) return attempt(() => takers.get(field)(file));
  // Read at once: until its turn comes the file may change or go.
  const copy = copyOf(file);
  copy.catch(() => {});
  waiting.push({ field, name: file.name, copy });
  return say(`Waiting for the engine to load: ${waiting.map(({ name }) => name).join(", ")}`);
}
