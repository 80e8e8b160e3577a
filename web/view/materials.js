// What lights models, and what they look like if their file does not say.
import { BoxGeometry, Mesh, MeshBasicMaterial, Scene } from './vendor.js';

const GREY = 0xa0a0a0; // shows relief in light and shadow alike

// glTF's default is a white metal, in which hardly any relief is to be seen.
function isDefault(material) {
  const { color, metalness, roughness, map, metalnessMap, name } = material;
  return !name && !map && !metalnessMap && metalness === 1 && roughness === 1 && color.r === 1;
}

// Paints grey what has no material.
export function paintPlain(root) {
  root.traverse(({ plain, material }) => {
    for (const one of [plain ?? material ?? []].flat())
      if (one.isMeshStandardMaterial && isDefault(one)) paint(one);
  });
}

export function paint(material) {
  if (!material.vertexColors) material.color.set(GREY);
  Object.assign(material, { metalness: 0, roughness: 0.6 });
}

// Lights around the models: [brightness, position, size] of boxes, after the brightness of all around.
const PLACES = {
  studio: [
    0.22,
    [9, [-4, 5, 3], [2, 3, 3]],
    [4, [5, 1, -3], [1, 4, 2]],
    [1.2, [3, -1, 6], [3, 2, 1]],
  ],
  sky: [0.25, [1.6, [0, 9, 0], [18, 4, 18]], [0.7, [0, 2, 0], [30, 2, 30]]],
  even: [0.9],
};
export const ENVIRONMENTS = Object.keys(PLACES);

// A scene for PMREMGenerator.
export function environmentOf(name) {
  const [around, ...lights] = PLACES[name];
  const scene = new Scene();
  const add = (brightness, [x, y, z], [width, height, depth]) => {
    const material = new MeshBasicMaterial({ side: 2 }); // both sides
    material.color.setScalar(brightness);
    const box = new Mesh(new BoxGeometry(width, height, depth), material);
    box.position.set(x, y, z);
    scene.add(box);
  };
  add(around, [0, 0, 0], [40, 40, 40]);
  for (const light of lights) add(...light);
  return scene;
}
