// Finishes the folder of the page: compresses what becomes smaller, and writes the list of its files.
// pack.mjs FOLDER

import { createHash } from "node:crypto";
import { readdirSync, readFileSync, writeFileSync } from "node:fs";
import { join } from "node:path";
import { brotliCompressSync, constants, gzipSync } from "node:zlib";

/** Of brotli's qualities 0 to 11 the last two take ten times as long for a few percent. */
const brotli = (bytes) => brotliCompressSync(bytes, {
  params: { [constants.BROTLI_PARAM_QUALITY]: 9, [constants.BROTLI_PARAM_LGWIN]: 24, [constants.BROTLI_PARAM_SIZE_HINT]: bytes.length },
});
/** How names end, and what makes such a file. */
const CODINGS = { br: brotli, gz: (bytes) => gzipSync(bytes, { level: 9 }) };
/** What is compressed already. */
const COMPRESSED = /\.(png|jpg)$/;

const folder = process.argv[2];
const [digest, files, rows] = [createHash("sha256"), {}, []];
for (const name of readdirSync(folder).sort()) {
  // What a server is told, and no browser can ask for.
  if (name === "_headers") continue;
  const bytes = readFileSync(join(folder, name));
  digest.update(name).update(bytes);
  files[name] = bytes.length;
  rows.push([name, bytes.length, ...(COMPRESSED.test(name) ? [bytes.length, bytes.length] : compressed(name, bytes))]);
}
// What the page keeps for work without a network, and a version that changes with any of it.
writeFileSync(join(folder, "files.json"), `${JSON.stringify({ version: digest.digest("hex").slice(0, 16), files }, null, 1)}\n`);
tell(rows);

/** Writes the compressed files next to a file; their bytes. */
function compressed(name, bytes) {
  return Object.entries(CODINGS).map(([ending, code]) => {
    const smaller = code(bytes);
    if (smaller.length < bytes.length) writeFileSync(join(folder, `${name}.${ending}`), smaller);
    return Math.min(smaller.length, bytes.length);
  });
}

/** A line for each large file, and the sum of all. */
function tell(rows) {
  const sums = [1, 2, 3].map((column) => rows.reduce((sum, row) => sum + row[column], 0));
  const large = rows.filter(([, bytes]) => bytes > 1e6);
  for (const [name, ...bytes] of [...large, ["all files", ...sums]]) {
    const [whole, br, gz] = bytes.map((each) => `${(each / 1e6).toFixed(2)} MB`);
    console.log(`app: ${name}: ${whole}, brotli ${br}, gzip ${gz}`);
  }
}
