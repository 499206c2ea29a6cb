//! Procedural trees, shrubs, herbs, rocks, stumps and their textures.
