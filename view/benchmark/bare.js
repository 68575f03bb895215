// 3d-tiles-renderer as its own example uses it, and nothing else: what the view's frame time is held against.
import { TilesRenderer } from '3d-tiles-renderer/three';
import { DirectionalLight, Matrix4, PerspectiveCamera, Scene, WebGLRenderer } from 'three';

const said = new URLSearchParams(location.search);
const canvas = document.getElementById('canvas');
const renderer = new WebGLRenderer({ canvas, antialias: true, powerPreference: 'high-performance' });
renderer.setClearColor('#dfe8ee');
renderer.setSize(window.innerWidth, window.innerHeight, false);
const scene = new Scene();
const light = new DirectionalLight('#fff', 3);
light.position.set(-0.45, -0.35, 0.82);
scene.add(light);
const camera = new PerspectiveCamera(45, window.innerWidth / window.innerHeight, 1, 1e4);
camera.up.set(0, 0, 1);
const tiles = new TilesRenderer(said.get('tileset'));
tiles.errorTarget = Number(said.get('error'));
tiles.lruCache.maxBytesSize = 2 ** 33;
tiles.setCamera(camera);
tiles.setResolutionFromRenderer(camera, renderer);
scene.add(tiles.group);
const { frame } = await (await fetch(said.get('city'))).json();
new Matrix4().fromArray(frame).invert().decompose(tiles.group.position, tiles.group.quaternion, tiles.group.scale);

window.bare = { tiles, renderer, scene, camera, render: () => { camera.updateMatrixWorld(); tiles.update(); renderer.render(scene, camera); } };
