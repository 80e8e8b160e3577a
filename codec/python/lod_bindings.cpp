#include "lod_bindings.h"

#include <nanobind/stl/string.h>
#include <nanobind/stl/tuple.h>
#include <nanobind/stl/vector.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <vector>

#include "arrays.h"
#include "common/curve.h"
#include "common/parallel.h"
#include "lod/group_meshlets.h"
#include "lod/replacement_errors.h"
#include "lod/surface_distance.h"
#include "segment/check_meshlets.h"

namespace meshlet {

using namespace nb::literals;

namespace {

constexpr size_t kPointsAtOnce = 1024;

std::vector<uint32_t> begins_of(const Numbers& begin, size_t end) {
  std::vector<uint32_t> out = vector_of(begin);
  if (!are_begins(out, end))
    throw nb::value_error("begins do not increase from 0 to the number of triangles");
  return out;
}

nb::tuple generate(const Indices& triangles, const Numbers& triangle_begin,
                   const Numbers& position_ids, const Points& positions, int max_triangles,
                   float lambda, const std::string& effort, int threads) {
  const size_t vertices = positions.shape(0);
  check_triangles(triangles, vertices, true);
  if (position_ids.shape(0) != vertices)
    throw nb::value_error("position_ids and positions differ in length");
  if (max_triangles < 1 || max_triangles > 64)
    throw nb::value_error("a meshlet holds 1 to 64 triangles");
  const std::vector<uint32_t> begin = begins_of(triangle_begin, triangles.shape(0));
  GenerationOptions options;
  options.max_triangles = max_triangles;
  if (lambda > 0) options.lambda = lambda;
  options.effort = effort_of(effort);
  options.threads = threads;
  const MeshView mesh{triangles.data(), triangles.shape(0), position_ids.data(), positions.data(),
                      vertices};
  GroupMeshlets made;
  {
    nb::gil_scoped_release release;
    made = generate_in_groups(mesh, begin, options);
  }
  return nb::make_tuple(array_of(std::move(made.triangles)), array_of(std::move(made.disk_begin)),
                        array_of(std::move(made.meshlet_begin)),
                        array_of(std::move(made.group_begin)));
}

GroupTriangles groups_of(const Indices& triangles, const Numbers& begin, size_t vertices) {
  check_triangles(triangles, vertices, false);
  return {triangles.data(), begins_of(begin, triangles.shape(0))};
}

// Measures with arrays that it keeps alive.
class Errors {
 public:
  Errors(std::vector<Points> shapes, const Indices& triangles, const Numbers& begin,
         float vertex_share, int threads)
      : shapes_(std::move(shapes)), threads_(threads) {
    if (shapes_.empty()) throw nb::value_error("there are no shapes");
    std::vector<const float*> positions;
    for (const Points& shape : shapes_) {
      if (shape.shape(0) != vertices()) throw nb::value_error("shapes differ in length");
      positions.push_back(shape.data());
    }
    const GroupTriangles level_0 = groups_of(triangles, begin, vertices());
    nb::gil_scoped_release release;
    errors_.emplace(std::move(positions), vertices(), level_0, vertex_share, threads_);
  }

  nb::tuple measure(const Indices& before, const Numbers& before_begin, const Indices& after,
                    const Numbers& after_begin, const Numbers& chosen, const Numbers& carried,
                    const Numbers& carried_begin, const Floats& areas) const {
    const GroupTriangles was = groups_of(before, before_begin, vertices());
    const GroupTriangles is = groups_of(after, after_begin, vertices());
    if (was.groups() != is.groups())
      throw nb::value_error("before and after differ in their number of groups");
    const std::vector<uint32_t> groups = vector_of(chosen);
    for (uint32_t group : groups)
      if (group >= was.groups()) throw nb::value_error("a group is out of range");
    CarriedVertices vertices_on{vector_of(carried),
                                {},
                                vector_of(carried_begin),
                                {areas.data(), areas.data() + areas.shape(0)}};
    check_carried(vertices_on, groups.size());
    std::vector<float> found;
    {
      nb::gil_scoped_release release;
      found = errors_->measure(was, is, groups, vertices_on, threads_);
    }
    return nb::make_tuple(array_of(std::move(found)), array_of(std::move(vertices_on.vertices)),
                          array_of(std::move(vertices_on.triangles)),
                          array_of(std::move(vertices_on.begin)),
                          array_of(std::move(vertices_on.areas)));
  }

 private:
  size_t vertices() const { return shapes_[0].shape(0); }

  void check_carried(const CarriedVertices& c, size_t groups) const {
    if (c.begin.size() != groups + 1 || c.begin.front() != 0 ||
        c.begin.back() != c.vertices.size() || !std::is_sorted(c.begin.begin(), c.begin.end()))
      throw nb::value_error("begins do not rise from 0 to the number of vertices");
    if (c.areas.size() != c.vertices.size()) throw nb::value_error("areas differ in length");
    for (uint32_t v : c.vertices)
      if (v >= vertices()) throw nb::value_error("a vertex is out of range");
  }

