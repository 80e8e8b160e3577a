// count FILE: prints the counts of a compressed view. C++11 without extensions.
#include <gltf_meshlet.h>

#include <fstream>
#include <iostream>
#include <iterator>
#include <memory>
#include <vector>

int main(int argc, char** argv) {
  if (argc != 2) return 2;
  std::ifstream file(argv[1], std::ios::binary);
  const std::vector<char> bytes((std::istreambuf_iterator<char>(file)),
                                std::istreambuf_iterator<char>());
  gltf_meshlet_view* opened = nullptr;
  if (gltf_meshlet_open(bytes.data(), bytes.size(), &opened) != GLTF_MESHLET_OK) {
    std::cerr << gltf_meshlet_error() << '\n';
    return 1;
  }
  const std::unique_ptr<gltf_meshlet_view, int (*)(void*)> view(opened, gltf_meshlet_close);
  gltf_meshlet_counts counts = gltf_meshlet_counts();
  counts.size = sizeof counts;
  gltf_meshlet_get_counts(view.get(), &counts);
  std::cout << counts.triangles << " triangles, " << counts.meshlets << " meshlets\n";
}
