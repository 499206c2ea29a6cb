//! The data set on disk: SemanticKITTI layout, truth images, manifest, readers and checks.
