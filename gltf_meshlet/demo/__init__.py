"""`gltf-meshlet demo`: a generated model compressed, verified and drawn."""
