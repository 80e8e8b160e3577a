// What web/webgpu.js makes of blobs, as digests that Python compares with the native decoder's. For
// Node and browsers.
// Returns per view {"error": sentence}, or {"indices", "streams": digests, "draw": words,
// "problem": what check() says, or null}.
// All views at a time: Firefox looks for finished copies ten times a second only.
export function digests(device, decoder, decodeToGPU, { packed, views, options }) {
  const decode = async ([offset, length]) => {
    const view = packed.slice(offset, offset + length);
    return digest(device, await decodeToGPU(device, view, { ...options, decoder }));
  };
  return Promise.all(
    views.map((view) => decode(view).catch((error) => ({ error: error.message }))),
  );
}

async function digest(device, primitive) {
  const [draw, indices, ...streams] = await Promise.all(
    [primitive.indirect, primitive.indices, ...primitive.streams.map(({ buffer }) => buffer)].map(
      (buffer) => read(device, buffer),
    ),
  );
  const result = {
    draw: [...new Uint32Array(draw.buffer)],
    indices: await hash(indices),
    streams: await Promise.all(streams.map(hash)),
    problem: await primitive.check().then(
      () => null,
      (error) => error.message,
    ),
  };
  primitive.destroy();
  return result;
}

async function read(device, buffer) {
  const copy = device.createBuffer({
    size: buffer.size,
    usage: GPUBufferUsage.MAP_READ | GPUBufferUsage.COPY_DST,
  });
  const encoder = device.createCommandEncoder();
  encoder.copyBufferToBuffer(buffer, 0, copy, 0, buffer.size);
  device.queue.submit([encoder.finish()]);
  await copy.mapAsync(GPUMapMode.READ);
  const bytes = new Uint8Array(copy.getMappedRange()).slice();
  copy.destroy();
  return bytes;
}

async function hash(bytes) {
  const digest = new Uint8Array(await crypto.subtle.digest('SHA-256', bytes));
  return Array.from(digest, (byte) => byte.toString(16).padStart(2, '0')).join('');
}
