// The model before the photograph: a part of it lies behind the canvas, and the city is drawn by its own camera. Hidden edges stay hidden.
import { Matrix4, Vector3 } from 'three';
import { byId, element, percent, say } from '../elements.js';
import { isTyping } from './before.js';
import { attempt } from './desk.js';

export class Photograph {
  constructor(page) {
    Object.assign(this, { page, shown: null, unit: null, names: [], at: 0 });
    this.picture = element('img', { id: 'photograph', alt: 'Photograph', hidden: true });
    this.text = element('span', {});
    this.bar = element('div', { id: 'photograph-bar', class: 'hint', hidden: true }, this.text, ' ',
      element('button', { type: 'button', title: 'Another photograph (key: .)', onclick: () => this.step(1) }, 'Next photograph'),
      element('button', { type: 'button', onclick: () => this.leave() }, 'Back'));
    byId('stage').prepend(this.picture);
    byId('stage').append(this.bar);
    page.stage.beforeFrame.push(() => this.#hide());
    new ResizeObserver(() => this.shown && this.#place()).observe(page.stage.canvas.parentElement);
    window.addEventListener('keydown', (event) => {
      if (isTyping(event) || event.ctrlKey || event.metaKey || event.altKey || page.stage.isFlying) return;
      if (event.key === 'i') this.toggle();
      else if (event.key === '.' && this.shown) this.step(1);
    });
    window.addEventListener('keydown', (event) => event.key === 'Escape' && this.shown && (event.stopImmediatePropagation(), this.leave()), true);
  }

  toggle() {
    return this.shown ? this.leave() : this.show();
  }

  /** The photographs of the chosen building, the one that coloured most of it first. */
  async show() {
    const unit = this.page.city.selected;
    if (unit === null) return say('Choose a building first.');
    this.names = (await attempt(() => this.page.desk.get('photographs', { unit }))) ?? [];
    if (!this.names.length) return say('No photograph of this run shows the whole building.');
    return this.step(0, 0);
  }

  /** Another one of them. */
  async step(by, from = this.at) {
    const { city, desk, layers, stage } = this.page;
    this.unit = city.selected;
    this.at = (from + by + this.names.length) % this.names.length;
    const [image, share] = this.names[this.at];
    const query = { unit: city.selected, image };
    const part = await attempt(() => desk.get('photograph', query));
    if (!part) return;
    this.picture.src = `../desk/photograph.jpg?${new URLSearchParams(query)}`;
    await this.picture.decode().catch(() => say(`${image} cannot be shown.`));
    this.page.before.leave();
    if (!this.shown) Object.assign(this, { back: stage.place, overlays: [] });
    this.shown = part;
    this.text.textContent = `${image}${share === null ? '' : `, ${percent(share)} of its texture`} (${this.at + 1} of ${this.names.length})`;
    this.picture.hidden = this.bar.hidden = false;
    document.body.classList.add('photographed');
    stage.controls.enabled = false;
    stage.renderer.setClearAlpha(0);
    this.overlays = [...this.overlays, ...[...layers.groups.values()].filter((group) => group.visible)];
    for (const group of this.overlays) group.visible = false;
    this.#place();
    say('The edges of the model over the photograph: they should fit. Key i leads back.');
  }

  leave() {
    if (!this.shown) return;
    const { stage, city } = this.page;
    this.shown = this.unit = null;
    this.picture.hidden = this.bar.hidden = true;
    document.body.classList.remove('photographed');
    stage.renderer.setClearAlpha(1);
    stage.controls.enabled = true;
    stage.camera.matrixAutoUpdate = true;
    delete stage.camera.updateProjectionMatrix;
    for (const { mesh } of city.meshes()) mesh.material.colorWrite = true;
    for (const mesh of city.renewed.group.children) mesh.material.colorWrite = mesh.children[0].visible = true;
    city.colourBy(city.mode);
    for (const group of this.overlays) group.visible = true;
    stage.look(this.back.slice(0, 3), this.back.slice(3));
  }

  /** Lay the photograph into the middle of what no panel covers, and give the city its camera. */
  #place() {
    const { stage } = this.page;
    const { width, height, fx, fy, cx, cy, view } = this.shown;
    const [wide, tall] = stage.size;
    const { left, right, top, bottom } = stage.aim ?? stage.covered;
    const scale = Math.min((wide - left - right) / width, (tall - top - bottom) / height);
    const x = left + (wide - left - right - scale * width) / 2;
    const y = top + (tall - top - bottom - scale * height) / 2;
    Object.assign(this.picture.style, { left: `${x}px`, top: `${y}px`, width: `${scale * width}px`, height: `${scale * height}px` });
    const [a, b, c] = view;
    // the page's camera looks along its negative third axis, and its second points up
    const seen = new Matrix4().set(...a, ...b.map((v) => -v), ...c.map((v) => -v), 0, 0, 0, 1);
    const { camera } = stage;
    camera.matrixAutoUpdate = false;
    camera.matrix.copy(seen).invert();
    camera.matrixWorldNeedsUpdate = true;
    camera.position.setFromMatrixPosition(camera.matrix);
    camera.quaternion.setFromRotationMatrix(camera.matrix);
    camera.updateProjectionMatrix = () => {
      const { near, far } = camera;
      camera.projectionMatrix.set(
        (2 * scale * fx) / wide, 0, 1 - (2 * (x + scale * cx)) / wide, 0,
        0, (2 * scale * fy) / tall, (2 * (y + scale * cy)) / tall - 1, 0,
        0, 0, -(far + near) / (far - near), (-2 * far * near) / (far - near),
        0, 0, -1, 0,
      );
      camera.projectionMatrixInverse.copy(camera.projectionMatrix).invert();
    };
    const away = camera.position.distanceTo(new Vector3(...(this.page.index.byId.get(this.page.city.selected)?.place ?? [0, 0, 0])));
    Object.assign(camera, { near: Math.max(away / 50, 0.2), far: 4 * away + 2000 });
    camera.updateProjectionMatrix();
    stage.changed();
  }

  /** Of the city only the edges of the building are drawn, where nothing stands before them. */
  #hide() {
    if (!this.shown) return;
    for (const { mesh, model } of this.page.city.meshes()) {
      mesh.material.colorWrite = false;
      for (const lines of model.creases ?? []) lines.visible = false;
    }
    for (const mesh of this.page.city.renewed.group.children) mesh.material.colorWrite = mesh.children[0].visible = false;
  }
}
