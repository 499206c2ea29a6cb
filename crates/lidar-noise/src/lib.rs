//! LiDAR range-error models: bias by range and incidence, Gaussian spread, detection.
