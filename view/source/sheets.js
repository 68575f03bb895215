// Ground tiles whose models are too far away to be drawn: a flat sheet for each, so that a large city ends where it ends.
import { BufferAttribute, BufferGeometry, Color, DoubleSide, Mesh, MeshBasicMaterial } from 'three';
import { STATUS, UNKNOWN, VERDICT } from './colours.js';

/** Nearer ones are loaded sooner or later. */
const FAR_M = 4000;
const PLAIN = '#a9a395';
const KINDS = { status: STATUS, verdict: VERDICT };

export class Sheets {
  /** @param {Units} index @param {City} city */
  constructor(index, city, stage) {
    this.tiles = index.tiles.filter(({ box }) => box);
    Object.assign(this, { city, stage, mode: null, shown: this.tiles.map(() => false) });
    const geometry = new BufferGeometry();
    geometry.setAttribute('position', new BufferAttribute(new Float32Array(this.tiles.flatMap(cornersOf)), 3));
    geometry.setAttribute('color', new BufferAttribute(new Float32Array(12 * this.tiles.length), 3));
    geometry.setIndex([]);
    this.mesh = new Mesh(geometry, new MeshBasicMaterial({ vertexColors: true, side: DoubleSide }));
    this.mesh.visible = false;
    stage.scene.add(this.mesh);
  }

  /** Before each frame: those that are far away and have no model there now. */
  update() {
    const { position } = this.stage.camera;
    const drawn = this.city.drawnTiles();
    const shown = this.tiles.map(({ name, box }) => !drawn.has(name) && distance(box, position) > FAR_M);
    if (shown.some((is, k) => is !== this.shown[k])) this.#choose(shown);
    if (this.city.mode !== this.mode) this.#paint();
  }

  #choose(shown) {
    this.shown = shown;
    this.mesh.geometry.setIndex(shown.flatMap((is, k) => (is ? [0, 1, 2, 0, 2, 3].map((i) => 4 * k + i) : [])));
    this.mesh.visible = shown.some(Boolean);
  }

  #paint() {
    this.mode = this.city.mode;
    const { color } = this.mesh.geometry.attributes;
    this.tiles.forEach((tile, k) => {
      const { r, g, b } = colourOf(tile, KINDS[this.mode]);
      for (let i = 0; i < 4; i += 1) color.setXYZ(4 * k + i, r, g, b);
    });
    color.needsUpdate = true;
  }
}

/** The mean of its buildings' colours; a quiet one where they are not coloured by how they ended. */
function colourOf(tile, kinds) {
  if (!kinds) return new Color(PLAIN);
  const known = Object.entries(kinds).filter(([name]) => tile[name]);
  const count = known.reduce((sum, [name]) => sum + tile[name], 0);
  if (!count) return new Color(UNKNOWN);
  return known.reduce((sum, [name, [, colour]]) => sum.add(new Color(colour).multiplyScalar(tile[name] / count)), new Color(0, 0, 0));
}

const cornersOf = ({ box: [x0, y0, z, x1, y1] }) => [x0, y0, z, x1, y0, z, x1, y1, z, x0, y1, z];

const distance = ([x0, y0, z0, x1, y1, z1], { x, y, z }) => Math.hypot((x0 + x1) / 2 - x, (y0 + y1) / 2 - y, (z0 + z1) / 2 - z);
