"""A glTF scene as plain data for renderers: cameras, lights, materials, images, view points."""
