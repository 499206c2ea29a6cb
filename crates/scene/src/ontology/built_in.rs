//! The built-in tables.

use super::{Class, Ontology};
use crate::Semantic;

impl Ontology {
    /// The paper's eight classes (section V-A): the default.
    #[must_use]
    pub fn paper() -> Self {
        Self::new("paper", paper_classes(), paper_class).expect("the built-in table is complete")
    }

    /// The paper's table for fire prevention: shrubs and herbaceous plants merged into "Fuel".
    #[must_use]
    pub fn fuel() -> Self {
        let mut classes = paper_classes();
        classes.retain(|c| c.id != 6);
        classes[5].name = "Fuel".to_owned();
        Self::new("fuel", classes, |s| match paper_class(s) {
            6 => 5,
            id => id,
        })
        .expect("the built-in table is complete")
    }

    /// Each fine semantic as a class of its own, with its number and name. Colours are near that of
    /// the paper's class which contains it.
    #[must_use]
    pub fn semantics() -> Self {
        let class = |&semantic: &Semantic| Class {
            id: semantic as u8,
            name: semantic.name().to_owned(),
            colour: semantic_colour(semantic),
        };
        let classes = Semantic::ALL.iter().map(class).collect();
        Self::new("semantics", classes, |s| s as u8).expect("the built-in table is complete")
    }

    /// All built-in tables.
    #[must_use]
    pub fn built_in() -> [Self; 3] {
        [Self::paper(), Self::fuel(), Self::semantics()]
    }

    /// A built-in table by its name: `paper`, `fuel` or `semantics`.
    #[must_use]
    pub fn by_name(name: &str) -> Option<Self> {
        Self::built_in().into_iter().find(|o| o.name == name)
    }
}

fn paper_classes() -> Vec<Class> {
    let class = |id, name: &str, colour| Class {
        id,
        name: name.to_owned(),
        colour,
    };
    vec![
        class(0, "Background", [132, 193, 238]),
        class(1, "Terrain", [152, 118, 84]),
        class(2, "Traversable", [236, 208, 120]),
        class(3, "Trunks", [158, 42, 43]),
        class(4, "Canopy", [27, 107, 58]),
        class(5, "Shrubs", [138, 201, 38]),
        class(6, "Herbaceous", [64, 224, 208]),
        class(7, "Rocks", [125, 125, 140]),
    ]
}

fn paper_class(semantic: Semantic) -> u8 {
    use Semantic as S;
    match semantic {
        S::Sky | S::AirborneEcho => 0,
        S::Soil | S::Litter | S::FallenTwig | S::GroundMoss | S::CutSlope => 1,
        S::FallenBranch | S::SurfaceRoot | S::FallenBark => 1,
        S::Water | S::Ice | S::Snow => 1,
        S::TrailSurface | S::TrailRut | S::TrailStrip => 2,
        S::Stem | S::Limb | S::RootFlare | S::Stump | S::Log | S::Snag | S::StemGrowth => 3,
        S::RootPlate => 3,
        S::Branch | S::Twig | S::Leaf | S::Needle => 4,
        S::Shrub | S::Bramble | S::Climber => 5,
        S::Grass | S::Herb | S::Fern | S::Seedling => 6,
        S::Rock | S::Stone => 7,
    }
}

fn semantic_colour(semantic: Semantic) -> [u8; 3] {
    use Semantic as S;
    match semantic {
        S::Sky => [132, 193, 238],
        S::AirborneEcho => [255, 255, 255],
        S::Soil => [152, 118, 84],
        S::Litter => [176, 132, 76],
        S::FallenTwig => [118, 86, 60],
        S::FallenBranch => [98, 70, 50],
        S::FallenBark => [140, 96, 62],
        S::GroundMoss => [122, 140, 60],
        S::SurfaceRoot => [108, 92, 80],
        S::CutSlope => [190, 150, 112],
        S::Water => [40, 96, 190],
        S::Ice => [176, 220, 232],
        S::Snow => [238, 244, 250],
        S::TrailSurface => [236, 208, 120],
        S::TrailRut => [214, 176, 84],
        S::TrailStrip => [220, 222, 140],
        S::Stem => [158, 42, 43],
        S::Limb => [196, 78, 62],
        S::RootFlare => [122, 34, 50],
        S::Stump => [204, 110, 90],
        S::Log => [176, 74, 110],
        S::RootPlate => [104, 44, 30],
        S::Snag => [210, 130, 140],
        S::StemGrowth => [148, 92, 40],
        S::Branch => [92, 72, 30],
        S::Twig => [72, 92, 40],
        S::Leaf => [27, 107, 58],
        S::Needle => [14, 84, 78],
        S::Shrub => [138, 201, 38],
        S::Bramble => [170, 214, 92],
        S::Climber => [98, 170, 24],
        S::Grass => [64, 224, 208],
        S::Herb => [96, 236, 164],
        S::Fern => [36, 188, 150],
        S::Seedling => [150, 240, 226],
        S::Rock => [125, 125, 140],
        S::Stone => [164, 164, 178],
    }
}
