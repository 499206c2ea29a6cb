//! Gullies: what running water carves into a ground, as a function of the place alone.

use std::cell::RefCell;
use std::f64::consts::TAU;
use std::sync::atomic::{AtomicU64, Ordering};

use glam::DVec2;
use nemoral_scene::{ParamError, Surface, SurfaceSample};
use nemoral_seed::{Domain, Draw, Key};

const GULLIES: Domain = Domain::new("terrain.gullies");

/// Side of a cell, in distances between gullies of its generation.
const CELL: f64 = 1.2;
/// The greatest distance of a cell's pivot from its middle along each axis, in cells.
const JITTER: f64 = 0.25;
/// How far a cell's stripes reach from its pivot, in cells. Every place is reached by one at least,
/// as no pivot is farther than √2 · (½ + `JITTER`) from the corner of its cell, and by none but the
/// nine around it.
const REACH: f64 = 1.25;
/// The slope at which gullies have half of their depth: water on level ground carves nothing.
const ONSET: f64 = 0.2;
/// Over what distance the slope is taken that a gully follows, in distances between gullies.
const BASELINE: f64 = 0.7;
/// Depth of a generation over that of the one before.
const SHALLOWER: f64 = 0.4;
/// Depth of the shallowest cell over that of the deepest on the same slope: some slopes are more
/// dissected than others.
const SHALLOWEST: f64 = 0.3;
/// How stripes end where those around do not fit together: the least length of their phase that
/// still counts.
const FADE: f64 = 0.35;

/// The gullies of an [`ErodedSurface`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ErosionParams {
    /// Distance between the largest gullies, metres, 2..=1000.
    pub spacing_m: f64,
    /// Depth of the largest gullies on the steepest slopes, metres, from 0 to 0.4 · `spacing_m`.
    pub depth_m: f64,
    /// Generations, 1..=6: each has half the spacing and two fifths of the depth of the one before,
    /// and follows the slopes that those before have made, so that gullies branch.
    pub generations: u32,
}

impl Default for ErosionParams {
    /// Gullies 30 m apart and up to 2 m deep, in three generations.
    fn default() -> Self {
        Self {
            spacing_m: 30.0,
            depth_m: 2.0,
            generations: 3,
        }
    }
}

impl ErosionParams {
    /// Checks what [`ErodedSurface::new`] checks.
    ///
    /// # Errors
    /// If a parameter is out of its range.
    pub fn check(&self) -> Result<(), ParamError> {
        ParamError::check_range("spacing_m", self.spacing_m, 2.0..=1000.0, "2..=1000 m")?;
        ParamError::check_range(
            "depth_m",
            self.depth_m,
            0.0..=0.4 * self.spacing_m,
            "from 0 to 0.4 spacing_m",
        )?;
        let generations = f64::from(self.generations);
        ParamError::check_range("generations", generations, 1.0..=6.0, "1..=6")
    }
}

/// A ground of heights above 0 with gullies that run down its slopes and branch. Each place is
/// computed by itself, and the gradient is exact.
///
/// In the plane are cells, and at the pivot of each the slope is measured once. A cell carries
/// stripes along that slope, which fade into those of its neighbours; the phases of what overlaps
/// are added as vectors, so that gullies join where stripes differ, and their length is evened out
/// (phasor noise with a direction for each kernel: Tricard et al. 2019, "Procedural Phasor Noise",
/// doi 10.1145/3306346.3322990). Such stripes along the slope, in generations that follow the
/// slopes of those before, are the erosion of Clay John (2018, "Eroded Terrain Noise") and of Rune
/// Skovbo Johansen (2026, "Fast and Gorgeous Erosion Filter"). As direction, depth and phase belong
/// to cells, the gradient of a place needs no curvature of the ground, and is exact.
///
/// Where a height h is to be carved by d, h² / (h + d) is left, which is nearly h − d and above 0:
/// the lowest ground, on which water runs out, is not carved below 0.
#[derive(Debug)]
pub struct ErodedSurface<S> {
    base: S,
    generations: Vec<Generation>,
    /// Tells the cells of this ground from those of others in a thread's memory.
    number: u64,
}

/// The gullies of one size.
#[derive(Clone, Copy, Debug)]
struct Generation {
    key: Key,
    spacing_m: f64,
    depth_m: f64,
}

/// The stripes of one cell.
#[derive(Clone, Copy, Debug)]
struct Stripes {
    pivot_m: DVec2,
    /// The change of the phase with the place, 1/m: across the slope.
    wave: DVec2,
    phase: f64,
    depth_m: f64,
}

impl<S: Surface> ErodedSurface<S> {
    /// Carves gullies into a ground whose heights are nowhere below 0.
    ///
    /// # Errors
    /// If a parameter is out of its range.
    pub fn new(params: ErosionParams, key: Key, base: S) -> Result<Self, ParamError> {
        static NUMBER: AtomicU64 = AtomicU64::new(1);
        params.check()?;
        let generation = |i: u32| {
            let part = 1.0 / f64::from(1_u32 << i);
            Generation {
                key: key.domain(GULLIES).item(u64::from(i)),
                spacing_m: part * params.spacing_m,
                depth_m: libm::pow(SHALLOWER, f64::from(i)) * params.depth_m,
            }
        };
        Ok(Self {
            base,
            generations: (0..params.generations).map(generation).collect(),
            number: NUMBER.fetch_add(1, Ordering::Relaxed),
        })
    }

