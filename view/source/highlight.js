// The edges of the chosen building, drawn over it: a tint alone is lost in a photograph.
import { BufferAttribute, BufferGeometry } from 'three';
import { LineMaterial } from 'three/addons/lines/LineMaterial.js';
import { LineSegments2 } from 'three/addons/lines/LineSegments2.js';
import { LineSegmentsGeometry } from 'three/addons/lines/LineSegmentsGeometry.js';
import { EdgesGeometry } from 'three';

const CREASE_DEG = 12;
export const CHOSEN = '#00b4ff';

/** Lines along the edges of some triangles, in the page's frame; null of none. */
export function edgesOf(triangles) {
  if (!triangles.length) return null;
  const [origin] = triangles[0];
  const places = new Float32Array(9 * triangles.length);
  triangles.flat().forEach((corner, i) => corner.forEach((v, k) => (places[3 * i + k] = v - origin[k])));
  const solid = new BufferGeometry();
  solid.setAttribute('position', new BufferAttribute(places, 3));
  const edges = new EdgesGeometry(solid, CREASE_DEG).attributes.position.array;
  solid.dispose();
  const drawn = linesOf(edges, CHOSEN, 2.5);
  drawn.position.set(...origin);
  drawn.renderOrder = 6;
  return drawn;
}

/** Lines of a width in pixels between pairs of places, seen through whatever stands before them. */
export function linesOf(places, color, linewidth) {
  const geometry = new LineSegmentsGeometry().setPositions(places);
  return new LineSegments2(geometry, new LineMaterial({ color, linewidth, depthTest: false, transparent: true, opacity: 0.95 }));
}
