// What can be laid over the city: points, surface, cut lines, failures. Each is fetched when it is first wanted.
import {
  BufferAttribute, BufferGeometry, DoubleSide, Group, LineBasicMaterial, LineSegments, Mesh, MeshBasicMaterial, Points,
  PointsMaterial, ShapeUtils, Vector2,
} from 'three';
import { CUTS, POINT_CLASSES, relief, rgb, STATUS, UNKNOWN } from './colours.js';
import { pathOf } from './cuts.js';
import { binary } from './data.js';
import { linesOf } from './highlight.js';

/** Points of a tile as written for this page: places relative to `origin`, colours, classes. */
export async function tilePoints(tile) {
  if (!tile.points) return null;
  const buffer = await binary(`data/points/${encodeURIComponent(tile.name)}.bin`);
  const { count, is_coloured: isColoured, origin } = tile.points;
  return {
    origin, count, isColoured,
    xyz: new Float32Array(buffer, 0, 3 * count),
    rgb: isColoured ? new Uint8Array(buffer, 12 * count, 3 * count) : null,
    classes: new Uint8Array(buffer, (isColoured ? 15 : 12) * count, count),
  };
}

const MOST_NEAR = 64;
const REST_MS = 300;

export class Layers {
  constructor(about, index, stage) {
    Object.assign(this, { about, index, stage });
    this.groups = new Map();
    this.loading = 0;
    let timer = null;
    stage.afterMove.push(() => {
      clearTimeout(timer);
      timer = setTimeout(() => this.#follow(), REST_MS);
    });
  }

  /** Where one looks now may be other tiles than before. */
  async #follow() {
    for (const name of ['cuts', 'failures']) {
      const group = this.groups.get(name);
      if (group?.visible) await this[`_${name}`](group);
    }
  }

  /** Tables of the tiles nearest to what one looks at that have something of a layer and are not drawn yet. */
  async *#near(name, group) {
    const { x, y } = this.stage.controls.target;
    const away = ({ box: [x0, y0, , x1, y1] }) => Math.hypot((x0 + x1) / 2 - x, (y0 + y1) / 2 - y);
    const near = this.index.tiles.filter((tile) => tile[name] && tile.box).sort((a, b) => away(a) - away(b));
    const drawn = (group.userData.drawn ??= new Set());
    for (const tile of near.slice(0, MOST_NEAR)) {
      if (drawn.has(tile.name)) continue;
      drawn.add(tile.name);
      yield (await this.index.table(tile.name))[name];
      this.stage.changed();
    }
  }

  /** Show or hide a layer; resolves when it is drawn. */
  async show(name, isShown) {
    if (isShown && !this.groups.has(name)) {
      const group = new Group();
      this.groups.set(name, group);
      this.stage.scene.add(group);
      this.loading += 1;
      try {
        await this[`_${name}`](group);
      } catch (error) {
        this.groups.delete(name);
        this.stage.scene.remove(group);
        throw error;
      } finally {
        this.loading -= 1;
      }
    }
    const group = this.groups.get(name);
    if (group) group.visible = isShown;
    if (isShown) this.stage.isBlank = false;
    this.stage.changed();
  }

  /** What is drawn is of before: read it again. Returns a promise for each layer that is shown. */
  renew() {
    const shown = [...this.groups].filter(([, group]) => group.visible).map(([name]) => name);
    for (const group of this.groups.values()) this.stage.scene.remove(group);
    this.groups.clear();
    return shown.map((name) => this.show(name, true));
  }

  /** Objects of a layer, for picking. */
  objects(name) {
    const group = this.groups.get(name);
    return group?.visible ? group.children : [];
  }

  async _points(group) {
    for (const tile of this.about.tiles.filter((t) => t.points)) {
      const found = await tilePoints(tile);
      const geometry = new BufferGeometry();
      geometry.setAttribute('position', new BufferAttribute(found.xyz, 3));
      geometry.setAttribute('color', new BufferAttribute(found.rgb ?? classColours(found.classes), 3, true));
      const material = new PointsMaterial({ size: 2, sizeAttenuation: false, vertexColors: true });
      toLinear(material);
      const points = new Points(geometry, material);
      points.position.set(...found.origin);
      group.add(points);
      this.stage.changed();
    }
  }

  async _dsm(group) {
    const material = reliefMaterial();
    for (const tile of this.about.tiles.filter((t) => t.dsm)) {
      const heights = new Float32Array(await binary(`data/dsm/${encodeURIComponent(tile.name)}.bin`));
      group.add(new Mesh(reliefGeometry(heights, tile.dsm, this.about.heights), material));
      this.stage.changed();
    }
  }

  async _cuts(group) {
    for await (const lines of this.#near('cuts', group)) {
      for (const isAccepted of [false, true]) {
        const chosen = lines.filter((line) => line.accepted === isAccepted);
        if (chosen.length) group.add(...drawnCuts(chosen, isAccepted));
      }
    }
  }

  async _failures(group) {
    for await (const shapes of this.#near('failures', group)) for (const shape of shapes) group.add(...drawnFailure(shape));
  }
}

