// What cityflow has written for this page: small files beside it, fetched when they are needed.

const fetched = new Map();

/** A JSON file of the page's data; the same promise for everybody who asks. */
export function json(path) {
  return once(path, (response) => response.json());
}

/** What the page asked for before this program had come; null where it did not, or in vain. */
const early = async (path) => (await window.cityflowEarly?.[path]) ?? null;

export function binary(path) {
  return once(path, (response) => response.arrayBuffer());
}

function once(path, read) {
  if (!fetched.has(path)) fetched.set(path, load(path, read));
  return fetched.get(path);
}

async function load(path, read) {
  const known = await early(path);
  if (known) return known;
  const response = await fetch(path);
  if (!response.ok) throw new Error(`${path}: ${response.status} ${response.statusText}`);
  return read(response);
}

/** Everything is read again: the run has gone on. */
export function forget() {
  fetched.clear();
  window.cityflowEarly = null;
}

/** World coordinates of a place in the page's frame: polynomials of second degree that follow the map's projection. */
export function toWorld(city, [e, n, u]) {
  if (!city.world) return [e, n, u];
  const terms = [1, e, n, u, e * e, e * n, n * n, e * u, n * u];
  return city.world.map((row) => row.reduce((sum, c, i) => sum + c * terms[i], 0));
}

/** Place in the page's frame of world coordinates: the same polynomials turned round (Newton). */
export function toPage(city, world) {
  if (!city.world) return [...world];
  const place = world.map((v, k) => v - city.world[k][0]);
  for (let step = 0; step < 6; step += 1) {
    const off = toWorld(city, place);
    for (const k of [0, 1, 2]) place[k] += world[k] - off[k];
  }
  return place;
}
