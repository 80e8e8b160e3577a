// What web/webgpu.js makes of blobs, as digests that Python compares with the native decoder's. For
// Node and browsers.
// Returns per view {"error": sentence}, or {"indices", "streams": digests, "draw": words,
// "problem": what check() says, or null}.
export async function digests(device, decoder, decodeToGPU, { packed, views, options }) {
  const results = [];
  for (const [offset, length] of views) {
    const view = packed.slice(offset, offset + length);
    const result = decodeToGPU(device, view, { ...options, decoder }).then((primitive) =>
      digest(device, primitive),
    );
    results.push(await result.catch((error) => ({ error: error.message })));
  }
  return results;
}

async function digest(device, primitive) {
  const streams = [];
  for (const { buffer } of primitive.streams) streams.push(await hash(await read(device, buffer)));
  const result = {
    draw: [...new Uint32Array((await read(device, primitive.indirect)).buffer)],
    indices: await hash(await read(device, primitive.indices)),
    streams,
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
