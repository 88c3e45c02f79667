// The arm, its block, the force on its tip and the paths of tip and reference.

import {
  AmbientLight, ArrowHelper, Box3, BoxGeometry, BufferAttribute, BufferGeometry, Color, DirectionalLight, GridHelper,
  Line, LineBasicMaterial, MathUtils, Mesh, MeshStandardMaterial, PerspectiveCamera, Scene, Sphere, SphereGeometry, Vector3,
  WebGLRenderer,
} from "three";
import { OrbitControls } from "three/examples/jsm/controls/OrbitControls.js";
import { arm } from "./urdf.js";

const PATH_POINTS = 600;
const ARROW_M_PER_N = 0.01;
const MAX_ARROW_M = 0.5;
const LEAST_FORCE_N = 0.5;
// From where the camera looks, and the least radius that it sees.
const DIRECTION = new Vector3(0.85, -1.2, 0.5).normalize();
const LEAST_RADIUS_M = 0.4;

const css = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();

class Path {
  constructor(colour) {
    this.positions = new BufferAttribute(new Float32Array(3 * PATH_POINTS), 3);
    const geometry = new BufferGeometry();
    geometry.setAttribute("position", this.positions);
    this.line = new Line(geometry, new LineBasicMaterial({ color: colour }));
    this.line.frustumCulled = false;
    this.set([]);
  }

  set(points) {
    const last = points.slice(-PATH_POINTS);
    last.forEach((point, i) => this.positions.setXYZ(i, ...point));
    this.positions.needsUpdate = true;
    this.line.geometry.setDrawRange(0, last.length);
  }
}

export class ArmScene {
  constructor(container, info) {
    this.container = container;
    this.joints = info.joints;
    this.renderer = new WebGLRenderer({ antialias: true, alpha: true });
    this.renderer.setPixelRatio(Math.min(devicePixelRatio, 2));
    container.prepend(this.renderer.domElement);
    this.scene = new Scene();
    this.camera = new PerspectiveCamera(40, 1, 0.02, 50);
    this.camera.up.set(0, 0, 1);
    this.scene.add(new AmbientLight("#ffffff", 1.6));
    const sun = new DirectionalLight("#ffffff", 2.2);
    sun.position.set(1.5, -2, 4);
    this.scene.add(sun);
    this.arm = arm(info.urdf, info.fixed_joints_rad);
    this.scene.add(this.arm.root);
    info.home_rad.forEach((angle, i) => this.arm.set(this.joints[i], angle));
    this.arm.root.updateMatrixWorld(true);
    this.tip = new Path(css("--tip"));
    this.reference = new Path(css("--reference"));
    this.marker = new Mesh(new SphereGeometry(0.012, 20, 12), new MeshStandardMaterial({ color: css("--reference") }));
    this.arrow = new ArrowHelper(new Vector3(0, 0, 1), new Vector3(), 0.1, css("--force"), 0.05, 0.03);
    this.scene.add(this.tip.line, this.reference.line, this.marker, this.arrow);
    if (info.block_m !== null) this.addBlock(info.block_m);
    this.look();
    this.colour();
    new ResizeObserver(() => this.resize()).observe(container);
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => this.colour());
    this.renderer.setAnimationLoop(() => {
      this.controls.update();
      this.renderer.render(this.scene, this.camera);
    });
  }

  addBlock(height) {
    const [side, thickness] = [2.4, 0.1];
    const wood = new MeshStandardMaterial({ color: "#b98b5a", roughness: 0.9, transparent: true, opacity: 0.55 });
    const block = new Mesh(new BoxGeometry(side, side, thickness), wood);
    block.position.z = height - thickness / 2;
    this.scene.add(block);
    this.block = block;
  }

  /** The camera follows the arm until the user moves it, and again after a double click. */
  look() {
    this.controls = new OrbitControls(this.camera, this.renderer.domElement);
    let moves = false;
    this.controls.addEventListener("start", () => (moves = true));
    this.controls.addEventListener("end", () => (moves = false));
    this.controls.addEventListener("change", () => {
      if (moves) this.seen = null;
    });
    this.renderer.domElement.addEventListener("dblclick", () => {
      this.seen = new Box3();
      this.keepInView([]);
    });
    this.seen = new Box3();
    this.keepInView([]);
    this.floorHeight = this.seen.isEmpty() ? 0 : this.seen.min.z;
  }

  /** Keeps in view what the arm has filled so far, and these points. */
  keepInView(points) {
    if (!this.seen) return;
    this.seen.expandByObject(this.arm.root);
    for (const point of points.filter((point) => point.every(Number.isFinite))) this.seen.expandByPoint(new Vector3(...point));
    if (this.seen.isEmpty()) return;
    const { center, radius } = this.seen.getBoundingSphere(new Sphere());
    const half = MathUtils.degToRad(this.camera.fov / 2);
    const narrower = Math.min(half, Math.atan(Math.tan(half) * this.camera.aspect));
    this.controls.target.copy(center);
    this.camera.position
      .copy(center)
      .addScaledVector(DIRECTION, Math.max(LEAST_RADIUS_M, radius) / Math.sin(narrower));
  }

  colour() {
    if (this.grid) this.scene.remove(this.grid);
    this.grid = new GridHelper(3, 12, css("--floor"), css("--floor"));
    this.grid.rotation.x = Math.PI / 2;
    this.grid.position.z = this.floorHeight;
    this.scene.add(this.grid);
    for (const [path, name] of [[this.tip, "--tip"], [this.reference, "--reference"]]) {
      path.line.material.color = new Color(css(name));
    }
    this.marker.material.color = new Color(css("--reference"));
    this.arrow.setColor(new Color(css("--force")));
  }

  resize() {
    const { clientWidth: width, clientHeight: height } = this.container;
    if (!width || !height) return;
    this.renderer.setSize(width, height, false);
    this.camera.aspect = width / height;
    this.camera.updateProjectionMatrix();
    this.keepInView([]);
  }

  /** Draws a frame, with the points that led to it. */
  show(frame, tipPath, referencePath) {
    frame.joints_rad.forEach((angle, i) => this.arm.set(this.joints[i], angle));
    this.keepInView(frame.reference_m ? [frame.tip_m, frame.reference_m] : [frame.tip_m]);
    this.tip.set(tipPath);
    this.reference.set(referencePath);
    this.marker.visible = frame.reference_m !== null;
    if (frame.reference_m) this.marker.position.set(...frame.reference_m);
    const force = new Vector3(...frame.force_n);
    const size = force.length();
    this.arrow.visible = size > LEAST_FORCE_N;
    if (this.arrow.visible) {
      const length = Math.min(MAX_ARROW_M, ARROW_M_PER_N * size);
      this.arrow.position.set(...frame.tip_m);
      this.arrow.setDirection(force.normalize());
      this.arrow.setLength(length, Math.min(0.05, 0.5 * length), Math.min(0.03, 0.3 * length));
    }
  }
}
