// After a decoder, one workgroup: the place of each meshlet's triangles in the index buffer, the
// arguments of the draw, and how many meshlets are malformed.
#version 460
#extension GL_GOOGLE_include_directive : require

#define GROUP 256u
layout(local_size_x = GROUP) in;
#define THREAD gl_LocalInvocationIndex

shared uint group_triangles[GROUP];
shared uint group_malformed[GROUP];
shared uint group_first[GROUP];  // malformed meshlet

void main() {
  uint share = (push.meshlets + GROUP - 1u) / GROUP;
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
  group_triangles[THREAD] = triangles;
  group_malformed[THREAD] = malformed;
  group_first[THREAD] = first;
  barrier();
  uint place = 0u;
  for (uint i = 0u; i < THREAD; i++) place += group_triangles[i];
  for (uint m = begin; m < end; m++) first_triangles[m] += place;
  if (THREAD != GROUP - 1u) return;
  for (uint i = 0u; i < GROUP - 1u; i++) {
    malformed += group_malformed[i];
    first = min(first, group_first[i]);
  }
  draw[0] = 3u * (place + triangles);
  draw[1] = 1u;  // instances
  draw[2] = 0u;  // first index
  draw[3] = 0u;  // base vertex
  draw[4] = 0u;  // first instance
  status[0] = malformed;
  status[1] = first;
}
