#include "encode/plan.h"

#include <algorithm>

namespace gltf_meshlet_codec {

const PlannedReference& PlannedReferences::before(uint32_t i) const {
  if (i == 0 || data[i - 1].loop_end)
    while (!data[i].loop_end) i++;
  else
    i--;
  return data[i];
}

bool PlannedReferences::all_private() const {
  return std::all_of(begin(), end(),
                     [](const PlannedReference& r) { return r.lone && r.is_private(); });
}

uint32_t PlannedReferences::flags() const {
  if (all_private()) return 0;
  uint32_t loops = 0, flags = 0;
  for (const PlannedReference& r : *this) {
    loops += r.loop_end;
    if (r.is_private()) flags |= FLAG_PRIVATE;
    if (r.foreign() && !r.alias()) flags |= FLAG_SEAMS;
  }
  return flags | (loops > 1 ? FLAG_LOOPS : 0);
}

void PlanChunk::lists_of(size_t i, std::vector<StreamLists>& lists) const {
  const uint32_t* from = residuals.data() + plans[i].first_residual;
  const uint32_t* counts = &residual_counts[i * lists.size() * kResidualLists];
  for (StreamLists& stream : lists)
    for (Residuals& list : stream.of) {
      list = {from, *counts++};
      from += list.count;
    }
}

}  // namespace gltf_meshlet_codec
