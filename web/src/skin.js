// Skinned meshes, drawn translucent around the bones by three.js.

import {
  Bone, BufferAttribute, BufferGeometry, DoubleSide, Matrix4, MeshLambertMaterial, Quaternion, Skeleton, SkinnedMesh,
  Vector3,
} from "three";

// Translucent, so that the bones inside remain visible.
const OPACITY = 0.4;
const COLOUR = 0x9aa3ad;
// The number of vertices that are used for the bounding box of the view.
const MEASURED = 300;

export class Skin {
  /** `ghostColour`: the colour if the mesh belongs to a ghost; otherwise null. */
  constructor({ places, triangles, bonesOf, weights, joints, toJoints }, ghostColour) {
    const geometry = new BufferGeometry();
    geometry.setAttribute("position", new BufferAttribute(places, 3));
    geometry.setAttribute("skinIndex", new BufferAttribute(bonesOf, 4));
    geometry.setAttribute("skinWeight", new BufferAttribute(weights, 4, true));
    geometry.setIndex(new BufferAttribute(triangles, 1));
    geometry.computeVertexNormals();
    const opacity = ghostColour ? OPACITY / 2 : OPACITY;
    const look = { color: ghostColour ?? COLOUR, transparent: true, opacity, depthWrite: false, side: DoubleSide };
    this.joints = joints;
    this.bones = joints.map(() => {
      const bone = new Bone();
      // `follow` sets the world matrices, so three.js must not recompute them from positions and rotations.
      bone.matrixAutoUpdate = false;
      bone.matrixWorldAutoUpdate = false;
      return bone;
    });
    const inverses = joints.map((_, i) => new Matrix4().fromArray(toJoints, 16 * i));
    this.mesh = new SkinnedMesh(geometry, new MeshLambertMaterial(look));
    this.mesh.bindMode = "detached";
    this.mesh.bind(new Skeleton(this.bones, inverses), new Matrix4());
    this.mesh.frustumCulled = false;
    // Draw after the bones inside: a translucent mesh drawn first would hide them.
    this.mesh.renderOrder = 1;
  }

  /** Moves the mesh with the joints: by their matrices (16 numbers each), or by world positions and rotations. */
  follow({ matrices, places, turned }, shift) {
    const one = new Vector3(1, 1, 1);
    this.bones.forEach((bone, i) => {
      const joint = this.joints[i];
      if (matrices) bone.matrixWorld.fromArray(matrices, 16 * joint);
      else bone.matrixWorld.compose(places[joint], new Quaternion().copy(turned[joint]), one);
    });
    this.mesh.position.x = shift;
    this.mesh.skeleton.update();
  }

  /** The current positions of about 300 vertices. */
  points() {
    const count = this.mesh.geometry.attributes.position.count;
    const step = Math.max(1, Math.floor(count / MEASURED));
    const points = [];
    for (let vertex = 0; vertex < count; vertex += step) points.push(this.vertex(vertex));
    return points;
  }

  /** The current position of a vertex. */
  vertex(vertex) {
    const at = new Vector3().fromBufferAttribute(this.mesh.geometry.attributes.position, vertex);
    return this.mesh.applyBoneTransform(vertex, at);
  }

  dispose() {
    this.mesh.geometry.dispose();
    this.mesh.material.dispose();
    this.mesh.skeleton.dispose();
  }
}
