//! What the stages of a plan have in common.

use std::fmt::Debug;

use crate::Hasher;

/// The types that all stages of a plan share. A user names them once, on an empty type of their
/// own.
///
/// ```
/// use nemoral_plan::{AnyCoordinate, Hasher, PlanTypes};
/// # use nemoral_plan::StageError;
/// # #[derive(Clone, Debug)]
/// # struct Error;
/// # impl StageError<Day> for Error {
/// #     fn panicked(_: &'static str, _: Day) -> Self {
/// #         Self
/// #     }
/// # }
///
/// /// Nodes are computed once for all, or for a day.
/// #[derive(Clone, Copy, Debug, PartialEq, Eq)]
/// enum Day {
///     Always,
///     Of(u32),
/// }
///
/// impl AnyCoordinate for Day {
///     const GLOBAL: Self = Self::Always;
///
///     fn hash(self, hasher: &mut Hasher) {
///         if let Self::Of(day) = self {
///             hasher.write_u64(u64::from(day));
///         }
///     }
/// }
///
/// struct Almanac;
///
/// impl PlanTypes for Almanac {
///     type At = Day;
///     type Context = u64;
///     type Error = Error;
///
///     fn hash_context(seed: &u64, hasher: &mut Hasher) {
///         hasher.write_u64(*seed);
///     }
/// }
/// ```
pub trait PlanTypes: 'static {
    /// Every coordinate of the plan, in one type.
    type At: AnyCoordinate;
    /// What every stage is given besides its inputs, such as the seed of all randomness, or `()`.
    type Context: Clone + Send + Sync + 'static;
    /// The error of stages.
    type Error: StageError<Self::At>;

    /// Writes the context, on which every key depends.
    fn hash_context(context: &Self::Context, hasher: &mut Hasher);
}

/// Every coordinate of a plan, in one type: usually an enum with a variant for each [`Coordinate`].
pub trait AnyCoordinate: Copy + Eq + Debug + Send + Sync + 'static {
    /// The coordinate of nodes that are computed once for the whole plan, which stands for `()`.
    const GLOBAL: Self;

    /// Writes what distinguishes the coordinate from others of its kind into a key. A node has
    /// coordinates of one kind only, so different kinds may write the same.
    fn hash(self, hasher: &mut Hasher);
}

/// One kind of coordinate: what the nodes of a stage are computed at. `()` is one in every plan.
pub trait Coordinate<P: PlanTypes>: Copy + Send + Sync + 'static {
    /// The coordinate as one of all kinds.
    fn erase(self) -> P::At;

    /// The coordinate of this kind; `None` if it is of another kind.
    fn restore(at: P::At) -> Option<Self>;
}

impl<P: PlanTypes> Coordinate<P> for () {
    fn erase(self) -> P::At {
        P::At::GLOBAL
    }

    fn restore(at: P::At) -> Option<Self> {
        (at == P::At::GLOBAL).then_some(())
    }
}

/// An error of stages. It is cloned for every thread that waits for the stage that failed.
pub trait StageError<At>: Clone + Send + Sync + 'static {
    /// Adds where the error happened. It is called with the stage that failed first, then with each
    /// stage that asked for it; an error that already has a place stays as it is.
    #[must_use]
    fn in_stage(self, stage: &'static str, at: At) -> Self {
        let _ = (stage, at);
        self
    }

    /// The error for those who waited for a stage that panicked on another thread.
    fn panicked(stage: &'static str, at: At) -> Self;
}
