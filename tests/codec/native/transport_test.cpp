// transport_test [FOLDER]: packs the .resident files of a folder, unpacks what comes out, and
// compares with the packed .bin files beside them. Default: the conformance vectors.
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <vector>

#include "transport/transport.h"

namespace {

using Bytes = std::vector<uint8_t>;

Bytes read(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  return Bytes(std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>());
}

Bytes unpacked(const Bytes& packed) {
  gltf_meshlet_codec::List<gltf_meshlet_codec::PackedPage> pages;
  if (gltf_meshlet_codec::read_page_table(packed.data(), packed.size(), pages)) return {};
  Bytes view(pages.back().begin + pages.back().bytes);
  const auto unpacker = gltf_meshlet_codec::make_page_unpacker();
  for (const gltf_meshlet_codec::PackedPage& page : pages)
    if (unpacker->unpack(packed.data(), page, view.data() + page.begin)) return {};
  return view;
}

}  // namespace

int main(int argc, char** argv) {
  int files = 0, failures = 0;
  const char* folder = argc > 1 ? argv[1] : "spec/transport_vectors";
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    std::filesystem::path path = entry.path();
    if (path.extension() != ".resident") continue;
    const Bytes resident = read(path), expected = read(path.replace_extension(".bin"));
    Bytes packed;
    const bool same = !gltf_meshlet_codec::pack_view(resident.data(), resident.size(), 1, packed) &&
                      packed == expected && unpacked(expected) == resident;
    if (!same) std::fprintf(stderr, "FAILED: %s\n", path.c_str());
    failures += !same;
    files++;
  }
  if (!files) std::fprintf(stderr, "FAILED: no .resident files in %s\n", folder);
  return failures || !files;
}
