// The 3D view, drawn by three.js: boxes (here), bones (bones.js) or bodies on paths (bodies.js), with floor and camera.

import {
  Box3, BoxGeometry, BufferAttribute, BufferGeometry, Color, DirectionalLight, DoubleSide, Euler, GridHelper,
  HemisphereLight, InstancedMesh, MathUtils, Matrix4, Mesh, MeshLambertMaterial, PerspectiveCamera, Quaternion,
  Raycaster, Scene, Vector2, Vector3, WebGLRenderer,
} from "three";
import { OrbitControls } from "three/addons/controls/OrbitControls.js";
import { Bodies } from "./bodies.js";
import { Bones } from "./bones.js";
import { look } from "./look.js";

// If frames take longer than this [ms], the pixel ratio is lowered, but not below COARSEST.
const SLOW = 30;
const COARSEST = 0.5;
// The initial direction of the camera [rad]: its elevation, and its azimuth about the vertical axis.
const DOWN = 0.3;
const AROUND = 0.4;
// The elevation if the scene has a ground mesh, which is easier to read from above.
const DOWN_ON_GROUND = 0.6;
// The colours of the ground mesh and of obstacles on it.
const GROUND = 0xa9c28f;
const OBSTACLE = 0x9c9690;

/** The boxes of a clip without a skeleton; `place` moves them to a sample of a result. */
class Boxes {
  constructor(count, length, colours, ghost) {
    const breadth = length * 0.28;
    const geometry = new BoxGeometry(breadth, length * 0.96, breadth);
    geometry.translate(0, -length / 2, 0); // the pivot is the top end of the box
    const material = new MeshLambertMaterial(look(ghost));
    this.mesh = new InstancedMesh(geometry, material, count);
    this.mesh.frustumCulled = false;
    this.object = this.mesh;
    this.meshes = [this.mesh];
    this.length = length;
    this.colours = colours;
    this.paint(-1);
  }

  /** Colours the boxes; the selected one is lighter (`chosen`: its index, -1 for none). */
  paint(chosen) {
    const colour = new Color();
    for (let box = 0; box < this.mesh.count; box++) {
      colour.set(this.colours[box % this.colours.length]);
      if (box === chosen) colour.lerp(new Color(0xffffff), 0.35);
      this.mesh.setColorAt(box, colour);
    }
    this.mesh.instanceColor.needsUpdate = true;
  }

  /** As a chain, box i is attached to the end of box i-1 and rotates relative to it. If `apart`, each has a cell of a grid. */
  place(result, sample, { apart, shift }) {
    const count = this.mesh.count;
    const matrices = this.mesh.instanceMatrix.array;
    const own = new Quaternion();
    const turned = new Quaternion();
    const hung = new Vector3(shift, 0, 0);
    const along = new Vector3();
    const one = new Vector3(1, 1, 1);
    const matrix = new Matrix4();
    for (let box = 0; box < count; box++) {
      const at = (sample * count + box) * 4;
      own.fromArray(result.rotations, at).normalize();
      if (apart) {
        turned.copy(own);
        hung.copy(cell(box, count, this.length)).x += shift;
      } else {
        turned.multiply(own).normalize();
      }
      matrix.compose(hung, turned, one).toArray(matrices, box * 16);
      hung.add(along.set(0, -this.length, 0).applyQuaternion(turned));
    }
    this.mesh.instanceMatrix.needsUpdate = true;
  }

  /** The positions of both ends of all boxes at about 60 samples, for the bounding box of the view. */
  points(result, samples, apart) {
    const points = [];
    const matrix = new Matrix4();
    const step = Math.max(1, Math.floor(samples / 60));
    for (let sample = 0; sample < samples; sample += step) {
      this.place(result, sample, { apart, shift: 0 });
      for (let box = 0; box < this.mesh.count; box++) {
        this.mesh.getMatrixAt(box, matrix);
        for (const end of [0, -this.length]) points.push(new Vector3(0, end, 0).applyMatrix4(matrix));
      }
    }
    return points;
  }

