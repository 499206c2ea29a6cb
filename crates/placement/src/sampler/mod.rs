//! Variable-radius Poisson disks of an endless plane.

pub(crate) mod bridson;
pub(crate) mod index;
pub(crate) mod key;
pub(crate) mod quadtree;
pub(crate) mod sizes;
pub(crate) mod square;

use glam::DVec2;

use self::bridson::{SamplePoint, fill, halo};
use self::key::SampleKey;
use self::sizes::DiskSizes;
use self::square::Square;
use crate::variety::{DiskKind, check_varieties};
use nemoral_scene::ParamError;

/// Disks per square of the least distance in a saturated sample.
const SATURATED: f64 = 0.6966;

/// The most disks that a halo may hold if all were as small as the smallest variety's.
const MOST_IN_HALO: f64 = 67_108_864.0;

/// What [`PoissonDisks`] samples.
#[derive(Clone, Debug, PartialEq)]
pub struct PoissonDiskParams {
    /// The edge of the square tiles that the plane is divided into, metres, 10⁻³ to 10⁶. Tiles are
    /// the unit of exact arithmetic: positions are multiples of 2⁻³⁰ of their edge. No radius may
    /// be larger. The disks depend on this value; apart from that, tiles appear only in
    /// [`in_tile`](PoissonDisks::in_tile).
    pub tile_m: f64,
    /// The sizes of disks with their weights among the darts; at least one. Small disks find more
    /// places than large ones, so that their share of the sample is larger than of the darts.
    pub varieties: Vec<DiskKind>,
    /// How often the active list is processed, 1 to 8. More rounds give denser samples, up to 3 of
    /// them; further ones add nothing but time.
    pub rounds: u32,
}

impl Default for PoissonDiskParams {
    /// Disks of 1 m radius, so that centres are at least 2 m apart.
    fn default() -> Self {
        Self {
            tile_m: 50.0,
            varieties: vec![DiskKind {
                weight: 1.0,
                radius_m: (1.0, 1.0),
            }],
            rounds: 3,
        }
    }
}

/// A disk of a [`PoissonDisks`] sample.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Disk<K> {
    /// Its centre, metres.
    pub position_m: DVec2,
    /// Its radius, metres.
    pub radius_m: f64,
    /// The index of its variety in [`PoissonDiskParams::varieties`].
    pub variety: u16,
    /// Its own key, for everything else that is drawn for this disk.
    pub key: K,
}

/// A sampler of variable-radius Poisson disks on an endless plane (Bridson 2007, "Fast Poisson disk
/// sampling in arbitrary dimensions", with k = 30 darts a point, without an order of points).
///
/// # Guarantees
/// - No two disks of the plane overlap: the distance of their centres is at least the sum of their
///   radii, but for the rounding of coordinates (2⁻³⁰ of a tile, and that of `f64` far from the
///   origin).
/// - The disks are one set of the whole plane, a pure function of parameters and key. Any part of
///   the plane has the same disks to the bit, whatever the order and the thread of the calls.
/// - The law of the set is the same everywhere: it has no seams at the borders of tiles.
/// - The set need not be maximal. With disks of one radius it has 80 % of the density of a
///   saturated set after one round, 87 % after two, and 88 % after three or more; a saturated set
///   has 0.6966 disks per square of the least distance (`examples/poisson_disks.rs`).
///
/// # Cost
/// A call computes the disks of the part that is asked for and of a halo around it, `6 + 7 rounds`
/// times the largest radius wide, seldom more. With n disks in both together it takes O(n k log n)
/// time and O(n) memory; nothing is kept between calls. Asking for large parts at once is cheaper
/// than for many small ones. One rare variety that is much larger than the others makes the halo
/// wide.
///
/// # Example
/// ```
/// use nemoral_placement::{PoissonDiskParams, PoissonDisks};
/// use nemoral_seed::Key;
///
/// let sampler = PoissonDisks::new(PoissonDiskParams::default(), Key::world(7))?;
/// let disks = sampler.in_rect([-20.0, 0.0].into(), [40.0, 30.0].into());
/// for (i, a) in disks.iter().enumerate() {
///     for b in &disks[..i] {
///         assert!(a.position_m.distance(b.position_m) > a.radius_m + b.radius_m - 1e-6);
///     }
/// }
/// # Ok::<(), nemoral_placement::ParamError>(())
/// ```
#[derive(Clone, Debug)]
pub struct PoissonDisks<K> {
    sizes: DiskSizes,
    rounds: u32,
    tile_m: f64,
    key: K,
}

