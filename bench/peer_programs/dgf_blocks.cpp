// dgf_blocks PACKER USER_DATA IN DECODED
//
// Encodes the positions and triangles of parts (parts.h) as blocks of AMD's DGF with its SDK's
// baker. PACKER: SAH or HPG24. USER_DATA: bytes of it in each block, 0 or 4. DECODED: the parts
// after decoding, vertices per block. Prints a JSON object.
#include <cmath>
#include <cstring>

#include "DGF.h"
#include "DGFBaker.h"
#include "parts.h"

namespace {

using Blocks = std::vector<uint8_t>;

// The SDK's "target bits" count a sign. With these its exponent is 0, a step of the grid.
size_t target_bits(const std::vector<float>& positions) {
  float low[3], high[3], edge = 1.0f;
  for (size_t i = 0; i < positions.size(); i++) {
    if (i < 3) low[i] = high[i] = positions[i];
    low[i % 3] = std::fmin(low[i % 3], positions[i]);
    high[i % 3] = std::fmax(high[i % 3], positions[i]);
    edge = std::fmax(edge, high[i % 3] - low[i % 3]);
  }
  return size_t(std::ceil(std::log2(edge + 1.0f))) + 1;
}

Blocks encode(const Part& part, const char* packer, bool user_data) {
  const std::vector<float> positions = part.positions();
  DGFBaker::Config config = {};
  config.targetBitWidth = target_bits(positions);
  config.packer = DGFBaker::PackerModeFromString(packer);
  config.enableUserData = user_data;
  const DGFBaker::BakerMesh mesh(positions.data(), part.triangles.data(), part.vertex_count(),
                                 part.triangle_count());
  return DGFBaker::Baker(config).BakeDGF(mesh).dgfBlocks;
}

// Room for one decoded block.
struct Output {
  DGF::MetaData meta;
  uint8_t triangles[DGF::MAX_INDICES];
  DGF::OffsetVert offsets[DGF::MAX_VERTS];
  DGF::FloatVert positions[DGF::MAX_VERTS];
};

void decode_block(const uint8_t* block, Output& output) {
  DGF::DecodeMetaData(&output.meta, block);
  DGF::DecodeTriangleList(output.triangles, block);
  DGF::DecodeOffsetVerts(output.meta.numVerts, output.offsets, block);
  DGF::ConvertOffsetsToFloat(output.meta.numVerts, output.positions, output.offsets, output.meta);
}

Part decode(const Blocks& blocks) {
  Part part{{0, 0, 0}, {}, {}};
  Output output;
  for (size_t at = 0; at < blocks.size(); at += DGF::BLOCK_SIZE) {
    const uint32_t first = uint32_t(part.vertex_count());
    decode_block(&blocks[at], output);
    for (size_t i = 0; i < 3 * size_t(output.meta.numTris); i++)
      part.triangles.push_back(first + output.triangles[i]);
    for (size_t v = 0; v < output.meta.numVerts; v++)
      for (float x : output.positions[v].xyz) part.values.push_back(uint32_t(std::lround(x)));
  }
  return part;
}

}  // namespace

int main(int argc, char** argv) {
  require(argc == 5, "reading the arguments");
  const std::vector<Part> parts = read_parts(argv[3]);
  Blocks blocks;
  std::vector<Part> decoded;
  for (const Part& part : parts) {
    const Blocks own = encode(part, argv[1], atoi(argv[2]) != 0);
    decoded.push_back(decode(own));
    blocks.insert(blocks.end(), own.begin(), own.end());
  }
  write_parts(argv[4], decoded);

  Output output;
  print_figures(blocks.size() / DGF::BLOCK_SIZE, blocks.size(), [&] {
    for (size_t at = 0; at < blocks.size(); at += DGF::BLOCK_SIZE)
      decode_block(&blocks[at], output);
  });
}
