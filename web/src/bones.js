// Skeletons, drawn by three.js: a bone from each joint's parent to the joint, a cube for each root.

import {
  BoxGeometry, BufferGeometry, Color, Float32BufferAttribute, Group, InstancedMesh, Matrix4, MeshLambertMaterial,
  Quaternion, Vector3,
} from "three";
import { position } from "./data.js";
import { look } from "./look.js";
import { Skin } from "./skin.js";

// The breadth of a bone as a fraction of its length, and where it is broadest (0: at the joint, 1: at the parent).
const BREADTH = 0.18;
const BROADEST = 0.85;
// The edge of a root's cube: CUBE times the median bone length, or LONE_CUBE times the extent of the motion if all bones
// have length 0.
const CUBE = 0.2;
const LONE_CUBE = 0.03;

/** The geometry of a bone of length 1, an octahedron: the joint at the origin, the parent at (0, -1, 0). */
function octahedron() {
  const half = BREADTH / 2;
  const ring = [[half, 0], [0, half], [-half, 0], [0, -half]].map(([x, z]) => [x, -BROADEST, z]);
  const sides = ring.flatMap((corner, i) => {
    const next = ring[(i + 1) % 4];
    return [[0, 0, 0], next, corner, [0, -1, 0], corner, next];
  });
  const geometry = new BufferGeometry();
  geometry.setAttribute("position", new Float32BufferAttribute(sides.flat(), 3));
  geometry.computeVertexNormals();
  return geometry;
}

/** The indices of all joints, sorted so that each comes after its parent. */
function parentsFirst(parents) {
  const order = [];
  const placed = parents.map(() => false);
  parents.forEach((_, first) => {
    const line = [];
    for (let joint = first; joint >= 0 && !placed[joint]; joint = parents[joint]) {
      placed[joint] = true;
      line.push(joint);
    }
    while (line.length > 0) order.push(line.pop());
  });
  return order;
}

/** The meshes of one skeleton; `place` moves them to a sample of a result. */
export class Bones {
  constructor(input, result, colours, ghost) {
    this.input = input;
    this.colours = colours;
    this.order = parentsFirst(input.parents);
    this.turned = input.parents.map(() => new Quaternion());
    this.places = input.parents.map(() => new Vector3());
    this.find(result, 0);
    this.axes = input.parents.map((_, joint) => this.acrossAxis(joint));
    const lengths = input.parents.map((_, joint) => this.bone(joint).length());
    const some = lengths.filter((length) => length > 0).sort((a, b) => a - b);
    const extent = Math.max(...result.positions.size);
    /** The median bone length: the unit for sizes and margins of the view. */
    this.length = some[some.length >> 1] ?? (extent * LONE_CUBE) / CUBE;
    if (!(this.length > 0)) this.length = 1;

    const edge = this.length * CUBE;
    const material = new MeshLambertMaterial(look(ghost));
    const joints = input.parents.map((_, joint) => joint);
    const kinds = [
      [octahedron(), joints.filter((joint) => input.parents[joint] >= 0)],
      [new BoxGeometry(edge, edge, edge), joints.filter((joint) => input.parents[joint] < 0)],
    ];
    this.meshes = kinds.map(([geometry, joints]) => {
      const mesh = new InstancedMesh(geometry, material, joints.length);
      mesh.frustumCulled = false;
      mesh.visible = joints.length > 0;
      mesh.userData.joints = joints;
      return mesh;
    });
    this.object = new Group().add(...this.meshes);
    this.skin = input.skin ? new Skin(input.skin, ghost ? colours[0] : null) : null;
    if (this.skin) this.object.add(this.skin.mesh);
    this.paint(-1);
  }

  /** Computes the world position and rotation of each joint at a sample, into `places` and `turned`. */
  find(result, sample) {
    const { boxes, parents, isWorld } = this.input;
    for (const joint of this.order) {
      this.places[joint].fromArray(position(result, boxes, sample, joint));
      const turned = this.turned[joint].fromArray(result.rotations, (sample * boxes + joint) * 4).normalize();
      if (parents[joint] >= 0 && !isWorld) turned.premultiply(this.turned[parents[joint]]).normalize();
    }
  }

  /** The vector from the parent to the joint; zero for a root. */
  bone(joint) {
    const parent = this.input.parents[joint];
    return parent < 0 ? new Vector3() : this.places[joint].clone().sub(this.places[parent]);
  }

