// write_bags.mjs WORK SCANS OUT [FORM ...]: a folder of scans (binary PCD called by their stamps, odometry.tum) as bags of
// ROS 2, by other people's writers: @mcap/core, sql.js with @foxglove/rosmsg2-serialization; what they wrote as SQLite is read
// again by @foxglove/rosbag2. FORMS: plain, zstd, lz4, packed, unchunked, split, tf, sqlite. All: without a name.
import assert from "node:assert/strict";
import { mkdirSync, openSync, readFileSync, readdirSync, writeFileSync, writeSync, closeSync } from "node:fs";
import { createRequire } from "node:module";
import path from "node:path";

const [work, scansFolder, out, ...forms] = process.argv.slice(2);
const require = createRequire(path.resolve(work, "package.json"));
const { McapWriter } = require("@mcap/core");
const { MessageWriter } = require("@foxglove/rosmsg2-serialization");
const { ros2humble } = require("@foxglove/rosmsg-msgs-common");
const zstd = require("@foxglove/wasm-zstd");
const lz4 = require("lz4js");

const wanted = (form) => forms.length === 0 || forms.includes(form);
await zstd.isLoaded;
mkdirSync(out, { recursive: true });

// --- the scans
const nsOf = (text) => {
  const [whole, part = ""] = text.split(".");
  return BigInt(whole) * 1000000000n + BigInt(part.padEnd(9, "0").slice(0, 9));
};
const timeOf = (ns) => ({ sec: Number(ns / 1000000000n), nanosec: Number(ns % 1000000000n) });

function readPcd(file) {
  const bytes = readFileSync(file);
  const data = bytes.indexOf("DATA binary\n") + "DATA binary\n".length;
  const header = bytes.subarray(0, data).toString();
  const count = Number(/POINTS\s+(\d+)/.exec(header)[1]);
  const step = /SIZE (.*)/.exec(header)[1].split(" ").reduce((sum, size) => sum + Number(size), 0);
  return Array.from({ length: count }, (_, i) => [0, 4, 8].map((at) => bytes.readFloatLE(data + i * step + at)));
}

const scans = readdirSync(scansFolder)
  .filter((name) => name.endsWith(".pcd"))
  .map((name) => ({ file: path.join(scansFolder, name), ns: nsOf(name.slice(0, -4)) }))
  .sort((a, b) => (a.ns < b.ns ? -1 : 1));
const odometry = readFileSync(path.join(scansFolder, "odometry.tum"), "utf8")
  .split("\n")
  .filter((line) => line !== "" && !line.startsWith("#"))
  .map((line) => {
    const [stamp, x, y, z, qx, qy, qz, qw] = line.split(" ");
    const number = Number;
    return {
      ns: nsOf(stamp),
      position: { x: number(x), y: number(y), z: number(z) },
      orientation: { x: number(qx), y: number(qy), z: number(qz), w: number(qw) },
    };
  });

// --- messages
const float32 = 7;
const float64 = 8;
const field = (name, offset, datatype) => ({ name, offset, datatype, count: 1 });

/// As a driver of a spinning lidar has it: x y z intensity, one row.
function plainCloud(points, ns) {
  const step = 16;
  const data = Buffer.alloc(points.length * step);
  points.forEach((point, i) => point.forEach((value, axis) => data.writeFloatLE(value, i * step + 4 * axis)));
  return {
    header: { stamp: timeOf(ns), frame_id: "base_link" },
    height: 1, width: points.length,
    fields: [field("x", 0, float32), field("y", 4, float32), field("z", 8, float32), field("intensity", 12, float32)],
    is_bigendian: false, point_step: step, row_step: data.length, data, is_dense: true,
  };
}

/// Doubles, big endian, two rows with a gap behind each, fields in another order.
function oddCloud(points, ns) {
  const step = 26;
  const width = Math.ceil(points.length / 2);
  const rowStep = width * step + 6;
  const data = Buffer.alloc(2 * rowStep);
  for (let i = 0; i < 2 * width; i++) {
    const at = Math.floor(i / width) * rowStep + (i % width) * step;
    const point = points[i] ?? [NaN, NaN, NaN];
    data.writeDoubleBE(point[2], at);
    data.writeDoubleBE(point[0], at + 8);
    data.writeDoubleBE(point[1], at + 16);
  }
  return {
    header: { stamp: timeOf(ns), frame_id: "base_link" },
    height: 2, width,
    fields: [field("z", 0, float64), field("x", 8, float64), field("y", 16, float64), field("ring", 24, 4)],
    is_bigendian: true, point_step: step, row_step: rowStep, data, is_dense: false,
  };
}

