// The robot in the 3D view, and the camera that follows it from the viewpoint the viewer has chosen.
import { THREE } from "nicegui-scene";

const UP = new THREE.Vector3(0, 0, 1);
const GLIDE_MS = 120; // slightly longer than between two poses, so that the motion does not pause
const STEP_MS = 40;
const LEAP_M = 0.5; // a robot this far away was repositioned

// Position and target of the camera relative to the robot; x is forward in "follow", east in the others.
const PLACES = {
  orbit: { camera: [-1.6, -0.7, 1.05], target: [0.6, 0.1, 0] },
  follow: { camera: [-1.5, 0, 0.95], target: [0.9, 0, 0] },
  top: { camera: [0, -0.01, 13], target: [0, 0, 0] }, // slightly south, so that north is up
};

const IDLE_MS = 1000; // a view in which nothing moves is drawn this often

// Everything that a picture of the view depends on, as numbers.
function state(scene, camera, canvas) {
  const found = [canvas.width, canvas.height, ...camera.matrixWorld.elements, ...camera.projectionMatrix.elements];
  scene.traverseVisible(({ id, matrixWorld, geometry, material }) => {
    found.push(id, ...matrixWorld.elements, geometry?.id, material?.version, material?.opacity, material?.color?.getHex());
  });
  return found;
}

// NiceGUI draws the view 20 times a second, which takes half a processor where there is no graphics card.
function drawChangesOnly(renderer) {
  const draw = renderer.render.bind(renderer);
  let drawn = [];
  let drawn_ms = -Infinity;
  renderer.render = (scene, camera) => {
    scene.updateMatrixWorld();
    camera.updateMatrixWorld();
    const now = state(scene, camera, renderer.domElement);
    const isSame = now.length === drawn.length && now.every((value, index) => value === drawn[index]);
    if (isSame && performance.now() - drawn_ms < IDLE_MS) return;
    [drawn, drawn_ms] = [now, performance.now()];
    draw(scene, camera);
  };
}

const shortest = (turn) => Math.atan2(Math.sin(turn), Math.cos(turn));

export default class RobotRig {
  // joints: [id of the link, roll, pitch, yaw, axis x, y, z] each; angles: theirs, in rad, in the same order
  create_mesh(scene, view, joints, x, y, yaw, angles) {
    this.scene = scene;
    this.view = view;
    this.mesh = new THREE.Group();
    this.control(joints);
    this.stand({ x, y, yaw, angles });
    const { renderer } = getElement(scene) ?? {};
    if (renderer) drawChangesOnly(renderer); // without WebGL there is none
    return this.mesh;
  }

  control(joints) {
    this.joints = joints.map(([id, roll, pitch, yaw, ...axis]) => ({
      id,
      rest: new THREE.Quaternion().setFromEuler(new THREE.Euler(roll, pitch, yaw, "ZYX")), // about fixed axes
      axis: new THREE.Vector3(...axis).normalize(),
    }));
  }

  stand(pose) {
    const from = this.mesh.position.clone();
    const turn = this.view === "follow" ? pose.yaw - this.mesh.rotation.z : 0;
    this.pose = pose;
    this.mesh.position.set(pose.x, pose.y, 0);
    this.mesh.rotation.z = pose.yaw;
    const { camera, controls, objects } = getElement(this.scene) ?? {};
    for (const point of [camera?.position, controls?.target]) {
      point?.sub(from).applyAxisAngle(UP, turn).add(this.mesh.position);
    }
    this.joints.forEach(({ id, rest, axis }, index) => {
      const turned = new THREE.Quaternion().setFromAxisAngle(axis, pose.angles[index] ?? 0);
      objects?.get(id)?.mesh?.quaternion.multiplyQuaternions(rest, turned);
    });
  }

  // Poses arrive less often than pictures are drawn, so they are interpolated.
  go(x, y, yaw, angles) {
    const isUnderWay = this.target !== undefined;
    this.target = { x, y, yaw, angles };
    this.from = this.pose;
    this.began = performance.now();
    if (Math.hypot(x - this.from.x, y - this.from.y) > LEAP_M) this.from = this.target;
    if (!isUnderWay) this.glide();
  }

  glide() {
    const { from, target } = this;
    const part = Math.min((performance.now() - this.began) / GLIDE_MS, 1);
    const angles = target.angles.map((angle, i) => angle - (1 - part) * shortest(angle - (from.angles[i] ?? angle)));
    this.stand({
      x: from.x + part * (target.x - from.x),
      y: from.y + part * (target.y - from.y),
      yaw: target.yaw - (1 - part) * shortest(target.yaw - from.yaw),
      angles,
    });
    // Not at each frame of the screen: the view is drawn 20 times a second, and the rest of the page rarely.
    if (part < 1) setTimeout(() => this.glide(), STEP_MS);
    else this.target = undefined;
  }

  look(view) {
    const { camera, controls } = getElement(this.scene) ?? {};
    if (!controls) return; // without WebGL
    this.view = view;
    const turn = view === "follow" ? this.mesh.rotation.z : 0;
    const from = (place) => new THREE.Vector3(...place).applyAxisAngle(UP, turn).add(this.mesh.position);
    camera.position.copy(from(PLACES[view].camera));
    controls.target.copy(from(PLACES[view].target));
    // From above, dragging moves the map instead of rotating it.
    const isMap = view === "top";
    controls.enableRotate = !isMap;
    controls.mouseButtons.LEFT = isMap ? THREE.MOUSE.PAN : THREE.MOUSE.ROTATE;
    controls.touches.ONE = isMap ? THREE.TOUCH.PAN : THREE.TOUCH.ROTATE;
    controls.update();
  }
}
