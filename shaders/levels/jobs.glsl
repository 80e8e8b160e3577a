// Path `visibility` with a pool of decoded clusters, which stay from frame to frame and which
// instances share: the clusters to draw, and the slots of the decoded ones. Without levels of
// detail the clusters are all meshlets of all instances.
#ifndef JOBS_GLSL
#define JOBS_GLSL

struct Cut {
  // Set by the host once:
  uvec2 fresh;    // address of a list of Fresh: clusters to decode
  uvec2 decoded;  // of the slot of each meshlet, or UNDECODED | the last stamp that wanted it
  uvec2 owners;   // of each slot's place in `decoded`
  uvec2 stamps;   // of the stamp with which each slot was used last
  uvec2 states;   // of the JOB_ of each job
  uvec2 hints;    // of the frames in which clusters were visible last
  uint capacity;  // jobs
  uint slots;
  uint hint_mask;    // number of hints - 1
  uint per_connect;  // clusters of a workgroup of connect_stream.comp
  uint per_task;     // and of mesh.task; or 0
  // Counters that the shaders keep:
  uint frame;
  uint stamp;   // of a choice of slots: no slot that has it is taken away
  uint cursor;  // slots before it were taken last
  uint first_cursor;
  // Of a frame; with levels of detail, the host sets the first four:
  uvec4 dispatch;  // arguments of the next cut.comp; none if the clusters fit
  uint clusters;   // to draw; more than `capacity` do not fit
  float max_pixels;
  uint rounds;  // that did not fit
  uint used;    // slots that the clusters in view need
  uint fresh_total;
  uint decoded_total;  // without the last fresh_total
  uint hidden;         // clusters behind others
  uint triangles;      // drawn
  // Arguments of the shaders that decode and draw; z is 0 if there is nothing to draw:
  uvec4 connect;
  uvec4 values;
  uvec4 small;
  uvec4 pieces;
  uvec4 resolve;
  uvec4 tasks;  // of paths mesh and mesh-paper
};

struct Job {
  uint instance;
  uint row;      // of its page or primitive in Frame.primitives
  uint meshlet;  // in that blob
  uint number;   // of the cluster in the primitive
};

struct Fresh {
  uint row;
  uint meshlet;
  uint place;  // in `decoded`
  uint slot;
};

#define DECODING 0xFFFFFFFFu

#define JOB_HIDDEN 0u   // out of view, facing away, or behind others
#define JOB_WAITING 1u  // to be drawn in this phase, or in a later pass if no slot is free
#define JOB_LATER 2u    // to be tested against the depths of the first phase
#define JOB_DRAWN 3u    // + the pass in which it was drawn

layout(buffer_reference, std430, buffer_reference_align = 16) buffer Jobs {
  Cut cut;
  Job at[];
};
layout(buffer_reference, std430, buffer_reference_align = 16) buffer FreshClusters { Fresh at[]; };
layout(buffer_reference, std430, buffer_reference_align = 4) buffer SlotNumbers { uint at[]; };

#endif
