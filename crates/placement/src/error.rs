//! Errors in the parameters of a stand.

use nemoral_scene::ParamError;

/// Why a [`Placement`](crate::Placement) cannot be made.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum PlacementError {
    /// A field is outside of its range.
    #[error(transparent)]
    Param(#[from] ParamError),
    /// A layer's radii do not leave room for its number.
    #[error(
        "layers[{layer}].per_chunk = {per_chunk} ({name}): with these radii, spacing_factor and \
         density_factor at most about {at_most:.1} per chunk find room; lower per_chunk, \
         spacing_factor or the radii of this layer or of those before it"
    )]
    TooDense {
        /// The layer's index.
        layer: usize,
        /// The layer's name.
        name: String,
        /// The number asked for.
        per_chunk: f64,
        /// The largest number that fits, approximately.
        at_most: f64,
    },
}
