// How far points lie above or below the roof of a building, by the same rule as the figures of the run: against the topmost roof.
import { Vector3 } from 'three';

const NOT_OF_A_ROOF = new Set([2, 3, 4, 5, 7, 9, 18]);
const ROOFS = new Set(['RoofSurface']);

/** Triangles of a building's roof, in the page's frame, and their box in plan. */
export function roofTriangles(city, unit) {
  const triangles = trianglesOf(city, unit, ROOFS);
  const [x, y] = [0, 1].map((k) => triangles.flat().map((corner) => corner[k]));
  return { triangles, box: [lowest(x), lowest(y), highest(x), highest(y)] };
}

const lowest = (values) => values.reduce((a, b) => Math.min(a, b), Infinity);
const highest = (values) => values.reduce((a, b) => Math.max(a, b), -Infinity);

/** Triangles of a building, in the page's frame; of some classes of surfaces where these are named. */
export function trianglesOf(city, unit, classes = null) {
  const triangles = [];
  for (const { mesh, model } of city.meshes('buildings')) {
    const row = model.rows.get(unit);
    if (row === undefined) continue;
    const { _feature_id_0: rows, surfaceClass, position } = mesh.geometry.attributes;
    const { index, drawRange } = mesh.geometry;
    for (let i = 0; i < Math.min(index.count, drawRange.count); i += 3) {
      const first = index.getX(i);
      if (rows.getX(first) !== row || (classes && !classes.has(model.tables.words[surfaceClass.getX(first)]))) continue;
      triangles.push([0, 1, 2].map((k) => new Vector3().fromBufferAttribute(position, index.getX(i + k)).applyMatrix4(mesh.matrixWorld).toArray()));
    }
  }
  return triangles;
}

/** Height of every point over the roof below or above it; points beside the roof are left out. */
export function residuals({ triangles, box }, clouds) {
  const places = [];
  const values = [];
  for (const { xyz, origin, classes, count } of clouds.filter(Boolean)) {
    for (let i = 0; i < count; i += 1) {
      const [x, y, z] = [0, 1, 2].map((k) => xyz[3 * i + k] + origin[k]);
      if (x < box[0] || x > box[2] || y < box[1] || y > box[3] || NOT_OF_A_ROOF.has(classes[i])) continue;
      const roof = roofAt(triangles, x, y);
      if (roof === -Infinity) continue;
      places.push(x, y, z);
      values.push(z - roof);
    }
  }
  return { places, values };
}

function roofAt(triangles, x, y) {
  let top = -Infinity;
  for (const [a, b, c] of triangles) {
    const area = (b[0] - a[0]) * (c[1] - a[1]) - (c[0] - a[0]) * (b[1] - a[1]);
    if (area === 0) continue;
    const v = ((x - a[0]) * (c[1] - a[1]) - (c[0] - a[0]) * (y - a[1])) / area;
    const w = ((b[0] - a[0]) * (y - a[1]) - (x - a[0]) * (b[1] - a[1])) / area;
    if (v < -1e-9 || w < -1e-9 || v + w > 1 + 1e-9) continue;
    top = Math.max(top, a[2] + v * (b[2] - a[2]) + w * (c[2] - a[2]));
  }
  return top;
}

/** Count, median, NMAD, RMSE and share within 20 cm; null of nothing. */
export function summary(values) {
  if (!values.length) return null;
  const middle = median(values);
  return {
    count: values.length, median: middle, nmad: 1.4826 * median(values.map((v) => Math.abs(v - middle))),
    rmse: Math.sqrt(values.reduce((sum, v) => sum + v * v, 0) / values.length),
    within: values.filter((v) => Math.abs(v) <= 0.2).length / values.length,
  };
}

function median(values) {
  const sorted = Float64Array.from(values).sort();
  const half = sorted.length >> 1;
  return sorted.length % 2 ? sorted[half] : (sorted[half - 1] + sorted[half]) / 2;
}
