#include "gpu.h"

#include <cstdio>
#include <cstring>
#include <fstream>
#include <iterator>
#include <stdexcept>

#include "layout.h"
// Made from shaders/ by CMakeLists.txt.
#include "decode_comp.h"
#include "draw_frag.h"
#include "draw_vert.h"

namespace {

constexpr VkFormat kColor = VK_FORMAT_R8G8B8A8_UNORM, kDepth = VK_FORMAT_D32_SFLOAT;
constexpr uint32_t kPushed = 96;  // bytes of push constants, of either shader

struct Job {  // what decode.comp takes
  uint32_t page_begin, page_words, first, count, streams, normals;
};

void check_vk(VkResult result, const char* what) {
  if (result != VK_SUCCESS)
    throw std::runtime_error(std::string(what) + ": Vulkan's error " + std::to_string(result));
}

VKAPI_ATTR VkBool32 VKAPI_CALL show(VkDebugUtilsMessageSeverityFlagBitsEXT,
                                    VkDebugUtilsMessageTypeFlagsEXT,
                                    const VkDebugUtilsMessengerCallbackDataEXT* data, void* user) {
  std::fprintf(stderr, "%s\n", data->pMessage);
  ++*static_cast<uint32_t*>(user);
  return VK_FALSE;
}

}  // namespace

Gpu::Gpu(const Sizes& sizes, std::string cache) : sizes_(sizes), cache_file_(std::move(cache)) {}

// Where this throws, the destructor runs: the object is whole after the other constructor.
Gpu::Gpu(const Sizes& sizes, uint32_t* messages, std::string cache) : Gpu(sizes, std::move(cache)) {
  open_instance(messages);
  open_device();
  const VkDeviceSize meshlets = VkDeviceSize(4) * MESHLET_WORDS * sizes.meshlets * sizes.slots,
                     pages = VkDeviceSize(sizes.page_bytes) * sizes.slots;
  require(meshlets <= properties_.limits.maxStorageBufferRange &&
              pages <= properties_.limits.maxStorageBufferRange,
          "the budget is more than this device binds as one buffer: choose a smaller one");
  const VkBufferUsageFlags storage = VK_BUFFER_USAGE_STORAGE_BUFFER_BIT;
  // An engine copies pages through a staging buffer to memory of the device.
  make_buffer(pages_, pages, storage, true);
  make_buffer(meshlets_, meshlets, storage, false);
  make_buffer(errors_, 4, storage, true);
  std::memset(errors_.mapped, 0, 4);
  make_buffer(readback_, VkDeviceSize(4) * sizes.width * sizes.height,
              VK_BUFFER_USAGE_TRANSFER_DST_BIT, true);
  make_image(color_, kColor, VK_IMAGE_USAGE_COLOR_ATTACHMENT_BIT | VK_IMAGE_USAGE_TRANSFER_SRC_BIT,
             VK_IMAGE_ASPECT_COLOR_BIT);
  make_image(depth_, kDepth, VK_IMAGE_USAGE_DEPTH_STENCIL_ATTACHMENT_BIT,
             VK_IMAGE_ASPECT_DEPTH_BIT);
  const Buffer buffers[] = {pages_, meshlets_, errors_};
  make_descriptors(buffers, 3);
  make_render_pass();
  open_cache();
  make_compute_pipeline();
  make_graphics_pipeline();
  save_cache();
}

