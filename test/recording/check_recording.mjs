// check_recording.mjs MAKE_RECORDING FOLDER: lets MAKE_RECORDING write a drive into FOLDER and reads it with @mcap/core,
// decodes every message with its own schema (@foxglove/rosmsg, @foxglove/rosmsg2-serialization), and compares with
// what was recorded; then the same file, cut off.
import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import { readFileSync } from "node:fs";
import { createRequire } from "node:module";
import path from "node:path";

const [makeRecording, folder] = process.argv.slice(2);
// The packages lie in FOLDER, this script lies among the sources.
const require = createRequire(path.resolve(folder, "package.json"));
const { McapIndexedReader, McapStreamReader } = require("@mcap/core");
const { parse } = require("@foxglove/rosmsg");
const { MessageReader } = require("@foxglove/rosmsg2-serialization");

const eventCount = 2000;
const file = path.join(folder, "drive.mcap");
const made = JSON.parse(execFileSync(makeRecording, [file, String(eventCount)], { encoding: "utf8" }));
const bytes = readFileSync(file);
assert.equal(bytes.length, made.bytes);
assert.equal(made.events_unknown, 0);

// --- CRC-32, one bit at a time
const crcTable = Array.from({ length: 256 }, (_, n) => {
  for (let k = 0; k < 8; k++) n = n & 1 ? 0xedb88320 ^ (n >>> 1) : n >>> 1;
  return n >>> 0;
});
function crc32(data) {
  let crc = 0xffffffff;
  for (const byte of data) crc = crcTable[(crc ^ byte) & 0xff] ^ (crc >>> 8);
  return ~crc >>> 0;
}

// --- decoding
class Decoder {
  schemas = new Map();
  channels = new Map();
  readers = new Map();
  add(record) {
    if (record.type === "Schema") this.schemas.set(record.id, record);
    if (record.type === "Channel") this.channels.set(record.id, record);
  }
  topic(message) {
    return this.channels.get(message.channelId).topic;
  }
  decode(message) {
    const channel = this.channels.get(message.channelId);
    assert.equal(channel.messageEncoding, "cdr");
    assert.ok(channel.metadata.has("offered_qos_profiles"), "the ros2 profile asks for offered_qos_profiles");
    let reader = this.readers.get(channel.schemaId);
    if (!reader) {
      const schema = this.schemas.get(channel.schemaId);
      assert.equal(schema.encoding, "ros2msg");
      reader = new MessageReader(parse(new TextDecoder().decode(schema.data), { ros2: true }));
      this.readers.set(channel.schemaId, reader);
    }
    return reader.readMessage(message.data);
  }
}

// --- what sample_drive.h records
const stampOf = (i) => BigInt(made.begin_ns) + BigInt(i) * 1234567n - ([1, 2].includes(i % 13) ? 700000n : 0n);
const nsOf = (time) => BigInt(time.sec) * 1000000000n + BigInt(time.nsec ?? time.nanosec);

function checkEvent(i, topic, message, value) {
  const kind = i % 13;
  assert.equal(message.publishTime, stampOf(i), `event ${i}: publish time`);
  const stamp = value.header ? value.header.stamp : value.stamp;
  assert.equal(nsOf(stamp), stampOf(i), `event ${i}: stamp`);
  const bus = Math.floor(i / 13) % 2;
  if (kind === 0) {
    const topics = { 7: "/alces/orders", 8: "/alces/syncs", 9: "/alces/stop" };
    assert.equal(topic, topics[Math.floor(i / 13) % 10] ?? "/alces/tick");
  }
  if (kind === 1 || kind === 2) {
    assert.equal(topic, `/can${bus}/${kind === 1 ? "rx" : "tx"}`);
    assert.equal(value.id, 0x181 + (i % 3));
    assert.equal(value.dlc, i % 9);
    assert.deepEqual([...value.data].slice(0, value.dlc), Array.from({ length: i % 9 }, (_, b) => (i + b) & 255));
    assert.equal(value.is_rtr || value.is_extended || value.is_error, false);
  }
  if (kind === 3) {
    assert.equal(value.id, 0x12345678);
    assert.equal(value.is_rtr && value.is_extended, true);
    assert.equal(value.dlc, 4);
  }
  if (kind === 4) assert.equal(value.is_error, true);
  if (kind === 5) {
    assert.equal(topic, "/can0/rx_fd");
    assert.equal(value.is_fd && value.is_bit_rate_switched, true);
    assert.equal(value.is_error_state_indicated, i % 2 === 0);
    assert.deepEqual([...value.data], Array.from({ length: i % 2 === 0 ? 64 : 12 }, (_, b) => (3 * b) & 255));
  }
  if (kind === 6 || kind === 7) {
    assert.equal(topic, "/alces/edges");
    assert.deepEqual([value.line, value.is_rising, value.sequence], [i % 3, i % 2 === 0, 1 + Math.floor(i / 13)]);
  }
  if (kind === 8) assert.deepEqual([topic, value.line, value.lost_count], ["/alces/edges_lost", 1, i]);
  if (kind >= 9 && kind <= 11) {
    const name = ["laser_a", "laser_b", "gps"][i % 3];
    assert.equal(topic, `/${name}/${kind === 10 ? "tx" : "rx"}`);
    assert.equal(value.channel, i % 3);
    assert.equal(value.is_sent, kind === 10);
    assert.deepEqual([...value.data], Array.from({ length: 5 + (i % 100) }, (_, b) => (i * 7 + b) & 255));
  }
  if (kind === 12) assert.deepEqual([value.medium, value.channel, value.is_up], [i % 2, i % 2, i % 4 < 2]);
}

