// SPDX-License-Identifier: MIT
// From the page's script elements to typed arrays.

const kTypes = {
  f32: Float32Array,
  i16: Int16Array,
  i8: Int8Array,
  u32: Uint32Array,
  u16: Uint16Array,
  u8: Uint8Array,
};

export function readHeader() {
  return JSON.parse(document.getElementById("report-header").textContent);
}

async function inflate(base64) {
  const text = atob(base64);
  const bytes = new Uint8Array(text.length);
  for (let i = 0; i < text.length; ++i) bytes[i] = text.charCodeAt(i);
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"));
  return new Response(stream).arrayBuffer();
}

// The arrays of clip `index` by name, as geometry/report/report_data.h lists them.
export async function readPayload(index, directory) {
  const element = document.getElementById(`report-payload-${index}`);
  const buffer = await inflate(element.textContent);
  element.remove(); // megabytes of text that nobody needs any more
  const arrays = {};
  for (const [name, { type, offset, count }] of Object.entries(directory)) {
    arrays[name] = new kTypes[type](buffer, offset, count);
  }
  if (arrays.distance) restoreDistances(arrays.distance, directory.distance.stride);
  return arrays;
}

// Each frame is stored as the difference to the one before, modulo 256, as Int8Array wraps it.
function restoreDistances(values, stride) {
  for (let i = stride; i < values.length; ++i) values[i] += values[i - stride];
}
