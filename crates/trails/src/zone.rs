//! The parts of a trail that a point can be on.

/// The part of a trail that a point is on.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum TrailZone {
    /// Ground that no trail has touched.
    Off,
    /// A slope that a trail has cut or filled, beside its surface.
    CutSlope,
    /// The surface of a trail, apart from ruts and strip.
    Surface,
    /// A wheel rut.
    Rut,
    /// The strip between the ruts.
    Strip,
}