    /// The ground with the first `count` generations of gullies.
    fn after(&self, count: usize, world_m: DVec2) -> SurfaceSample {
        let base = self.base.sample(world_m);
        let (mut depth_m, mut slope) = (0.0, DVec2::ZERO);
        for number in 0..count {
            let (of_generation, gradient) = self.depth_m(number, world_m);
            depth_m += of_generation;
            slope += gradient;
        }
        let height_m = base.height_m;
        let sum = height_m + depth_m;
        if depth_m <= 0.0 || height_m <= 0.0 {
            return base;
        }
        let left = height_m / sum;
        SurfaceSample {
            height_m: height_m * left,
            gradient: (2.0 - left) * left * base.gradient - left * left * slope,
        }
    }

    /// How deep a generation carves at a place, and the gradient of that.
    fn depth_m(&self, number: usize, world_m: DVec2) -> (f64, DVec2) {
        let side_m = CELL * self.generations[number].spacing_m;
        let reach_m = REACH * side_m;
        let cell = (world_m / side_m).floor();
        let (mut weight, mut cosine, mut sine, mut depth_m) = (0.0, 0.0, 0.0, 0.0);
        let [mut weight_, mut cosine_, mut sine_, mut depth_] = [DVec2::ZERO; 4];
        for i in 0..9 {
            let at = cell + DVec2::new(f64::from(i % 3) - 1.0, f64::from(i / 3) - 1.0);
            let stripes = self.stripes(number, [at.x as i32, at.y as i32]);
            let off = world_m - stripes.pivot_m;
            let rest = 1.0 - off.length_squared() / (reach_m * reach_m);
            if rest <= 0.0 {
                continue;
            }
            let w = rest * rest * rest;
            let w_ = off * (-6.0 * rest * rest / (reach_m * reach_m));
            let (sin, cos) = libm::sincos(stripes.wave.dot(off) + stripes.phase);
            weight += w;
            weight_ += w_;
            cosine += w * cos;
            cosine_ += w_ * cos - stripes.wave * (w * sin);
            sine += w * sin;
            sine_ += w_ * sin + stripes.wave * (w * cos);
            depth_m += w * stripes.depth_m;
            depth_ += w_ * stripes.depth_m;
        }
        let faded = FADE * FADE * weight;
        let square = cosine * cosine + sine * sine + faded * weight;
        let length = libm::sqrt(square);
        let length_ = (cosine * cosine_ + sine * sine_ + faded * weight_) / length;
        let crest = cosine / length;
        let crest_ = (cosine_ - crest * length_) / length;
        // Narrow beds between broad ridges: the square of what runs from 0 on crests to 1 in beds.
        let bed = 0.5 * (1.0 - crest);
        let mean_m = depth_m / weight;
        let mean_ = (depth_ - mean_m * weight_) / weight;
        (mean_m * bed * bed, bed * (bed * mean_ - mean_m * crest_))
    }

    /// The stripes of a cell: from this thread's memory, or made.
    fn stripes(&self, number: usize, cell: [i32; 2]) -> Stripes {
        let [x, y] = cell;
        let tag = (self.number, number, cell);
        let mix = (x as u32).wrapping_mul(0x9E37_79B1) ^ (y as u32).wrapping_mul(0x85EB_CA77);
        let mix = mix ^ (number as u32 ^ (self.number as u32) << 3).wrapping_mul(0xC2B2_AE3D);
        let slot = ((mix ^ mix >> 15) as usize) % REMEMBERED;
        let known = CELLS.with_borrow(|cells| cells.get(slot).copied().flatten());
        if let Some((of, stripes)) = known
            && of == tag
        {
            return stripes;
        }
        let stripes = self.make_stripes(number, cell);
        CELLS.with_borrow_mut(|cells| {
            cells.resize(REMEMBERED, None);
            cells[slot] = Some((tag, stripes));
        });
        stripes
    }

    fn make_stripes(&self, number: usize, cell: [i32; 2]) -> Stripes {
        let Generation {
            key,
            spacing_m,
            depth_m,
        } = self.generations[number];
        let mut rng = key.chunk(cell).rng();
        let off = DVec2::new(rng.unit_f64(), rng.unit_f64()) - 0.5;
        let middle = DVec2::new(f64::from(cell[0]), f64::from(cell[1])) + 0.5;
        let pivot_m = (middle + 2.0 * JITTER * off) * (CELL * spacing_m);
        let phase = rng.range_f64(0.0, TAU);
        let deep_m = depth_m * rng.range_f64(SHALLOWEST, 1.0);
        let half_m = 0.5 * BASELINE * spacing_m;
        let along = |way: DVec2| {
            let height_m = |p| self.after(number, p).height_m;
            (height_m(pivot_m + way * half_m) - height_m(pivot_m - way * half_m)) / (2.0 * half_m)
        };
        let slope = DVec2::new(along(DVec2::X), along(DVec2::Y));
        let square = slope.length_squared();
        let down = slope.try_normalize().unwrap_or(DVec2::X);
        Stripes {
            pivot_m,
            wave: down.perp() * (TAU / spacing_m),
            phase,
            depth_m: deep_m * square / (square + ONSET * ONSET),
        }
    }
}

impl<S: Surface> Surface for ErodedSurface<S> {
    fn sample(&self, world_m: DVec2) -> SurfaceSample {
        self.after(self.generations.len(), world_m)
    }
}

/// Cells that a thread remembers.
const REMEMBERED: usize = 4096;

/// A cell: its ground, its generation, where it is.
type Tag = (u64, usize, [i32; 2]);

thread_local! {
    /// Cells by a hash of what they are. They are pure functions of that, so it does not matter
    /// which ones a thread remembers.
    static CELLS: RefCell<Vec<Option<(Tag, Stripes)>>> = const { RefCell::new(Vec::new()) };
}