function checkResult(number, topic, value) {
  const stamp = BigInt(made.begin_ns) + BigInt(number) * 20000000n;
  if (topic === "/alces/scan_info") {
    assert.equal(value.number, number);
    assert.equal(nsOf(value.header.stamp), stamp);
    assert.equal(value.begin_stamp_ns, stamp - 1000n);
    assert.equal(value.verdict, number % 4 === 3 ? "dropped: the mapper was busy" : "mapped");
    assert.equal(value.head_turn_rad, 3.25);
    assert.equal(value.odometry_from_body.position.x, 0.5 * number);
    assert.deepEqual({ ...value.gps_position_m }, { x: 1, y: 2, z: 3 });
  } else if (topic === "/alces/cloud") {
    assert.equal(value.header.frame_id, "body");
    assert.deepEqual([value.height, value.width, value.point_step, value.row_step], [1, 10, 12, 120]);
    assert.deepEqual(value.fields.map((f) => [f.name, f.offset, f.datatype, f.count]),
                     [["x", 0, 7, 1], ["y", 4, 7, 1], ["z", 8, 7, 1]]);
    assert.equal(value.is_bigendian, false);
    const view = new DataView(value.data.buffer, value.data.byteOffset, value.data.byteLength);
    assert.deepEqual([108, 112, 116].map((at) => view.getFloat32(at, true)), [9, number, -1.5]);
  } else if (topic === "/alces/pose") {
    assert.equal(value.header.frame_id, "map");
    assert.equal(value.pose.position.y, -0.25 * number);
    assert.ok(Math.abs(value.pose.orientation.w - Math.cos(0.005 * number)) < 1e-12);
  } else if (topic === "/tf") {
    assert.equal(value.transforms.length, 1);
    const [{ header, child_frame_id: child, transform }] = value.transforms;
    assert.deepEqual([nsOf(header.stamp), header.frame_id, child], [stamp, "map", "body"]);
    assert.deepEqual({ ...transform.translation }, { x: 0.5 * number, y: -0.25 * number, z: 0.125 });
    assert.ok(Math.abs(transform.rotation.z - Math.sin(0.005 * number)) < 1e-12);
  } else if (topic === "/alces/path") {
    assert.deepEqual(value.poses.map((p) => p.pose.position.x), [0, 0.5, 1, 1.5]);
    assert.equal(nsOf(value.poses[3].header.stamp), BigInt(made.begin_ns) + 3n);
  } else if (topic === "/alces/loops") {
    assert.deepEqual([value.first, value.last, value.is_closed, value.verdict, value.correction_m, value.iterations],
                     [1, number, true, "closed", 1.25, 11]);
  } else if (topic === "/alces/graph_edges") {
    assert.deepEqual([value.from_scan, value.to_scan, value.closes_loop, value.variance_rotation_rad2],
                     [number, number + 1, number === 7, 0.04]);
  } else if (topic === "/diagnostics") {
    assert.equal(value.status.length, 1);
    const [status] = value.status;
    assert.ok(status.name === "motor" ? status.level === 1 && status.values[0].value === "25376"
                                      : status.values.some((v) => v.key === "bytes_written"));
  } else {
    assert.fail(`unexpected topic ${topic}`);
  }
}

const resultTopics = new Set(["/alces/scan_info", "/alces/cloud", "/alces/pose", "/tf", "/alces/path",
                              "/alces/loops", "/alces/graph_edges", "/diagnostics"]);

/// Compares one message after the other with what was recorded, in that order.
function follower() {
  let events = 0;
  let messages = 0;
  let lastLogTime = 0n;
  return {
    follow(topic, message, value) {
      assert.ok(message.logTime >= lastLogTime, "log times do not decrease");
      lastLogTime = message.logTime;
      messages++;
      if (resultTopics.has(topic)) checkResult(events / 20 - 1, topic, value);
      else checkEvent(events++, topic, message, value);
    },
    get events() { return events; },
    get messages() { return messages; },
  };
}