const covariance = new Array(36).fill(0);
const zero = { x: 0, y: 0, z: 0 };
const odometryMessage = (pose) => ({
  header: { stamp: timeOf(pose.ns), frame_id: "odom" },
  child_frame_id: "base_link",
  pose: { pose: { position: pose.position, orientation: pose.orientation }, covariance },
  twist: { twist: { linear: zero, angular: zero }, covariance },
});
const tfMessage = (pose) => ({
  transforms: [{
    header: { stamp: timeOf(pose.ns), frame_id: "odom" }, child_frame_id: "base_link",
    transform: { translation: pose.position, rotation: pose.orientation },
  }],
});

const types = { cloud: "sensor_msgs/PointCloud2", odometry: "nav_msgs/Odometry", tf: "tf2_msgs/TFMessage" };

function definitionsOf(type) {
  const found = new Map();
  const add = (name) => {
    if (found.has(name) || !ros2humble[name]) return;
    found.set(name, ros2humble[name]);
    ros2humble[name].definitions.filter((each) => each.isComplex).forEach((each) => add(each.type));
  };
  add(type);
  return [...found.values()];
}
const writers = Object.fromEntries(
  Object.entries(types).map(([key, type]) => [key, new MessageWriter(definitionsOf(type))]));
const definitionText = (type) =>
  definitionsOf(type)
    .map((each, i) => (i === 0 ? "" : "=".repeat(80) + `\nMSG: ${each.name}\n`) +
      each.definitions.filter((f) => !f.isConstant).map((f) =>
        `${f.type}${f.isArray ? `[${f.arrayLength ?? ""}]` : ""} ${f.name}\n`).join(""))
    .join("");

/// In the order of their stamps, odometry before the scan of its time; handed on a little later.
function* messages({ cloud = plainCloud, hasTf = false, from = 0, to = scans.length } = {}) {
  let next = 0;
  const first = from === 0 ? 0n : scans[from - 1].ns + 1n;
  const last = to === scans.length ? 1n << 62n : scans[to - 1].ns;
  while (next < odometry.length && odometry[next].ns < first) next++;
  const pose = (each) => hasTf
    ? { topic: "/tf", key: "tf", log: each.ns + 1000000n, data: writers.tf.writeMessage(tfMessage(each)) }
    : { topic: "/odom", key: "odometry", log: each.ns + 1000000n, data: writers.odometry.writeMessage(odometryMessage(each)) };
  for (const scan of scans.slice(from, to)) {
    for (; next < odometry.length && odometry[next].ns <= scan.ns; next++) yield pose(odometry[next]);
    yield {
      topic: "/points", key: "cloud", log: scan.ns + 60000000n,
      data: writers.cloud.writeMessage(cloud(readPcd(scan.file), scan.ns)),
    };
  }
  for (; next < odometry.length && odometry[next].ns <= last; next++) yield pose(odometry[next]);
}

// --- MCAP
async function writeMcap(file, all, options = {}) {
  const fd = openSync(file, "w");
  let position = 0n;
  const writable = {
    position: () => position,
    write: async (bytes) => {
      writeSync(fd, bytes);
      position += BigInt(bytes.byteLength);
    },
  };
  const writer = new McapWriter({ writable, ...options });
  await writer.start({ profile: "ros2", library: "alces test" });
  const channels = new Map();
  let sequence = 0;
  for (const message of all) {
    if (!channels.has(message.topic)) {
      const name = types[message.key].replace("/", "/msg/");
      const schemaId = await writer.registerSchema({
        name, encoding: "ros2msg", data: Buffer.from(definitionText(types[message.key])),
      });
      channels.set(message.topic, await writer.registerChannel({
        topic: message.topic, schemaId, messageEncoding: "cdr", metadata: new Map(),
      }));
    }
    await writer.addMessage({
      channelId: channels.get(message.topic), sequence: sequence++, logTime: message.log, publishTime: message.log,
      data: message.data,
    });
  }
  await writer.end();
  closeSync(fd);
}

const zstdChunk = (data) => ({ compression: "zstd", compressedData: zstd.compress(data, 1) });
const lz4Chunk = (data) => ({ compression: "lz4", compressedData: lz4.compress(data) });

function metadata(storage, files, compression = {}) {
  return `rosbag2_bagfile_information:
  version: 5
  storage_identifier: ${storage}
  duration:
    nanoseconds: 0
  starting_time:
    nanoseconds_since_epoch: 0
  message_count: 0
  topics_with_message_count:
    []
  compression_format: "${compression.format ?? ""}"
  compression_mode: "${compression.mode ?? ""}"
  relative_file_paths:
${files.map((file) => `    - ${file}\n`).join("")}`;
}

