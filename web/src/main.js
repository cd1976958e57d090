// The state of the page, and the handlers of its controls.

import { Set as Input, decimals, mesh, placeInWords, rotation, skin } from "./data.js";
import { Ghost } from "./ghosts.js";
import { engine } from "./live.js";
import { Plots } from "./plots.js";
import { Stage } from "./scene.js";
import { colours, switchTheme } from "./theme.js";

const element = (id) => document.getElementById(id);
const stored = JSON.parse(element("data").textContent);
const inputs = stored.sets.map((set) => new Input(set));
for (const input of inputs) {
  for (const { set, ...found } of input.stored.ghosts) {
    const ghost = new Ghost(inputs[set], found);
    input.ghosts.push(ghost);
    inputs[set].ghosts.push(ghost.reversed(input));
  }
}
/** The index of a clip among the clips that are drawn together; it selects the clip's colour. */
const rank = (input) => input.ghosts.filter((ghost) => inputs.indexOf(ghost.input) < inputs.indexOf(input)).length;
const COLOURS = stored.boxColours;
// Chains with more boxes than this are hard to read, so their boxes are shown apart by default.
const CHAIN = 64;
const isTangle = (input) => !input.isSkeleton && input.boxes > CHAIN;
const SPEEDS = [0.1, 0.25, 0.5, 1, 2, 4];

const state = {
  input: inputs[0],
  method: inputs[0].methods[0],
  other: "",
  pairing: "ghost",
  apart: isTangle(inputs[0]),
  // -1 until the first result is loaded; then the joint that rotates most, or the first box.
  box: -1,
  picked: false,
  // Whether times between frames are evaluated and drawn, too.
  between: false,
  hasSkin: true,
  // Clips that are not drawn. At first these are the clips beyond the number of colours, so that no two have the same.
  hidden: new Set(inputs.filter((input) => rank(input) >= COLOURS.length)),
  time: 0,
  sample: 0,
  playing: false,
  loop: true,
  speed: 1,
};
let results = [];
// The ghosts that are drawn now.
let ghosts = [];
let stage = null;
const plots = new Plots({ components: element("components"), speeds: element("speeds") }, (time) => seek(time));

function fill(select, entries) {
  select.replaceChildren(
    ...entries.map(([value, text, title]) => {
      const option = new Option(text, value);
      if (title) option.title = title;
      return option;
    }),
  );
}

/**
 * Loads the selected results and redraws everything. If the engine refuses them, shows its error message and goes back to the
 * first stored method. Calls run one after another: a later selection must not be overwritten by an earlier one.
 */
let loading = Promise.resolve();
function load(refit = false) {
  loading = loading.then(async () => {
    try {
      await redraw(refit);
      complain("");
    } catch (error) {
      const [written] = state.input.written;
      if (state.method === written && state.other === "") throw error;
      Object.assign(state, { method: written, other: "" });
      await redraw(refit);
      complain(error.message);
    }
  });
  return loading;
}

async function redraw(refit) {
  const { input, method, other } = state;
  await input.unpack();
  const names = other && other !== method ? [method, other] : [method];
  const found = await Promise.all(names.map((name) => input.result(name)));
  const drawn = input.ghosts.filter((ghost) => !state.hidden.has(ghost.input));
  await Promise.all(drawn.map((ghost) => ghost.load(method)));
  // Assigned together after all awaits, because a frame may be drawn during any await.
  const before = ghosts;
  [results, ghosts] = [found, drawn];
  if (state.box < 0) state.box = input.isSkeleton ? input.busiest(results[0]) : 0;
  state.box = Math.min(state.box, input.boxes - 1);
  if (stage) {
    stage.fill(figures());
    if (refit || ghosts.some((ghost) => !before.includes(ghost))) stage.measure();
    if (refit) stage.frame(side());
    stage.paint(picked());
  }
  tell();
  drawPlots();
  show(Math.min(state.sample, input.samples - 1));
}