void Gpu::open_instance(uint32_t* messages) {
  VkApplicationInfo application{VK_STRUCTURE_TYPE_APPLICATION_INFO};
  application.apiVersion = VK_API_VERSION_1_2;
  VkDebugUtilsMessengerCreateInfoEXT messenger{
      VK_STRUCTURE_TYPE_DEBUG_UTILS_MESSENGER_CREATE_INFO_EXT};
  messenger.messageSeverity = VK_DEBUG_UTILS_MESSAGE_SEVERITY_WARNING_BIT_EXT |
                              VK_DEBUG_UTILS_MESSAGE_SEVERITY_ERROR_BIT_EXT;
  messenger.messageType = VK_DEBUG_UTILS_MESSAGE_TYPE_VALIDATION_BIT_EXT;
  messenger.pfnUserCallback = show;
  messenger.pUserData = messages;
  const VkValidationFeatureEnableEXT checks[] = {
      VK_VALIDATION_FEATURE_ENABLE_SYNCHRONIZATION_VALIDATION_EXT};
  VkValidationFeaturesEXT features{VK_STRUCTURE_TYPE_VALIDATION_FEATURES_EXT, &messenger, 1,
                                   checks};
  const char* layers[] = {"VK_LAYER_KHRONOS_validation"};
  const char* extensions[] = {VK_EXT_DEBUG_UTILS_EXTENSION_NAME};
  VkInstanceCreateInfo info{VK_STRUCTURE_TYPE_INSTANCE_CREATE_INFO};
  info.pApplicationInfo = &application;
  if (messages) {
    info.pNext = &features;
    info.enabledLayerCount = info.enabledExtensionCount = 1;
    info.ppEnabledLayerNames = layers;
    info.ppEnabledExtensionNames = extensions;
  }
  const VkResult opened = vkCreateInstance(&info, nullptr, &instance_);
  require(opened != VK_ERROR_LAYER_NOT_PRESENT, "the validation layer is not installed");
  check_vk(opened, "Vulkan cannot be opened");
  if (!messages) return;
  const auto create = reinterpret_cast<PFN_vkCreateDebugUtilsMessengerEXT>(
      vkGetInstanceProcAddr(instance_, "vkCreateDebugUtilsMessengerEXT"));
  check_vk(create(instance_, &messenger, nullptr, &messenger_), "no messages of the layer");
}

// The first device of Vulkan 1.2 with a queue for everything.
void Gpu::open_device() {
  uint32_t count = 16;
  VkPhysicalDevice devices[16];
  const VkResult listed = vkEnumeratePhysicalDevices(instance_, &count, devices);
  if (listed != VK_INCOMPLETE) check_vk(listed, "devices cannot be listed");
  for (uint32_t d = 0; d < count && !physical_; d++) {
    vkGetPhysicalDeviceProperties(devices[d], &properties_);
    if (properties_.apiVersion < VK_API_VERSION_1_2) continue;
    uint32_t families = 16;
    VkQueueFamilyProperties family[16];
    vkGetPhysicalDeviceQueueFamilyProperties(devices[d], &families, family);
    const VkQueueFlags all = VK_QUEUE_GRAPHICS_BIT | VK_QUEUE_COMPUTE_BIT;
    for (family_ = 0; family_ < families && (family[family_].queueFlags & all) != all;) family_++;
    if (family_ < families) physical_ = devices[d];
  }
  require(physical_, "no device has Vulkan 1.2");
  vkGetPhysicalDeviceMemoryProperties(physical_, &memories_);
  const float priority = 1;
  VkDeviceQueueCreateInfo queue{VK_STRUCTURE_TYPE_DEVICE_QUEUE_CREATE_INFO};
  queue.queueFamilyIndex = family_;
  queue.queueCount = 1;
  queue.pQueuePriorities = &priority;
  VkDeviceCreateInfo info{VK_STRUCTURE_TYPE_DEVICE_CREATE_INFO};
  info.queueCreateInfoCount = 1;
  info.pQueueCreateInfos = &queue;
  check_vk(vkCreateDevice(physical_, &info, nullptr, &device_), "the device cannot be opened");
  vkGetDeviceQueue(device_, family_, 0, &queue_);
  VkCommandPoolCreateInfo pool{VK_STRUCTURE_TYPE_COMMAND_POOL_CREATE_INFO};
  pool.queueFamilyIndex = family_;
  check_vk(vkCreateCommandPool(device_, &pool, nullptr, &pool_), "no memory for commands");
  VkCommandBufferAllocateInfo commands{VK_STRUCTURE_TYPE_COMMAND_BUFFER_ALLOCATE_INFO};
  commands.commandPool = pool_;
  commands.commandBufferCount = 1;
  check_vk(vkAllocateCommandBuffers(device_, &commands, &commands_), "no memory for commands");
  const VkFenceCreateInfo fence{VK_STRUCTURE_TYPE_FENCE_CREATE_INFO};
  check_vk(vkCreateFence(device_, &fence, nullptr, &fence_), "no fence");
}

