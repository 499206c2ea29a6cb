//! Alpha-aware ray casting over instanced forests: a two-level BVH and a brute-force oracle.
