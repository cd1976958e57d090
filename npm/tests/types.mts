// Calls that the types allow: compiled by scripts/npm.sh, not run.

import { load, sample, TumbleError, type Clip, type Pose } from "tumble";
const engine = await load();
const clip: Clip = engine.clip([{ name: "door", times: new Float64Array([0, 1]), rotations: [0, 0, 0, 1, 0, 0, 0, 1] }]);
const pose: Pose = sample(clip, { fps: "30000/1001" }, { method: "c2", layout: "frame", ends: "natural" });
const first: number = pose.rotations[0];
const moved: Float32Array | null = pose.translations;
const v = clip.velocities(0.5, { axes: "parent" }).values;
// @ts-expect-error there is no such layout
clip.sample([0], { layout: "frame-major" });
// @ts-expect-error nobody makes clips so
new (class extends TumbleError {})("a", "b").code = "c";
const hip: Float32Array = clip.sampler({ after: "loop" }).sample(0, 0.5);
// @ts-expect-error a sampler has one pose at a time
clip.sampler({ layout: "frame" }).pose(hip[0]);
for (const { name } of engine.methods) console.log(name, first, moved, v.length, engine.read(new ArrayBuffer(4)).clips.length);
