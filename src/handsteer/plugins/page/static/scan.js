// The laser scan in the 3D view: a dot for each ray that hits something.
import { THREE } from "nicegui-scene";

export default class ScanDots {
  create_mesh(points, size, height) {
    this.height = height;
    this.mesh = new THREE.Points(new THREE.BufferGeometry(), new THREE.PointsMaterial({ size, transparent: true }));
    this.show(points);
    return this.mesh;
  }

  show(points) {
    // A geometry's buffers cannot grow.
    this.mesh.geometry.dispose();
    this.mesh.geometry = new THREE.BufferGeometry();
    const places = points.flatMap(([x, y]) => [x, y, this.height]);
    this.mesh.geometry.setAttribute("position", new THREE.Float32BufferAttribute(places, 3));
  }
}
