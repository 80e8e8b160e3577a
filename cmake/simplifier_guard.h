// A guard for meshoptimizer's simplifier: it refuses collapses after which a triangle's corner fits
// no normal of the model. cmake/simplifier.cmake includes this file in simplifier.cpp, in namespace
// meshopt.
//
// The simplifier compares a triangle with that of its last pass, and allows 75 degrees. Turns add up
// over passes and levels of detail: triangles end up facing away from the normals at their corners.

// Unit normals of each place: those of place p are begin[p] .. begin[p + 1].
struct Guard {
  const unsigned int* places;  // of each vertex; null without a guard
  const unsigned int* begin;
  const float* normals;
  float least_cosine;
  const unsigned int* sparse_remap;  // of the simplifier: the caller's number of each vertex
};
static thread_local Guard guard;

// The cosine between a triangle's normal and the normal at a vertex that fits it best.
static float bestFit(unsigned int vertex, const Vector3& normal, float length) {
  const unsigned int place = guard.places[guard.sparse_remap ? guard.sparse_remap[vertex] : vertex];
  float best = -1.f;
  for (unsigned int i = guard.begin[place]; i < guard.begin[place + 1]; ++i) {
    const float* n = guard.normals + 3 * size_t(i);
    const float fit = (n[0] * normal.x + n[1] * normal.y + n[2] * normal.z) / length;
    best = fit > best ? fit : best;
  }
  return best;
}

// How well the corners of a triangle fit. Those without area have no shading: they fit.
struct Fits {
  float corners[3];
};
static Fits fitsOf(const Vector3* points, unsigned int a, unsigned int b, unsigned int c) {
  const Vector3 u = {points[b].x - points[a].x, points[b].y - points[a].y,
                     points[b].z - points[a].z};
  const Vector3 v = {points[c].x - points[a].x, points[c].y - points[a].y,
                     points[c].z - points[a].z};
  const Vector3 normal = {u.y * v.z - u.z * v.y, u.z * v.x - u.x * v.z, u.x * v.y - u.y * v.x};
  const float length = sqrtf(normal.x * normal.x + normal.y * normal.y + normal.z * normal.z);
  if (length == 0.f) return {{1.f, 1.f, 1.f}};
  return {{bestFit(a, normal, length), bestFit(b, normal, length), bestFit(c, normal, length)}};
}

// Whether triangle (a, b, before) may not become (a, b, after): a corner fits too little, and less
// than before.
static bool guardRefuses(const Vector3* points, unsigned int a, unsigned int b,
                         unsigned int before, unsigned int after) {
  if (!guard.places) return false;
  const Fits is = fitsOf(points, a, b, after);
  const float* fit = is.corners;
  if (fit[0] >= guard.least_cosine && fit[1] >= guard.least_cosine && fit[2] >= guard.least_cosine)
    return false;
  const Fits was = fitsOf(points, a, b, before);
  for (int k = 0; k < 3; ++k)
    if (fit[k] < guard.least_cosine && fit[k] < was.corners[k]) return true;
  return false;
}

SHOWN size_t meshopt_simplifyGuarded(
    unsigned int* destination, const unsigned int* indices, size_t index_count,
    const float* vertex_positions, size_t vertex_count, size_t vertex_positions_stride,
    const float* vertex_attributes, size_t vertex_attributes_stride,
    const float* attribute_weights, size_t attribute_count, const unsigned char* vertex_lock,
    size_t target_index_count, float target_error, unsigned int options, float* result_error,
    const unsigned int* vertex_places, const unsigned int* normal_begin, const float* normals,
    float least_cosine) {
  guard = {vertex_places, normal_begin, normals, least_cosine, nullptr};
  const size_t count = meshopt_simplifyWithAttributes(
      destination, indices, index_count, vertex_positions, vertex_count, vertex_positions_stride,
      vertex_attributes, vertex_attributes_stride, attribute_weights, attribute_count, vertex_lock,
      target_index_count, target_error, options, result_error);
  guard = {};
  return count;
}
