// A meshlet ready to be written.
#pragma once
#include <cstdint>
#include <vector>

#include "encode/bit_writer.h"
#include "encode/boundaries.h"
#include "encode/edgebreaker.h"
#include "encode/residual_codes.h"

namespace gltf_meshlet_codec {

struct PlannedReference {
  Reference reference;
  bool loop_end;
  bool lone;  // alone in its loop

  bool foreign() const { return reference.kind == ReferenceKind::kForeign; }
  bool owned() const { return reference.kind == ReferenceKind::kOwned; }
  bool is_private() const { return reference.kind == ReferenceKind::kPrivate; }
  // Does it store its own values for stream s?
  bool own_for(uint32_t s) const { return !foreign() || !(reference.shared >> s & 1); }
  // Is its length stored?
  bool sized() const { return owned() || (is_private() && !lone); }
  // Are all its vertices another meshlet's?
  bool alias() const { return foreign() && reference.shared == ~0ull; }
};

// References in stream order.
struct PlannedReferences : Span<PlannedReference> {
  // The reference before the i-th in its loop.
  const PlannedReference& before(uint32_t i) const;
  bool all_private() const;
  // FLAG_ bits.
  uint32_t flags() const;
  // The number in the meshlet's header.
  uint32_t stored_count() const { return all_private() ? 0 : uint32_t(count); }
};

struct Plan {
  Symbols symbols;
  uint32_t vertex_count = 0;
  uint32_t first_reference = 0, reference_count = 0;  // in its chunk
  uint32_t first_residual = 0;                        // in its chunk
  uint32_t bytes = 0;                                 // once written
};

// A stream's lists of residuals in a meshlet. `anchors` begins with the first anchor's values.
enum ResidualList : uint32_t { kAnchors, kChains, kInteriors, kResidualLists };

// The lists of one stream in a meshlet.
struct StreamLists {
  Residuals of[kResidualLists];

  // The anchors but the first.
  Residuals further_anchors(uint32_t elements) const {
    const Residuals& all = of[kAnchors];
    return all.count ? Residuals{all.data + elements, all.count - elements} : all;
  }
};

// Consecutive meshlets, which one thread plans and writes: whole groups.
struct PlanChunk {
  std::vector<Plan> plans;
  std::vector<PlannedReference> references;
  // The lists of each meshlet, stream after stream.
  std::vector<uint32_t> residuals;
  std::vector<uint32_t> residual_counts;  // of each list
  BitWriter out;

  PlannedReferences references_of(const Plan& plan) const {
    return {references.data() + plan.first_reference, plan.reference_count};
  }
  // Sets `lists`, one for each stream, to those of the i-th meshlet.
  void lists_of(size_t i, std::vector<StreamLists>& lists) const;
};

constexpr uint32_t kChunkMeshlets = 4 * BLOB_GROUP_MESHLETS;

}  // namespace gltf_meshlet_codec
