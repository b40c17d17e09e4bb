// Files from the user: those that the engine reads, those that only the browser reads, and those to refuse.

/** The largest file, bytes. */
const MOST_BYTES = 100e6;
/** The largest picture, pixels. */
const MOST_PIXELS = 100e6;
/** Pictures that the browser decodes are reduced to this many pixels. */
const KEPT_PIXELS = 2 ** 21;
/** The bytes that identify a file's type. */
const HEAD = 65536;

/** Signatures of files that the engine reads: [offset, text]. */
const READ_BY_ENGINE = [[0, "\xff\xd8\xff"], [0, "\x89PNG"], [8, "WEBP"], [0, "\x76\x2f\x31\x01"], [0, "#?"]];

/** Whether the engine reads a file itself. Refuses empty and too large files. */
export async function openable(file) {
  if (file.size === 0) throw new Error(`${file.name} is empty.`);
  if (file.size > MOST_BYTES) throw new Error(`${file.name} is too large: ${(file.size / 1e6).toFixed(0)} MB; the limit is ${MOST_BYTES / 1e6} MB.`);
  const head = await headOf(file);
  if (isCaptured(file)) return true;
  if (isSvg(file, head)) throw new Error(`${file.name} is a drawing (SVG): choose a photograph.`);
  return READ_BY_ENGINE.some(([at, text]) => head.startsWith(text, at));
}

/** A picture decoded by the browser, upright and not too large: { fields: { name, width, height }, rgba }. */
export async function asPixels(file) {
  const [wide, high] = declaredSize(await headOf(file)) ?? [0, 0];
  if (wide * high > MOST_PIXELS) throw new Error(`${file.name} is too large: ${wide} × ${high} pixels; the limit is ${MOST_PIXELS / 1e6} million.`);
  const image = await createImageBitmap(file, { imageOrientation: "from-image" }).catch(() => null);
  if (!image) throw new Error(`${file.name} is not a picture that this browser can read.`);
  const scale = Math.min(1, Math.sqrt(KEPT_PIXELS / (image.width * image.height)));
  const [width, height] = [image.width, image.height].map((side) => Math.max(1, Math.floor(side * scale)));
  const context = new OffscreenCanvas(width, height).getContext("2d");
  context.imageSmoothingQuality = "high";
  context.drawImage(image, 0, 0, width, height);
  image.close();
  return { fields: { name: file.name, width, height }, rgba: new Uint8Array(context.getImageData(0, 0, width, height).data.buffer) };
}

/** A copy that stays readable if the file changes or disappears. */
export async function copyOf(file) {
  try {
    return new File([await file.arrayBuffer()], file.name || "photo", { type: file.type });
  } catch {
    throw new Error(`${file.name} cannot be read: choose it again.`);
  }
}

async function headOf(file) {
  const bytes = new Uint8Array(await file.slice(0, HEAD).arrayBuffer());
  return Array.from(bytes, (byte) => String.fromCharCode(byte)).join("");
}

const isCaptured = ({ name }) => /\.relit$/i.test(name);

const isSvg = ({ name, type }, head) => type === "image/svg+xml" || /\.svgz?$/i.test(name) || /<svg[\s>]/i.test(head.slice(0, 4096));

/** The width and height that the head of a GIF, BMP, HEIC or AVIF states. */
function declaredSize(head) {
  if (head.startsWith("GIF8")) return [little(head, 6, 2), little(head, 8, 2)];
  if (head.startsWith("BM")) return [little(head, 18, 4), little(head, 22, 4)];
  if (!head.startsWith("ftyp", 4)) return null;
  const sizes = [...head.matchAll(/ispe[^]{4}([^]{4})([^]{4})/g)].map(([, width, height]) => [big(width), big(height)]);
  return sizes.sort((a, b) => b[0] * b[1] - a[0] * a[1])[0] ?? null;
}

/** A little-endian integer of so many bytes. */
const little = (text, at, bytes) => [...text.slice(at, at + bytes)].reduceRight((sum, letter) => 256 * sum + letter.charCodeAt(0), 0);

/** A big-endian integer. */
const big = (text) => [...text].reduce((sum, letter) => 256 * sum + letter.charCodeAt(0), 0);