  /** The rotation x y z w of a box relative to the box before it, read from the mesh: tests check the picture with it. */
  shown(box, apart) {
    const world = new Quaternion();
    const parent = new Quaternion();
    const matrix = new Matrix4();
    const read = (index, into) => {
      this.mesh.getMatrixAt(index, matrix);
      matrix.decompose(new Vector3(), into, new Vector3());
    };
    read(box, world);
    if (box > 0 && !apart) read(box - 1, parent);
    return parent.invert().multiply(world).toArray();
  }

  dispose() {
    this.mesh.geometry.dispose();
    this.mesh.material.dispose();
    this.mesh.dispose();
  }
}

/** The position of a box in a grid in the plane y = 0, for boxes that are shown apart. */
function cell(box, count, length) {
  const columns = Math.ceil(Math.sqrt(count));
  const x = (box % columns) - (columns - 1) / 2;
  const z = Math.floor(box / columns) - (Math.ceil(count / columns) - 1) / 2;
  return new Vector3(x, 0, z).multiplyScalar(length * 2.3);
}

export class Stage {
  constructor(element, antialias) {
    this.element = element;
    this.renderer = new WebGLRenderer({ antialias });
    this.renderer.domElement.setAttribute("aria-hidden", "true");
    element.append(this.renderer.domElement);
    this.ratio = Math.min(devicePixelRatio, 2);
    this.scene = new Scene();
    this.camera = new PerspectiveCamera(38, 1, 0.1, 1000);
    this.sky = new HemisphereLight(0xffffff, 0x8a8f98, 2);
    this.sun = new DirectionalLight(0xffffff, 2.2);
    this.sun.position.set(2, 4, 3);
    this.scene.add(this.sky, this.sun);
    this.controls = new OrbitControls(this.camera, this.renderer.domElement);
    this.controls.addEventListener("change", () => (this.stale = true));
    this.ground = [];
    this.drawn = 0;
    this.slow = 0;
    this.stale = true;
    new ResizeObserver(() => this.resize()).observe(element);
    this.resize();
  }

  resize() {
    const { clientWidth: width, clientHeight: height } = this.element;
    if (width === 0 || height === 0) return;
    this.renderer.setPixelRatio(this.ratio);
    this.renderer.setSize(width, height, false);
    this.camera.aspect = width / height;
    this.camera.updateProjectionMatrix();
    this.stale = true;
  }

  /** Adds the ground mesh (the first) and the obstacles (the others); `mesh` in data.js unpacks them. */
  stand(meshes) {
    this.ground = meshes.map(({ places, triangles }, i) => {
      const geometry = new BufferGeometry();
      geometry.setAttribute("position", new BufferAttribute(places, 3));
      geometry.setIndex(new BufferAttribute(triangles, 1));
      const color = i === 0 ? GROUND : OBSTACLE;
      return new Mesh(geometry, new MeshLambertMaterial({ color, flatShading: true, side: DoubleSide }));
    });
    if (this.ground.length > 0) this.scene.add(...this.ground);
    this.stale = true;
  }

  /**
   * Replaces all groups (boxes, bones or bodies), one for each figure. A figure has a clip (`input`), its `result`,
   * `colours`, `isGhost`, `apart` (boxes in a grid instead of a chain), `side` (-1 left, 0 middle, 1 right), `offset` (its
   * origin minus that of the first figure) and `partner` (maps a joint of the first figure to this figure's).
   */
  fill(figures) {
    for (const group of this.groups ?? []) {
      this.scene.remove(group.object);
      group.dispose();
    }
    this.figures = figures;
    this.groups = figures.map(({ input, result, colours, isGhost, offset }) => {
      const group = input.bodies
        ? new Bodies(input, result, colours, isGhost)
        : input.isSkeleton
          ? new Bones(input, result, colours, isGhost)
          : new Boxes(input.boxes, input.length, colours, isGhost);
      group.object.position.fromArray(offset);
      return group;
    });
    this.scene.add(...this.groups.map((group) => group.object));
    this.hasSquares = figures[0].input.isSkeleton;
    this.stale = true;
  }