uint32_t Gpu::memory_type(uint32_t allowed, VkMemoryPropertyFlags wanted) const {
  for (uint32_t i = 0; i < memories_.memoryTypeCount; i++)
    if ((allowed >> i & 1) && (memories_.memoryTypes[i].propertyFlags & wanted) == wanted) return i;
  throw std::runtime_error("the device lacks a kind of memory");
}

void Gpu::make_buffer(Buffer& out, VkDeviceSize bytes, VkBufferUsageFlags usage, bool mapped) {
  VkBufferCreateInfo info{VK_STRUCTURE_TYPE_BUFFER_CREATE_INFO};
  info.size = bytes;
  info.usage = usage;
  check_vk(vkCreateBuffer(device_, &info, nullptr, &out.buffer), "a buffer cannot be made");
  VkMemoryRequirements needs;
  vkGetBufferMemoryRequirements(device_, out.buffer, &needs);
  VkMemoryAllocateInfo memory{VK_STRUCTURE_TYPE_MEMORY_ALLOCATE_INFO};
  memory.allocationSize = needs.size;
  memory.memoryTypeIndex =
      memory_type(needs.memoryTypeBits, mapped ? VK_MEMORY_PROPERTY_HOST_VISIBLE_BIT |
                                                     VK_MEMORY_PROPERTY_HOST_COHERENT_BIT
                                               : VK_MEMORY_PROPERTY_DEVICE_LOCAL_BIT);
  check_vk(vkAllocateMemory(device_, &memory, nullptr, &out.memory), "no memory for a buffer");
  check_vk(vkBindBufferMemory(device_, out.buffer, out.memory, 0), "no memory for a buffer");
  if (mapped)
    check_vk(vkMapMemory(device_, out.memory, 0, bytes, 0, &out.mapped), "memory is out of reach");
}

void Gpu::make_image(Image& out, VkFormat format, VkImageUsageFlags usage,
                     VkImageAspectFlags aspect) {
  VkImageCreateInfo info{VK_STRUCTURE_TYPE_IMAGE_CREATE_INFO};
  info.imageType = VK_IMAGE_TYPE_2D;
  info.format = format;
  info.extent = {sizes_.width, sizes_.height, 1};
  info.mipLevels = info.arrayLayers = 1;
  info.samples = VK_SAMPLE_COUNT_1_BIT;
  info.usage = usage;
  check_vk(vkCreateImage(device_, &info, nullptr, &out.image), "an image cannot be made");
  VkMemoryRequirements needs;
  vkGetImageMemoryRequirements(device_, out.image, &needs);
  VkMemoryAllocateInfo memory{VK_STRUCTURE_TYPE_MEMORY_ALLOCATE_INFO};
  memory.allocationSize = needs.size;
  memory.memoryTypeIndex = memory_type(needs.memoryTypeBits, VK_MEMORY_PROPERTY_DEVICE_LOCAL_BIT);
  check_vk(vkAllocateMemory(device_, &memory, nullptr, &out.memory), "no memory for an image");
  check_vk(vkBindImageMemory(device_, out.image, out.memory, 0), "no memory for an image");
  VkImageViewCreateInfo view{VK_STRUCTURE_TYPE_IMAGE_VIEW_CREATE_INFO};
  view.image = out.image;
  view.viewType = VK_IMAGE_VIEW_TYPE_2D;
  view.format = format;
  view.subresourceRange = {aspect, 0, 1, 0, 1};
  check_vk(vkCreateImageView(device_, &view, nullptr, &out.view), "an image cannot be viewed");
}

