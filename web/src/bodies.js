// Bodies that follow paths, drawn by three.js: a box for each body, the path as a curve, and the body's orientation at
// some points of the path as three small axes (x red, y green, z blue).

import {
  BoxGeometry, Color, Group, InstancedMesh, Matrix4, MeshBasicMaterial, MeshLambertMaterial, Quaternion, Vector3,
} from "three";
import { position } from "./data.js";
import { look } from "./look.js";

// Sizes as multiples of the body's length: breadth and height of the box, thickness of the curve, thickness and length
// of the axes.
const BREADTH = 0.6;
const HEIGHT = 0.4;
const LINE = 0.05;
const AXIS = 0.04;
const AXIS_LENGTH = 0.55;
const AXES = [0xd55e00, 0x009e73, 0x0072b2];
// The colour of the curve; it is readable on the light and on the dark background.
const CURVE = 0x6b727a;
// The largest number of straight pieces that the curves of all bodies are drawn with; longer clips use every second,
// third … sample.
const MOST_PIECES = 40_000;

export class Bodies {
  constructor(input, result, colours, ghost) {
    const { length, turn, stand } = input.bodies;
    this.input = input;
    this.colours = colours;
    this.length = length;
    this.result = result;
    const material = () => new MeshLambertMaterial(look(ghost));
    const box = new BoxGeometry(BREADTH * length, HEIGHT * length, length);
    const roof = new BoxGeometry(BREADTH * length, HEIGHT * length * 0.08, length);
    roof.translate(0, HEIGHT * length * 0.54, 0);
    const own = new Quaternion(...turn);
    for (const geometry of [box, roof]) {
      if (stand) geometry.translate(0, (HEIGHT * length) / 2, 0);
      geometry.applyQuaternion(own);
    }
    this.meshes = [box, roof].map((geometry) => {
      const mesh = new InstancedMesh(geometry, material(), input.boxes);
      mesh.frustumCulled = false;
      return mesh;
    });
    this.object = new Group().add(...this.meshes, ...this.lines(ghost));
    this.paint(-1);
  }

  /** The meshes of the curves and of the axes on them. They do not depend on the time, so they are made once. */
  lines(ghost) {
    const { boxes, samples, bodies } = this.input;
    const step = Math.max(1, Math.ceil((samples * boxes) / MOST_PIECES));
    const pieces = [];
    const axes = [];
    const turned = new Quaternion();
    for (let body = 0; body < boxes; body++) {
      const places = [];
      for (let sample = 0; sample < samples; sample += step) places.push([sample, this.at(sample, body)]);
      const ways = [0];
      for (let i = 1; i < places.length; i++) {
        const [from, to] = [places[i - 1][1], places[i][1]];
        ways.push(ways[i - 1] + from.distanceTo(to));
        if (ways[i] > ways[i - 1]) pieces.push([from, to]);
      }
      const way = ways[ways.length - 1];
      let next = 0;
      places.forEach(([sample, place], i) => {
        if (next >= bodies.axes || ways[i] < (way * next) / Math.max(bodies.axes - 1, 1) - 1e-9 * way) return;
        while (next < bodies.axes && (way * next) / Math.max(bodies.axes - 1, 1) <= ways[i]) next += 1;
        turned.fromArray(this.result.rotations, (sample * boxes + body) * 4).normalize();
        const ends = [[1, 0, 0], [0, 1, 0], [0, 0, 1]].map((axis) =>
          new Vector3(...axis).applyQuaternion(turned).multiplyScalar(AXIS_LENGTH * this.length).add(place),
        );
        axes.push(...ends.map((end) => [place, end]));
      });
    }
    const material = (color) => new MeshBasicMaterial({ color, ...look(ghost) });
    this.curve = bars(pieces, LINE * this.length, material(ghost ? this.colours[0] : CURVE));
    this.axes = bars(axes, AXIS * this.length, material(0xffffff));
    const colour = new Color();
    axes.forEach((_, i) => this.axes.setColorAt(i, colour.set(AXES[i % 3])));
    return [this.curve, this.axes];
  }

  at(sample, body) {
    return new Vector3(...position(this.result, this.input.boxes, sample, body));
  }

  /** Colours the bodies; the selected one is lighter (`chosen`: its index, -1 for none). */
  paint(chosen) {
    const colour = new Color();
    const white = new Color(0xffffff);
    for (let body = 0; body < this.input.boxes; body++) {
      colour.set(this.colours[body % this.colours.length]);
      if (body === chosen) colour.lerp(white, 0.35);
      this.meshes[0].setColorAt(body, colour);
      this.meshes[1].setColorAt(body, colour.lerp(white, 0.6));
    }
    for (const mesh of this.meshes) mesh.instanceColor.needsUpdate = true;
  }

  place(result, sample, { shift }) {
    this.result = result;
    const matrix = new Matrix4();
    const turned = new Quaternion();
    const one = new Vector3(1, 1, 1);
    for (let body = 0; body < this.input.boxes; body++) {
      turned.fromArray(result.rotations, (sample * this.input.boxes + body) * 4).normalize();
      const place = this.at(sample, body);
      place.x += shift;
      matrix.compose(place, turned, one);
      for (const mesh of this.meshes) matrix.toArray(mesh.instanceMatrix.array, body * 16);
    }
    for (const mesh of this.meshes) mesh.instanceMatrix.needsUpdate = true;
    this.curve.position.x = shift;
    this.axes.position.x = shift;
  }

  /** The positions of all bodies at up to about 200 samples, for the bounding box of the view. */
  points(result, samples) {
    const points = [];
    const step = Math.max(1, Math.floor(samples / 200));
    for (let sample = 0; sample < samples; sample += step) {
      for (let body = 0; body < this.input.boxes; body++) {
        points.push(new Vector3(...position(result, this.input.boxes, sample, body)));
      }
    }
    return points;
  }

  /** The position of a body as it is drawn: read from the mesh, so that tests check the picture and not the input. */
  ends(body) {
    const matrix = new Matrix4();
    this.meshes[0].getMatrixAt(body, matrix);
    return [new Vector3().setFromMatrixPosition(matrix).toArray()];
  }

  /** The rotation x y z w of a body as it is drawn, read from the mesh like `ends`. */
  shown(body) {
    const matrix = new Matrix4();
    this.meshes[0].getMatrixAt(body, matrix);
    return new Quaternion().setFromRotationMatrix(matrix).toArray();
  }

  dispose() {
    for (const mesh of [...this.meshes, this.curve, this.axes]) {
      mesh.geometry.dispose();
      mesh.material.dispose();
      mesh.dispose();
    }
  }
}

/** One mesh with a straight bar between the two points of each pair. */
function bars(pairs, breadth, material) {
  const mesh = new InstancedMesh(new BoxGeometry(1, 1, 1), material, pairs.length);
  mesh.frustumCulled = false;
  const matrix = new Matrix4();
  const turned = new Quaternion();
  const forward = new Vector3(0, 0, 1);
  pairs.forEach(([from, to], i) => {
    const along = to.clone().sub(from);
    const length = along.length();
    turned.setFromUnitVectors(forward, along.divideScalar(length));
    matrix.compose(from.clone().lerp(to, 0.5), turned, new Vector3(breadth, breadth, length + breadth * 0.4));
    mesh.setMatrixAt(i, matrix);
  });
  return mesh;
}