/** The figures for `Stage.fill`: the clip once for each selected method, then the ghosts. */
function figures() {
  const { input, apart } = state;
  const colours = ghosts.length > 0 ? [colourOfClip(input)] : COLOURS;
  const own = results.map((result, i) => {
    const isGhost = i > 0 && !side();
    const shown = { input, result, isGhost, colours: isGhost ? [colourOf(result.method)] : colours };
    return { ...shown, apart, side: side() ? 2 * i - 1 : 0, offset: [0, 0, 0], partner: (joint) => joint };
  });
  const others = ghosts.map((ghost) => ({
    input: ghost.input,
    result: ghost.result,
    isGhost: true,
    colours: [colourOfClip(ghost.input)],
    apart: apart || isTangle(ghost.input),
    side: side() ? -1 : 0,
    offset: ghost.offset(input),
    partner: (joint) => ghost.partner(joint),
  }));
  return [...own, ...others];
}

function complain(message) {
  if (!stage) return; // without WebGL the element shows why nothing is drawn
  element("trouble").hidden = message === "";
  element("trouble").textContent = message;
}

// Only a box that the user selected is highlighted; the one that is plotted at first is not.
const picked = () => (state.picked ? state.box : -1);
const side = () => results.length > 1 && state.pairing === "side";
const colourOf = (name) => stored.methods.find((method) => method.name === name).colour;
const colourOfClip = (input) => COLOURS[rank(input) % COLOURS.length];

/** Updates menus, names and legend from the state. */
function tell() {
  const { input } = state;
  fillMethods();
  element("title").textContent = input.name;
  document.title = `${input.name} · Tumble`;
  element("set").value = String(inputs.indexOf(input));
  element("method").value = state.method;
  element("other").value = state.other;
  element("pairing").value = state.pairing;
  element("pairing-field").hidden = results.length < 2;
  element("pairing-field").style.display = results.length < 2 ? "none" : "";
  element("arrangement").value = state.apart ? "apart" : "chain";
  element("arrangement-field").style.display = input.isSkeleton ? "none" : "";
  element("box-label").textContent = input.bodies ? "Body" : input.isSkeleton ? "Joint" : "Box";
  element("method-label").textContent = input.hasFrames ? "Frame" : "Method";
  element("box-name").textContent = input.isSkeleton ? input.names[state.box] : "";
  element("stage").ariaLabel = `The ${input.bodies ? "paths" : input.isSkeleton ? "bones" : "boxes"}. Drag, or use the arrow keys, to turn the view.`;
  element("rate-field").style.display = input.live ? "" : "none";
  element("between-field").style.display = input.live ? "" : "none";
  element("skin-field").style.display = input.skin ? "" : "none";
  element("rate").value = input.rate ?? "";
  element("between").checked = state.between;
  element("skin").checked = state.hasSkin;
  element("speed").value = String(state.speed);
  element("loop").checked = state.loop;
  element("box").max = String(input.boxes);
  element("box").value = String(state.box + 1);
  element("time").max = String(input.samples - 1);
  const legend = results.map(({ method }, i) => {
    const entry = document.createElement("span");
    const place = side() ? ["left: ", "right: "][i] : ["", "ghost: "][i];
    entry.textContent = place + method;
    entry.style.setProperty("--mark", colourOf(method));
    return entry;
  });
  element("legend").replaceChildren(...legend);
  tellClips();
  markKeys();
  const square = input.isSkeleton && stage?.floor?.visible && stage.square;
  element("floor").textContent = square ? `squares of ${Number(square.toPrecision(1))}` : "";
}

/** Updates the list of clips: the selected clip and those that can be its ghosts. */
function tellClips() {
  const { input } = state;
  element("clips").hidden = input.ghosts.length === 0;
  inputs.forEach((other, i) => {
    const field = element("clips").children[i];
    const ghost = input.ghosts.find((ghost) => ghost.input === other);
    field.hidden = !ghost && other !== input;
    field.classList.toggle("ghost", Boolean(ghost));
    field.querySelector("input").checked = !state.hidden.has(other);
    const method = ghost && ghosts.includes(ghost) && ghost.method !== state.method ? ` (${ghost.method})` : "";
    field.querySelector(".clip-name").textContent = other.name + method;
    field.querySelector(".note").textContent = ghost?.note ?? "";
  });
}

/** Fills the menus of methods: first those that are stored in the page, then those that the page's engine evaluates. */
function fillMethods() {
  const { methods, written } = state.input;
  const names = methods.join();
  if (element("method").dataset.names === names) return;
  element("method").dataset.names = names;
  const entries = (isWritten) =>
    stored.methods
      .filter(({ name }) => methods.includes(name) && written.includes(name) === isWritten)
      .map(({ name, summary }) => [name, name, summary]);
  fill(element("method"), entries(true));
  fill(element("other"), [["", "nothing"], ...entries(true)]);
  const others = entries(false);
  if (others.length === 0) return;
  for (const id of ["method", "other"]) {
    const group = document.createElement("optgroup");
    group.label = "evaluated in this page";
    fill(group, others);
    element(id).append(group);
  }
}