// One set for both pipelines: buffer i is binding i.
void Gpu::make_descriptors(const Buffer* buffers, uint32_t count) {
  std::vector<VkDescriptorSetLayoutBinding> bindings;
  for (uint32_t i = 0; i < count; i++)
    bindings.push_back({i, VK_DESCRIPTOR_TYPE_STORAGE_BUFFER, 1,
                        VK_SHADER_STAGE_COMPUTE_BIT | VK_SHADER_STAGE_VERTEX_BIT, nullptr});
  VkDescriptorSetLayoutCreateInfo set{VK_STRUCTURE_TYPE_DESCRIPTOR_SET_LAYOUT_CREATE_INFO};
  set.bindingCount = count;
  set.pBindings = bindings.data();
  check_vk(vkCreateDescriptorSetLayout(device_, &set, nullptr, &set_layout_), "no descriptors");
  const VkPushConstantRange pushed = {VK_SHADER_STAGE_COMPUTE_BIT | VK_SHADER_STAGE_VERTEX_BIT, 0,
                                      kPushed};
  VkPipelineLayoutCreateInfo layout{VK_STRUCTURE_TYPE_PIPELINE_LAYOUT_CREATE_INFO};
  layout.setLayoutCount = layout.pushConstantRangeCount = 1;
  layout.pSetLayouts = &set_layout_;
  layout.pPushConstantRanges = &pushed;
  check_vk(vkCreatePipelineLayout(device_, &layout, nullptr, &layout_), "no layout");
  const VkDescriptorPoolSize room = {VK_DESCRIPTOR_TYPE_STORAGE_BUFFER, count};
  VkDescriptorPoolCreateInfo pool{VK_STRUCTURE_TYPE_DESCRIPTOR_POOL_CREATE_INFO};
  pool.maxSets = pool.poolSizeCount = 1;
  pool.pPoolSizes = &room;
  check_vk(vkCreateDescriptorPool(device_, &pool, nullptr, &descriptors_), "no descriptors");
  VkDescriptorSetAllocateInfo info{VK_STRUCTURE_TYPE_DESCRIPTOR_SET_ALLOCATE_INFO};
  info.descriptorPool = descriptors_;
  info.descriptorSetCount = 1;
  info.pSetLayouts = &set_layout_;
  check_vk(vkAllocateDescriptorSets(device_, &info, &set_), "no descriptors");
  for (uint32_t i = 0; i < count; i++) {
    const VkDescriptorBufferInfo buffer = {buffers[i].buffer, 0, VK_WHOLE_SIZE};
    VkWriteDescriptorSet write{VK_STRUCTURE_TYPE_WRITE_DESCRIPTOR_SET};
    write.dstSet = set_;
    write.dstBinding = i;
    write.descriptorCount = 1;
    write.descriptorType = VK_DESCRIPTOR_TYPE_STORAGE_BUFFER;
    write.pBufferInfo = &buffer;
    vkUpdateDescriptorSets(device_, 1, &write, 0, nullptr);
  }
}

