// Pages of photographs within a budget of pixels: coarser where a city has too many of them, and sharp again where one stands near.
import { Source, Sphere } from 'three';

const MOST_PIXELS = 40e6;
const MOST_SHARP_PIXELS = 16e6;
const SHARP_WITHIN_M = 300;
const IDLE_MS = 350;
const DECODED = { premultiplyAlpha: 'none', colorSpaceConversion: 'none' };

/** How much smaller pages are shown, edge to edge, so that `pixels` of them fit. */
export const scaleFor = (pixels) => Math.min(1, Math.sqrt(MOST_PIXELS / Math.max(pixels, 1)));

async function decoded(url, scale) {
  const response = await fetch(url);
  if (!response.ok) throw new Error(`${url}: ${response.status}`);
  const whole = await createImageBitmap(await response.blob(), DECODED);
  if (scale >= 1) return whole;
  const [resizeWidth, resizeHeight] = [whole.width, whole.height].map((v) => Math.max(1, Math.round(v * scale)));
  const smaller = await createImageBitmap(whole, { ...DECODED, resizeWidth, resizeHeight, resizeQuality: 'high' });
  whole.close();
  return smaller;
}

/** Takes the place of the loader's own for images. */
export class PageLoader {
  constructor(scale) {
    this.scale = scale;
    this.isImageBitmapLoader = true;
    this.addressOf = new WeakMap();
  }

  load(url, onLoad, onProgress, onError) {
    decoded(url, this.scale).then((bitmap) => {
      this.addressOf.set(bitmap, { url, pixels: (bitmap.width * bitmap.height) / this.scale ** 2 });
      onLoad(bitmap);
    }, onError ?? (() => {}));
  }
}

/** Shows the pages of the nearest models at their full size once the camera rests. */
export class Sharpener {
  constructor(city, loader, stage) {
    Object.assign(this, { city, loader, stage, timer: null });
    this.sharp = new Set();
    this.isEnded = false;
    this.rest = () => {
      clearTimeout(this.timer);
      this.timer = setTimeout(() => this.#sharpen(), IDLE_MS);
    };
    stage.afterMove.push(this.rest);
  }

  end() {
    this.isEnded = true;
    clearTimeout(this.timer);
    this.stage.afterMove.splice(this.stage.afterMove.indexOf(this.rest), 1);
  }

  /** Note where the pages of a model come from, and let go of their pixels once the graphics card has them. */
  note(model) {
    model.pages = model.meshes.flatMap(({ material }) => {
      const texture = material.uniforms.page.value;
      const known = texture && this.loader.addressOf.get(texture.image);
      return known ? [{ texture, ...known }] : [];
    });
    for (const { texture } of model.pages) released(texture);
    this.rest();
  }

  async #sharpen() {
    if (this.loader.scale >= 1 || this.isEnded) return;
    const wanted = this.#nearest();
    for (const page of [...this.sharp]) {
      if (!wanted.has(page)) await this.#exchange(page, this.loader.scale);
    }
    for (const page of wanted) {
      if (!this.sharp.has(page)) await this.#exchange(page, 1);
    }
  }

  #nearest() {
    const eye = this.stage.camera.position;
    const ranked = [...this.city.models.values()]
      .filter((model) => model.scene.parent && model.pages.length)
      .map((model) => ({ model, away: distance(model, eye) }))
      .filter(({ away }) => away < SHARP_WITHIN_M)
      .sort((a, b) => a.away - b.away);
    const wanted = new Set();
    let pixels = 0;
    for (const page of ranked.flatMap(({ model }) => model.pages)) {
      pixels += page.pixels;
      if (pixels > MOST_SHARP_PIXELS) break;
      wanted.add(page);
    }
    return wanted;
  }

  async #exchange(page, scale) {
    if (scale < 1) this.sharp.delete(page);
    else this.sharp.add(page);
    const bitmap = await decoded(page.url, scale).catch(() => null);
    if (!bitmap || this.isEnded) return;
    // the storage of a texture has one size for good
    page.texture.dispose();
    page.texture.source = new Source(bitmap);
    page.texture.needsUpdate = true;
    released(page.texture);
    this.stage.changed();
  }
}

function released(texture) {
  texture.onUpdate = () => {
    texture.onUpdate = null;
    texture.source.data?.close?.();
  };
}

const sphere = new Sphere();

function distance(model, eye) {
  return Math.min(
    ...model.meshes.map(({ geometry, matrixWorld }) => {
      if (!geometry.boundingSphere) geometry.computeBoundingSphere();
      return sphere.copy(geometry.boundingSphere).applyMatrix4(matrixWorld).distanceToPoint(eye);
    }),
  );
}