impl<K: SampleKey> PoissonDisks<K> {
    /// A sampler of valid parameters.
    ///
    /// # Errors
    /// A [`ParamError`] for a value out of range, or if the halo of a call would have room for more
    /// than 2²⁶ disks of the smallest variety: after three rounds, if the largest radius is more
    /// than 360 times the smallest variety's mean radius.
    pub fn new(params: PoissonDiskParams, key: K) -> Result<Self, ParamError> {
        let PoissonDiskParams {
            tile_m,
            varieties,
            rounds,
        } = params;
        ParamError::check_within("tile_m", tile_m, 1e-3, 1e6)?;
        ParamError::check_within("rounds", f64::from(rounds), 1.0, 8.0)?;
        check_varieties("varieties", &varieties, tile_m, "tile_m")?;
        for (i, v) in varieties.iter().enumerate() {
            // Positions of smaller disks would be too coarse.
            let field = format!("varieties[{i}].radius_m.0");
            ParamError::check_within(&field, v.radius_m.0, 1e-5 * tile_m, tile_m)?;
        }
        let no_core = vec![0.0; varieties.len()];
        let sizes = DiskSizes::new(&varieties, no_core, tile_m, 1.0);
        let drawn = (0..varieties.len()).filter(|&i| varieties[i].weight > 0.0);
        let smallest = drawn.map(|i| sizes.typical_core(i));
        let smallest = smallest.fold(f64::INFINITY, f64::min);
        // Twice the halo across, by the least distance of two disks.
        let across = 2.0 * halo(&sizes, rounds) / (2.0 * smallest);
        let times = sizes.max_core / smallest;
        ParamError::check(
            SATURATED * across * across <= MOST_IN_HALO,
            "varieties",
            format!("radii up to {times:.0} times the smallest"),
            "nearer to each other in radius, or rounds lower: there may be over 67,000,000 disks",
        )?;
        Ok(Self {
            sizes,
            rounds,
            tile_m,
            key,
        })
    }

    /// The disks whose centres lie in the tile with the south-west corner `tile * tile_m`, sorted
    /// by key. Tiles are half open, so each disk is in one tile.
    #[must_use]
    pub fn in_tile(&self, tile: [i32; 2]) -> Vec<Disk<K>> {
        let need = Square::around_tile(0.5);
        let points = fill(&self.sizes, self.rounds, self.key, tile, need);
        let inside = |p: &SamplePoint<K>| p.p.min_element() >= 0.0 && p.p.max_element() < 1.0;
        self.disks(tile, points.into_iter().filter(inside))
    }

    /// The disks whose centres lie in the half-open rectangle from `low_m` to `high_m`, sorted by
    /// key; none if `high_m` is not above `low_m`.
    ///
    /// # Panics
    /// If a coordinate is not finite or beyond 2³⁰ tiles, or the rectangle is longer than 2¹⁸
    /// tiles.
    #[must_use]
    pub fn in_rect(&self, low_m: DVec2, high_m: DVec2) -> Vec<Disk<K>> {
        let most_m = self.tile_m * f64::from(1 << 30);
        let near = |p: DVec2| p.is_finite() && p.abs().max_element() <= most_m;
        assert!(
            near(low_m) && near(high_m),
            "{low_m} to {high_m} is too far out"
        );
        if !low_m.cmplt(high_m).all() {
            return Vec::new();
        }
        let middle = (0.5 * (low_m + high_m) / self.tile_m).floor();
        let tile = [middle.x as i32, middle.y as i32];
        let in_tile = |p_m: DVec2| p_m / self.tile_m - middle;
        // Slightly more than needed, so that rounding loses no disk at the border.
        let need = Square::covering(in_tile(low_m), in_tile(high_m)).grown(1e-6);
        assert!(
            need.half_width < f64::from(1 << 18),
            "{low_m} to {high_m} is too large"
        );
        let points = fill(&self.sizes, self.rounds, self.key, tile, need);
        let mut disks = self.disks(tile, points.into_iter());
        disks.retain(|d| d.position_m.cmpge(low_m).all() && d.position_m.cmplt(high_m).all());
        disks
    }

    fn disks(&self, tile: [i32; 2], points: impl Iterator<Item = SamplePoint<K>>) -> Vec<Disk<K>> {
        let corner = DVec2::from(tile.map(f64::from));
        let mut disks: Vec<Disk<K>> = points
            .map(|point| Disk {
                position_m: (corner + point.p) * self.tile_m,
                radius_m: point.core * self.tile_m,
                variety: point.variety,
                key: point.key,
            })
            .collect();
        disks.sort_unstable_by_key(|disk| disk.key);
        disks
    }
}