// More marks than this would merge into a line, so none are drawn.
const MOST_MARKS = 200;

/** Marks the key times of the selected box below the time slider. */
function markKeys() {
  const { input } = state;
  const { times } = input.keysOf(state.box);
  const [first, last] = [input.times[0], input.times[input.samples - 1]];
  const within = Array.from(times).filter((time) => time >= first && time <= last);
  const marks = within.length > MOST_MARKS ? [] : within.map((time) => new Option("", String(input.nearest(time))));
  element("key-marks").replaceChildren(...marks);
}

function drawPlots() {
  plots.show(state.input, results, state.box, colours(stored.methods));
  plots.now(state.input.times[state.sample] ?? 0);
}

/** Shows a sample or, for a `time` between this sample and the next, the pose that the engine evaluates there. */
function show(sample, time = state.input.times[sample]) {
  const { input } = state;
  state.sample = sample;
  if (!state.playing) state.time = time;
  const isBetween = time !== input.times[sample];
  const shown = isBetween ? results.map(({ method }) => input.live.pose(method, [time])) : results;
  const at = isBetween ? 0 : sample;
  const moments = ghosts.map((ghost) => ghost.at(time));
  if (stage) {
    const isHidden = state.hidden.has(input);
    const own = shown.map((result) => ({ result, sample: at, isHidden, matrices: matrices(input, result.method, time) }));
    const others = moments.map((moment, i) => {
      const ghost = ghosts[i];
      return moment && { ...moment, matrices: matrices(ghost.input, ghost.method, time + ghost.shift) };
    });
    stage.place([...own, ...others], { hasSkin: state.hasSkin });
  }
  tellDistances(moments, { result: shown[0], sample: at });
  plots.now(time);
  element("time").value = String(sample);
  element("time").setAttribute("aria-valuetext", `${time.toFixed(3)} seconds`);
  const key = input.keyAt(state.box, time);
  const keys = input.keysOf(state.box).times.length;
  element("clock").textContent =
    `${time.toFixed(3)} s, ${isBetween ? "after " : ""}sample ${sample + 1} of ${input.samples}` +
    (key >= 0 ? `, key ${key + 1} of ${keys}` : "");
  const [x, y, z, w] = rotation(shown[0], input.boxes, at, state.box);
  const turned = `w ${signed(w)}  x ${signed(x)}  y ${signed(y)}  z ${signed(z)}`;
  // The number of digits comes from the extent of the whole result, so that it does not change during playback.
  const { positions } = shown[0];
  const place = positions && { positions: { ...positions, size: results[0].positions.size } };
  element("box-values").textContent = turned + (input.isSkeleton ? `, at ${placeInWords(place, input.boxes, at, state.box)}` : "");
}

/** The matrices of the joints, if a skinned mesh needs them because the joints have scales; otherwise undefined. */
function matrices(input, method, time) {
  return input.skin && input.stored.hasScales && input.live ? input.live.matrices(method, time) : undefined;
}

/** Updates the text of each ghost: its largest distances from the clip at this time. */
function tellDistances(moments, own) {
  const { input } = state;
  const turned = (i) => stage && (stage.groups[i].turned ?? []);
  const digits = results[0].positions ? decimals(results[0]) : 0;
  inputs.forEach((other, i) => {
    const place = ghosts.findIndex((ghost) => ghost.input === other);
    const moment = moments[place] && { ...moments[place], turned: turned(results.length + place) };
    const words = place < 0 ? "" : ghosts[place].words(input, { ...own, turned: turned(0) }, moment, digits);
    element("clips").children[i].querySelector("output").textContent = words;
  });
}

/** Shows a time exactly if times between frames are enabled; otherwise the frame `sample`. */
function showTime(time, sample) {
  if (state.between && state.input.live) show(state.input.sampleAt(time), time);
  else show(sample);
}

const signed = (value) => (value < 0 ? "−" : "+") + Math.abs(value).toFixed(4);

