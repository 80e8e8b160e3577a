// Levels of detail, first: chooses the clusters of each instance by the rule
// of EXT_meshlet_lod, a thread per group. Resident pages never lack the page of a coarser group,
// and errors on the screen grow towards coarser groups, so that a group is active if it is resident
// and needed: no thread needs the result of another. If rounding breaks that order, a surface is
// drawn at two levels; no hole opens.
//
// Inputs: hierarchies, resident pages, the allowed error. Outputs: jobs; requests for pages.
#version 460
#extension GL_GOOGLE_include_directive : require

#include "levels/levels.glsl"
#include "decoders/bounds.glsl"
layout(local_size_x = CUT_THREADS) in;

Instance instance;
uint instance_number;
Hierarchy hierarchy;

Group group_of(uint g) { return Groups(push.groups).at[hierarchy.first_group + g]; }
Page page_of(Group group) { return Pages(push.pages).at[hierarchy.first_page + group.page]; }

bool is_top(Group group) { return floatBitsToUint(group.error) == INFINITE_BITS; }

// The error of a group's replacement at the nearest point of its sphere that is seen. The least
// distance is one for all groups, so that errors grow towards coarser ones.
float pixels_from(vec4 eye, Group group) {
  if (is_top(group)) return uintBitsToFloat(INFINITE_BITS);
  float error = group.error * instance.scale * push.pixels_per_unit;
  if (eye.w == 0.0 || error == 0.0) return error;
  float center = distance((instance.object_to_world * vec4(group.sphere.xyz, 1.0)).xyz, eye.xyz);
  return error / max(center - group.sphere.w * instance.scale, push.near);
}

float pixels_of(Group group) { return pixels_from(Frame(push.frame).eye, group); }

bool is_needed(Group group, float pixels) {
  return is_top(group) || pixels > Jobs(push.jobs).cut.max_pixels;
}

// Adds clusters [first, first + count) of the group's page, as far as there is room.
void put_clusters(Page page, uint first, uint count) {
  Jobs jobs = Jobs(push.jobs);
  uint begin = atomicAdd(jobs.cut.clusters, count);
  uint end = min(begin + count, jobs.cut.capacity);
  for (uint i = begin; i < end; i++) {
    uint meshlet = first + i - begin;
    jobs.at[i] = Job(instance_number, page.row, meshlet, page.first_cluster + meshlet);
  }
}

// Adds the clusters of an active group that no active group replaces.
void put_group(Group group, Page page) {
  uint meshlet = group.counts & 0xFFFFu;
  uint runs = group.counts >> 24;
  if (runs == 0u) put_clusters(page, meshlet, (group.counts >> 16) & 255u);
  for (uint r = 0u; r < runs; r++) {
    uint run = SceneWords(push.runs).at[hierarchy.first_run + group.first_run + r];
    Group finer = group_of(run & 0xFFFFFFu);
    bool resident = page_of(finer).row != NOT_RESIDENT;
    if (!(resident && is_needed(finer, pixels_of(finer)))) put_clusters(page, meshlet, run >> 24);
    meshlet += run >> 24;
  }
}

// Whether the group's page is asked for: a little before it is needed.
bool is_asked_for(Group group, float pixels) { return is_top(group) || pixels > push.least_pixels; }

void request(Requests requests, uint page, float pixels) {
  uint place = hierarchy.first_page + page, bits = floatBitsToUint(pixels);
  if (requests.at[place] < bits) atomicMax(requests.at[place], bits);
}

// Asks for the group's page if the camera will need it where it goes.
void look_ahead(Group group) {
  Ahead ahead = Aheads(push.ahead).at;
  float pixels = pixels_from(ahead.eye, group);
  if (!is_asked_for(group, pixels)) return;
  mat4 to_clip = ahead.world_to_clip * instance.object_to_world;
  if (outside_view(group.sphere.xyz, group.sphere.w, to_clip)) return;
  request(Requests(ahead.requests), group.page, pixels);
}

void main() {
  uint number = gl_WorkGroupID.y * CUT_COLUMNS + gl_WorkGroupID.x;
  if (number >= push.block_total) return;
  Block block = Blocks(push.blocks).at[number];
  instance_number = block.instance;
  instance = Instances(Frame(push.frame).instances).at[instance_number];
  hierarchy = Hierarchies(push.hierarchies).at[instance.primitive];
  uint g = block.first_group + gl_LocalInvocationIndex;
  if (g >= hierarchy.groups) return;
  Group group = group_of(g);
  if (push.ahead != uvec2(0u)) look_ahead(group);
  float pixels = pixels_of(group);
  if (!is_asked_for(group, pixels)) return;
  mat4 to_clip = Matrices(Frame(push.frame).object_to_clip).at[instance_number];
  if (outside_view(group.sphere.xyz, group.sphere.w, to_clip)) return;
  request(Requests(push.requests), group.page, pixels);
  Page page = page_of(group);
  if (page.row != NOT_RESIDENT && is_needed(group, pixels)) put_group(group, page);
}
