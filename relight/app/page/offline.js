// The page stays in the browser, so that it opens without a network.

import { $ } from "./dom.js";

/** Keeps the page's files; says when they are all here. Where the browser does not keep pages, says that. */
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
