// Files from the user: chosen with a button, dropped or pasted. Files that come before the engine is ready are kept.

import { $ } from "./dom.js";
import { copyOf } from "./files.js";
import { attempt, say } from "./notices.js";

/** The field for dropped or pasted files. */
const ANY = "photo-file";

/** What to do with a file, by field. */
const takers = new Map();
/** Files that came too early: { field, name, copy }. Null once files are handled at once. */
let waiting = [];

/** Listens to all fields and their buttons, and to dropped and pasted files. */
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

/** Sets the handler for the files of a field. */
export function takeFiles(field, take) {
  takers.set(field, take);
}

/** Handles the early files in order, and from now on each as it comes. */
export async function takeWaiting() {
  const files = waiting;
  waiting = null;
  for (const { field, copy } of files) await attempt(async () => takers.get(field)(await copy));
}

/** Refuses all files from now on, with the reason. */
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
  // Read at once: the file may change or disappear before its turn.
  const copy = copyOf(file);
  copy.catch(() => {});
  waiting.push({ field, name: file.name, copy });
  return say(`Waiting for the engine to load: ${waiting.map(({ name }) => name).join(", ")}`);
}
