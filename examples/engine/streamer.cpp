#include "streamer.h"

#include <algorithm>
#include <cmath>

Streamer::Streamer(const Model& model, uint64_t budget, double threshold) : model_(model) {
  gltf_meshlet_levels* levels = nullptr;
  check(gltf_meshlet_open_levels(&model.counts, &levels));
  levels_.reset(levels);
  gltf_meshlet_level_counts counts{};
  counts.size = sizeof counts;
  check(gltf_meshlet_get_level_counts(levels, &counts));
  root_pages_ = counts.root_pages;
  rows_.resize(counts.pages);
  for (uint32_t p = 0; p < counts.pages; p++) {
    rows_[p].size = sizeof rows_[p];
    check(gltf_meshlet_get_level_page(levels, p, &rows_[p]));
    const Bytes view = model.views[rows_[p].is_fine];
    require(rows_[p].offset <= view.size && rows_[p].bytes <= view.size - rows_[p].offset,
            "a page lies outside of its buffer view");
    page_bytes_ = std::max(page_bytes_, rows_[p].bytes);
    meshlets_ = std::max(meshlets_, rows_[p].meshlets);
  }
  // Nothing is drawn without the root pages: they are loaded by any budget.
  const uint64_t wanted = std::max<uint64_t>(budget / page_bytes_, root_pages_);
  page_of_.assign(size_t(std::min<uint64_t>(wanted, counts.pages)), -1);
  slot_of_.assign(counts.pages, -1);
  resident_.resize(counts.pages);
  urgency_.resize(counts.pages);
  order_.resize(counts.pages);
  costs_.assign(counts.pages, page_bytes_);
  active_.resize(counts.known_groups);
  draws_.resize(size_t(counts.most_draws));
  cut_.size = sizeof cut_;
  cut_.threshold = threshold;
  cut_.matrix = model.place.data();
  cut_.resident = resident_.data();
  cut_.active = active_.data();
  cut_.urgency = urgency_.data();
  cut_.draws = draws_.data();
  cut_.draw_room = draws_.size();
  open_page(0);
}

// Checks what the GPU trusts: the page's header and tables, and that they go with the levels'.
void Streamer::open_page(uint32_t page) {
  const gltf_meshlet_level_page& row = rows_[page];
  gltf_meshlet_view* opened = nullptr;
  check(gltf_meshlet_open(model_.views[row.is_fine].data + row.offset, row.bytes, &opened));
  std::unique_ptr<gltf_meshlet_view, Close> view(opened);
  check(gltf_meshlet_check_page(levels_.get(), page, opened, first_.get()));
  if (first_) return;
  // The streams up to that of normals are decoded. The shader has room for 8, and 20 elements.
  streams_ = 1 + uint32_t(std::max(model_.normals, 0));
  gltf_meshlet_counts counts{};
  counts.size = sizeof counts;
  check(gltf_meshlet_get_counts(opened, &counts));
  require(counts.streams <= 8 && streams_ <= counts.streams, "the page has too many streams");
  gltf_meshlet_stream stream{};
  uint32_t elements = 0;
  for (uint32_t s = 0; s < streams_; s++) {
    check(gltf_meshlet_get_stream(opened, 0, s, &stream));
    elements += stream.elements;
    require(s > 0 || (stream.kind == GLTF_MESHLET_GRID && stream.elements == 3),
            "positions are not on a grid");
  }
  require(elements <= 20, "the streams have too many elements");
  require(model_.normals < 0 || stream.kind == GLTF_MESHLET_OCT, "normals are not octahedral");
  first_ = std::move(view);
}

Sphere Streamer::whole() const {
  double low[3], high[3];
  for (int k = 0; k < 3; k++) low[k] = HUGE_VAL, high[k] = -HUGE_VAL;
  for (uint32_t p = 0; p < root_pages_; p++) {
    for (uint32_t g = 0; g < rows_[p].groups; g++) {
      gltf_meshlet_group group{};
      group.size = sizeof group;
      check(gltf_meshlet_get_group(levels_.get(), rows_[p].first_group + g, &group));
      for (int k = 0; k < 3; k++) {
        low[k] = std::min(low[k], double(group.centre[k]) - group.radius);
        high[k] = std::max(high[k], double(group.centre[k]) + group.radius);
      }
    }
  }
  Sphere out{};
  double square = 0;
  for (int k = 0; k < 3; k++) {
    out.centre[k] = (low[k] + high[k]) / 2;
    square += (high[k] - low[k]) * (high[k] - low[k]) / 4;
  }
  out.radius = std::sqrt(square);
  return out;
}

std::vector<Draw> Streamer::cut(const Camera& camera, uint32_t height, double near) {
  std::fill(urgency_.begin(), urgency_.end(), 0.0f);
  for (int k = 0; k < 3; k++) cut_.eye[k] = camera.place[12 + k];
  cut_.pixels_per_unit = height / (2 * std::tan(camera.height_angle / 2));
  cut_.least_distance = near;
  check(gltf_meshlet_make_cut(levels_.get(), &cut_));
  std::vector<Draw> draws;
  for (uint64_t i = 0; i < cut_.draw_count; i++) {
    const gltf_meshlet_draw& draw = draws_[i];
    draws.push_back({uint32_t(slot_of_[draw.page]), draw.first_meshlet, draw.meshlets});
  }
  return draws;
}

std::vector<Load> Streamer::load(size_t most) {
  size_t needed = 0, affordable = 0;
  check(gltf_meshlet_rank_pages(urgency_.data(), costs_.data(), costs_.size(),
                                uint64_t(slots()) * page_bytes_, order_.data(), &needed,
                                &affordable));
  const auto wanted = order_.begin() + ptrdiff_t(affordable);
  std::vector<Load> loads;
  uint32_t slot = 0;
  for (auto page = order_.begin(); page != wanted && loads.size() < most; page++) {
    if (resident_[*page]) continue;
    const auto is_wanted = [&](int64_t p) {
      return std::find(order_.begin(), wanted, uint32_t(p)) != wanted;
    };
    while (page_of_[slot] >= 0 && is_wanted(page_of_[slot])) slot++;  // one is free, by the budget
    open_page(*page);
    if (page_of_[slot] >= 0) {
      resident_[size_t(page_of_[slot])] = 0;
      slot_of_[size_t(page_of_[slot])] = -1;
    }
    page_of_[slot] = *page;
    slot_of_[*page] = slot;
    resident_[*page] = 1;
    const gltf_meshlet_level_page& row = rows_[*page];
    loads.push_back({slot, row.meshlets, {model_.views[row.is_fine].data + row.offset, row.bytes}});
  }
  return loads;
}
