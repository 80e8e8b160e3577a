// The part of the C interface that counts bits.
#include "c/statistics.h"

#include "c/open_view.h"

namespace gltf_meshlet_codec {

void copy_statistics(const BitStatistics& from, gltf_meshlet_statistics& to) {
  to.connectivity_bits = from.connectivity;
  to.reference_bits = from.references;
  std::copy(from.streams, from.streams + BLOB_MAX_STREAMS, to.stream_bits);
  std::copy(from.symbols, from.symbols + 5, to.symbols);
  to.disks = from.disks;
  to.owned_references = from.owned_references;
  to.private_references = from.private_references;
  to.foreign_references = from.foreign_references;
}

}  // namespace gltf_meshlet_codec

using namespace gltf_meshlet_codec;

int gltf_meshlet_get_statistics(const gltf_meshlet_view* view, gltf_meshlet_statistics* out) {
  return with<const OpenView>(view, [&](const OpenView& open) {
    BitStatistics bits, one;
    for (size_t b = 0; b < open.view.blobs.size(); b++) {
      if (const Problem p = count_bits(open.view.blobs[b].data, open.view.blobs[b].size, one))
        return fail(open.view.located(p, b));
      bits.add(one);
    }
    gltf_meshlet_statistics found{};
    copy_statistics(bits, found);
    return give(found, out);
  });
}
