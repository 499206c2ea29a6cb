//! Virtual cameras: ray-cast RGB, semantic, instance, depth and normal images under sun and sky.
