// The part of the C interface that reads levels of detail.
#include "c/open_view.h"
#include "levels/cut.h"
#include "levels/tables.h"

namespace gltf_meshlet_codec {
namespace {

static_assert(sizeof(gltf_meshlet_draw) == sizeof(CutDraw), "they are the same");

struct OpenLevels : Object {
  static constexpr Kind kKind = Kind::kLevels;
  LevelTables tables;

  OpenLevels() : Object(kKind) {}
};

// A page of levels that is known, its number and the view of its blob.
Problem check_counts(const LevelTables& tables, uint32_t number, const View& view) {
  const LevelPage& page = tables.page(number);
  if (view.blobs.size() != 1) return {"page # is not one blob", number};
  const ViewBlob& blob = view.blobs[0];
  if (blob.size != page.bytes || blob.triangle_count != page.triangles ||
      blob.vertex_count != page.vertices || blob.meshlet_count != tables.page_clusters(number))
    return {"page # has other counts than the tables say", number};
  return {};
}

bool is_finite(double x) { return x - x == 0; }

// Mistakes with a prefix are the caller's: the file breaks no rule.
int fail_to_open(const Problem& problem) {
  for (const char* mistake : {kPrefixEnds, kPrefixRuns, kPrefixRoots})
    if (problem.text == mistake) return bad_argument(mistake);
  return fail(problem);
}

// Returns what is wrong, or null.
const char* problem_of(const gltf_meshlet_cut& cut, const LevelTables& tables) {
  if (!cut.active) return kNull;
  if (cut.reserved || cut.is_orthographic > 1) return kReserved;
  if (cut.draws && cut.draw_room < tables.most_draws()) return kRoom;
  for (double x : cut.eye)
    if (!is_finite(x)) return "the eye is not finite";
  if (!(cut.pixels_per_unit > 0) || !is_finite(cut.pixels_per_unit))
    return "the pixels per unit are not above 0";
  if (!(cut.threshold >= 0)) return "the threshold is below 0";
  if (!(cut.least_distance >= 0) || !is_finite(cut.least_distance))
    return "the least distance is below 0";
  for (int i = 0; cut.matrix && i < 16; i++)
    if (!is_finite(cut.matrix[i])) return "the matrix is not finite";
  return nullptr;
}

}  // namespace
}  // namespace gltf_meshlet_codec

using namespace gltf_meshlet_codec;

int gltf_meshlet_open_levels(const gltf_meshlet_tables* tables, gltf_meshlet_levels** levels) {
  return guarded([&] {
    if (!levels) return bad_argument(kNull);
    *levels = nullptr;
    gltf_meshlet_tables t;
    if (!take(tables, t)) return bad_argument(kWrongSize);
    if (!t.bytes || (!t.runs && t.run_bytes)) return bad_argument(kNull);
    std::unique_ptr<OpenLevels> opened(new OpenLevels);
    if (!opened) return fail({kNoMemory});
    const LevelCounts counts = {t.page_count, t.coarse_page_count, t.group_count, t.run_count,
                                t.root_page_count};
    const LevelBytes bytes = {static_cast<const uint8_t*>(t.bytes), t.byte_count,
                              static_cast<const uint8_t*>(t.runs), t.run_bytes};
    if (const Problem p = opened->tables.open(counts, bytes)) return fail_to_open(p);
    return give_object(std::move(opened), levels);
  });
}

int gltf_meshlet_get_level_counts(const gltf_meshlet_levels* levels,
                                  gltf_meshlet_level_counts* counts) {
  return with<const OpenLevels>(levels, [&](const OpenLevels& open) {
    const LevelTables& t = open.tables;
    return give({0, t.counts().pages, t.counts().coarse_pages, t.root_pages(), t.counts().groups,
                 t.known_groups(), t.most_draws()},
                counts);
  });
}

int gltf_meshlet_get_level_page(const gltf_meshlet_levels* levels, uint32_t page,
                                gltf_meshlet_level_page* out) {
  return with<const OpenLevels>(levels, [&](const OpenLevels& open) {
    const LevelTables& t = open.tables;
    if (page >= t.counts().pages) return no_such("there is no such page");
    const LevelPage& row = t.page(page);
    const bool is_known = t.knows_page(page);
    return give({0, row.bytes, t.page_begin(page), page >= t.counts().coarse_pages, is_known,
                 row.triangles, row.vertices, is_known ? t.page_clusters(page) : 0u,
                 row.first_group, t.page_end_group(page) - row.first_group},
                out);
  });
}

int gltf_meshlet_get_group(const gltf_meshlet_levels* levels, uint32_t group,
                           gltf_meshlet_group* out) {
  return with<const OpenLevels>(levels, [&](const OpenLevels& open) {
    if (group >= open.tables.known_groups()) return no_such("there is no such group, or not yet");
    const LevelGroup& g = open.tables.group(group);
    return give({0,
                 {g.centre[0], g.centre[1], g.centre[2]},
                 g.radius,
                 g.error,
                 g.page,
                 g.first_cluster,
                 g.clusters},
                out);
  });
}

int gltf_meshlet_check_page(const gltf_meshlet_levels* levels, uint32_t page,
                            const gltf_meshlet_view* view, const gltf_meshlet_view* other) {
  return with<const OpenLevels>(levels, [&](const OpenLevels& open) {
    const auto* const opened = object_of<const OpenView>(view);
    const auto* const sibling = object_of<const OpenView>(other);
    if (!opened || (other && !sibling)) return bad_argument(kWrongObject);
    if (page >= open.tables.counts().pages) return no_such("there is no such page");
    if (!open.tables.knows_page(page))
      return bad_argument("the groups of the page are not in the prefix");
    if (const Problem p = check_counts(open.tables, page, opened->view)) return fail(p);
    if (sibling && !same_streams(opened->view.streams, sibling->view.streams))
      return fail({"page # has other streams than the primitive", page});
    return kOk;
  });
}

int gltf_meshlet_make_cut(const gltf_meshlet_levels* levels, gltf_meshlet_cut* cut) {
  return with<const OpenLevels>(levels, [&](const OpenLevels& open) {
    gltf_meshlet_cut c;
    if (!take(cut, c)) return bad_argument(kWrongSize);
    if (const char* problem = problem_of(c, open.tables)) return bad_argument(problem);
    const double scale = c.matrix ? largest_scale(c.matrix) : 1;
    if (!is_finite(scale)) return bad_argument("the matrix is too large");
    const CutCamera camera = {c.is_orthographic != 0,
                              {c.eye[0], c.eye[1], c.eye[2]},
                              c.pixels_per_unit,
                              c.least_distance,
                              c.threshold,
                              c.matrix,
                              scale};
    const CutResult result =
        make_cut(open.tables, camera,
                 {c.resident, c.active, c.urgency, reinterpret_cast<CutDraw*>(c.draws)});
    cut->draw_count = result.draws;
    cut->error = result.error;
    cut->groups_needed = result.groups;
    return kOk;
  });
}

int gltf_meshlet_rank_pages(const float* urgency, const uint32_t* bytes, size_t count,
                            uint64_t budget, uint32_t* order, size_t* needed, size_t* affordable) {
  return guarded([&] {
    if (!needed || !affordable || (count && (!urgency || !bytes || !order)))
      return bad_argument(kNull);
    if (count > UINT32_MAX) return bad_argument("there are too many pages");
    *needed = rank_pages(urgency, count, order);
    size_t fits = 0;
    for (uint64_t sum = 0; fits < *needed; fits++) {
      sum += bytes[order[fits]];
      if (sum > budget) break;
    }
    *affordable = fits;
    return kOk;
  });
}
