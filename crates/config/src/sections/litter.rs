//! Keys of litter in relief.

use crate::schema::AllowedValues::Real;
use crate::schema::section;

section! {
    /// Litter in relief: dead leaves, mats of needles, twigs, cones, nuts, strips of bark and
    /// stones, by the species that stand near. It is deep in hollows, against stems and along
    /// verges, thin on crests, in the open and on trails, and follows the ground. Without it the
    /// forest floor is a flat picture, with a few patches of twigs (`undergrowth.litter`).
    Litter at "litter" {
        /// Share of the ground under closed crowns that it lies on; 0 for none.
        cover: f64 = 0.9, Real(0.0, 1.0), "our choice: most of a closed stand's floor";
        /// The same share on trails, relative to that beside them: three times as much on trails of
        /// leaves or needles.
        on_trails: f64 = 0.12, Real(0.0, 1.0), "our choice: trodden, driven over, swept aside";
        /// Leaves and needles that stand out, relative to what each species usually sheds.
        leaves: f64 = 1.0, Real(0.1, 2.0), "the species' `shed.leaves_per_m2`";
        /// Twigs, bark, cones and nuts, relative to the usual.
        wood: f64 = 1.0, Real(0.0, 4.0), "2.6 twigs on a square metre; the species' `shed`";
        /// Stones over 5 cm, relative to the usual.
        stones: f64 = 1.0, Real(0.0, 10.0), "0.2 on a square metre";
    }
}

impl Litter {
    /// No litter in relief at all.
    #[must_use]
    pub fn none() -> Self {
        Self {
            cover: 0.0,
            ..Self::default()
        }
    }

    /// Whether there is any.
    #[must_use]
    pub fn is_any(&self) -> bool {
        self.cover > 0.0
    }
}