void Gpu::make_render_pass() {
  VkAttachmentDescription attachments[2]{};
  attachments[0].format = kColor;
  attachments[0].storeOp = VK_ATTACHMENT_STORE_OP_STORE;
  attachments[0].finalLayout = VK_IMAGE_LAYOUT_TRANSFER_SRC_OPTIMAL;
  attachments[1].format = kDepth;
  attachments[1].storeOp = VK_ATTACHMENT_STORE_OP_DONT_CARE;
  attachments[1].finalLayout = VK_IMAGE_LAYOUT_DEPTH_STENCIL_ATTACHMENT_OPTIMAL;
  for (VkAttachmentDescription& attachment : attachments) {
    attachment.samples = VK_SAMPLE_COUNT_1_BIT;
    attachment.loadOp = VK_ATTACHMENT_LOAD_OP_CLEAR;
    attachment.stencilLoadOp = VK_ATTACHMENT_LOAD_OP_DONT_CARE;
    attachment.stencilStoreOp = VK_ATTACHMENT_STORE_OP_DONT_CARE;
  }
  const VkAttachmentReference color = {0, VK_IMAGE_LAYOUT_COLOR_ATTACHMENT_OPTIMAL},
                              depth = {1, VK_IMAGE_LAYOUT_DEPTH_STENCIL_ATTACHMENT_OPTIMAL};
  VkSubpassDescription subpass{};
  subpass.pipelineBindPoint = VK_PIPELINE_BIND_POINT_GRAPHICS;
  subpass.colorAttachmentCount = 1;
  subpass.pColorAttachments = &color;
  subpass.pDepthStencilAttachment = &depth;
  // The picture is copied after the pass.
  VkSubpassDependency after{0, VK_SUBPASS_EXTERNAL};
  after.srcStageMask = VK_PIPELINE_STAGE_COLOR_ATTACHMENT_OUTPUT_BIT;
  after.srcAccessMask = VK_ACCESS_COLOR_ATTACHMENT_WRITE_BIT;
  after.dstStageMask = VK_PIPELINE_STAGE_TRANSFER_BIT;
  after.dstAccessMask = VK_ACCESS_TRANSFER_READ_BIT;
  VkRenderPassCreateInfo info{VK_STRUCTURE_TYPE_RENDER_PASS_CREATE_INFO};
  info.attachmentCount = 2;
  info.pAttachments = attachments;
  info.subpassCount = info.dependencyCount = 1;
  info.pSubpasses = &subpass;
  info.pDependencies = &after;
  check_vk(vkCreateRenderPass(device_, &info, nullptr, &pass_), "no render pass");
  const VkImageView views[] = {color_.view, depth_.view};
  VkFramebufferCreateInfo target{VK_STRUCTURE_TYPE_FRAMEBUFFER_CREATE_INFO};
  target.renderPass = pass_;
  target.attachmentCount = 2;
  target.pAttachments = views;
  target.width = sizes_.width;
  target.height = sizes_.height;
  target.layers = 1;
  check_vk(vkCreateFramebuffer(device_, &target, nullptr, &target_), "no framebuffer");
}

// The decoder takes long to compile: a second start finds it in the file.
void Gpu::open_cache() {
  std::vector<char> bytes;
  if (!cache_file_.empty()) {
    std::ifstream in(cache_file_, std::ios::binary);
    bytes.assign(std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>());
  }
  VkPipelineCacheCreateInfo info{VK_STRUCTURE_TYPE_PIPELINE_CACHE_CREATE_INFO};
  info.initialDataSize = bytes.size();
  info.pInitialData = bytes.data();
  check_vk(vkCreatePipelineCache(device_, &info, nullptr, &cache_), "no pipeline cache");
}

void Gpu::save_cache() const {
  if (cache_file_.empty()) return;
  size_t size = 0;
  check_vk(vkGetPipelineCacheData(device_, cache_, &size, nullptr), "no pipeline cache");
  std::vector<char> bytes(size);
  check_vk(vkGetPipelineCacheData(device_, cache_, &size, bytes.data()), "no pipeline cache");
  std::ofstream out(cache_file_, std::ios::binary);
  out.write(bytes.data(), std::streamsize(size));
  out.close();  // which writes the rest
  require(out.good(), "the file for compiled shaders cannot be written");
}

VkShaderModule Gpu::shader(const uint32_t* code, size_t bytes) const {
  VkShaderModuleCreateInfo info{VK_STRUCTURE_TYPE_SHADER_MODULE_CREATE_INFO};
  info.codeSize = bytes;
  info.pCode = code;
  VkShaderModule out = nullptr;
  check_vk(vkCreateShaderModule(device_, &info, nullptr, &out), "a shader is refused");
  return out;
}