// --- front to back
function readStream(data) {
  const reader = new McapStreamReader({ includeChunks: true, validateCrcs: true });
  const decoder = new Decoder();
  const counts = new Map();
  const follow = follower();
  const perTopic = new Map();
  let dataEnd;
  reader.append(data);
  for (let record; (record = reader.nextRecord()); ) {
    counts.set(record.type, (counts.get(record.type) ?? 0) + 1);
    decoder.add(record);
    if (record.type === "Chunk") assert.notEqual(record.uncompressedCrc, 0, "every chunk has a CRC");
    if (record.type === "DataEnd") dataEnd = record;
    if (record.type === "Message") {
      const topic = decoder.topic(record);
      assert.equal(record.sequence, perTopic.get(topic) ?? 0, `sequence of ${topic}`);
      perTopic.set(topic, record.sequence + 1);
      follow.follow(topic, record, decoder.decode(record));
    }
  }
  return { done: reader.done(), counts, follow, dataEnd, perTopic };
}

const stream = readStream(bytes);
assert.ok(stream.done, "a whole file");
assert.equal(stream.follow.events, eventCount);
assert.equal(stream.follow.messages, made.messages);
assert.equal(stream.counts.get("Chunk"), made.chunks);
assert.ok(made.chunks > 5);

// --- by the index
const readable = {
  size: async () => BigInt(bytes.length),
  read: async (offset, length) => new Uint8Array(bytes.buffer, bytes.byteOffset + Number(offset), Number(length)),
};
const indexed = await McapIndexedReader.Initialize({ readable });
assert.equal(indexed.header.profile, "ros2");
assert.equal(Number(indexed.statistics.messageCount), made.messages);
assert.equal(indexed.chunkIndexes.length, made.chunks);
const byId = new Map([...indexed.channelsById.values()].map((c) => [c.id, c.topic]));
for (const [id, count] of indexed.statistics.channelMessageCounts)
  assert.equal(Number(count), stream.perTopic.get(byId.get(id)) ?? 0, `statistics of ${byId.get(id)}`);

const dataEndOffset = Number(indexed.dataEndOffset);
assert.notEqual(stream.dataEnd.dataSectionCrc, 0);
assert.equal(stream.dataEnd.dataSectionCrc, crc32(bytes.subarray(0, dataEndOffset)), "CRC over the data section");
const summaryStart = Number(indexed.footer.summaryStart);
assert.notEqual(indexed.footer.summaryCrc, 0);
assert.equal(indexed.footer.summaryCrc, crc32(bytes.subarray(summaryStart, bytes.length - 8 - 4)), "summary CRC");

const decoder = new Decoder();
for (const schema of indexed.schemasById.values()) decoder.add(schema);
for (const channel of indexed.channelsById.values()) decoder.add(channel);
const byIndex = follower();
for await (const message of indexed.readMessages({ validateCrcs: true }))
  byIndex.follow(decoder.topic(message), message, decoder.decode(message));
assert.equal(byIndex.messages, made.messages);

let poses = 0;
for await (const message of indexed.readMessages({ topics: ["/alces/pose"] })) poses += message.data.length > 0;
assert.equal(poses, eventCount / 20);

const attachments = [];
for await (const attachment of indexed.readAttachments({ validateCrcs: true })) attachments.push(attachment);
assert.deepEqual(attachments.map((a) => [a.name, new TextDecoder().decode(a.data)]),
                 [["vehicle.toml", '[laser_a]\nmake = "LMS 291"\n']]);
for await (const metadata of indexed.readMetadata()) {
  assert.equal(metadata.name, "alces");
  assert.equal(metadata.metadata.get("clock"), "CLOCK_MONOTONIC");
  assert.equal(metadata.metadata.get("utc_offset_ns"), made.utc_offset_ns);
}

// --- cut off: all that was in whole chunks is there
const chunks = [...indexed.chunkIndexes].sort((a, b) => Number(a.chunkStartOffset - b.chunkStartOffset));
for (const [index, chunk] of chunks.entries()) {
  const begin = Number(chunk.chunkStartOffset);
  const end = begin + Number(chunk.chunkLength + chunk.messageIndexLength);
  for (const cut of [begin, begin + 5, begin + 700, end - 1, end]) {
    const part = readStream(bytes.subarray(0, cut));
    assert.equal(part.done, false);
    const whole = cut >= begin + Number(chunk.chunkLength) ? index + 1 : index;
    assert.equal(part.counts.get("Chunk") ?? 0, whole, `chunks in the first ${cut} bytes`);
  }
}

console.log(`${made.messages} messages on ${indexed.channelsById.size} topics in ${made.chunks} chunks: all decode, all CRCs right`);
