//! Endless octave-noise terrain with analytic gradients, and watertight chunk meshes.