// --- SQLite
async function writeSqlite(folder, all) {
  const SQL = await require("sql.js")();
  const database = new SQL.Database();
  database.run(`CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT NOT NULL, type TEXT NOT NULL,
    serialization_format TEXT NOT NULL, offered_qos_profiles TEXT NOT NULL)`);
  database.run(`CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER NOT NULL, timestamp INTEGER NOT NULL,
    data BLOB NOT NULL)`);
  database.run("CREATE INDEX timestamp_idx ON messages (timestamp ASC)");
  const topics = new Map();
  let count = 0;
  for (const message of all) {
    if (!topics.has(message.topic)) {
      topics.set(message.topic, topics.size + 1);
      database.run("INSERT INTO topics VALUES (?, ?, ?, 'cdr', '')",
        [topics.size, message.topic, types[message.key].replace("/", "/msg/")]);
    }
    // a number would lose nanoseconds
    database.run(`INSERT INTO messages(topic_id, timestamp, data) VALUES (${topics.get(message.topic)}, ${message.log}, ?)`,
      [message.data]);
    count++;
  }
  mkdirSync(folder, { recursive: true });
  writeFileSync(path.join(folder, "bag_0.db3"), Buffer.from(database.export()));
  writeFileSync(path.join(folder, "metadata.yaml"), metadata("sqlite3", ["bag_0.db3"]));
  await checkSqlite(folder, SQL, count);
}

/// @foxglove/rosbag2 has no SQLite of its own: it gets this one.
async function checkSqlite(folder, SQL, count) {
  const { Rosbag2 } = require("@foxglove/rosbag2");
  const database = new SQL.Database(readFileSync(path.join(folder, "bag_0.db3")));
  const topics = database.exec("SELECT id, name, type FROM topics")[0].values.map(([id, name, type]) =>
    ({ id, name, type, serializationFormat: "cdr", offeredQosProfiles: [] }));
  const sqlite = {
    open: async () => {},
    close: async () => {},
    readTopics: async () => topics,
    readMessages: async function* () {
      const rows = database.prepare("SELECT topic_id, CAST(timestamp AS TEXT), data FROM messages ORDER BY timestamp");
      while (rows.step()) {
        const [id, text, data] = rows.get();
        const ns = BigInt(text);
        yield {
          topic: topics.find((topic) => topic.id === id), data,
          timestamp: { sec: Number(ns / 1000000000n), nsec: Number(ns % 1000000000n) },
        };
      }
    },
  };
  const bag = new Rosbag2([sqlite]);
  await bag.open();
  let read = 0;
  let clouds = 0;
  for await (const message of bag.readMessages()) {
    read++;
    if (message.topic.name === "/points") assert.equal(message.value.header.stamp.nsec, Number(scans[clouds++].ns % 1000000000n));
  }
  assert.equal(read, count);
  assert.equal(clouds, scans.length);
}

const bag = (name) => path.join(out, name);
if (wanted("plain")) await writeMcap(bag("plain.mcap"), messages());
if (wanted("zstd")) await writeMcap(bag("zstd.mcap"), messages(), { compressChunk: zstdChunk });
if (wanted("lz4")) await writeMcap(bag("lz4.mcap"), messages(), { compressChunk: lz4Chunk });
if (wanted("unchunked")) await writeMcap(bag("unchunked.mcap"), messages({ cloud: oddCloud }), { useChunks: false });
if (wanted("tf")) await writeMcap(bag("tf.mcap"), messages({ hasTf: true }));
if (wanted("packed")) {  // as rosbag2 has it with compression_mode: MESSAGE
  mkdirSync(bag("packed"), { recursive: true });
  const packed = function* () {
    for (const message of messages()) yield { ...message, data: zstd.compress(message.data, 1) };
  };
  await writeMcap(bag("packed/bag_0.mcap"), packed());
  writeFileSync(bag("packed/metadata.yaml"), metadata("mcap", ["bag_0.mcap"], { format: "zstd", mode: "MESSAGE" }));
}
if (wanted("split")) {
  mkdirSync(bag("split"), { recursive: true });
  const middle = Math.floor(scans.length / 2);
  await writeMcap(bag("split/bag_0.mcap"), messages({ to: middle }), { compressChunk: zstdChunk });
  await writeMcap(bag("split/bag_1.mcap"), messages({ from: middle }), { compressChunk: zstdChunk });
  writeFileSync(bag("split/metadata.yaml"), metadata("mcap", ["bag_0.mcap", "bag_1.mcap"]));
}
if (wanted("sqlite")) await writeSqlite(bag("sqlite"), messages({ cloud: oddCloud }));
