// Vulkan 1.2: slots of compressed pages, decoded on the GPU, drawn into a picture without a window.
#pragma once
#include <vulkan/vulkan.h>

#include <string>
#include <vector>

#include "streamer.h"

struct Buffer {
  VkBuffer buffer = nullptr;
  VkDeviceMemory memory = nullptr;
  void* mapped = nullptr;  // null: only the GPU reaches it
};

struct Image {
  VkImage image = nullptr;
  VkDeviceMemory memory = nullptr;
  VkImageView view = nullptr;
};

struct Sizes {
  uint32_t width, height;                // of the picture
  uint32_t slots, page_bytes, meshlets;  // of a page, at most
  uint32_t streams, normals;             // as decode.comp takes them
};

// What draw.vert takes.
struct Frame {
  float clip[16], eye[4];
};

class Gpu {
 public:
  // messages: null, or the validation layer adds its messages, also while this object is closed.
  // cache: a file for compiled shaders, or "".
  Gpu(const Sizes& sizes, uint32_t* messages, std::string cache);
  ~Gpu();
  Gpu(const Gpu&) = delete;

  const char* name() const { return properties_.deviceName; }
  // Copies pages into their slots; the next frame decodes them.
  void load(const std::vector<Load>& loads);
  // Decodes what was loaded, draws, and waits.
  void draw(const Frame& frame, const std::vector<Draw>& draws);
  // Meshlets that did not decode, so far.
  uint32_t malformed() const { return *static_cast<const uint32_t*>(errors_.mapped); }
  // Four bytes for each pixel of the last frame.
  const uint8_t* picture() const { return static_cast<const uint8_t*>(readback_.mapped); }

 private:
  Gpu(const Sizes& sizes, std::string cache);
  void open_instance(uint32_t* messages);
  void open_device();
  uint32_t memory_type(uint32_t allowed, VkMemoryPropertyFlags wanted) const;
  void make_buffer(Buffer& out, VkDeviceSize bytes, VkBufferUsageFlags usage, bool mapped);
  void make_image(Image& out, VkFormat format, VkImageUsageFlags usage, VkImageAspectFlags aspect);
  void make_descriptors(const Buffer* buffers, uint32_t count);
  void make_render_pass();
  VkShaderModule shader(const uint32_t* code, size_t bytes) const;
  void make_compute_pipeline();
  void make_graphics_pipeline();
  void open_cache();
  void save_cache() const;
  void record_decoding();
  void record_drawing(const Frame& frame, const std::vector<Draw>& draws);

  const Sizes sizes_;
  const std::string cache_file_;
  VkInstance instance_ = nullptr;
  VkDebugUtilsMessengerEXT messenger_ = nullptr;
  VkPhysicalDevice physical_ = nullptr;
  VkPhysicalDeviceProperties properties_{};
  VkPhysicalDeviceMemoryProperties memories_{};
  VkDevice device_ = nullptr;
  uint32_t family_ = 0;
  VkQueue queue_ = nullptr;
  VkCommandPool pool_ = nullptr;
  VkCommandBuffer commands_ = nullptr;
  VkFence fence_ = nullptr;
  Buffer pages_, meshlets_, errors_, readback_;
  Image color_, depth_;
  VkDescriptorSetLayout set_layout_ = nullptr;
  VkDescriptorPool descriptors_ = nullptr;
  VkDescriptorSet set_ = nullptr;
  VkPipelineLayout layout_ = nullptr;
  VkPipelineCache cache_ = nullptr;
  VkRenderPass pass_ = nullptr;
  VkFramebuffer target_ = nullptr;
  VkPipeline decode_ = nullptr, draw_ = nullptr;
  std::vector<Load> loads_;  // that the next frame decodes
};
