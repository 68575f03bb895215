// The city from RUN's own 3D Tiles: loading, how buildings are coloured, what stands under the pointer.
import { TilesRenderer } from '3d-tiles-renderer/three';
import { BufferAttribute, Color, DataTexture, Matrix4, NearestFilter, Raycaster, SRGBColorSpace, Vector3 } from 'three';
import { GLTFLoader } from 'three/addons/loaders/GLTFLoader.js';
import { CLASSES, STATUS, UNKNOWN, VERDICT, rgb, scaled } from './colours.js';
import { byId } from './elements.js';
import { creasesOf, disposed, edgesOf } from './highlight.js';
import { CLASS, define, lighten, materialFor, PHOTOGRAPHS, UNIT } from './materials.js';
import { TablesPlugin } from './metadata.js';
import { Renewed } from './renewed.js';
import { trianglesOf } from './residuals.js';
import { PageLoader, scaleFor, Sharpener } from './textures.js';

const MODES = { photographs: PHOTOGRAPHS, classes: CLASS, nmad: UNIT, rmse: UNIT, status: UNIT, verdict: UNIT };
const MOST_CACHED_BYTES = 400 * 2 ** 20;
const ERROR_TARGET_PX = 16;

export class City {
  /**
   * @param {object} about data/city.json
   * @param {Units} units tables of buildings
   * @param {{camera, renderer, scene, changed: () => void}} stage
   * @param {string} base of the page's files, where they are those of another run
   */
  constructor(about, units, stage, base = '') {
    Object.assign(this, { about, units, stage, base });
    this.mode = 'photographs';
    this.set = about.sets.rectified ? 'rectified' : 'raw';
    this.isDivided = true;
    this.shown = { terrain: true, buildings: true };
    this.selected = null;
    this.models = new Map();
    this.failures = [];
    const colours = Array.from({ length: 8 }, () => new Color(UNKNOWN));
    this.classColours = { value: colours };
    this.raycaster = new Raycaster();
    this.tiles = null;
    this.edges = null;
    this.former = null;
    this.isArriving = false;
    this.renewed = new Renewed(this.models, stage);
    this.isEnded = false;
    // what a lost context held is fetched again: pixels are let go of once they are drawn
    stage.canvas.addEventListener('webglcontextrestored', () => this.load());
    this.load();
  }

  get isEmpty() {
    return !this.about.sets.rectified && !this.about.sets.raw;
  }

  /** Show the set of textures that is wanted, in place of the one before. */
  load() {
    if (this.isEmpty || this.isEnded) return;
    this.#dispose();
    this.#forgetFormer();
    this.#begin();
  }

  /** Let go of everything. */
  end() {
    this.isEnded = true;
    this.#dispose();
    this.#forgetFormer();
    this.tiles = null;
  }

  /** Drawn for a moment without 'buildings', or without the 'chosen' one alone; null: with all that is shown. */
  without(what) {
    for (const model of this.models.values()) {
      for (const mesh of model.meshes) {
        mesh.visible = this.shown[partOf(mesh)] && !(what === 'buildings' && partOf(mesh) === what);
        mesh.material.uniforms.leftOut.value = what === 'chosen' ? 1 : 0;
      }
      for (const lines of model.creases ?? []) lines.visible = model.isPlain && !(what === 'chosen' && model.rows.has(this.selected));
    }
  }

  /** The run has other models now. Those of before stay in sight until the new ones are there, and are kept. */
  async renew() {
    if (this.isEmpty) return;
    const { tiles, models, sharpener, renewed } = this;
    this.#forgetFormer();
    if (!tiles) return this.#begin();
    sharpener.end();
    this.former = { tiles, models };
    this.isArriving = true;
    this.models = new Map();
    this.renewed = new Renewed(this.models, this.stage);
    this.#begin();
    this.tiles.group.visible = false;
    await this.#arrival(this.tiles);
    this.isArriving = false;
    renewed.end();
    this.showFormer(false);
    this.#outline();
  }

  /** Buildings that were made anew, before the tiles have them; see `Renewed.add`. */
  add(models, without) {
    this.renewed.add(models, without);
    this.#outline();
  }

  /** The tiles have what was made, or nothing was. */
  dropRenewed() {
    if (this.renewed.isEmpty) return;
    this.renewed.end();
    this.renewed = new Renewed(this.models, this.stage);
    this.#outline();
    this.stage.changed();
  }

  /** Whether there is anything of before. */
  get hasFormer() {
    return Boolean(this.former) || !this.renewed.isEmpty;
  }