void Gpu::make_compute_pipeline() {
  VkComputePipelineCreateInfo info{VK_STRUCTURE_TYPE_COMPUTE_PIPELINE_CREATE_INFO};
  info.stage.sType = VK_STRUCTURE_TYPE_PIPELINE_SHADER_STAGE_CREATE_INFO;
  info.stage.stage = VK_SHADER_STAGE_COMPUTE_BIT;
  info.stage.module = shader(decode_comp, sizeof decode_comp);
  info.stage.pName = "main";
  info.layout = layout_;
  const VkResult result = vkCreateComputePipelines(device_, cache_, 1, &info, nullptr, &decode_);
  vkDestroyShaderModule(device_, info.stage.module, nullptr);
  check_vk(result, "the decoder cannot be compiled");
}

void Gpu::make_graphics_pipeline() {
  VkPipelineShaderStageCreateInfo stages[2]{};
  for (VkPipelineShaderStageCreateInfo& stage : stages) {
    stage.sType = VK_STRUCTURE_TYPE_PIPELINE_SHADER_STAGE_CREATE_INFO;
    stage.pName = "main";
  }
  stages[0].stage = VK_SHADER_STAGE_VERTEX_BIT;
  stages[0].module = shader(draw_vert, sizeof draw_vert);
  stages[1].stage = VK_SHADER_STAGE_FRAGMENT_BIT;
  stages[1].module = shader(draw_frag, sizeof draw_frag);
  const VkPipelineVertexInputStateCreateInfo pulled{
      VK_STRUCTURE_TYPE_PIPELINE_VERTEX_INPUT_STATE_CREATE_INFO};  // by the shader
  VkPipelineInputAssemblyStateCreateInfo lists{
      VK_STRUCTURE_TYPE_PIPELINE_INPUT_ASSEMBLY_STATE_CREATE_INFO};
  lists.topology = VK_PRIMITIVE_TOPOLOGY_TRIANGLE_LIST;
  const VkViewport viewport = {0, 0, float(sizes_.width), float(sizes_.height), 0, 1};
  const VkRect2D all = {{0, 0}, {sizes_.width, sizes_.height}};
  const VkPipelineViewportStateCreateInfo view{
      VK_STRUCTURE_TYPE_PIPELINE_VIEWPORT_STATE_CREATE_INFO, nullptr, 0, 1, &viewport, 1, &all};
  VkPipelineRasterizationStateCreateInfo raster{
      VK_STRUCTURE_TYPE_PIPELINE_RASTERIZATION_STATE_CREATE_INFO};
  raster.lineWidth = 1;
  VkPipelineMultisampleStateCreateInfo samples{
      VK_STRUCTURE_TYPE_PIPELINE_MULTISAMPLE_STATE_CREATE_INFO};
  samples.rasterizationSamples = VK_SAMPLE_COUNT_1_BIT;
  VkPipelineDepthStencilStateCreateInfo depth{
      VK_STRUCTURE_TYPE_PIPELINE_DEPTH_STENCIL_STATE_CREATE_INFO};
  depth.depthTestEnable = depth.depthWriteEnable = VK_TRUE;
  depth.depthCompareOp = VK_COMPARE_OP_GREATER;  // 1 is near, 0 infinitely far
  VkPipelineColorBlendAttachmentState opaque{};
  opaque.colorWriteMask = 15;
  VkPipelineColorBlendStateCreateInfo blend{
      VK_STRUCTURE_TYPE_PIPELINE_COLOR_BLEND_STATE_CREATE_INFO};
  blend.attachmentCount = 1;
  blend.pAttachments = &opaque;
  VkGraphicsPipelineCreateInfo info{VK_STRUCTURE_TYPE_GRAPHICS_PIPELINE_CREATE_INFO};
  info.stageCount = 2;
  info.pStages = stages;
  info.pVertexInputState = &pulled;
  info.pInputAssemblyState = &lists;
  info.pViewportState = &view;
  info.pRasterizationState = &raster;
  info.pMultisampleState = &samples;
  info.pDepthStencilState = &depth;
  info.pColorBlendState = &blend;
  info.layout = layout_;
  info.renderPass = pass_;
  const VkResult result = vkCreateGraphicsPipelines(device_, cache_, 1, &info, nullptr, &draw_);
  for (const VkPipelineShaderStageCreateInfo& stage : stages)
    vkDestroyShaderModule(device_, stage.module, nullptr);
  check_vk(result, "the shaders that draw cannot be compiled");
}