/** A light rim under each line, so that it is seen on a dark roof and on a bright one. */
function drawnCuts(cuts, isAccepted) {
  const places = cuts.flatMap((line) => pathOf(line).flatMap((place, i, path) => (i ? [...path[i - 1], ...place] : [])));
  const rim = linesOf(places, '#ffffff', isAccepted ? 6 : 4.5);
  const drawn = linesOf(places, (isAccepted ? CUTS.taken : CUTS.refused)[1], isAccepted ? 3.5 : 2.5);
  rim.renderOrder = isAccepted ? 5 : 4.6;
  drawn.renderOrder = isAccepted ? 5.5 : 4.8;
  drawn.userData.cuts = cuts;
  return [rim, drawn];
}

function drawnFailure({ id, status, rings, base, height }) {
  const colour = STATUS[status][1];
  const material = new MeshBasicMaterial({ color: colour, transparent: true, opacity: 0.45, depthTest: false, depthWrite: false });
  const fill = new Mesh(prism(rings, base, height), material);
  const rim = new LineSegments(rimOf(rings, base, height), new LineBasicMaterial({ color: colour, depthTest: false }));
  fill.userData.unit = id;
  rim.renderOrder = 4;
  fill.renderOrder = 3;
  return [fill, rim];
}

function classColours(classes) {
  const found = new Uint8Array(3 * classes.length);
  classes.forEach((value, i) => found.set(rgb(POINT_CLASSES[value]?.[1] ?? UNKNOWN), 3 * i));
  return found;
}

/** Colours of vertices are bytes as screens show them; three.js takes them for linear light. */
export function toLinear(material) {
  material.onBeforeCompile = (shader) => {
    shader.vertexShader = shader.vertexShader.replace('#include <color_vertex>', 'vColor = vec4(pow(color.rgb, vec3(2.2)), 1.0);');
    shader.vertexShader = shader.vertexShader.replace('#include <color_pars_vertex>', 'varying vec4 vColor;');
    shader.fragmentShader = shader.fragmentShader
      .replace('#include <color_pars_fragment>', 'varying vec4 vColor;')
      .replace('#include <color_fragment>', 'diffuseColor.rgb *= vColor.rgb;');
  };
}

function reliefMaterial() {
  // drawn a little nearer than it is, since it lies in the terrain and in the roofs
  const material = new MeshBasicMaterial({ vertexColors: true, side: DoubleSide, polygonOffset: true, polygonOffsetFactor: -2, polygonOffsetUnits: -8 });
  toLinear(material);
  return material;
}

