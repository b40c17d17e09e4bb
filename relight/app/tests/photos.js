// Photographs that the tests make: a lit ball before a backdrop, drawn by the browser; and files that are none.

import { extname } from "node:path";
import { crc32, deflateSync } from "node:zlib";

/** Where the ball is, in parts of the picture: its box. */
export const BALL = [0.28, 0.2, 0.44, 0.6];

/** A ball that is lit from the upper left, as a file: { name, mimeType, buffer }. */
export async function ball(browser, { name = "ball.png", width = 640, height = 480, hue = 28 } = {}) {
  const mimeType = `image/${extname(name).slice(1).replace("jpg", "jpeg")}`;
  const page = await browser.newPage();
  const bytes = await page.evaluate(drawBall, { width, height, hue, mimeType });
  await page.close();
  return { name, mimeType, buffer: Buffer.from(bytes, "base64") };
}

/** Runs in the page. */
async function drawBall({ width, height, hue, mimeType }) {
  const canvas = Object.assign(document.createElement("canvas"), { width, height });
  const context = canvas.getContext("2d");
  const wall = context.createLinearGradient(0, 0, width, height);
  wall.addColorStop(0, "#5b6a78");
  wall.addColorStop(1, "#a9b3ba");
  context.fillStyle = wall;
  context.fillRect(0, 0, width, height);
  const [x, y, r] = [width / 2, height / 2, 0.27 * height];
  const skin = context.createRadialGradient(x - 0.4 * r, y - 0.5 * r, 0.05 * r, x, y, 1.05 * r);
  skin.addColorStop(0, `hsl(${hue} 85% 78%)`);
  skin.addColorStop(0.5, `hsl(${hue} 75% 45%)`);
  skin.addColorStop(1, `hsl(${hue} 70% 14%)`);
  context.fillStyle = skin;
  context.beginPath();
  context.arc(x, y, r, 0, 2 * Math.PI);
  context.fill();
  return canvas.toDataURL(mimeType, 0.93).split(",")[1];
}

/** A JPEG that is displayed turned by a quarter, as its Exif says. */
export function exifTurned({ buffer, ...file }) {
  const orientation = [0x01, 0x12, 0, 3, 0, 0, 0, 1, 0, 6, 0, 0];
  const tiff = ["M".charCodeAt(0), "M".charCodeAt(0), 0, 42, 0, 0, 0, 8, 0, 1, ...orientation, 0, 0, 0, 0];
  const content = Buffer.concat([Buffer.from("Exif\0\0", "latin1"), Buffer.from(tiff)]);
  const marker = Buffer.from([0xff, 0xe1, 0, content.length + 2]);
  return { ...file, buffer: Buffer.concat([buffer.subarray(0, 2), marker, content, buffer.subarray(2)]) };
}

/** A panorama, twice as wide as high, with a bright window. */
export async function panorama(browser, name = "hall.jpg") {
  const page = await browser.newPage();
  const bytes = await page.evaluate(() => {
    const canvas = Object.assign(document.createElement("canvas"), { width: 1024, height: 512 });
    const context = canvas.getContext("2d");
    const hall = context.createLinearGradient(0, 0, 0, 512);
    hall.addColorStop(0, "#8796a5");
    hall.addColorStop(0.5, "#6c6a60");
    hall.addColorStop(1, "#4a3c2c");
    context.fillStyle = hall;
    context.fillRect(0, 0, 1024, 512);
    context.fillStyle = "#fff8e0";
    context.fillRect(640, 120, 150, 110);
    return canvas.toDataURL("image/jpeg", 0.93).split(",")[1];
  });
  await page.close();
  return { name, mimeType: "image/jpeg", buffer: Buffer.from(bytes, "base64") };
}

/** A grey PNG of one value, small as a file however large it is. */
export function plainPng(name, width, height, { data = true } = {}) {
  const head = Buffer.alloc(13);
  head.writeUInt32BE(width, 0);
  head.writeUInt32BE(height, 4);
  head.set([8, 0, 0, 0, 0], 8);
  const rows = data ? deflateSync(Buffer.alloc((width + 1) * height)) : deflateSync(Buffer.alloc(16));
  const signature = Buffer.from([0x89, 0x50, 0x4e, 0x47, 0x0d, 0x0a, 0x1a, 0x0a]);
  const buffer = Buffer.concat([signature, chunk("IHDR", head), chunk("IDAT", rows), chunk("IEND", Buffer.alloc(0))]);
  return { name, mimeType: "image/png", buffer };
}

function chunk(kind, content) {
  const body = Buffer.concat([Buffer.from(kind, "latin1"), content]);
  const [length, sum] = [Buffer.alloc(4), Buffer.alloc(4)];
  length.writeUInt32BE(content.length);
  sum.writeUInt32BE(crc32(body));
  return Buffer.concat([length, body, sum]);
}

/** What is no photograph, or too much of one. */
export async function badFiles(browser) {
  const jpeg = await ball(browser, { name: "cut-off.jpg" });
  const text = (name, content, mimeType) => ({ name, mimeType, buffer: Buffer.from(content) });
  return [
    { ...jpeg, buffer: jpeg.buffer.subarray(0, Math.floor(jpeg.buffer.length / 2)) },
    plainPng("huge.png", 20_000, 20_000, { data: false }),
    plainPng("bomb.png", 12_000, 12_000),
    text("drawing.svg", "<svg xmlns='http://www.w3.org/2000/svg' width='9' height='9'/>", "image/svg+xml"),
    text("note.jpg", "Dear diary, this is no photograph.", "image/jpeg"),
    text("nothing.png", "", "image/png"),
  ];
}