  /** Until what is in sight is loaded. */
  #arrival(tiles) {
    return new Promise((resolve) => {
      const look = () => {
        if (this.tiles === tiles && (this.isLoading || !this.models.size) && !this.failures.length) setTimeout(look, 30);
        else resolve();
      };
      look();
      this.stage.changed();
    });
  }

  /** Show the models of before the last change in place of those of now, or these again. */
  showFormer(isShown) {
    this.drawFormer(isShown);
    this.stage.changed();
  }

  /** The same within a frame. */
  drawFormer(isShown) {
    if (!this.renewed.isEmpty) this.renewed.show(!isShown);
    else if (this.former && this.tiles) {
      this.former.tiles.group.visible = isShown;
      this.tiles.group.visible = !isShown;
    }
  }

  #forgetFormer() {
    if (!this.former) return;
    this.stage.scene.remove(this.former.tiles.group);
    this.former.tiles.dispose();
    this.former = null;
  }

  #begin() {
    const tiles = new TilesRenderer(`${this.base}../${this.about.sets[this.set]}`);
    const loader = new GLTFLoader(tiles.manager);
    loader.register((parser) => new TablesPlugin(parser));
    tiles.manager.addHandler(/\.(gltf|glb)$/g, loader);
    const pages = new PageLoader(scaleFor(this.about.texture_pixels[this.set]));
    tiles.manager.addHandler(/\.(jpe?g|png|webp)$/i, pages);
    this.sharpener = new Sharpener(this, pages, this.stage);
    tiles.errorTarget = ERROR_TARGET_PX;
    tiles.lruCache.maxBytesSize = MOST_CACHED_BYTES;
    tiles.setCamera(this.stage.camera);
    if (this.about.frame) {
      new Matrix4().fromArray(this.about.frame).invert().decompose(tiles.group.position, tiles.group.quaternion, tiles.group.scale);
    }
    tiles.addEventListener('load-model', ({ scene, tile, url }) => this.tiles === tiles && this.#loaded(scene, url ?? tile.content?.uri ?? ''));
    const { models } = this;
    tiles.addEventListener('dispose-model', ({ scene }) => gone(scene, models));
    tiles.addEventListener('tile-visibility-change', ({ scene }) => !this.isArriving && models.get(scene)?.rows.has(this.selected) && this.#forgetOutline());
    tiles.addEventListener('load-error', ({ url, error }) => this.#failed(url, error));
    for (const event of ['needs-update', 'needs-render', 'load-tileset', 'load-content', 'tiles-load-end']) {
      tiles.addEventListener(event, this.stage.changed);
    }
    hasten(tiles, this.stage);
    this.stage.scene.add(tiles.group);
    tiles.group.updateMatrixWorld(true);
    this.tiles = tiles;
    this.resize();
    this.stage.changed();
  }

  resize() {
    this.tiles?.setResolutionFromRenderer(this.stage.camera, this.stage.renderer);
  }

  update() {
    this.tiles?.update();
    if (this.selected !== null && !this.edges) this.#outline();
    if (!this.isLoading) this.stage.isBlank = false;
    if (!this.base) byId('loading').hidden = this.models.size > 0 || !this.isLoading;
  }

  get isLoading() {
    if (!this.tiles) return false;
    const { downloading, parsing, queued } = this.tiles.stats;
    return !this.tiles.root || this.tiles.isLoading || downloading + parsing + (queued ?? 0) > 0;
  }

  /** Colour buildings by `photographs`, `classes`, `nmad`, `rmse`, `status` or `verdict`. */
  colourBy(mode) {
    this.mode = mode;
    for (const model of this.models.values()) this.#dress(model);
    this.stage.changed();
  }

  /** Textures straightened beforehand (`rectified`), or in the geometry of their images (`raw`), divided per pixel or not. */
  textures(set, isDivided) {
    const isOther = set !== this.set;
    Object.assign(this, { set, isDivided });
    if (isOther) this.load();
    else for (const model of this.models.values()) this.#dress(model);
    this.stage.changed();
  }

  show(part, isShown) {
    this.shown[part] = isShown;
    for (const model of this.models.values()) this.#hide(model);
    if (this.edges) this.edges.visible = this.shown.buildings;
    this.stage.changed();
  }

  #hide(model) {
    for (const mesh of model.meshes) mesh.visible = this.shown[partOf(mesh)];
  }

  select(id) {
    this.selected = id;
    for (const model of [...this.models.values(), ...(this.former?.models.values() ?? [])]) this.#mark(model);
    this.#outline();
    this.stage.changed();
  }

  /** The chosen building is drawn from another model now, near or far. */
  #forgetOutline() {
    if (!this.edges) return;
    this.stage.scene.remove(this.edges);
    disposed(this.edges);
    this.edges = null;
  }

  #outline() {
    this.#forgetOutline();
    // tiles are attached to the scene some time after they have come
    const model = this.renewed.has(this.selected) ? null : [...this.seen.values()].find(({ rows, scene }) => rows.has(this.selected) && scene.parent);
    model?.scene.updateWorldMatrix(true, true);
    this.edges = edgesOf(model ? trianglesOf(this, this.selected) : this.renewed.trianglesOf(this.selected));
    if (!this.edges) return;
    this.edges.visible = this.shown.buildings;
    this.stage.scene.add(this.edges);
  }

  /** What a ray from the camera meets first: place, part, building, class of surface. */
  pick(ndc) {
    if (!this.tiles) return null;
    this.raycaster.setFromCamera(ndc, this.stage.camera);
    return this.#first();
  }

  /** What stands at a place in plan, seen from above; `part` where only one counts. */
  below(x, y, part = null) {
    if (!this.tiles) return null;
    this.raycaster.set(new Vector3(x, y, 1e4), new Vector3(0, 0, -1));
    return this.#first(part);
  }

  #first(part = null) {
    const hits = this.raycaster.intersectObjects([this.tiles.group, this.renewed.group], true);
    for (const hit of hits) {
      const { unit } = hit.object.userData;
      if (unit && this.renewed.isShown && part !== 'terrain') return { place: hit.point, part: 'buildings', isFar: false, unit, surface: null };
      const model = this.models.get(rootOf(hit.object, this.models));
      if (!model || !(part ? partOf(hit.object) === part : hit.object.visible)) continue;
      return { place: hit.point, part: partOf(hit.object), isFar: model.isFar, ...this.#described(model, hit) };
    }
    return null;
  }

  #described(model, hit) {
    const rows = hit.object.geometry.attributes._feature_id_0;
    if (!rows || !model.tables) return { unit: null, surface: null };
    const face = hit.object.geometry.attributes._feature_id_1.getX(hit.face.a);
    return { unit: model.tables.ids[rows.getX(hit.face.a)], surface: model.tables.words[model.tables.types[face]] };
  }

  /** Whether a tile that was loaded knows a class of surfaces. */
  hasClass(name) {
    return [...this.models.values()].some(({ tables }) => tables?.words.includes(name));
  }

  /** Models of the tiles that are in sight: those of before until the new ones are there. */
  get seen() {
    return this.isArriving ? this.former.models : this.models;
  }

  /** Meshes of the tiles that are drawn now. */
  *meshes(part = null) {
    for (const model of this.seen.values()) {
      if (!model.scene.parent) continue;
      for (const mesh of model.meshes) if (!part || partOf(mesh) === part) yield { mesh, model };
    }
  }

  #loaded(scene, url) {
    const tables = scene.userData.tables ?? null;
    const model = { scene, tables, isFar: Boolean(tables?.units), tile: tileOf(url), meshes: [], colours: null, rows: new Map(), crease };
    if (tables) {
      tables.ids.forEach((id, row) => model.rows.set(id, row));
      model.colours = unitTexture(tables.ids.length);
      tables.words.forEach((word, i) => this.classColours.value[i].set(CLASSES.find(([name]) => name === word)?.[2] ?? UNKNOWN));
    }
    scene.traverse((object) => {
      if (object.isMesh) model.meshes.push(object);
    });
    // it is attached to the others some time after it has come
    scene.updateMatrixWorld(true);
    for (const mesh of model.meshes) {
      lighten(mesh.geometry, new Matrix4().multiplyMatrices(this.tiles.group.matrixWorld, mesh.matrixWorld));
      if (partOf(mesh) === 'buildings') classify(mesh.geometry, tables.types);
      mesh.material = materialFor(mesh, { classColours: this.classColours, unitColours: model.colours });
    }
    this.sharpener.note(model);
    this.#hide(model);
    this.models.set(scene, model);
    this.renewed.leaveOut(model);
    this.stage.isBlank = false;
    this.#dress(model);
    this.#mark(model);
    if (tables && !model.isFar) this.#know(model);
    this.stage.changed();
  }

  /** What is in sight may be asked for, and coloured by how it ended. */
  async #know(model) {
    await this.units.table(model.tile);
    if (MODES[this.mode] !== UNIT || this.models.get(model.scene) !== model) return;
    this.#paint(model);
    this.stage.changed();
  }

  #dress(model) {
    const mode = model.tables ? MODES[this.mode] : PHOTOGRAPHS;
    if (mode === UNIT) this.#paint(model);
    if (!model.isFar) this.#crease(model, mode);
    for (const mesh of model.meshes) {
      const { material, geometry } = mesh;
      const isBuilding = partOf(mesh) === 'buildings';
      define(material, 'MODE', isBuilding ? mode : PHOTOGRAPHS);
      define(material, 'IS_MUTED', isBuilding || this.mode === 'photographs' ? undefined : '');
      define(material, 'HAS_TRIPLETS', geometry.attributes._uvd && this.isDivided ? '' : undefined);
    }
  }

  /** Lines along the edges of buildings without photographs: planes of one colour cannot be told apart by their light alone. */
  #crease(model, mode) {
    const isPlain = mode !== PHOTOGRAPHS || !model.meshes.some(({ material }) => material.defines.HAS_MAP);
    if (model.tables && !model.creases && isPlain) {
      model.creases = [];
      model.meshes.forEach((_, k) => model.crease(k));
      this.renewed.drawRange(model);
    }
    for (const lines of model.creases ?? []) lines.visible = isPlain;
    model.isPlain = isPlain;
  }

  #paint(model) {
    const { data } = model.colours.image;
    const known = model.isFar ? (_, row) => model.tables.units[row] : (id) => this.units.byId.get(id);
    model.tables.ids.forEach((id, row) => data.set([...this.#colourOf(known(id, row)), 255], 4 * row));
    model.colours.needsUpdate = true;
  }

  #colourOf(unit) {
    if (!unit) return rgb(UNKNOWN);
    if (this.mode === 'status') return rgb(STATUS[unit.status]?.[1] ?? UNKNOWN);
    if (this.mode === 'verdict') return rgb(VERDICT[unit.verdict]?.[1] ?? UNKNOWN);
    const value = unit[this.mode];
    return value === null ? rgb(UNKNOWN) : scaled(value / this.about.scales[this.mode]);
  }

  #mark(model) {
    const row = this.selected === null ? undefined : model.rows.get(this.selected);
    for (const mesh of model.meshes) {
      define(mesh.material, 'HAS_SELECTION', row === undefined || partOf(mesh) !== 'buildings' ? undefined : '');
      mesh.material.uniforms.selected.value = row ?? -1;
    }
  }

  #failed(url, error) {
    this.failures.push(String(url ?? error));
    this.stage.isBlank = false;
    this.onfailure?.(String(url ?? error));
    this.stage.changed();
  }

  #dispose() {
    if (!this.tiles) return;
    this.sharpener.end();
    this.stage.scene.remove(this.tiles.group);
    this.tiles.dispose();
    this.models.clear();
  }
}

