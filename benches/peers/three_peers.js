// three.js, as its AnimationMixer samples a track: one interpolant a track, one sample after the other.
//
//   NODE_PATH=… node three_peers.js KEYS FOLDER    called by race.py
const fs = require("fs");
const path = require("path");
const { QuaternionKeyframeTrack, REVISION } = require("three");

const [keysPath, folder] = process.argv.slice(2);
const file = fs.readFileSync(keysPath);
const [tracks, keys, frames] = [0, 4, 8].map((at) => file.readUInt32LE(at));
const rate = file.readDoubleLE(12);
const from = (start, length) => file.buffer.slice(file.byteOffset + start, file.byteOffset + start + length);
const times = new Float64Array(from(20, 8 * tracks * keys));
const values = new Float32Array(from(20 + 8 * tracks * keys, 16 * tracks * keys));

const interpolants = Array.from({ length: tracks }, (_, track) => {
  const ofTrack = (list, size) => list.subarray(track * keys * size, (track + 1) * keys * size);
  const keyframes = new QuaternionKeyframeTrack("a.quaternion", Array.from(ofTrack(times, 1)), Array.from(ofTrack(values, 4)));
  return keyframes.createInterpolant(new Float32Array(4));
});
const output = new Float32Array(4 * tracks * frames);
const seconds = [];
for (let turn = 0; turn < 4; turn++) {
  const started = process.hrtime.bigint();
  interpolants.forEach((interpolant, track) => {
    for (let frame = 0; frame < frames; frame++) {
      output.set(interpolant.evaluate(frame / rate), 4 * (track * frames + frame));
    }
  });
  if (turn > 0) seconds.push(Number(process.hrtime.bigint() - started) / 1e6);
}
seconds.sort((a, b) => a - b);
const name = "three.js QuaternionLinearInterpolant";
fs.writeFileSync(path.join(folder, `${name}.f32`), Buffer.from(output.buffer, 0, 16 * frames));
console.log(JSON.stringify({ name, work: "slerp", ms: seconds[1], row: `${name}.f32`, threads: "1", version: REVISION }));