/** Triangles over a grid of heights, shaded from the north-west; cells without a height are left out. */
function reliefGeometry(heights, { rows, cols, origin, right, down }, [low, high]) {
  const places = new Float32Array(3 * rows * cols);
  const colours = new Uint8Array(3 * rows * cols);
  for (let i = 0; i < rows * cols; i += 1) {
    const [r, c] = [Math.floor(i / cols), i % cols];
    places.set([0, 1].map((k) => origin[k] + c * right[k] + r * down[k]), 3 * i);
    places[3 * i + 2] = heights[i];
    colours.set(reliefColour(heights, i, r, c, rows, cols, right[0], (heights[i] - low) / (high - low)), 3 * i);
  }
  const triangles = [];
  const isKnown = (i) => Number.isFinite(heights[i]);
  for (let r = 0; r + 1 < rows; r += 1) {
    for (let c = 0; c + 1 < cols; c += 1) {
      const [a, b, d, e] = [r * cols + c, r * cols + c + 1, (r + 1) * cols + c, (r + 1) * cols + c + 1];
      if (isKnown(b) && isKnown(d)) {
        if (isKnown(a)) triangles.push(a, d, b);
        if (isKnown(e)) triangles.push(b, d, e);
      }
    }
  }
  for (let i = 0; i < rows * cols; i += 1) if (!isKnown(i)) places[3 * i + 2] = low;
  const geometry = new BufferGeometry();
  geometry.setAttribute('position', new BufferAttribute(places, 3));
  geometry.setAttribute('color', new BufferAttribute(colours, 3, true));
  geometry.setIndex(triangles);
  return geometry;
}

function reliefColour(heights, i, r, c, rows, cols, cell, share) {
  const at = (row, col) => heights[Math.min(Math.max(row, 0), rows - 1) * cols + Math.min(Math.max(col, 0), cols - 1)];
  const slopeX = (at(r, c + 1) - at(r, c - 1)) / (2 * cell) || 0;
  const slopeY = (at(r - 1, c) - at(r + 1, c)) / (2 * cell) || 0;
  const light = (0.5 * slopeX - 0.5 * slopeY + 0.707) / Math.sqrt(slopeX ** 2 + slopeY ** 2 + 1);
  const bright = 0.45 + 0.75 * Math.min(Math.max(light, 0), 1);
  return relief(share || 0).map((v) => Math.min(255, bright * v));
}

function turned(ring, isClockwise) {
  return ShapeUtils.isClockWise(ring) === isClockwise ? ring : ring.reverse();
}

function prism(rings, base, height) {
  // counted so that faces look outwards: only those towards the eye are drawn
  const [contour, ...holes] = rings.map((ring, k) => turned(ring.map(([x, y]) => new Vector2(x, y)), k > 0));
  const flat = [contour, ...holes].flat();
  const places = [];
  for (const [a, b, c] of ShapeUtils.triangulateShape(contour, holes)) {
    for (const k of [a, b, c]) places.push(flat[k].x, flat[k].y, base + height);
  }
  for (const ring of [contour, ...holes]) {
    ring.forEach((p, i) => {
      const q = ring[(i + 1) % ring.length];
      places.push(p.x, p.y, base, q.x, q.y, base, q.x, q.y, base + height, p.x, p.y, base, q.x, q.y, base + height, p.x, p.y, base + height);
    });
  }
  const geometry = new BufferGeometry();
  geometry.setAttribute('position', new BufferAttribute(new Float32Array(places), 3));
  return geometry;
}

function rimOf(rings, base, height) {
  const places = rings.flatMap((ring) =>
    ring.flatMap((p, i) => {
      const q = ring[(i + 1) % ring.length];
      return [p[0], p[1], base + height, q[0], q[1], base + height, p[0], p[1], base, p[0], p[1], base + height];
    }),
  );
  const geometry = new BufferGeometry();
  geometry.setAttribute('position', new BufferAttribute(new Float32Array(places), 3));
  return geometry;
}
