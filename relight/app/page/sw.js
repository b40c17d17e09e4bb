// Stores all files of one version of the page and serves them: the page opens offline.

const CACHE = `relight ${new URL(self.location).searchParams.get("version")}`;

self.addEventListener("install", (event) => event.waitUntil(keep()));
self.addEventListener("activate", (event) => event.waitUntil(takeOver()));
self.addEventListener("fetch", (event) => {
  const url = new URL(event.request.url);
  if (event.request.method === "GET" && url.href.startsWith(self.registration.scope)) event.respondWith(answer(event.request, url));
});

async function keep() {
  const { files } = await (await fetch("files.json", { cache: "no-cache" })).json();
  const names = [...Object.keys(files), "files.json"].filter((name) => name !== "sw.js");
  await (await caches.open(CACHE)).addAll(names.map((name) => new Request(name, { cache: "no-cache" })));
}

async function takeOver() {
  const names = await caches.keys();
  await Promise.all(names.filter((name) => name.startsWith("relight ") && name !== CACHE).map((name) => caches.delete(name)));
  await self.clients.claim();
}

/** A check for a new version asks the network first; everything else is served from the store. */
async function answer(request, url) {
  const cache = await caches.open(CACHE);
  if (url.pathname.endsWith("/files.json") && request.cache === "no-cache") return fetch(request).catch(() => cache.match("files.json"));
  const kept = await cache.match(request.mode === "navigate" ? "index.html" : request, { ignoreSearch: true });
  return kept ?? fetch(request);
}