/** Goes to a time, or to the nearest sample if times between frames are not evaluated. */
function seek(time) {
  const { times, samples } = state.input;
  const sample = state.input.nearest(time);
  state.time = times[sample];
  showTime(Math.min(Math.max(time, times[0]), times[samples - 1]), sample);
}

function step(samples) {
  play(false);
  show(Math.min(Math.max(state.sample + samples, 0), state.input.samples - 1));
}

function toKey(direction) {
  play(false);
  const now = state.time;
  const { times } = state.input.keysOf(state.box);
  const near = 1e-9 * Math.max(1, Math.abs(now));
  const found = direction > 0 ? times.find((time) => time > now + near) : times.findLast((time) => time < now - near);
  if (found !== undefined) seek(found);
}

function play(playing) {
  const { times, samples } = state.input;
  if (playing && state.sample === samples - 1) {
    state.time = times[0];
    show(0);
  }
  state.playing = playing;
  element("play").textContent = playing ? "Pause" : "Play";
  element("play").setAttribute("aria-pressed", String(playing));
}

function advance(seconds) {
  const { times, samples } = state.input;
  const last = times[samples - 1];
  state.time += seconds * state.speed;
  if (state.time > last) {
    const length = last - times[0];
    if (state.loop && length > 0) {
      state.time = times[0] + ((state.time - times[0]) % length);
    } else {
      state.time = last;
      play(false);
    }
  }
  showTime(state.time, state.input.sampleAt(state.time));
}

/** Evaluates frames at another rate in the page; null returns to the stored frames. */
function setRate(rate) {
  const { input, time } = state;
  if (!input.live) return;
  const before = input.rate;
  try {
    input.setRate(rate);
  } catch (error) {
    complain(error.message);
    element("rate").value = before ?? "";
    return;
  }
  state.sample = input.nearest(time);
  load();
}

function setBetween(on) {
  if (!state.input.live) return;
  state.between = on;
  tell();
  seek(state.time);
}

function setSkin(on) {
  state.hasSkin = on;
  tell();
  show(state.sample, state.time);
}

function setHidden(input, isHidden) {
  if (isHidden) state.hidden.add(input);
  else state.hidden.delete(input);
  load();
}

/** Hides all ghosts if any is visible; otherwise shows all. */
function toggleGhosts() {
  const others = state.input.ghosts.map((ghost) => ghost.input);
  const isHidden = others.some((other) => !state.hidden.has(other));
  for (const other of others) setHidden(other, isHidden);
}

function setMethod(name) {
  if (!state.input.methods.includes(name)) return; // the page has no result of it and cannot evaluate it
  state.method = name;
  load();
}

function setOther(name, pairing = state.pairing) {
  const before = side();
  Object.assign(state, { other: name, pairing });
  // The camera is reset only if the side-by-side layout begins or ends: a ghost takes no more space.
  load(before !== (name !== "" && pairing === "side"));
}

/** Advances the comparison with a second method: off, ghost, side by side, off. */
function nextPairing() {
  const names = state.input.methods;
  const other = ["slerp", "bessel-overhauser", ...names].find((name) => name !== state.method && names.includes(name));
  if (!other) return;
  if (!state.other) setOther(other, "ghost");
  else if (state.pairing === "ghost") setOther(other, "side");
  else setOther("", "ghost");
}

function arrange(apart) {
  if (state.input.isSkeleton) return; // the joints of a skeleton are connected and cannot be shown apart
  state.apart = apart;
  load(true);
}

function chooseBox(box) {
  const boxes = state.input.boxes;
  state.box = Math.min(Math.max(box, 0), boxes - 1);
  state.picked = true;
  stage?.paint(picked());
  tell();
  drawPlots();
  show(state.sample);
}

function faster(steps) {
  const place = Math.min(Math.max(SPEEDS.indexOf(state.speed) + steps, 0), SPEEDS.length - 1);
  state.speed = SPEEDS[place];
  tell();
}

function loop(on) {
  state.loop = on;
  tell();
}

function setInput(input) {
  // If the new clip was a ghost, the time and the selected joint stay the same.
  const ghost = state.input.ghosts.find((ghost) => ghost.input === input);
  const time = ghost ? state.time + ghost.shift : 0;
  if (ghost && state.picked) state.box = ghost.partner(state.box);
  if (state.box < 0) state.picked = false;
  state.hidden.delete(input);
  Object.assign(state, { input, sample: 0, time: 0, apart: isTangle(input) });
  if (!state.picked) state.box = -1;
  if (!input.methods.includes(state.method)) state.method = input.methods[0];
  if (!input.methods.includes(state.other)) state.other = "";
  load(true);
  if (ghost) loading = loading.then(() => seek(time));
}

