//! Fine semantics: what a surface is.

macro_rules! semantics {
    ($($(#[$doc:meta])* $name:ident = $value:literal, $text:literal;)*) => {
        /// What a surface is, finer than any class table. The numbers are stable: they are written
        /// to caches and chosen by ontologies.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
        #[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
        #[repr(u8)]
        #[non_exhaustive]
        pub enum Semantic { $($(#[$doc])* $name = $value,)* }

        impl Semantic {
            /// Every semantic, in order of its number.
            pub const ALL: &'static [Self] = &[$(Self::$name,)*];

            /// The name used in files, `snake_case`.
            #[must_use]
            pub const fn name(self) -> &'static str {
                match self { $(Self::$name => $text,)* }
            }

            /// The semantic with this number.
            #[must_use]
            pub const fn from_u8(value: u8) -> Option<Self> {
                match value { $($value => Some(Self::$name),)* _ => None }
            }
        }
    };
}

semantics! {
    /// Nothing was hit: sky, or beyond the visible radius.
    Sky = 0, "sky";
    /// Bare mineral soil.
    Soil = 1, "soil";
    /// Leaf and needle litter.
    Litter = 2, "litter";
    /// Fallen twigs, cones and leaves in three dimensions.
    FallenTwig = 3, "fallen_twig";
    /// Moss on the ground.
    GroundMoss = 4, "ground_moss";
    /// The slopes a trail has cut or filled.
    CutSlope = 5, "cut_slope";
    /// The surface of a trail, whatever its material.
    TrailSurface = 6, "trail_surface";
    /// The wheel ruts of a trail.
    TrailRut = 7, "trail_rut";
    /// The strip between the ruts.
    TrailStrip = 8, "trail_strip";
    /// Stem of a living tree.
    Stem = 9, "stem";
    /// Limb thicker than the trunk threshold (radius 4 cm by default).
    Limb = 10, "limb";
    /// The foot of a stem where it widens into roots.
    RootFlare = 11, "root_flare";
    /// Stump of a felled tree.
    Stump = 12, "stump";
    /// Log on the ground.
    Log = 13, "log";
    /// Standing dead stem.
    Snag = 14, "snag";
    /// Moss, lichen and loose bark on a stem.
    StemGrowth = 15, "stem_growth";
    /// Wood thinner than the trunk threshold.
    Branch = 16, "branch";
    /// Twigs, dead or alive.
    Twig = 17, "twig";
    /// Leaves of a tree.
    Leaf = 18, "leaf";
    /// Needles of a tree.
    Needle = 19, "needle";
    /// A climber on a stem.
    Climber = 20, "climber";
    /// Woody shrub.
    Shrub = 21, "shrub";
    /// Bramble.
    Bramble = 22, "bramble";
    /// Grass.
    Grass = 23, "grass";
    /// Herb.
    Herb = 24, "herb";
    /// Fern.
    Fern = 25, "fern";
    /// Tree seedling under 0.3 m.
    Seedling = 26, "seedling";
    /// Rock.
    Rock = 27, "rock";
    /// Stone over 5 cm.
    Stone = 28, "stone";
    /// Branch or top of a tree that lies on the ground.
    FallenBranch = 29, "fallen_branch";
    /// Root plate of a thrown tree.
    RootPlate = 30, "root_plate";
    /// Root of a living tree at the surface of the ground.
    SurfaceRoot = 31, "surface_root";
    /// Bark strip or cone on the ground.
    FallenBark = 32, "fallen_bark";
    /// Water.
    Water = 33, "water";
    /// Ice.
    Ice = 34, "ice";
    /// Snow.
    Snow = 35, "snow";
    /// False echo in the air: rain, fog, snowfall or dust.
    AirborneEcho = 36, "airborne_echo";
}
