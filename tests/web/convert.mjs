// Reads a file with glTF-Transform and the extension of gltf-meshlet/gltf-transform, and writes it.
// Copied into a folder with the packages. Usage: node convert.mjs IN OUT CHANGE
// CHANGE: none; move (moves the vertices of the first primitive); no-decoder. Prints an error.
import { NodeIO } from '@gltf-transform/core';
import { ALL_EXTENSIONS } from '@gltf-transform/extensions';
import { createDecoder } from 'gltf-meshlet';
import {
  DECODER,
  EXTMeshletEdgebreaker,
  EXTMeshletTransport,
  UNPACKER,
} from 'gltf-meshlet/gltf-transform';
import { createUnpacker } from 'gltf-meshlet/transport';

const [input, output, change] = process.argv.slice(2);
const extensions = [...ALL_EXTENSIONS, EXTMeshletEdgebreaker, EXTMeshletTransport];
const io = new NodeIO().registerExtensions(extensions);
if (change !== 'no-decoder')
  io.registerDependencies({
    [DECODER]: await createDecoder(),
    [UNPACKER]: await createUnpacker(),
  });
try {
  const document = await io.read(input);
  if (change === 'move') {
    const [primitive] = document.getRoot().listMeshes()[0].listPrimitives();
    const positions = primitive.getAttribute('POSITION');
    positions.setArray(positions.getArray().map((x) => x + 1));
  }
  await io.write(output, document);
} catch (error) {
  console.log(error.message);
}
