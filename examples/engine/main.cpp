// engine MODEL.glb PICTURE.ppm [OPTIONS]: moves a camera up to a model with levels of detail,
// streams its pages within a budget, decodes them on the GPU and writes the last frame.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <stdexcept>

#include "gpu.h"
#include "model.h"
#include "streamer.h"

namespace {

struct Options {
  std::string model, picture, cache;
  uint32_t width = 800, height = 600, frames = 16, loads = 4;
  uint64_t budget = 64 << 20;
  double threshold = 1;
  bool validate = false;
};

Options read_options(int argc, char** argv) {
  Options out;
  require(argc >= 3,
          "usage: engine MODEL.glb PICTURE.ppm [--width N] [--height N] [--frames N]\n"
          "  [--loads N] pages a frame [--budget BYTES] of compressed pages\n"
          "  [--error PIXELS] [--cache FILE] of compiled shaders [--validate]");
  out.model = argv[1];
  out.picture = argv[2];
  for (int i = 3; i < argc; i++) {
    const std::string name = argv[i];
    if (name == "--validate") {
      out.validate = true;
      continue;
    }
    require(i + 1 < argc, "an option has no value");
    const char* text = argv[++i];
    if (name == "--cache") {
      out.cache = text;
      continue;
    }
    char* end = nullptr;
    const double value = std::strtod(text, &end);
    require(end != text && !*end && value >= 0 && value < 1e18,
            "an option's value is no number from 0 on, or too large");
    if (name == "--width")
      out.width = uint32_t(std::min(std::max(value, 1.0), 16384.0));
    else if (name == "--height")
      out.height = uint32_t(std::min(std::max(value, 1.0), 16384.0));
    else if (name == "--frames")
      out.frames = uint32_t(std::min(std::max(value, 1.0), 1e6));
    else if (name == "--loads")
      out.loads = uint32_t(std::min(std::max(value, 1.0), 1e6));
    else if (name == "--budget")
      out.budget = uint64_t(value);
    else if (name == "--error")
      out.threshold = value;
    else
      throw std::runtime_error("there is no option " + name);
  }
  return out;
}

// A sphere in coordinates of the scene: rotations keep it, scales enlarge it.
Sphere placed(const Matrix& m, const Sphere& sphere) {
  Sphere out{};
  double scale = 0;
  for (int c = 0; c < 3; c++) {
    scale = std::max(scale, std::hypot(m[4 * c], m[4 * c + 1], m[4 * c + 2]));
    out.centre[c] = m[12 + c];
    for (int k = 0; k < 3; k++) out.centre[c] += m[4 * k + c] * sphere.centre[k];
  }
  out.radius = scale * sphere.radius;
  return out;
}

// The model's camera, or one that sees all of it. pulled_back: along its view, in units.
Camera camera_of(const Model& model, const Sphere& whole, double pulled_back) {
  Camera camera = model.camera;
  if (!model.has_camera) {
    camera = {{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1}, 0.8};
    for (int k = 0; k < 3; k++) camera.place[12 + k] = whole.centre[k];
    pulled_back += 1.1 * whole.radius / std::sin(camera.height_angle / 2);
  }
  for (int c = 0; c < 3; c++) {  // no scale
    double* axis = &camera.place[4 * c];
    const double length = std::hypot(axis[0], axis[1], axis[2]);
    require(length > 0, "the camera is flat");
    for (int k = 0; k < 3; k++) axis[k] /= length;
  }
  for (int k = 0; k < 3; k++) camera.place[12 + k] += pulled_back * camera.place[8 + k];
  return camera;
}

// From the scene to clip coordinates, with depths from 1 at `near` to 0 infinitely far away.
Matrix clip_of(const Camera& camera, double aspect, double near) {
  const Matrix& p = camera.place;
  Matrix view{};
  for (int r = 0; r < 3; r++)
    for (int k = 0; k < 3; k++) {
      view[4 * k + r] = p[4 * r + k];
      view[12 + r] -= p[4 * r + k] * p[12 + k];
    }
  view[15] = 1;
  const double f = 1 / std::tan(camera.height_angle / 2);
  const Matrix projection{f / aspect, 0, 0, 0, 0, -f, 0, 0, 0, 0, 0, -1, 0, 0, near, 0};
  return product(projection, view);
}

// The point of POSITION's coordinates that m leads to `point`: Cramer's rule.
void bring_back(const Matrix& m, const double* point, float* out) {
  const auto determinant = [](const double* a, const double* b, const double* c) {
    return a[0] * (b[1] * c[2] - b[2] * c[1]) - a[1] * (b[0] * c[2] - b[2] * c[0]) +
           a[2] * (b[0] * c[1] - b[1] * c[0]);
  };
  const double right[3] = {point[0] - m[12], point[1] - m[13], point[2] - m[14]};
  const double all = determinant(&m[0], &m[4], &m[8]);
  require(all != 0, "the model is flat");
  out[0] = float(determinant(right, &m[4], &m[8]) / all);
  out[1] = float(determinant(&m[0], right, &m[8]) / all);
  out[2] = float(determinant(&m[0], &m[4], right) / all);
  out[3] = 1;
}

Frame frame_of(const Model& model, const Camera& camera, double aspect, double near) {
  Frame frame{};
  const Matrix clip = product(clip_of(camera, aspect, near), model.place);
  for (int i = 0; i < 16; i++) frame.clip[i] = float(clip[size_t(i)]);
  bring_back(model.place, &camera.place[12], frame.eye);
  return frame;
}

void write_picture(const std::string& path, uint32_t width, uint32_t height, const uint8_t* rgba) {
  std::ofstream out(path, std::ios::binary);
  out << "P6\n" << width << " " << height << "\n255\n";
  for (size_t i = 0; i < size_t(width) * height; i++)
    out.write(reinterpret_cast<const char*>(rgba + 4 * i), 3);
  out.close();  // which writes the rest
  require(out.good(), "the picture cannot be written");
}

void run(const Options& options, uint32_t* messages) {
  const Model model = read_model(options.model);
  Streamer streamer(model, options.budget, options.threshold);
  Gpu gpu({options.width, options.height, streamer.slots(), streamer.page_bytes(),
           streamer.meshlets(), streamer.streams(), uint32_t(model.normals)},
          messages, options.cache);
  std::printf("%s, %u slots of %u bytes\n", gpu.name(), streamer.slots(), streamer.page_bytes());
  const Sphere whole = placed(model.place, streamer.whole());
  const double near = 1e-3 * whole.radius, aspect = double(options.width) / options.height;
  // Frames after the last move wait for pages, but not for ever.
  bool settled = false;
  for (uint32_t i = 0; i < options.frames || (!settled && i < options.frames + 1000); i++) {
    const double way = std::max(0.0, 1 - (i + 1.0) / options.frames);
    const Camera camera = camera_of(model, whole, 20 * way * whole.radius);
    const std::vector<Draw> draws = streamer.cut(camera, options.height, near);
    gpu.draw(frame_of(model, camera, aspect, near), draws);
    uint64_t meshlets = 0;
    for (const Draw& draw : draws) meshlets += draw.count;
    const std::vector<Load> loads = streamer.load(options.loads);
    gpu.load(loads);
    settled = loads.empty();
    std::printf("frame %u: %llu meshlets, error %.3g pixels, %zu pages to load\n", i,
                static_cast<unsigned long long>(meshlets), streamer.error(), loads.size());
  }
  require(gpu.malformed() == 0, "some meshlets are malformed");
  write_picture(options.picture, options.width, options.height, gpu.picture());
}

}  // namespace

int main(int argc, char** argv) {
  try {
    const Options options = read_options(argc, argv);
    uint32_t messages = 0;
    run(options, options.validate ? &messages : nullptr);
    require(messages == 0, "the validation layer has complaints");
    return 0;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "engine: %s\n", error.what());
    return 1;
  }
}
