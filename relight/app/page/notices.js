// What the page says: a quiet line for what goes on, an alert for what failed. One sentence each.

import { $ } from "./dom.js";

/** Says what goes on or was done. */
export function say(text) {
  $("status").textContent = text;
}

/** Says what failed, until it is read. */
export function alert(text) {
  $("alert-text").textContent = sentence(text);
  $("alert").hidden = false;
  say("");
}

/** The engine's messages end without a full stop, as they do in a terminal. */
const sentence = (text) => (/[.!?]$/.test(text) ? text : `${text}.`);

/** Takes the alert away. */
export function calm() {
  $("alert").hidden = true;
  $("alert-text").textContent = "";
}

/** Does something that may fail; what went wrong is said. */
export async function attempt(doing) {
  try {
    return await doing();
  } catch (error) {
    alert(error.message);
    return undefined;
  }
}

/** Sentences for what nobody foresaw, so that the page stays in use. */
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
