// 3d-tiles-renderer as its own example uses it, and nothing else: what the view's frame time is held against. With `equal` it does without
// what the view does without, too: a light, and photographs larger than the view shows them.
import { TilesRenderer } from '3d-tiles-renderer/three';
import { DirectionalLight, Matrix4, MeshBasicMaterial, PerspectiveCamera, Scene, WebGLRenderer } from 'three';
import { GLTFLoader } from 'three/addons/loaders/GLTFLoader.js';
import { PageLoader, scaleFor } from '../source/textures.js';

const asked = new URLSearchParams(location.search);
const isEqual = asked.get('equal') === '1';
const [width, height] = asked.get('size').split('x').map(Number);
const canvas = document.getElementById('canvas');
Object.assign(canvas.style, { position: 'fixed', left: '0', top: `${window.innerHeight - height}px`, width: `${width}px`, height: `${height}px` });
const renderer = new WebGLRenderer({ canvas, antialias: true, powerPreference: 'high-performance' });
renderer.setClearColor('#dfe8ee');
renderer.setSize(width, height, false);
const scene = new Scene();
const camera = new PerspectiveCamera(45, width / height, 1, 1e4);
camera.up.set(0, 0, 1);
const { frame, texture_pixels: pixels } = await (await fetch(asked.get('city'))).json();
const tiles = new TilesRenderer(asked.get('tileset'));
if (isEqual) {
  const loader = new GLTFLoader(tiles.manager);
  tiles.manager.addHandler(/\.(gltf|glb)$/g, loader);
  tiles.manager.addHandler(/\.(jpe?g|png|webp)$/i, new PageLoader(scaleFor(pixels.rectified)));
  tiles.addEventListener('load-model', ({ scene: model }) => model.traverse((mesh) => {
    if (!mesh.isMesh) return;
    const { map, color, side, vertexColors } = mesh.material;
    mesh.material = new MeshBasicMaterial({ map, color, side, vertexColors });
  }));
} else {
  const light = new DirectionalLight('#fff', 3);
  light.position.set(-0.45, -0.35, 0.82);
  scene.add(light);
}
tiles.errorTarget = Number(asked.get('error'));
// as in the view, nothing is let go of while one walks around
Object.assign(tiles.lruCache, { minBytesSize: 2 ** 33, maxBytesSize: 2 ** 33 });
tiles.setCamera(camera);
tiles.setResolutionFromRenderer(camera, renderer);
scene.add(tiles.group);
new Matrix4().fromArray(frame).invert().decompose(tiles.group.position, tiles.group.quaternion, tiles.group.scale);

window.bare = { tiles, renderer, scene, camera, render: () => { camera.updateMatrixWorld(); tiles.update(); renderer.render(scene, camera); } };
