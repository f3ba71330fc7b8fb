// Content of a bag as Foxglove's own packages read it, as one object of JSON: for each topic digests of its content, in
// the form of benchmarks/bags.py, which calls this. node benchmarks/bags.mjs MODULES FILE

import { createHash } from "node:crypto";
import { open } from "node:fs/promises";
import { createRequire } from "node:module";
import path from "node:path";

const require = createRequire(path.resolve(process.argv[2], "package.json"));

function place(pose) {
  const { position, translation, orientation, rotation } = pose;
  const { x, y, z } = position ?? translation;
  const turn = orientation ?? rotation;
  return new Float64Array([x, y, z, turn.w, turn.x, turn.y, turn.z]);
}

function content(message) {
  if (message.encoding === "mono") {
    const bytes = message.events.slice();
    const words = new Uint32Array(bytes.buffer, bytes.byteOffset, bytes.length / 4);
    const times = new Float64Array(words.length / 2);
    const pixels = new Uint32Array(words.length / 2);
    for (let k = 0; k < times.length; k++) {
      times[k] = (Number(message.time_base) + words[2 * k]) / 1000;
      pixels[k] = words[2 * k + 1];
    }
    return [times, pixels];
  }
  if (message.pose) return [place(message.pose)];
  if (message.transforms) return message.transforms.map((one) => place(one.transform));
  if (message.encoding) return [message.data];
  if (message.distortion_model) return [new Float64Array([...(message.k ?? message.K), ...(message.d ?? message.D)])];
  if (typeof message.data === "boolean") return [new Uint8Array([message.data ? 1 : 0])];
  if (typeof message.data === "number") return [new Float32Array([message.data])];
  return [Buffer.from(message.data)];
}

async function* ofMcap(file) {
  const { McapIndexedReader } = require("@mcap/core");
  const { parse } = require("@foxglove/rosmsg");
  const { MessageReader } = require("@foxglove/rosmsg2-serialization");
  const handle = await open(file);
  const readable = {
    size: async () => BigInt((await handle.stat()).size),
    read: async (offset, size) => {
      const buffer = new Uint8Array(Number(size));
      await handle.read(buffer, 0, Number(size), Number(offset));
      return buffer;
    },
  };
  const reader = await McapIndexedReader.Initialize({ readable });
  const decoders = new Map();
  for await (const { channelId, data } of reader.readMessages()) {
    const channel = reader.channelsById.get(channelId);
    if (!decoders.has(channelId)) {
      const text = new TextDecoder().decode(reader.schemasById.get(channel.schemaId).data);
      decoders.set(channelId, new MessageReader(parse(text, { ros2: true })));
    }
    yield { topic: channel.topic, message: decoders.get(channelId).readMessage(data) };
  }
  await handle.close();
}

async function* ofBag(file) {
  const { Bag } = require("@foxglove/rosbag");
  const { FileReader } = require("@foxglove/rosbag/node");
  const bag = new Bag(new FileReader(file));
  await bag.open();
  yield* bag.messageIterator();
}

const file = process.argv[3];
const topics = {};
for await (const { topic, message } of file.endsWith(".bag") ? ofBag(file) : ofMcap(file)) {
  const parts = content(message);
  topics[topic] ??= parts.map(() => createHash("sha256"));
  parts.forEach((part, k) => topics[topic][k].update(new Uint8Array(part.buffer, part.byteOffset, part.byteLength)));
}
console.log(JSON.stringify(topics, (_, value) => (value.digest ? value.digest("hex") : value)));
