// A static server on loopback, with the headers that `relight serve` sends. It can be stopped, as a network can.

import { createServer } from "node:http";
import { readFile } from "node:fs/promises";
import { extname, join, normalize } from "node:path";

const TYPES = {
  ".css": "text/css", ".html": "text/html", ".js": "text/javascript", ".json": "application/json", ".png": "image/png",
  ".svg": "image/svg+xml", ".wasm": "application/wasm", ".webmanifest": "application/manifest+json",
};
const POLICY = [
  "default-src 'none'", "script-src 'self' 'wasm-unsafe-eval'", "style-src 'self'", "img-src 'self' blob: data:", "media-src 'self' blob:",
  "connect-src 'self' blob:", "worker-src 'self'", "manifest-src 'self'", "base-uri 'none'", "form-action 'none'", "frame-ancestors 'none'",
].join("; ");
const HEADERS = {
  "Content-Security-Policy": POLICY, "Cross-Origin-Opener-Policy": "same-origin", "Cross-Origin-Embedder-Policy": "require-corp",
  "Cross-Origin-Resource-Policy": "same-origin", "X-Content-Type-Options": "nosniff", "Cache-Control": "no-cache",
};

/** Serves a folder under a path of its own, compressed where it is and the browser takes it: { address, stop }. `instead` makes other
 * texts of some files, by their names, `slowly` sends some in ways of its own, and `missing` are not there. */
export async function serve(folder, { instead = {}, slowly = {}, missing = new Set() } = {}) {
  const server = createServer(async ({ url, headers }, response) => {
    const path = normalize(new URL(url, "http://localhost").pathname).replace(/^\/app\/?/, "") || "index.html";
    if (missing.has(path)) return response.writeHead(404, HEADERS).end();
    try {
      const { bytes, coding } = instead[path] ? await madeOf(folder, path, instead[path]) : await encoded(folder, path, headers["accept-encoding"] ?? "");
      response.writeHead(200, { ...HEADERS, ...coding, "Content-Type": TYPES[extname(path)] ?? "application/octet-stream", "Content-Length": bytes.length });
      const send = (part) => new Promise((resolve) => response.write(part, resolve));
      if (slowly[path]) await slowly[path]({ bytes, response, send });
      else send(bytes);
      response.end();
    } catch {
      response.writeHead(404, HEADERS).end();
    }
  });
  await new Promise((resolve) => server.listen(0, "127.0.0.1", resolve));
  const stop = () => new Promise((resolve) => {
    server.close(resolve);
    server.closeAllConnections();
  });
  return { address: `http://127.0.0.1:${server.address().port}/app/`, stop };
}

async function madeOf(folder, path, make) {
  const text = await readFile(join(folder, path), "utf8").catch(() => "");
  return { bytes: Buffer.from(make(text)), coding: {} };
}

async function encoded(folder, path, accepted) {
  for (const [coding, ending] of [["br", "br"], ["gzip", "gz"]]) {
    if (!accepted.split(", ").includes(coding)) continue;
    const bytes = await readFile(join(folder, `${path}.${ending}`)).catch(() => null);
    if (bytes) return { bytes, coding: { "Content-Encoding": coding } };
  }
  return { bytes: await readFile(join(folder, path)), coding: {} };
}
