// After a decoder, one workgroup: the place of each meshlet's triangles in the index buffer, the
// arguments of the draw, and how many meshlets are malformed.
#version 460
#extension GL_GOOGLE_include_directive : require

#define WORKGROUP 256u
layout(local_size_x = WORKGROUP) in;
#define THREAD gl_LocalInvocationIndex

shared uint shared_triangles[WORKGROUP];
shared uint shared_malformed[WORKGROUP];
shared uint shared_first[WORKGROUP];  // malformed meshlet

void main() {
  uint share = (push.meshlets + WORKGROUP - 1u) / WORKGROUP;
  uint begin = min(THREAD * share, push.meshlets);
  uint end = min(begin + share, push.meshlets);
  uint triangles = 0u;
  uint malformed = 0u;
  uint first = NO_MESHLET;
  for (uint m = begin; m < end; m++) {
    uint summary = SUMMARY(m);  // once: an atomic load waits for memory
    first_triangles[m] = triangles;
    if (summary >> 16 == ERROR_NONE) {
      triangles += summary & 127u;
    } else {
      malformed++;
      first = min(first, m);
    }
  }
  shared_triangles[THREAD] = triangles;
  shared_malformed[THREAD] = malformed;
  shared_first[THREAD] = first;
  barrier();
  uint place = 0u;
  for (uint i = 0u; i < THREAD; i++) place += shared_triangles[i];
  for (uint m = begin; m < end; m++) first_triangles[m] += place;
  if (THREAD != WORKGROUP - 1u) return;
  for (uint i = 0u; i < WORKGROUP - 1u; i++) {
    malformed += shared_malformed[i];
    first = min(first, shared_first[i]);
  }
  draw[0] = 3u * (place + triangles);
  draw[1] = 1u;  // instances
  draw[2] = 0u;  // first index
  draw[3] = 0u;  // base vertex
  draw[4] = 0u;  // first instance
  status[0] = malformed;
  status[1] = first;
}
