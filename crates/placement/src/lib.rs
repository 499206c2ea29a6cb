//! Quadtree-backed variable-radius Bridson sampling of an endless chunked plane.