/** Draw lines along the edges of a mesh of a model, the so-manieth, in place of those of before. */
function crease(k) {
  const mesh = this.meshes[k];
  const old = this.creases[k];
  this.creases[k] = creasesOf(mesh.geometry);
  if (old) {
    mesh.remove(old);
    old.geometry.dispose();
    this.creases[k].visible = old.visible;
  }
  mesh.add(this.creases[k]);
  // what is in a tile is not looked at again once that is in the scene
  this.creases[k].updateMatrixWorld(true);
}

/** Let go of a model that is needed no more. */
function gone(scene, models) {
  const model = models.get(scene);
  if (!model) return;
  model.colours?.dispose();
  for (const mesh of model.meshes) mesh.material.dispose();
  for (const lines of model.creases ?? []) lines.geometry.dispose();
  models.delete(scene);
}

/** Between two looks at all tiles, in times of what a look takes: in a large city it takes long, and each tile that comes asks for one. */
const PAUSE = 4;

/**
 * The library does each step of loading with a frame, and frames are slow while a page begins: what is loaded leads to what it
 * asks for at once.
 */
function hasten(tiles, stage) {
  let isDue = false;
  let spent = 0;
  const soon = () => {
    if (isDue) return;
    isDue = true;
    setTimeout(() => {
      isDue = false;
      stage.camera.updateMatrixWorld();
      const begun = performance.now();
      tiles.update();
      spent = performance.now() - begun;
    }, PAUSE * spent);
  };
  for (const queue of [tiles.downloadQueue, tiles.parseQueue, tiles.processNodeQueue]) queue._schedulingCallback = (run) => setTimeout(run);
  for (const event of ['needs-update', 'load-tileset', 'load-content']) tiles.addEventListener(event, soon);
  soon();
}

/** The class of each vertex's face, as the shader reads it. */
function classify(geometry, types) {
  const faces = geometry.attributes._feature_id_1;
  const found = new Uint8Array(faces.count);
  for (let i = 0; i < faces.count; i += 1) found[i] = types[faces.getX(i)];
  geometry.setAttribute('surfaceClass', new BufferAttribute(found, 1));
}

function unitTexture(count) {
  const texture = new DataTexture(new Uint8Array(4 * count), count, 1);
  texture.colorSpace = SRGBColorSpace;
  texture.minFilter = NearestFilter;
  texture.magFilter = NearestFilter;
  return texture;
}

/** Whether a mesh is of `buildings` or of the `terrain`. */
export const partOf = (mesh) => (mesh.geometry.attributes._feature_id_0 ? 'buildings' : 'terrain');

/** The ground tile that a file is of: its folder. */
const tileOf = (url) => decodeURIComponent(url.split(/[?#]/)[0].split('/').at(-2) ?? '');

function rootOf(object, models) {
  let at = object;
  while (at && !models.has(at)) at = at.parent;
  return at;
}
