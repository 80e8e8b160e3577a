/* The package links, is at least as new as its header, and refuses bytes that are none of ours. */
#include <gltf_meshlet.h>
#include <stdio.h>

int main(void) {
  gltf_meshlet_view* view = 0;
  const char bytes[] = "no meshlets at all";
  if (gltf_meshlet_abi() < GLTF_MESHLET_ABI) return 1;
  if (gltf_meshlet_open(bytes, sizeof bytes, &view) == GLTF_MESHLET_OK) return 2;
  printf("interface %u: %s\n", (unsigned)gltf_meshlet_abi(), gltf_meshlet_error());
  return 0;
}
