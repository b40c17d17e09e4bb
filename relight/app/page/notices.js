// Messages: a quiet line for progress, an alert for failures. One sentence each.

import { $ } from "./dom.js";

/** Shows what is going on or was done. */
export function say(text) {
  $("status").textContent = text;
}

/** Shows what failed, until it is closed. */
export function alert(text) {
  $("alert-text").textContent = sentence(text);
  $("alert").hidden = false;
  say("");
}

/** The engine's messages end without a full stop, as they do in a terminal. */
const sentence = (text) => (/[.!?]$/.test(text) ? text : `${text}.`);

/** Closes the alert. */
export function calm() {
  $("alert").hidden = true;
  $("alert-text").textContent = "";
}

/** Runs an action that may fail, and shows its error. */
export async function attempt(doing) {
  try {
    return await doing();
  } catch (error) {
    alert(error.message);
    return undefined;
  }
}

/** Alerts for unexpected errors, so that the page stays usable. */
export function listen() {
  $("alert-close").addEventListener("click", calm);
  window.addEventListener("error", (event) => {
    event.preventDefault();
    alert(`Something went wrong in the page: ${event.message}.`);
  });
  window.addEventListener("unhandledrejection", (event) => {
    event.preventDefault();
    alert(event.reason?.message ?? String(event.reason));
  });
}
