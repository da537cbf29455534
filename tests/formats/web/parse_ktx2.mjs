// Reads a KTX2 file by ktx-parse and says what it understood; and whether what ktx-parse writes of
// that is read as the same again.
import { readFileSync } from "node:fs";
import { createRequire } from "node:module";
import { pathToFileURL } from "node:url";

const [, , modules, file] = process.argv;
const resolve = createRequire(pathToFileURL(`${modules}/`)).resolve;
const { read, write } = await import(pathToFileURL(resolve("ktx-parse")));

function described(container) {
  const [descriptor] = container.dataFormatDescriptor;
  return {
    width: container.pixelWidth,
    height: container.pixelHeight,
    format: container.vkFormat,
    scheme: container.supercompressionScheme,
    unpacked: container.levels.map((level) => level.uncompressedByteLength),
    levels: container.levels.map((level) => level.levelData.byteLength),
    transfer: descriptor.transferFunction,
    flags: descriptor.flags,
    model: descriptor.colorModel,
    block: [...descriptor.texelBlockDimension].slice(0, 2),
    samples: descriptor.samples.map((sample) => [
      sample.channelType, sample.bitOffset, sample.bitLength,
    ]),
    keys: container.keyValue,
  };
}

const container = read(new Uint8Array(readFileSync(file)));
const once = described(container);
const again = described(read(write(container, { keepWriter: true })));
const data = (each) => Buffer.concat(each.levels.map((level) => Buffer.from(level.levelData)));
const same = JSON.stringify(once) === JSON.stringify(again) &&
  data(container).equals(data(read(write(container, { keepWriter: true }))));
console.log(JSON.stringify({ ...once, same }));