  paint(chosen) {
    this.groups.forEach((group, i) => group.paint(this.figures[i].partner(chosen)));
    this.stale = true;
  }

  /** Draws figure i at `moments[i]`, {result, sample, matrices, isHidden}. It is invisible if this is null or hidden. */
  place(moments, { hasSkin }) {
    this.groups.forEach((group, i) => {
      const [moment, { apart, side }] = [moments[i], this.figures[i]];
      group.object.visible = Boolean(moment) && !moment.isHidden;
      if (!moment) return;
      const shift = side === 0 ? 0 : (side * this.span) / 2;
      group.place(moment.result, moment.sample, { apart, shift, matrices: moment.matrices, hasSkin });
    });
    this.stale = true;
  }

  /** Computes the bounding box of all figures and the ground, and the distance between figures side by side. */
  measure() {
    this.points = this.groups.flatMap((group, i) => {
      const { input, result, apart } = this.figures[i];
      return group.points(result, input.samples, apart).map((point) => point.add(group.object.position));
    });
    const [group] = this.groups;
    this.extent = new Box3().setFromPoints(this.points);
    for (const mesh of this.ground) {
      const { min, max } = new Box3().setFromObject(mesh);
      const sides = [min, max];
      for (let i = 0; i < 8; i++) this.points.push(new Vector3(sides[i & 1].x, sides[(i >> 1) & 1].y, sides[i >> 2].z));
      this.extent.union(new Box3(min, max));
    }
    this.room = this.extent.clone().expandByScalar(group.length * 0.2);
    const size = this.room.getSize(new Vector3());
    // The camera looks at an angle, so skeletons that move far along z would cover each other without this extra distance.
    this.span = size.x + (this.hasSquares ? size.z * Math.tan(AROUND) : 0) + group.length * 0.5;
  }

  /** Fits the floor and the camera to the bounding box. */
  frame(side) {
    const { min, max } = this.room;
    const centre = this.room.getCenter(new Vector3());
    const radius = this.room.getSize(new Vector3()).length() / 2;
    if (this.hasSquares) {
      this.layOut(side);
    } else {
      this.floorSize = 10 ** Math.ceil(Math.log10(radius * 4));
      this.floorSquares = 40;
      this.floorPlace = new Vector3(centre.x, min.y - (max.y - min.y) * 0.02, centre.z);
    }
    this.layFloor();
    const down = this.ground.length > 0 ? DOWN_ON_GROUND : DOWN;
    const view = new Quaternion().setFromEuler(new Euler(-down, AROUND, 0, "YXZ"));
    const back = view.clone().invert();
    const upright = Math.tan(MathUtils.degToRad(this.camera.fov / 2)) * 0.92;
    const point = new Vector3();
    let distance = 0;
    for (const place of this.points) {
      for (const shift of side ? [-this.span / 2, this.span / 2] : [0]) {
        point.copy(place).sub(centre).setX(place.x - centre.x + shift).applyQuaternion(back);
        const across = Math.abs(point.x) / (upright * this.camera.aspect);
        distance = Math.max(distance, point.z + Math.max(across, Math.abs(point.y) / upright));
      }
    }
    this.camera.near = distance / 100;
    this.camera.far = (distance + radius) * 20;
    this.camera.updateProjectionMatrix();
    this.controls.target.copy(centre);
    this.camera.position.set(0, 0, distance).applyQuaternion(view).add(centre);
    this.controls.update();
    this.stale = true;
  }

