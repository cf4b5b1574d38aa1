// make_scans.mjs OUT: twelve scans of a room with a pillar, as binary PCD called by their stamps, and odometry.tum at 20 Hz with
// an error that grows. The same every time.
import { mkdirSync, writeFileSync } from "node:fs";
import path from "node:path";

const [out] = process.argv.slice(2);
mkdirSync(out, { recursive: true });
const begin = 1700000000;

let state = 1n;  // numbers that look random
const random = () => {
  state = (state * 6364136223846793005n + 1442695040888963407n) & ((1n << 64n) - 1n);
  return Number(state >> 40n) / 2 ** 24;
};
const stampText = (milliseconds) => `${begin + Math.floor(milliseconds / 1000)}.${String(milliseconds % 1000).padStart(3, "0")}000000`;
const poseAt = (s) => ({ x: 0.5 * s, y: 0.2 * Math.sin(s), yaw: 0.2 * s });

function scanAt(s) {
  const pose = poseAt(s);
  const points = [];
  for (let i = 0; i < 1500; i++) {
    const wall = i % 6;
    const along = random() * 2 - 1;
    const up = random() * 3;
    const world = [
      [8, 6 * along, up], [-8, 6 * along, up], [8 * along, 6, up], [8 * along, -6, up], [8 * along, random() * 12 - 6, 0],
      [3 + 0.4 * Math.cos(9 * along), 2 + 0.4 * Math.sin(9 * along), up],
    ][wall];
    const [dx, dy] = [world[0] - pose.x, world[1] - pose.y];
    points.push([
      Math.cos(pose.yaw) * dx + Math.sin(pose.yaw) * dy + 0.01 * random(),
      -Math.sin(pose.yaw) * dx + Math.cos(pose.yaw) * dy + 0.01 * random(),
      world[2] - 1,
    ]);
  }
  return points;
}

for (let i = 0; i < 12; i++) {
  const points = scanAt(0.5 * i);
  const data = Buffer.alloc(12 * points.length);
  points.forEach((point, k) => point.forEach((value, axis) => data.writeFloatLE(value, 12 * k + 4 * axis)));
  const header = "VERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\n" +
    `WIDTH ${points.length}\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS ${points.length}\nDATA binary\n`;
  writeFileSync(path.join(out, `${stampText(500 * i)}.pcd`), Buffer.concat([Buffer.from(header), data]));
}
let tum = "";
for (let milliseconds = 0; milliseconds <= 5500; milliseconds += 50) {
  const s = milliseconds / 1000;
  const pose = poseAt(1.01 * s);
  tum += `${stampText(milliseconds)} ${pose.x.toFixed(7)} ${pose.y.toFixed(7)} 0.0000000 0 0 ` +
    `${Math.sin(pose.yaw / 2).toFixed(12)} ${Math.cos(pose.yaw / 2).toFixed(12)}\n`;
}
writeFileSync(path.join(out, "odometry.tum"), tum);
