//! The primitives that are drawn: triangles and cards.

/// The kinds of primitives; a page of the pool holds one of them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum PrimitiveKind {
    Triangles,
    Cards,
}

impl PrimitiveKind {
    pub(crate) const ALL: [Self; 2] = [Self::Triangles, Self::Cards];

    /// Bytes of a primitive.
    pub(crate) fn stride(self) -> u64 {
        match self {
            Self::Triangles => 80,
            Self::Cards => 48,
        }
    }

    /// Vertices that draw a primitive.
    pub(crate) fn vertices(self) -> u32 {
        match self {
            Self::Triangles => 3,
            Self::Cards => 6,
        }
    }
}