  /** The axis of the parent that is closest to perpendicular to the bone. It defines the roll of the drawn bone. */
  acrossAxis(joint) {
    const parent = this.input.parents[joint];
    if (parent < 0) return null;
    const along = this.bone(joint).applyQuaternion(this.turned[parent].clone().invert()).toArray().map(Math.abs);
    const axis = [0, 0, 0];
    axis[along.indexOf(Math.min(...along))] = 1;
    return new Vector3(...axis);
  }

  /** Colours the bones; the selected one is lighter (`chosen`: its joint, -1 for none). */
  paint(chosen) {
    const colour = new Color();
    for (const mesh of this.meshes) {
      mesh.userData.joints.forEach((joint, i) => {
        colour.set(this.colours[joint % this.colours.length]);
        if (joint === chosen) colour.lerp(new Color(0xffffff), 0.35);
        mesh.setColorAt(i, colour);
      });
      if (mesh.instanceColor) mesh.instanceColor.needsUpdate = true;
    }
  }

  place(result, sample, { shift, matrices, hasSkin }) {
    this.find(result, sample);
    if (this.skin) {
      // Only the engine's matrices contain scales; `places` and `turned` do not. Without matrices, hide a scaled mesh.
      const canFollow = matrices || !this.input.stored.hasScales;
      this.skin.mesh.visible = Boolean(hasSkin && canFollow);
      if (canFollow) this.skin.follow({ matrices, places: this.places, turned: this.turned }, shift);
    }
    const matrix = new Matrix4();
    const across = new Vector3();
    const third = new Vector3();
    const one = new Vector3(1, 1, 1);
    for (const mesh of this.meshes) {
      mesh.userData.joints.forEach((joint, i) => {
        const parent = this.input.parents[joint];
        if (parent < 0) {
          matrix.compose(this.places[joint], this.turned[joint], one);
        } else {
          const along = this.bone(joint);
          const length = along.length();
          // A bone of length 0 is invisible, so its direction does not matter.
          if (length > 0) along.divideScalar(length);
          else along.set(0, 1, 0);
          across.copy(this.axes[joint]).applyQuaternion(this.turned[parent]);
          across.addScaledVector(along, -across.dot(along));
          if (across.lengthSq() < 1e-6) across.set(along.y, along.z, along.x).cross(along);
          third.crossVectors(across.normalize(), along);
          matrix.makeBasis(across, along, third).scale(third.setScalar(length)).setPosition(this.places[joint]);
        }
        matrix.elements[12] += shift;
        matrix.toArray(mesh.instanceMatrix.array, i * 16);
      });
      mesh.instanceMatrix.needsUpdate = true;
    }
  }

  /**
   * Positions for the bounding box of the view: all joints at about 60 samples, the extreme position along each axis over
   * all samples, and points of the skinned mesh at about 6 samples.
   */
  points(result, samples) {
    const { boxes } = this.input;
    const points = [];
    const step = Math.max(1, Math.floor(samples / 60));
    for (let sample = 0; sample < samples; sample += step) {
      for (let joint = 0; joint < boxes; joint++) {
        points.push(new Vector3(...position(result, boxes, sample, joint)));
      }
    }
    const { packed } = result.positions;
    for (let axis = 0; axis < 3; axis++) {
      let [least, most] = [axis, axis];
      for (let i = axis; i < packed.length; i += 3) {
        if (packed[i] < packed[least]) least = i;
        if (packed[i] > packed[most]) most = i;
      }
      for (const i of [least, most]) points.push(new Vector3(...position(result, boxes, 0, Math.floor(i / 3))));
    }
    if (this.skin && !this.input.stored.hasScales) {
      const step = Math.max(1, Math.floor(samples / 6));
      for (let sample = 0; sample < samples; sample += step) {
        this.find(result, sample);
        this.skin.follow({ places: this.places, turned: this.turned }, 0);
        points.push(...this.skin.points());
      }
    }
    return points;
  }

  /** The position of a joint and, if it has one, of its parent, as they are drawn (read from the meshes, for tests). */
  ends(joint) {
    const matrix = new Matrix4();
    for (const mesh of this.meshes) {
      const i = mesh.userData.joints.indexOf(joint);
      if (i < 0) continue;
      mesh.getMatrixAt(i, matrix);
      const end = (y) => new Vector3(0, y, 0).applyMatrix4(matrix).toArray();
      return this.input.parents[joint] < 0 ? [end(0)] : [end(0), end(-1)];
    }
    return [];
  }

  dispose() {
    this.skin?.dispose();
    for (const mesh of this.meshes) {
      mesh.geometry.dispose();
      mesh.material.dispose();
      mesh.dispose();
    }
  }
}
