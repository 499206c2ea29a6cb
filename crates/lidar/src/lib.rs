//! Virtual LiDAR scanners: scan patterns, beams and returns.
