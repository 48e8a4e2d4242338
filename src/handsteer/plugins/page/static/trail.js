// The robot's trail in the 3D view: a ribbon on the floor through points that arrive a few at a time.
import { THREE } from "nicegui-scene";

export default class Trail {
  create_mesh(points, most, width) {
    this.most = most;
    this.width = width;
    this.points = [];
    // Basic, so that it looks the same from all sides. Not culled: its bounds would need repeated computation.
    const material = new THREE.MeshBasicMaterial({ transparent: true });
    material.forceSinglePass = true; // it is flat; two passes would change its version with each picture
    this.mesh = new THREE.Mesh(new THREE.BufferGeometry(), material);
    this.mesh.frustumCulled = false;
    this.extend(points);
    return this.mesh;
  }

  clear() {
    this.points = [];
    this.extend([]);
  }

  extend(points) {
    this.points = [...this.points, ...points].slice(-this.most);
    const corners = [];
    const triangles = [];
    this.points.forEach(([x, y], index) => {
      const [beforeX, beforeY] = this.points[Math.max(index - 1, 0)];
      const [afterX, afterY] = this.points[Math.min(index + 1, this.points.length - 1)];
      const length = Math.hypot(afterX - beforeX, afterY - beforeY) || 1;
      const toLeftX = ((beforeY - afterY) / length) * (this.width / 2);
      const toLeftY = ((afterX - beforeX) / length) * (this.width / 2);
      corners.push(x + toLeftX, y + toLeftY, 0, x - toLeftX, y - toLeftY, 0);
      const corner = 2 * index;
      if (index > 0) triangles.push(corner - 2, corner - 1, corner, corner - 1, corner + 1, corner);
    });
    // A geometry's buffers cannot grow.
    this.mesh.geometry.dispose();
    this.mesh.geometry = new THREE.BufferGeometry();
    this.mesh.geometry.setAttribute("position", new THREE.Float32BufferAttribute(corners, 3));
    this.mesh.geometry.setIndex(triangles);
  }
}
