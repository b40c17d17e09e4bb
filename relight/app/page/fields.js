// Fields for files, which are hidden behind buttons.

import { $ } from "./dom.js";
import { attempt } from "./notices.js";

/** Hands the files of a field on. */
export function takeFiles(field, take) {
  $(field).addEventListener("change", () => {
    const [file] = $(field).files;
    $(field).value = "";
    if (file) attempt(() => take(file));
  });
}

/** Lets buttons open a field. */
export function opens(field, ...buttons) {
  for (const button of buttons) $(button).addEventListener("click", () => $(field).click());
}
