// Where to stand so that the whole city fits beside the panels, seen obliquely, as near as can be.
import { MathUtils, Vector3 } from 'three';

const ELEVATION_DEG = 36;
const FROM_DEG = [28, 62];
const FILLED = 0.94;
/** Standing in the west must be worth this much nearness, since maps have made people look north. */
const WORTH = 0.88;
const ROUNDS = 40;
const DAMPING = 0.5;
const LEAST_ROOM_PX = 120;
const STOREYS_M = 10;

/**
 * @param {number[][]} corners places that must be seen; the corners of `box` where there are none
 * @param {{left, right, top, bottom}} covered pixels of each side that are hidden
 * @returns {{from: number[], at: number[]}}
 */
export function fitted(corners, box, camera, [width, height], covered) {
  const places = (corners.length ? uprights(corners, box) : cornersOf(box)).map((place) => new Vector3(...place));
  const focal = height / 2 / Math.tan(MathUtils.degToRad(camera.fov / 2));
  const room = [width - covered.left - covered.right, height - covered.top - covered.bottom];
  const halves = room.map((pixels) => (FILLED * Math.max(pixels, LEAST_ROOM_PX)) / 2 / focal);
  const [south, west] = FROM_DEG.map((azimuth) => standing(places, azimuth, halves));
  return west.distance < WORTH * south.distance ? west : south;
}

function standing(places, azimuthDeg, [halfX, halfY]) {
  const [azimuth, elevation] = [azimuthDeg, ELEVATION_DEG].map(MathUtils.degToRad);
  const back = new Vector3(-Math.sin(azimuth) * Math.cos(elevation), -Math.cos(azimuth) * Math.cos(elevation), Math.sin(elevation));
  const right = new Vector3(Math.cos(azimuth), -Math.sin(azimuth), 0);
  const up = back.clone().cross(right);
  const at = places.reduce((sum, place) => sum.add(place), new Vector3()).divideScalar(places.length);
  let distance = 0;
  for (let round = 0; round < ROUNDS; round += 1) {
    const seen = places.map((place) => {
      const way = place.clone().sub(at);
      return [way.dot(right), way.dot(up), way.dot(back)];
    });
    distance = Math.max(30, ...seen.map(([x, y, z]) => z + Math.max(Math.abs(x) / halfX, Math.abs(y) / halfY)));
    const [middleX, middleY] = [0, 1].map((k) => middleOf(seen.map((place) => place[k] / (distance - place[2]))));
    // the near end of the city answers to a step more than the far end does
    if (round + 1 < ROUNDS) at.addScaledVector(right, DAMPING * middleX * distance).addScaledVector(up, DAMPING * middleY * distance);
  }
  const from = at.clone().addScaledVector(back, distance);
  // one turns about a place on the ground, not in the air above it
  const ground = places.reduce((sum, { z }) => sum + z, 0) / places.length;
  return { from: from.toArray(), at: from.clone().addScaledVector(back, (ground - from.z) / back.z).toArray(), distance };
}

function middleOf(values) {
  return values.reduce(([low, high], v) => [Math.min(low, v), Math.max(high, v)], [Infinity, -Infinity]).reduce((a, b) => (a + b) / 2);
}

/** Foot and top of what stands at some places. */
function uprights(places, { min, max }) {
  return places.flatMap(([x, y, z]) => [[x, y, Math.max(min.z, z - STOREYS_M)], [x, y, Math.min(max.z, z + STOREYS_M)]]);
}

function cornersOf({ min, max }) {
  return [min.x, max.x].flatMap((x) => [min.y, max.y].flatMap((y) => [min.z, max.z].map((z) => [x, y, z])));
}
