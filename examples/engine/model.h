// What the program takes from a .glb: the levels of its first primitive that has some, and a
// camera.
#pragma once
#include <gltf_meshlet.h>

#include <array>
#include <cstdint>
#include <string>
#include <vector>

using Matrix = std::array<double, 16>;  // column by column

Matrix product(const Matrix& a, const Matrix& b);

struct Bytes {
  const uint8_t* data = nullptr;
  size_t size = 0;
};

struct Camera {
  Matrix place;  // columns: right, up, back, eye
  double height_angle;
};

struct Model {
  std::vector<uint8_t> file;
  Bytes tables, views[2];        // views: the coarse pages, and those of level 0
  gltf_meshlet_tables counts{};  // of the tables
  int normals = -1;              // the stream of NORMAL
  Matrix place{};                // from POSITION to the scene
  bool has_camera = false;
  Camera camera{};
};

// Throws std::runtime_error with one sentence.
Model read_model(const std::string& path);

// Throws the library's sentence unless the status is GLTF_MESHLET_OK.
void check(int status);
void require(bool ok, const char* problem);
