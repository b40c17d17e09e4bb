// Weights in half precision become integers of 8 bits: of the large layers, whose errors average out; the others stay as they are.
// weights.mjs FROM TO

import { readFileSync, writeFileSync } from "node:fs";

/** Smaller tensors stay as they are: the layers at the picture's own resolution, heads, gains and offsets. */
const LARGE = 30_000;
/** The largest integer. */
const MOST = 127;

const [from, to] = process.argv.slice(2);
const { tensors, facts } = read(readFileSync(from));
writeFileSync(to, written(tensors.flatMap(quantised), facts));

/** The tensors of a safetensors file: { name, dtype, shape, bytes }. */
function read(file) {
  const length = Number(file.readBigUInt64LE(0));
  const { __metadata__: facts, ...header } = JSON.parse(file.toString("utf8", 8, 8 + length));
  const data = file.subarray(8 + length);
  const tensors = Object.entries(header).map(([name, { dtype, shape, data_offsets: [begin, end] }]) => (
    { name, dtype, shape, bytes: data.subarray(begin, end) }));
  return { tensors, facts };
}

/** A tensor as integers and the scale of each output channel, which is the first dimension; or as it is. */
function quantised(tensor) {
  const { name, dtype, shape, bytes } = tensor;
  const count = bytes.length / 2;
  if (dtype !== "F16" || count < LARGE) return [tensor];
  const [channels] = shape;
  const [integers, scales] = [Buffer.alloc(count), Buffer.alloc(4 * channels)];
  for (let channel = 0; channel < channels; channel++) {
    const values = Array.from({ length: count / channels }, (_, index) => half(bytes.readUInt16LE(2 * (channel * count / channels + index))));
    const scale = Math.fround(Math.max(...values.map(Math.abs)) / MOST);
    values.forEach((value, index) => integers.writeInt8(scale === 0 ? 0 : Math.round(value / scale), channel * values.length + index));
    scales.writeFloatLE(scale, 4 * channel);
  }
  return [
    { name, dtype: "I8", shape, bytes: integers },
    { name: `${name}.scale`, dtype: "F32", shape: [channels], bytes: scales },
  ];
}

/** The number that 16 bits stand for. */
function half(bits) {
  const [exponent, fraction] = [(bits >> 10) & 31, bits & 1023];
  if (exponent === 31) throw new Error("a weight is not finite");
  const value = exponent === 0 ? fraction * 2 ** -24 : (1 + fraction / 1024) * 2 ** (exponent - 15);
  return bits & 0x8000 ? -value : value;
}

/** The bytes of a safetensors file: longer numbers come first, so that all are aligned. */
function written(tensors, facts) {
  const sorted = [...tensors].sort((a, b) => b.dtype.slice(1) - a.dtype.slice(1));
  const header = facts ? { __metadata__: facts } : {};
  let at = 0;
  for (const { name, dtype, shape, bytes } of sorted) header[name] = { dtype, shape, data_offsets: [at, (at += bytes.length)] };
  const text = Buffer.from(JSON.stringify(header));
  const padded = Buffer.concat([text, Buffer.alloc(-text.length & 7, " ")]);
  const length = Buffer.alloc(8);
  length.writeBigUInt64LE(BigInt(padded.length));
  return Buffer.concat([length, padded, ...sorted.map(({ bytes }) => bytes)]);
}
