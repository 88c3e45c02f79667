// The arm's shapes and joints from its URDF, as three.js objects. Meshes are not loaded: a link without boxes, cylinders
// or spheres is drawn as a rod to the joints that it carries.

import {
  BoxGeometry, Color, CylinderGeometry, Group, Mesh, MeshStandardMaterial, Quaternion, SphereGeometry, Vector3,
} from "three";

const ROD_RADIUS_M = 0.025;
const GREY = "#8d959e";

const numbers = (text, otherwise) => (text ? text.trim().split(/\s+/).map(Number) : otherwise);
const child = (element, name) => [...(element?.children ?? [])].find((c) => c.tagName === name) ?? null;
const children = (element, name) => [...element.children].filter((c) => c.tagName === name);

function place(object, origin) {
  const [x, y, z] = numbers(origin?.getAttribute("xyz"), [0, 0, 0]);
  const [roll, pitch, yaw] = numbers(origin?.getAttribute("rpy"), [0, 0, 0]);
  object.position.set(x, y, z);
  object.rotation.set(roll, pitch, yaw, "ZYX");
}

function shape(geometry) {
  const box = child(geometry, "box");
  const cylinder = child(geometry, "cylinder");
  const sphere = child(geometry, "sphere");
  if (box) return new BoxGeometry(...numbers(box.getAttribute("size"), [0.05, 0.05, 0.05]));
  if (sphere) return new SphereGeometry(Number(sphere.getAttribute("radius")), 32, 20);
  if (cylinder) {
    const radius = Number(cylinder.getAttribute("radius"));
    const length = Number(cylinder.getAttribute("length"));
    return new CylinderGeometry(radius, radius, length, 36).rotateX(Math.PI / 2);
  }
  return null;
}

const material = (colour) => new MeshStandardMaterial({ color: new Color(colour), roughness: 0.65, metalness: 0.05 });

function rod(to) {
  const mesh = new Mesh(new CylinderGeometry(ROD_RADIUS_M, ROD_RADIUS_M, to.length(), 20), material(GREY));
  mesh.position.copy(to).multiplyScalar(0.5);
  mesh.quaternion.copy(new Quaternion().setFromUnitVectors(new Vector3(0, 1, 0), to.clone().normalize()));
  return mesh;
}

/** Parses a URDF. Returns the arm's root and a function that sets the angles of joints by name (rad). */
export function arm(text, fixedJoints) {
  const robot = new DOMParser().parseFromString(text, "text/xml").documentElement;
  const colours = new Map();
  for (const named of children(robot, "material")) {
    colours.set(named.getAttribute("name"), numbers(child(named, "color")?.getAttribute("rgba"), null));
  }
  const links = new Map();
  for (const link of children(robot, "link")) {
    const group = new Group();
    for (const visual of children(link, "visual")) {
      const geometry = shape(child(visual, "geometry"));
      if (!geometry) continue;
      const named = child(visual, "material");
      const own = numbers(child(named, "color")?.getAttribute("rgba"), null);
      const rgba = own ?? colours.get(named?.getAttribute("name"));
      if (own && named) colours.set(named.getAttribute("name"), own);
      const mesh = new Mesh(geometry, material(GREY));
      if (rgba) mesh.material.color.setRGB(rgba[0], rgba[1], rgba[2], "srgb");
      place(mesh, child(visual, "origin"));
      group.add(mesh);
    }
    group.userData.drawn = group.children.length > 0;
    links.set(link.getAttribute("name"), group);
  }
  const joints = new Map();
  const moved = new Set();
  for (const joint of children(robot, "joint")) {
    const parent = links.get(child(joint, "parent")?.getAttribute("link"));
    const name = child(joint, "child")?.getAttribute("link");
    if (!parent || !links.has(name)) continue;
    const frame = new Group();
    place(frame, child(joint, "origin"));
    if (!parent.userData.drawn && frame.position.length() > 2 * ROD_RADIUS_M) parent.add(rod(frame.position));
    frame.add(links.get(name));
    parent.add(frame);
    moved.add(name);
    const axis = new Vector3(...numbers(child(joint, "axis")?.getAttribute("xyz"), [1, 0, 0])).normalize();
    joints.set(joint.getAttribute("name"), { axis, link: links.get(name), type: joint.getAttribute("type") });
  }
  const set = (name, value) => {
    const joint = joints.get(name);
    if (!joint) return;
    if (joint.type === "prismatic") joint.link.position.copy(joint.axis).multiplyScalar(value);
    else joint.link.quaternion.setFromAxisAngle(joint.axis, value);
  };
  for (const [name, value] of Object.entries(fixedJoints ?? {})) set(name, value);
  const root = new Group();
  for (const [name, link] of links) if (!moved.has(name)) root.add(link);
  return { root, set };
}
