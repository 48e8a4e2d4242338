// The robot in the 3D view, and the camera that goes along with it from wherever people have turned it.
import { THREE } from "nicegui-scene";

const UP = new THREE.Vector3(0, 0, 1);

// Where the camera stands and what it looks at, from the robot; x is forward in "follow", east in the others.
const PLACES = {
  orbit: { camera: [-1.6, -0.7, 1.05], target: [0.6, 0.1, 0] },
  follow: { camera: [-1.5, 0, 0.95], target: [0.9, 0, 0] },
  top: { camera: [0, -0.01, 13], target: [0, 0, 0] }, // a little to the south, so that north is up
};

export default class RobotRig {
  create_mesh(scene, view, x, y, yaw) {
    this.scene = scene;
    this.view = view;
    this.mesh = new THREE.Group();
    this.stand(x, y, yaw);
    return this.mesh;
  }

  stand(x, y, yaw) {
    this.mesh.position.set(x, y, 0);
    this.mesh.rotation.z = yaw;
  }

  go(x, y, yaw) {
    const from = this.mesh.position.clone();
    const turn = this.view === "follow" ? yaw - this.mesh.rotation.z : 0;
    this.stand(x, y, yaw);
    const { camera, controls } = getElement(this.scene) ?? {};
    for (const point of [camera?.position, controls?.target]) {
      point?.sub(from).applyAxisAngle(UP, turn).add(this.mesh.position);
    }
  }

  look(view) {
    const { camera, controls } = getElement(this.scene) ?? {};
    if (!controls) return; // there is no WebGL
    this.view = view;
    const turn = view === "follow" ? this.mesh.rotation.z : 0;
    const from = (place) => new THREE.Vector3(...place).applyAxisAngle(UP, turn).add(this.mesh.position);
    camera.position.copy(from(PLACES[view].camera));
    controls.target.copy(from(PLACES[view].target));
    // From above, a map is moved, not turned.
    const isMap = view === "top";
    controls.enableRotate = !isMap;
    controls.mouseButtons.LEFT = isMap ? THREE.MOUSE.PAN : THREE.MOUSE.ROTATE;
    controls.touches.ONE = isMap ? THREE.TOUCH.PAN : THREE.TOUCH.ROTATE;
    controls.update();
  }
}