function theme() {
  switchTheme();
  dress();
}

function dress() {
  const found = colours(stored.methods);
  stage?.theme({ ground: found.panel, line: found.line, pale: found.pale });
  if (results.length > 0) drawPlots();
}

const help = () => element("help").showModal();

const KEYS = [
  ["space", " ", "play or pause", () => play(!state.playing)],
  ["← →", ["ArrowLeft", "ArrowRight"], "one sample back or on; in the view, turn it", (key) => step(key === "ArrowLeft" ? -1 : 1)],
  ["[ ]", ["[", "]"], "to the key before, to the next key", (key) => toKey(key === "[" ? -1 : 1)],
  ["Home End", ["Home", "End"], "to the start, to the end", (key) => step(key === "Home" ? -Infinity : Infinity)],
  ["s", "s", "slerp", () => setMethod("slerp")],
  ["c", "c", "catmull-rom", () => setMethod("catmull-rom")],
  ["b", "b", "bessel-overhauser", () => setMethod("bessel-overhauser")],
  ["m", "m", "choose any other method", () => element("method").focus()],
  ["g", "g", "compare with another method: ghost, side by side, off", nextPairing],
  ["a", "a", "boxes as a chain, or apart", () => arrange(!state.apart)],
  ["n p", ["n", "p"], "curves of the next box, joint or body, of the one before", (key) => chooseBox(state.box + (key === "n" ? 1 : -1))],
  ["- +", ["-", "+", "="], "slower, faster", (key) => faster(key === "-" ? -1 : 1)],
  ["e", "e", "between frames, too, or frames alone", () => setBetween(!state.between)],
  ["k", "k", "what the joints carry", () => setSkin(!state.hasSkin)],
  ["h", "h", "the clips of other inputs as ghosts, or not", toggleGhosts],
  ["l", "l", "loop", () => loop(!state.loop)],
  ["r", "r", "the whole view again", () => stage?.frame(side())],
  ["t", "t", "light or dark", theme],
  ["?", "?", "these keys", help],
];

function pressed(event) {
  if (event.ctrlKey || event.metaKey || event.altKey || element("help").open) return;
  const { target, key } = event;
  // Menus and number fields handle all keys themselves, sliders the arrow keys, buttons and check boxes space and enter.
  if (target.matches("select, input[type=number]")) return;
  if (target.matches("input[type=range]") && /^(Arrow|Home|End|Page)/.test(key)) return;
  if (target.matches("button, input[type=checkbox]") && (key === " " || key === "Enter")) return;
  if (target === element("stage") && key.startsWith("Arrow")) {
    const turns = { ArrowLeft: [-0.1, 0], ArrowRight: [0.1, 0], ArrowUp: [0, 0.1], ArrowDown: [0, -0.1] };
    stage?.turn(...turns[key]);
    event.preventDefault();
    return;
  }
  if (target === element("stage") && (key === "PageUp" || key === "PageDown")) {
    stage?.zoom(key === "PageUp" ? 0.9 : 1.1);
    event.preventDefault();
    return;
  }
  const found = KEYS.find(([, keys]) => [keys].flat().includes(key));
  if (found) {
    event.preventDefault();
    found[3](key);
  }
}