  std::vector<Points> shapes_;
  int threads_;
  std::optional<ReplacementErrors> errors_;
};

nb::object distances_to_surface(const Points& points, const Points& positions,
                                const Indices& triangles, int threads) {
  check_triangles(triangles, positions.shape(0), false);
  if (triangles.shape(0) == 0) throw nb::value_error("there are no triangles");
  std::vector<float> distances(points.shape(0));
  {
    nb::gil_scoped_release release;
    const TriangleTree tree(positions.data(), triangles.data(), {0, uint32_t(triangles.shape(0))},
                            threads);
    for_blocks(threads, distances.size(), kPointsAtOnce, [&](size_t, size_t first, size_t last) {
      uint32_t hint = 0;
      for (size_t i = first; i < last; i++) {
        const float* p = points.data() + 3 * i;
        distances[i] = std::sqrt(tree.squared_distance({p[0], p[1], p[2]}, hint));
      }
    });
  }
  return array_of(std::move(distances));
}

nb::object hilbert_order(const Points& points) {
  std::vector<Vec3> all;
  for (const float* p = points.data(); p < points.data() + points.size(); p += 3)
    all.push_back({p[0], p[1], p[2]});
  if (all.empty()) return array_of(std::vector<uint32_t>());
  const Box box = box_of(all);
  const float longest = box.longest_side(), scale = longest > 0 ? 1 / longest : 0;
  return array_of(order_along_curve(
      all.size(), 1, [&](size_t i) { return (all[i] - box.low) * scale * kCurveCells; }));
}

}  // namespace

void bind_lod(nb::module_& m) {
  m.def("generate_in_groups", &generate, "triangles"_a, "triangle_begin"_a, "position_ids"_a,
        "positions"_a, "max_triangles"_a = 64, "lambda_"_a = 0.0f, "effort"_a = "normal",
        "threads"_a = 0,
        nb::sig("def generate_in_groups(triangles: numpy.typing.NDArray[numpy.uint32], "
                "triangle_begin: numpy.typing.NDArray[numpy.uint32], "
                "position_ids: numpy.typing.NDArray[numpy.uint32], "
                "positions: numpy.typing.NDArray[numpy.float32], max_triangles: int = 64, "
                "lambda_: float = 0.0, effort: str = 'normal', threads: int = 0) -> "
                "tuple[numpy.typing.NDArray[numpy.uint32], numpy.typing.NDArray[numpy.uint32], "
                "numpy.typing.NDArray[numpy.uint32], numpy.typing.NDArray[numpy.uint32]]"),
        "Makes meshlets that never cross groups. Group g: triangles triangle_begin[g] ..\n"
        "triangle_begin[g + 1]. Other arguments as in encode; position_ids: any numbers, equal "
        "where\n"
        "positions are. Returns (uint32[T], numbers of the triangles\n"
        "in order, disk begins, meshlet begins, group begins), the begins as encode takes them.\n"
        "Raises ValueError.");
  nb::class_<Errors>(m, "ReplacementErrors",
                     "Level 0, to measure what replaces parts of it. Keeps its arrays.")
      .def(nb::init<std::vector<Points>, const Indices&, const Numbers&, float, int>(), "shapes"_a,
           "triangles"_a, "begin"_a, "vertex_share"_a, "threads"_a = 0,
           nb::sig("def __init__(self, shapes: list[numpy.typing.NDArray[numpy.float32]], "
                   "triangles: numpy.typing.NDArray[numpy.uint32], "
                   "begin: numpy.typing.NDArray[numpy.uint32], vertex_share: float, "
                   "threads: int = 0) -> None"),
           "shapes: float32[V, 3] each: positions at rest, and with each morph target. triangles,\n"
           "begin: level 0 in groups. vertex_share: the share of its area that its vertices stand "
           "for.\n"
           "Raises ValueError.")
      .def("measure", &Errors::measure, "before"_a, "before_begin"_a, "after"_a, "after_begin"_a,
           "chosen"_a, "carried"_a, "carried_begin"_a, "areas"_a,
           nb::sig("def measure(self, before: numpy.typing.NDArray[numpy.uint32], "
                   "before_begin: numpy.typing.NDArray[numpy.uint32], "
                   "after: numpy.typing.NDArray[numpy.uint32], "
                   "after_begin: numpy.typing.NDArray[numpy.uint32], "
                   "chosen: numpy.typing.NDArray[numpy.uint32], "
                   "carried: numpy.typing.NDArray[numpy.uint32], "
                   "carried_begin: numpy.typing.NDArray[numpy.uint32], "
                   "areas: numpy.typing.NDArray[numpy.float32]) -> "
                   "tuple[numpy.typing.NDArray[numpy.float32], "
                   "numpy.typing.NDArray[numpy.uint32], numpy.typing.NDArray[numpy.uint32], "
                   "numpy.typing.NDArray[numpy.uint32], numpy.typing.NDArray[numpy.float32]]"),
           "Measures chosen groups of triangles that others replace. before, after: uint32[T, 3]\n"
           "with begins, of whole levels. carried: vertices of level 0 that are gone, in the "
           "chosen\n"
           "groups; areas: float32, of level 0 that each one stands for. Returns (float32: the\n"
           "distance between each chosen replacement and level 0 that 99.9 % of either surface "
           "keeps,\n"
           "vertices to carry on, for each the triangle of its group's `after` that is nearest, "
           "their\n"
           "begins, their areas). Raises ValueError.");
  m.def("surface_distances", &distances_to_surface, "points"_a, "positions"_a, "triangles"_a,
        "threads"_a = 0,
        nb::sig("def surface_distances(points: numpy.typing.NDArray[numpy.float32], "
                "positions: numpy.typing.NDArray[numpy.float32], "
                "triangles: numpy.typing.NDArray[numpy.uint32], threads: int = 0) -> "
                "numpy.typing.NDArray[numpy.float32]"),
        "Returns float32[N]: the distance of each point (float32[N, 3]) to the nearest triangle.\n"
        "Raises ValueError.");
  m.def("hilbert_order", &hilbert_order, "points"_a,
        nb::sig("def hilbert_order(points: numpy.typing.NDArray[numpy.float32]) -> "
                "numpy.typing.NDArray[numpy.uint32]"),
        "Returns uint32[N]: the numbers of points (finite float32[N, 3]) along a Hilbert curve.");
}

}  // namespace meshlet
