// The edges of the chosen building, drawn over it: a tint alone is lost in a photograph.
import { BufferAttribute, BufferGeometry, EdgesGeometry, Group, LineBasicMaterial, LineSegments } from 'three';
import { LineMaterial } from 'three/addons/lines/LineMaterial.js';
import { LineSegments2 } from 'three/addons/lines/LineSegments2.js';
import { LineSegmentsGeometry } from 'three/addons/lines/LineSegmentsGeometry.js';

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
  const [behind, before] = [linesOf(edges, CHOSEN, 1.5, 0.3), linesOf(edges, CHOSEN, 2.5)];
  before.material.depthTest = true;
  before.material.onBeforeCompile = drawnNearer;
  behind.renderOrder = 5.9;
  before.renderOrder = 6;
  const both = new Group().add(behind, before);
  both.position.set(...origin);
  return both;
}

const CREASES = new LineBasicMaterial({ color: '#2a2622', transparent: true, opacity: 0.5 });
CREASES.onBeforeCompile = (shader) => {
  shader.vertexShader = shader.vertexShader.replace('#include <project_vertex>', '#include <project_vertex>\ngl_Position.z -= 2e-4 * gl_Position.w;');
};

/**
 * Thin dark lines where faces of a mesh meet at an angle or end, in the mesh's own frame; those of faces that are left out come last. A ray does not
 * meet them.
 */
export function creasesOf(geometry) {
  const lines = new LineSegments(new EdgesGeometry(geometry, CREASE_DEG), CREASES);
  const { kept } = geometry.userData;
  if (kept !== undefined) {
    const index = [...geometry.index.array];
    const parts = [index.slice(0, kept), index.slice(kept)].map((of) => new EdgesGeometry(geometry.clone().setIndex(of), CREASE_DEG).attributes.position.array);
    lines.geometry.setAttribute('position', new BufferAttribute(new Float32Array([...parts[0], ...parts[1]]), 3));
    lines.geometry.userData.kept = parts[0].length / 3;
  }
  lines.raycast = () => {};
  return lines;
}

/** Lines of a width in pixels between pairs of places, seen through whatever stands before them. */
export function linesOf(places, color, linewidth, opacity = 0.95) {
  const geometry = new LineSegmentsGeometry().setPositions(places);
  return new LineSegments2(geometry, new LineMaterial({ color, linewidth, depthTest: false, transparent: true, opacity }));
}

/** Let go of what was drawn. */
export function disposed(lines) {
  for (const { geometry, material } of lines.children) {
    geometry.dispose();
    material.dispose();
  }
}

/** Edges lie in the faces that they bound: both ends come a little towards the eye, along the ray that they are seen by. */
function drawnNearer(shader) {
  for (const end of ['Start', 'End']) {
    const found = `modelViewMatrix * vec4( instance${end}, 1.0 )`;
    shader.vertexShader = shader.vertexShader.replace(found, `vec4( 0.996 * ( ${found} ).xyz, 1.0 )`);
  }
}
