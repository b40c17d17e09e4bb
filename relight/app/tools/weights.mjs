// Makes weights in half precision smaller, as far as no picture of the page changes by more than a step of 8 bits.
// weights.mjs FROM TO

import { readFileSync, writeFileSync } from "node:fs";

/** Layers at the coarsest resolutions, two thirds of all weights, whose errors average out: integers up to this one. */
const COARSE = /^(encoder\.4|middle|decoder\.0|light)\./;
const MOST = 31;
/** Layers at the next finer resolution: so many bits of the fraction stay, of 10. Finer layers stay as they are. */
const MIDDLE = /^(encoder\.3|decoder\.1)\./;
const BITS = 7;

const [from, to] = process.argv.slice(2);
const { tensors, facts } = read(readFileSync(from));
writeFileSync(to, written(tensors.flatMap(smaller), facts));

/** The tensors of a safetensors file: { name, dtype, shape, bytes }. */
function read(file) {
  const length = Number(file.readBigUInt64LE(0));
  const { __metadata__: facts, ...header } = JSON.parse(file.toString("utf8", 8, 8 + length));
  const data = file.subarray(8 + length);
  const tensors = Object.entries(header).map(([name, { dtype, shape, data_offsets: [begin, end] }]) => (
    { name, dtype, shape, bytes: data.subarray(begin, end) }));
  return { tensors, facts };
}

/** A tensor as it is kept; gains and offsets, which are vectors, as they are. */
function smaller(tensor) {
  if (tensor.dtype !== "F16" || tensor.shape.length < 2) return [tensor];
  if (COARSE.test(tensor.name)) return quantised(tensor);
  return [MIDDLE.test(tensor.name) ? rounded(tensor) : tensor];
}

/** A tensor as integers and the scale of each output channel, which is the first dimension. */
function quantised({ name, shape, bytes }) {
  const [channels] = shape;
  const count = bytes.length / 2;
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

/** A tensor whose fractions have fewer bits, so that it is compressed better. */
function rounded(tensor) {
  const step = 2 ** (10 - BITS);
  const bytes = Buffer.from(tensor.bytes);
  // A fraction that is rounded up to the next power of two carries into the exponent, as it should.
  for (let at = 0; at < bytes.length; at += 2) bytes.writeUInt16LE(Math.round(bytes.readUInt16LE(at) / step) * step, at);
  return { ...tensor, bytes };
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
