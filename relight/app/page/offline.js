// Stores the page in the browser, so that it opens offline.

import { $ } from "./dom.js";

/** Stores the page's files and shows when all are stored, or that the browser does not store pages. */
export async function keepOffline() {
  if (!("serviceWorker" in navigator)) return show("online", "Online only: browsers store pages only if they are opened over https");
  try {
    const { version } = await (await fetch("files.json", { cache: "no-cache" })).json();
    await navigator.serviceWorker.register(`sw.js?version=${version}`);
    await navigator.serviceWorker.ready;
    return show("ready", "Ready offline");
  } catch {
    return show("online", "Online only: the browser could not store the page");
  }
}

function show(state, text) {
  $("offline").dataset.state = state;
  $("offline").textContent = state === "ready" ? text : "Online only";
  $("offline").title = text;
}
