// A vertical cut: where it meets the triangles of the model, and which points lie beside it. Lengths along the cut from its beginning.
import { Vector3 } from 'three';

/** Pieces of line [s0, z0, s1, z1, part] where the cut from `a` to `b` meets a mesh. */
export function sectionTriangles(mesh, part, a, b) {
  const along = new Vector3(b.x - a.x, b.y - a.y, 0);
  const length = along.length();
  along.divideScalar(length || 1);
  const { position } = mesh.geometry.attributes;
  const { index } = mesh.geometry;
  const places = new Float64Array(2 * position.count);
  const heights = new Float64Array(position.count);
  const v = new Vector3();
  for (let i = 0; i < position.count; i += 1) {
    v.fromBufferAttribute(position, i).applyMatrix4(mesh.matrixWorld);
    const [dx, dy] = [v.x - a.x, v.y - a.y];
    places[2 * i] = dx * along.x + dy * along.y;
    places[2 * i + 1] = dx * along.y - dy * along.x;
    heights[i] = v.z;
  }
  const found = [];
  for (let i = 0; i < index.count; i += 3) {
    const corners = [index.getX(i), index.getX(i + 1), index.getX(i + 2)];
    const crossed = corners.flatMap((p, k) => crossing(places, heights, p, corners[(k + 1) % 3]));
    if (crossed.length < 2) continue;
    const piece = clipped(crossed[0], crossed[1], length);
    if (piece) found.push([...piece, part]);
  }
  return found;
}

function crossing(places, heights, p, q) {
  const [d, e] = [places[2 * p + 1], places[2 * q + 1]];
  if (d < 0 === e < 0) return [];
  const t = d / (d - e);
  return [[places[2 * p] + t * (places[2 * q] - places[2 * p]), heights[p] + t * (heights[q] - heights[p])]];
}

function clipped([s0, z0], [s1, z1], length) {
  if (Math.max(s0, s1) < 0 || Math.min(s0, s1) > length) return null;
  const at = (s) => (s1 === s0 ? z0 : z0 + ((s - s0) / (s1 - s0)) * (z1 - z0));
  const inside = (s) => Math.min(Math.max(s, 0), length);
  return s0 === s1 ? [s0, z0, s1, z1] : [inside(s0), at(inside(s0)), inside(s1), at(inside(s1))];
}

/** Points within half of `width` of the cut: lengths, heights, colours, classes. */
export function profileOf(a, b, width, clouds) {
  const along = [b.x - a.x, b.y - a.y];
  const length = Math.hypot(...along) || 1;
  const [ux, uy] = along.map((v) => v / length);
  const points = [];
  for (const { xyz, origin, rgb, classes, count } of clouds.filter(Boolean)) {
    const [ox, oy] = [origin[0] - a.x, origin[1] - a.y];
    for (let i = 0; i < count; i += 1) {
      const [dx, dy] = [xyz[3 * i] + ox, xyz[3 * i + 1] + oy];
      const s = dx * ux + dy * uy;
      if (s < 0 || s > length || Math.abs(dx * uy - dy * ux) > width / 2) continue;
      points.push([s, xyz[3 * i + 2] + origin[2], classes[i], rgb ? [rgb[3 * i], rgb[3 * i + 1], rgb[3 * i + 2]] : null]);
    }
  }
  return { points, count: points.length };
}
