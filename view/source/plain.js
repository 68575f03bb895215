// Models without photographs, drawn from triangles of the page's frame in the colours of their surfaces.
import { BufferAttribute, BufferGeometry, DoubleSide, Mesh, MeshBasicMaterial, Vector3 } from 'three';
import { creasesOf, disposed } from './highlight.js';
import { toLinear } from './layers.js';

const LIGHT = new Vector3(-0.6, -0.45, 0.66).normalize();

/** A model from triangles, each of one colour, with the light of the city. */
export function plainModel({ id, corners, colours }) {
  const origin = corners.slice(0, 3);
  const places = new Float32Array(corners.length);
  corners.forEach((v, i) => (places[i] = v - origin[i % 3]));
  const shades = new Uint8Array(corners.length);
  const [a, b, c] = [new Vector3(), new Vector3(), new Vector3()];
  for (let t = 0; 9 * t < places.length; t += 1) {
    [a, b, c].forEach((corner, k) => corner.fromArray(places, 9 * t + 3 * k));
    const up = b.sub(a).cross(c.sub(a)).normalize();
    const light = 0.42 + 0.62 * Math.max(0, 0.25 + 0.75 * up.dot(LIGHT));
    for (let i = 0; i < 9; i += 1) shades[9 * t + i] = Math.min(255, light * colours[3 * t + (i % 3)]);
  }
  const geometry = new BufferGeometry();
  geometry.setAttribute('position', new BufferAttribute(places, 3));
  geometry.setAttribute('color', new BufferAttribute(shades, 3, true));
  const material = new MeshBasicMaterial({ vertexColors: true, side: DoubleSide });
  toLinear(material);
  const mesh = new Mesh(geometry, material);
  const creases = creasesOf(geometry);
  mesh.add(creases);
  mesh.position.set(...origin);
  mesh.userData = { unit: id, corners, parts: { children: [{ geometry, material }, { geometry: creases.geometry, material: { dispose: () => {} } }] } };
  return mesh;
}

/** Let go of such models. */
export function forgotten(meshes) {
  for (const mesh of meshes) disposed(mesh.userData.parts);
}
