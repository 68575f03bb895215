// Buildings that were made anew before the files of their tiles: their models of before are left out of the tiles, and the new ones stand in plain colours.
import { Group, Vector3 } from 'three';
import { byId, element } from './elements.js';
import { forgotten, plainModel } from './plain.js';

const MARK = 'texture follows';

export class Renewed {
  /** @param {Map} models of the tiles that are in the scene, by their scenes */
  constructor(models, stage) {
    Object.assign(this, { models, stage, without: new Set(), marks: new Map(), isShown: true });
    this.group = new Group();
    stage.scene.add(this.group);
    this.place = () => this.#place();
    stage.beforeFrame.push(this.place);
  }

  get isEmpty() {
    return !this.without.size;
  }

  has(id) {
    return this.without.has(id);
  }

  /** @param {object[]} models triangles of buildings @param {string[]} without buildings whose models of before are no more */
  add(models, without) {
    const old = this.group.children.filter(({ userData }) => without.includes(userData.unit));
    this.group.remove(...old);
    forgotten(old);
    for (const id of without) {
      this.without.add(id);
      this.marks.get(id)?.mark.remove();
      this.marks.delete(id);
    }
    for (const model of models) this.#draw(model);
    for (const model of this.models.values()) this.leaveOut(model);
    this.stage.changed();
  }

  #draw(model) {
    this.group.add(plainModel(model));
    const mark = element('p', { class: 'mark', 'data-unit': model.id }, MARK);
    byId('stage').append(mark);
    this.marks.set(model.id, { mark, at: topOf(model.corners) });
  }

  /** Draw the new models, or those of before. */
  show(isShown) {
    this.isShown = this.group.visible = isShown;
    for (const model of this.models.values()) this.drawRange(model);
  }

  /** Put faces of renewed buildings at the end of a tile's meshes, where they can be left out. */
  leaveOut(model) {
    const rows = new Set([...this.without].map((id) => model.rows.get(id)).filter((row) => row !== undefined));
    if (!rows.size) return;
    model.meshes.forEach((mesh, k) => {
      const { geometry } = mesh;
      const { _feature_id_0: ids } = geometry.attributes;
      if (!ids) return;
      geometry.userData.kept = sorted(geometry.index, (vertex) => !rows.has(ids.getX(vertex)));
      if (model.creases) model.crease(k);
    });
    this.drawRange(model);
  }

  /** How much of a tile's model is drawn. */
  drawRange(model) {
    for (const { geometry, children } of model.meshes) {
      if (geometry.userData.kept === undefined) continue;
      for (const of of [geometry, ...children.map((lines) => lines.geometry)]) of?.setDrawRange(0, this.isShown ? (of.userData.kept ?? Infinity) : Infinity);
    }
  }

  /** Triangles of a building, in the page's frame. */
  trianglesOf(id) {
    const corners = this.group.children.find(({ userData }) => userData.unit === id)?.userData.corners ?? [];
    return Array.from({ length: corners.length / 9 }, (_, t) => [0, 3, 6].map((k) => corners.slice(9 * t + k, 9 * t + k + 3)));
  }

  /** The tiles have what was made: let go of all of it, and leave the models of before whole. */
  end() {
    this.show(false);
    this.stage.scene.remove(this.group);
    forgotten(this.group.children);
    for (const { mark } of this.marks.values()) mark.remove();
    this.stage.beforeFrame.splice(this.stage.beforeFrame.indexOf(this.place), 1);
  }

  /** Each mark stands over its building. */
  #place() {
    const { left, top } = this.stage.canvas.getBoundingClientRect();
    for (const { mark, at } of this.marks.values()) {
      const seen = this.isShown ? this.stage.onPage(at) : null;
      mark.hidden = !seen;
      if (seen) Object.assign(mark.style, { left: `${seen[0] - left}px`, top: `${seen[1] - top}px` });
    }
  }
}

/** Bring triangles whose first vertex is kept to the beginning of an index; returns how many entries they have. */
function sorted(index, isKept) {
  const [kept, others] = [[], []];
  for (let i = 0; i < index.count; i += 3) (isKept(index.getX(i)) ? kept : others).push(index.getX(i), index.getX(i + 1), index.getX(i + 2));
  index.array.set([...kept, ...others]);
  index.needsUpdate = true;
  return kept.length;
}

/** The middle of a model's corners, at the height of the highest. */
function topOf(corners) {
  const of = (k) => corners.filter((_, i) => i % 3 === k);
  const middle = (values) => (Math.min(...values) + Math.max(...values)) / 2;
  return new Vector3(middle(of(0)), middle(of(1)), Math.max(...of(2)));
}
