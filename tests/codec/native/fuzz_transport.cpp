// fuzz_transport FOLDER [MUTATIONS [SEED]]
// Unpacks MUTATIONS random mutations of the packed views (.bin files) of a folder, and validates
// what comes out. Build with ASan and UBSan (MESHLET_FUZZ). Any input must be unpacked or refused.
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <random>
#include <vector>

#include "gltf_meshlet.h"

namespace {

using Bytes = std::vector<uint8_t>;

constexpr uint32_t kMostPages = 8;  // whose table is kept

std::vector<Bytes> read_corpus(const char* folder) {
  std::vector<Bytes> corpus;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    if (entry.path().extension() != ".bin") continue;
    std::ifstream file(entry.path(), std::ios::binary);
    corpus.emplace_back(std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>());
    if (corpus.back().empty()) corpus.pop_back();
  }
  return corpus;
}

// Changes one to four places. Seven of eight mutations leave the page table alone.
void mutate(Bytes& view, std::mt19937& random) {
  const auto below = [&](size_t n) { return n ? random() % n : 0; };
  const size_t table = below(8) && view[1] <= kMostPages ? 4u + 8u * view[1] : 0;
  if (table >= view.size()) return;
  for (size_t changes = 1 + below(4); changes-- > 0;) {
    const size_t at = table + below(view.size() - table);
    switch (below(4)) {
      case 0: view[at] ^= uint8_t(1u << below(8)); break;
      case 1: view[at] = uint8_t(random()); break;
      case 2: view[at] = below(2) ? 0xFF : 0; break;
      default:
        for (size_t i = at; i < view.size() && i < at + 16; i++) view[i] = uint8_t(random());
    }
  }
}

bool expect(int status) {
  if (status == GLTF_MESHLET_OK) return true;
  if (status == GLTF_MESHLET_MALFORMED) return false;
  std::fprintf(stderr, "fuzz_transport: %s\n", gltf_meshlet_error());
  std::abort();
}

// Returns 0, 1 if the view was unpacked, 2 if the result is a valid view.
int run(const Bytes& packed) {
  size_t size = 0;
  if (!expect(gltf_meshlet_get_unpacked_bytes(packed.data(), packed.size(), &size))) return 0;
  Bytes resident(size);
  if (!expect(gltf_meshlet_unpack(packed.data(), packed.size(), 1, resident.data(), size)))
    return 0;
  gltf_meshlet_view* view = nullptr;
  if (!expect(gltf_meshlet_open(resident.data(), size, &view))) return 1;
  const bool valid = expect(gltf_meshlet_validate(view, 1));
  gltf_meshlet_close(view);
  return valid ? 2 : 1;
}

}  // namespace

int main(int argc, char** argv) {
  const std::vector<Bytes> corpus = argc > 1 ? read_corpus(argv[1]) : std::vector<Bytes>{};
  if (corpus.empty()) {
    std::fprintf(stderr, "usage: fuzz_transport FOLDER_WITH_BIN_FILES [MUTATIONS [SEED]]\n");
    return 2;
  }
  const long mutations = argc > 2 ? std::atol(argv[2]) : 100000;
  std::mt19937 random(argc > 3 ? uint32_t(std::atol(argv[3])) : 1u);
  long results[3] = {};
  for (long i = 0; i < mutations; i++) {
    Bytes view = corpus[random() % corpus.size()];
    mutate(view, random);
    results[run(view)]++;
  }
  std::printf("mutations: %ld refused, %ld unpacked, %ld of them valid\n", results[0],
              results[1] + results[2], results[2]);
  return 0;
}