  /**
   * The floor under skeletons, at the lowest position. Its squares are 1, 2 or 5 times a power of ten, and its lines are at
   * multiples of that, so that distances can be read.
   */
  layOut(side) {
    const { min, max } = this.extent;
    const aside = side ? this.span / 2 : 0;
    const across = Math.max(max.x - min.x + 2 * aside, max.y - min.y, max.z - min.z, this.room.max.y - this.room.min.y);
    const power = 10 ** Math.floor(Math.log10(across / 8));
    this.square = [1, 2, 5, 10].map((times) => times * power).find((square) => square >= across / 8);
    const middle = (low, high) => Math.round((low + high) / 2 / this.square) * this.square;
    this.floorPlace = new Vector3(middle(min.x, max.x), min.y, middle(min.z, max.z));
    // Two extra squares on each side, because the centre of the grid was rounded to a multiple of a square.
    this.floorSquares = 2 * (Math.ceil(across / 2 / this.square) + 2);
    this.floorSize = this.floorSquares * this.square;
  }

  /** Creates the grid of the floor in the colours of the theme. */
  layFloor() {
    if (this.floor) {
      this.scene.remove(this.floor);
      this.floor.dispose();
    }
    // The centre lines are emphasised only under boxes and bodies; under skeletons the centre is no special position.
    const lines = this.hasSquares ? [this.lines[1], this.lines[1]] : this.lines;
    this.floor = new GridHelper(this.floorSize, this.floorSquares, ...lines);
    this.floor.position.copy(this.floorPlace);
    this.floor.visible = this.ground.length === 0;
    this.scene.add(this.floor);
    this.stale = true;
  }

  theme({ ground, line, pale }) {
    this.renderer.setClearColor(ground);
    this.lines = [pale, line];
    if (this.floor) this.layFloor();
    this.stale = true;
  }

  /** Rotates the camera about its target [rad]: `around` the vertical axis, `over` a horizontal axis. */
  turn(around, over) {
    const { target } = this.controls;
    const offset = this.camera.position.clone().sub(target);
    const length = offset.length();
    const azimuth = Math.atan2(offset.x, offset.z) + around;
    const height = MathUtils.clamp(Math.asin(offset.y / length) + over, -1.5, 1.5);
    offset.set(Math.sin(azimuth) * Math.cos(height), Math.sin(height), Math.cos(azimuth) * Math.cos(height));
    this.camera.position.copy(target).addScaledVector(offset, length);
    this.controls.update();
    this.stale = true;
  }

  zoom(factor) {
    const { target } = this.controls;
    this.camera.position.sub(target).multiplyScalar(factor).add(target);
    this.controls.update();
    this.stale = true;
  }

  /** The index of the box or joint at a point of the page, x y in CSS pixels; -1 if there is none. */
  pick(x, y) {
    const area = this.renderer.domElement.getBoundingClientRect();
    const point = new Vector2(((x - area.left) / area.width) * 2 - 1, 1 - ((y - area.top) / area.height) * 2);
    const ray = new Raycaster();
    ray.setFromCamera(point, this.camera);
    const [{ input }] = this.figures;
    const own = this.groups.filter((group, i) => this.figures[i].input === input && group.object.visible);
    const meshes = own.flatMap((group) => group.meshes).filter((mesh) => mesh.visible);
    for (const mesh of meshes) mesh.boundingSphere = null;
    const [hit] = ray.intersectObjects(meshes);
    if (!hit) return -1;
    return hit.object.userData.joints?.[hit.instanceId] ?? hit.instanceId;
  }

  /** The number of visible instances (boxes, bones, pieces of curves, axes) in each mesh of each figure, for tests. */
  inView() {
    const count = (object) => (object.visible ? (object.count ?? 0) : 0);
    return this.groups.map(({ object }) => (object.visible ? object.children.map(count) : []));
  }

  /** Draws if anything has changed. After 12 slow frames in a row, the pixel ratio is lowered. `between`: ms since the last call. */
  draw(between) {
    this.controls.update();
    if (!this.stale) return;
    this.stale = false;
    this.renderer.render(this.scene, this.camera);
    this.drawn += 1;
    this.slow = between > SLOW ? this.slow + 1 : 0;
    if (this.slow > 12 && this.ratio > COARSEST) {
      this.ratio = Math.max(this.ratio * 0.75, COARSEST);
      this.slow = 0;
      this.resize();
    }
  }
}