function listen() {
  const on = (id, event, act) => element(id).addEventListener(event, act);
  addEventListener("keydown", pressed);
  on("play", "click", () => play(!state.playing));
  on("to-start", "click", () => step(-Infinity));
  on("key-before", "click", () => toKey(-1));
  on("key-after", "click", () => toKey(1));
  on("time", "input", (event) => {
    play(false);
    show(Number(event.target.value));
  });
  on("speed", "change", (event) => {
    state.speed = Number(event.target.value);
  });
  on("loop", "change", (event) => loop(event.target.checked));
  on("between", "change", (event) => setBetween(event.target.checked));
  on("skin", "change", (event) => setSkin(event.target.checked));
  on("rate", "change", (event) => setRate(event.target.value === "" ? null : Number(event.target.value)));
  on("set", "change", (event) => setInput(inputs[Number(event.target.value)]));
  on("method", "change", (event) => setMethod(event.target.value));
  on("other", "change", (event) => setOther(event.target.value));
  on("pairing", "change", (event) => setOther(state.other, event.target.value));
  on("arrangement", "change", (event) => arrange(event.target.value === "apart"));
  on("box", "change", (event) => chooseBox(Number(event.target.value) - 1 || 0));
  on("theme", "click", theme);
  on("help-open", "click", help);
  let down = null;
  on("stage", "pointerdown", (event) => (down = [event.clientX, event.clientY]));
  on("stage", "click", (event) => {
    const moved = down && Math.hypot(event.clientX - down[0], event.clientY - down[1]) > 4;
    const box = stage && !moved ? stage.pick(event.clientX, event.clientY) : -1;
    if (box >= 0) chooseBox(box);
  });
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", dress);
}

/** The list entry of a clip: a check box to draw it, its name, and its distance from the selected clip. */
function clipField(input) {
  const field = document.createElement("div");
  field.innerHTML =
    '<label class="check"><input type="checkbox"><span class="clip-name"></span></label> <output aria-live="off"></output> <span class="note"></span>';
  field.style.setProperty("--mark", colourOfClip(input));
  field.querySelector("input").addEventListener("change", (event) => setHidden(input, !event.target.checked));
  return field;
}

function menus() {
  fill(element("set"), inputs.map((input, i) => [String(i), input.name]));
  element("set-field").style.display = inputs.length > 1 ? "" : "none";
  element("set-label").textContent = stored.menu;
  element("clips").replaceChildren(...inputs.map(clipField));
  fill(element("speed"), SPEEDS.map((speed) => [String(speed), `${speed}×`]));
  element("keys").replaceChildren(
    ...KEYS.flatMap(([label, , text]) => {
      const [term, what] = [document.createElement("dt"), document.createElement("dd")];
      term.textContent = label;
      what.textContent = text;
      return [term, what];
    }),
  );
  element("about").textContent =
    `${inputs.some((input) => input.isSkeleton) ? "Rotations and positions" : "Rotations"} made by tumble ` +
    `${stored.version} on ${stored.device}, kept in 16 bits a component; ` +
    (inputs.some((input) => input.live)
      ? "other methods, rates and times are evaluated in this page, by the same engine with the same bits. "
      : "this page interpolates nothing. ") +
    "three.js and uPlot are under the MIT licence; see the page's source.";
}

async function start() {
  const here = await engine(stored.engine);
  const skins = await Promise.all(stored.skins.map(skin));
  for (const input of inputs) {
    await input.enliven(here, stored.options);
    input.skin = skins[input.stored.skin] ?? null;
  }
  menus();
  listen();
  try {
    // Antialiasing is off for many boxes: in a browser without a graphics card it takes a third of the speed.
    const many = Math.max(...inputs.map((input) => input.boxes)) > 256;
    stage = new Stage(element("stage"), !many);
  } catch (error) {
    element("trouble").hidden = false;
    element("trouble").textContent = `Nothing can be drawn, this browser has no WebGL (${error.message}); the curves are below.`;
  }
  stage?.stand(await Promise.all(stored.meshes.map(mesh)));
  dress();
  await load(true);
  let before = performance.now();
  const frame = (now) => {
    const between = now - before;
    before = now;
    // Browsers draw no frames of a hidden page. Limiting the step to 250 ms continues from the same time afterwards.
    if (state.playing && state.input.times) advance(Math.min(between, 250) / 1000);
    stage?.draw(between);
    requestAnimationFrame(frame);
  };
  requestAnimationFrame(frame);
}

// Access for tests and for the browser's console.
globalThis.tumble = {
  state,
  seek,
  loaded: () => loading,
  shown: (box, group = 0) => stage.groups[group].shown(box, state.apart),
  ends: (joint, group = 0) => stage.groups[group].ends(joint),
  vertex: (vertex, group = 0) => stage.groups[group].skin.vertex(vertex).toArray(),
  vertices: (group = 0) => stage.groups[group].skin?.mesh.geometry.attributes.position.count ?? 0,
  results: () => results,
  ghosts: () => ghosts.map((ghost) => ghost.input.name),
  frames: () => stage.drawn,
  pixelRatio: () => stage.ratio,
  inView: () => stage.inView(),
  ready: start(),
};