void Gpu::load(const std::vector<Load>& loads) {
  for (const Load& load : loads)
    std::memcpy(static_cast<uint8_t*>(pages_.mapped) + size_t(load.slot) * sizes_.page_bytes,
                load.bytes.data, load.bytes.size);
  loads_ = loads;
}

void Gpu::record_decoding() {
  if (loads_.empty()) return;
  vkCmdBindPipeline(commands_, VK_PIPELINE_BIND_POINT_COMPUTE, decode_);
  vkCmdBindDescriptorSets(commands_, VK_PIPELINE_BIND_POINT_COMPUTE, layout_, 0, 1, &set_, 0,
                          nullptr);
  for (const Load& load : loads_) {
    const Job job = {load.slot * sizes_.page_bytes / 4,
                     uint32_t(load.bytes.size / 4),
                     load.slot * sizes_.meshlets,
                     load.meshlets,
                     sizes_.streams,
                     sizes_.normals};
    vkCmdPushConstants(commands_, layout_, VK_SHADER_STAGE_COMPUTE_BIT | VK_SHADER_STAGE_VERTEX_BIT,
                       0, sizeof job, &job);
    vkCmdDispatch(commands_, (load.meshlets + 31) / 32, 1, 1);
  }
  VkMemoryBarrier decoded{VK_STRUCTURE_TYPE_MEMORY_BARRIER};
  decoded.srcAccessMask = VK_ACCESS_SHADER_WRITE_BIT;
  decoded.dstAccessMask = VK_ACCESS_SHADER_READ_BIT | VK_ACCESS_HOST_READ_BIT;
  vkCmdPipelineBarrier(commands_, VK_PIPELINE_STAGE_COMPUTE_SHADER_BIT,
                       VK_PIPELINE_STAGE_VERTEX_SHADER_BIT | VK_PIPELINE_STAGE_HOST_BIT, 0, 1,
                       &decoded, 0, nullptr, 0, nullptr);
  loads_.clear();
}

void Gpu::record_drawing(const Frame& frame, const std::vector<Draw>& draws) {
  VkClearValue clear[2]{};  // black, infinitely far
  VkRenderPassBeginInfo begin{VK_STRUCTURE_TYPE_RENDER_PASS_BEGIN_INFO};
  begin.renderPass = pass_;
  begin.framebuffer = target_;
  begin.renderArea.extent = {sizes_.width, sizes_.height};
  begin.clearValueCount = 2;
  begin.pClearValues = clear;
  vkCmdBeginRenderPass(commands_, &begin, VK_SUBPASS_CONTENTS_INLINE);
  vkCmdBindPipeline(commands_, VK_PIPELINE_BIND_POINT_GRAPHICS, draw_);
  vkCmdBindDescriptorSets(commands_, VK_PIPELINE_BIND_POINT_GRAPHICS, layout_, 0, 1, &set_, 0,
                          nullptr);
  vkCmdPushConstants(commands_, layout_, VK_SHADER_STAGE_COMPUTE_BIT | VK_SHADER_STAGE_VERTEX_BIT,
                     0, sizeof frame, &frame);
  for (const Draw& draw : draws)
    vkCmdDraw(commands_, 3 * GLTF_MESHLET_TRIANGLES, draw.count, 0,
              draw.slot * sizes_.meshlets + draw.first);
  vkCmdEndRenderPass(commands_);
  VkBufferImageCopy copy{};
  copy.imageSubresource = {VK_IMAGE_ASPECT_COLOR_BIT, 0, 0, 1};
  copy.imageExtent = {sizes_.width, sizes_.height, 1};
  vkCmdCopyImageToBuffer(commands_, color_.image, VK_IMAGE_LAYOUT_TRANSFER_SRC_OPTIMAL,
                         readback_.buffer, 1, &copy);
  VkMemoryBarrier copied{VK_STRUCTURE_TYPE_MEMORY_BARRIER};
  copied.srcAccessMask = VK_ACCESS_TRANSFER_WRITE_BIT;
  copied.dstAccessMask = VK_ACCESS_HOST_READ_BIT;
  vkCmdPipelineBarrier(commands_, VK_PIPELINE_STAGE_TRANSFER_BIT, VK_PIPELINE_STAGE_HOST_BIT, 0, 1,
                       &copied, 0, nullptr, 0, nullptr);
}

