// Messages between the page and its engine: the number of parts and the length of each as little-endian 32-bit integers, then
// the parts without gaps. The first part is JSON.

const WORD = 4;

/** The bytes that a message of these parts takes. */
export function lengthOf(parts) {
  return WORD * (parts.length + 1) + parts.reduce((sum, part) => sum + part.length, 0);
}

/** Writes parts as one message into bytes that have room for it. */
export function pack(parts, bytes) {
  const words = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
  words.setUint32(0, parts.length, true);
  parts.forEach((part, index) => words.setUint32(WORD * (index + 1), part.length, true));
  let at = WORD * (parts.length + 1);
  for (const part of parts) {
    bytes.set(part, at);
    at += part.length;
  }
}

/** Copies of the parts of a message. */
export function unpack(bytes) {
  const words = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
  const count = words.getUint32(0, true);
  let at = WORD * (count + 1);
  return Array.from({ length: count }, (_, index) => {
    const length = words.getUint32(WORD * (index + 1), true);
    at += length;
    return bytes.slice(at - length, at);
  });
}