void Gpu::draw(const Frame& frame, const std::vector<Draw>& draws) {
  check_vk(vkResetCommandPool(device_, pool_, 0), "commands cannot be recorded");
  VkCommandBufferBeginInfo begin{VK_STRUCTURE_TYPE_COMMAND_BUFFER_BEGIN_INFO};
  begin.flags = VK_COMMAND_BUFFER_USAGE_ONE_TIME_SUBMIT_BIT;
  check_vk(vkBeginCommandBuffer(commands_, &begin), "commands cannot be recorded");
  record_decoding();
  record_drawing(frame, draws);
  check_vk(vkEndCommandBuffer(commands_), "commands cannot be recorded");
  VkSubmitInfo submit{VK_STRUCTURE_TYPE_SUBMIT_INFO};
  submit.commandBufferCount = 1;
  submit.pCommandBuffers = &commands_;
  check_vk(vkQueueSubmit(queue_, 1, &submit, fence_), "the device takes no commands");
  check_vk(vkWaitForFences(device_, 1, &fence_, VK_TRUE, UINT64_MAX), "the device is lost");
  check_vk(vkResetFences(device_, 1, &fence_), "the device is lost");
}

// Vulkan takes null for what was not made.
Gpu::~Gpu() {
  if (device_) {
    vkDestroyPipeline(device_, decode_, nullptr);
    vkDestroyPipeline(device_, draw_, nullptr);
    vkDestroyPipelineCache(device_, cache_, nullptr);
    vkDestroyFramebuffer(device_, target_, nullptr);
    vkDestroyRenderPass(device_, pass_, nullptr);
    vkDestroyPipelineLayout(device_, layout_, nullptr);
    vkDestroyDescriptorPool(device_, descriptors_, nullptr);
    vkDestroyDescriptorSetLayout(device_, set_layout_, nullptr);
    for (const Image& image : {color_, depth_}) {
      vkDestroyImageView(device_, image.view, nullptr);
      vkDestroyImage(device_, image.image, nullptr);
      vkFreeMemory(device_, image.memory, nullptr);
    }
    for (const Buffer& buffer : {pages_, meshlets_, errors_, readback_}) {
      vkDestroyBuffer(device_, buffer.buffer, nullptr);
      vkFreeMemory(device_, buffer.memory, nullptr);
    }
    vkDestroyFence(device_, fence_, nullptr);
    vkDestroyCommandPool(device_, pool_, nullptr);
    vkDestroyDevice(device_, nullptr);
  }
  if (messenger_)
    reinterpret_cast<PFN_vkDestroyDebugUtilsMessengerEXT>(vkGetInstanceProcAddr(
        instance_, "vkDestroyDebugUtilsMessengerEXT"))(instance_, messenger_, nullptr);
  if (instance_) vkDestroyInstance(instance_, nullptr);
}
