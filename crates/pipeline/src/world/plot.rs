//! Where the trees of a stem map stand, and where no others may.

use std::collections::BTreeMap;

use nemoral_import::{Stem, unread_columns};
use nemoral_scene::ChunkCoord;
use nemoral_scene::glam::DVec2;
use nemoral_stand::{StandLayer, convex_hull};

use crate::config::Site;
use crate::{Error, InputFiles};

/// The layer of the sites of measured trees, after those of the stand.
pub(crate) const PLOT_LAYER: u8 = StandLayer::ALL.len() as u8;

/// The foot of a tree is this much wider than its stem at breast height (our choice, as the flares
/// of our species are).
const FLARE: f64 = 1.5;

/// Side of the cells by which trees near a place are found, metres.
const CELL_M: f64 = 8.0;

/// The trees of a stem map on the map of the world.
#[derive(Debug)]
pub(crate) struct Plot {
    places: Vec<Place>,
    /// The trees of each chunk, in the file's order.
    by_chunk: BTreeMap<[i32; 2], Vec<usize>>,
    by_cell: BTreeMap<[i64; 2], Vec<usize>>,
    /// The convex hull of their feet, counterclockwise.
    hull: Vec<DVec2>,
    margin_m: f64,
    /// The largest radius of a tree, metres.
    reach_m: f64,
    /// What the user should know about the file.
    note: Option<String>,
}

/// The foot of a tree.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Place {
    pub(crate) position_m: DVec2,
    pub(crate) radius_m: f64,
}

impl Plot {
    /// The plot of a config; `None` without a stem map. Trees without a diameter, also those that
    /// are copies of models, are taken as wide as the mean one: the ground is there before they are
    /// drawn.
    pub(crate) fn new(
        site: &Site,
        inputs: &InputFiles,
        dbh_mean_m: f64,
        chunk_size_m: f64,
    ) -> Result<Option<Self>, Error> {
        let Some(stems) = site.stem_map(inputs)? else {
            return Ok(None);
        };
        let place = |stem: &Stem| Place {
            position_m: site.position_m(stem),
            radius_m: 0.5 * FLARE * stem.dbh_m.unwrap_or(dbh_mean_m),
        };
        let places: Vec<Place> = stems.iter().map(place).collect();
        let mut by_chunk: BTreeMap<_, Vec<usize>> = BTreeMap::new();
        let mut by_cell: BTreeMap<_, Vec<usize>> = BTreeMap::new();
        for (i, place) in places.iter().enumerate() {
            let chunk = ChunkCoord::containing(place.position_m, chunk_size_m);
            by_chunk.entry([chunk.x, chunk.y]).or_default().push(i);
            by_cell.entry(cell(place.position_m)).or_default().push(i);
        }
        Ok(Some(Self {
            hull: convex_hull(places.iter().map(|p| p.position_m).collect()),
            margin_m: site.stems.margin_m,
            reach_m: places.iter().map(|p| p.radius_m).fold(0.0, f64::max),
            places,
            by_chunk,
            by_cell,
            note: note(site, inputs),
        }))
    }

    /// What the user should know about the file: which columns are not read.
    pub(crate) fn note(&self) -> Option<&str> {
        self.note.as_deref()
    }

    /// The chunks with trees.
    pub(crate) fn chunks(&self) -> impl Iterator<Item = ChunkCoord> {
        self.by_chunk.keys().map(|&[x, y]| ChunkCoord::new(x, y))
    }

    /// The numbers of the trees of a chunk, from 0 in the file's order.
    pub(crate) fn in_chunk(&self, chunk: ChunkCoord) -> &[usize] {
        let trees = self.by_chunk.get(&[chunk.x, chunk.y]);
        trees.map_or(&[], Vec::as_slice)
    }

    /// A tree's foot.
    pub(crate) fn place(&self, tree: usize) -> Place {
        self.places[tree]
    }

    /// Whether a place is kept free of other trees.
    pub(crate) fn contains(&self, world_m: DVec2) -> bool {
        self.beyond_margin_m(world_m) <= 0.0
    }

    /// The distance to the area that is kept free of other trees, metres; negative in it.
    pub(crate) fn beyond_margin_m(&self, world_m: DVec2) -> f64 {
        self.distance_m(world_m) - self.margin_m
    }

    /// The distance to the area that the trees span, metres; 0 inside.
    pub(crate) fn distance_m(&self, world_m: DVec2) -> f64 {
        let edges = || (self.hull.iter()).zip(self.hull.iter().cycle().skip(1));
        let is_inside =
            self.hull.len() > 2 && edges().all(|(&a, &b)| (b - a).perp_dot(world_m - a) >= 0.0);
        if is_inside {
            return 0.0;
        }
        let to_edge = |(&a, &b): (&DVec2, &DVec2)| {
            let along = b - a;
            let t = (world_m - a).dot(along) / along.length_squared().max(1e-12);
            (world_m - a - along * t.clamp(0.0, 1.0)).length()
        };
        edges().map(to_edge).fold(f64::INFINITY, f64::min)
    }

    /// Whether a disk on the map keeps clear of the trees.
    pub(crate) fn is_clear(&self, world_m: DVec2, radius_m: f64) -> bool {
        let reach = DVec2::splat(radius_m + self.reach_m);
        let ([x0, y0], [x1, y1]) = (cell(world_m - reach), cell(world_m + reach));
        let cells = (x0..=x1).flat_map(|x| (y0..=y1).map(move |y| [x, y]));
        let mut near = cells.filter_map(|at| self.by_cell.get(&at)).flatten();
        near.all(|&tree| {
            let Place {
                position_m,
                radius_m: own,
            } = self.places[tree];
            position_m.distance(world_m) >= own + radius_m
        })
    }
}

fn note(site: &Site, inputs: &InputFiles) -> Option<String> {
    /// The most characters of names.
    const NAMES: usize = 120;
    let (unread, has_sizes) = unread_columns(inputs.get(&site.stems.path)?.bytes()).ok()?;
    let mut notes = Vec::new();
    if !has_sizes {
        notes.push("has no column of diameters or heights, which are drawn".to_owned());
    }
    if !unread.is_empty() {
        let all = unread.join(", ");
        let mut names: String = all
            .chars()
            .filter(|c| !c.is_control())
            .take(NAMES)
            .collect();
        if names.len() < all.len() {
            names.push('…');
        }
        notes.push(format!("has columns that are not read: {names}"));
    }
    (!notes.is_empty()).then(|| format!("the stem map {}", notes.join(", and ")))
}

fn cell(world_m: DVec2) -> [i64; 2] {
    let at = (world_m / CELL_M).floor();
    [at.x as i64, at.y as i64]
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;

    /// The plot of a stem map of trees with these feet.
    pub(crate) fn plot(feet: &[[f64; 2]], margin_m: f64) -> Plot {
        let mut table = "x,y,dbh_cm\n".to_owned();
        for [x, y] in feet {
            table += &format!("{},{},40\n", x + 500_000.0, y + 4_000_000.0);
        }
        let dir = tempfile::tempdir().expect("a folder");
        let path = dir.path().join("stems.csv");
        nemoral_files::write(&path, table.as_bytes()).expect("written");
        let mut config = crate::config::Config::default();
        config.site.origin_x_m = 500_000.0;
        config.site.origin_y_m = 4_000_000.0;
        config.site.stems.margin_m = margin_m;
        config.site.stems.path = path.to_str().expect("UTF-8").into();
        let inputs = InputFiles::read(&config).expect("it is there");
        let plot = Plot::new(&config.site, &inputs, 0.3, 50.0);
        plot.expect("a stem map").expect("there is one")
    }

    #[test]
    fn the_area_of_the_trees_is_kept_free() {
        let square = plot(
            &[
                [0.0, 0.0],
                [40.0, 0.0],
                [40.0, 40.0],
                [0.0, 40.0],
                [9.0, 9.0],
            ],
            3.0,
        );
        assert_eq!(square.hull.len(), 4);
        for (x, y, is_inside) in [
            (20.0, 20.0, true),
            (-2.9, 20.0, true),
            (-3.1, 20.0, false),
            (42.0, 42.0, true),
            (42.2, 42.2, false),
        ] {
            assert_eq!(square.contains(DVec2::new(x, y)), is_inside, "{x} {y}");
        }
        // One tree, and trees in a row, span areas too.
        let one = plot(&[[5.0, 5.0]], 3.0);
        assert!(one.contains(DVec2::new(5.0, 7.9)) && !one.contains(DVec2::new(5.0, 8.1)));
        let row = plot(&[[0.0, 0.0], [10.0, 0.0], [20.0, 0.0]], 1.0);
        assert!(row.contains(DVec2::new(15.0, 0.9)) && !row.contains(DVec2::new(15.0, 1.1)));
    }

    #[test]
    fn trees_belong_to_their_chunks_and_are_kept_clear_of() {
        let feet: Vec<[f64; 2]> = (0..400)
            .map(|i| [f64::from(i % 20) * 7.3, f64::from(i / 20) * 7.7])
            .collect();
        let plot = plot(&feet, 3.0);
        let mut seen = 0;
        for &[x, y] in plot.by_chunk.keys() {
            let chunk = ChunkCoord::new(x, y);
            for &tree in plot.in_chunk(chunk) {
                let at = plot.place(tree).position_m;
                assert_eq!(ChunkCoord::containing(at, 50.0), chunk);
                assert!((at - DVec2::from(feet[tree])).length() < 1e-9);
                seen += 1;
            }
        }
        assert_eq!(seen, 400);
        // The search by cells is that of all trees.
        for i in 0..2000 {
            let p = DVec2::new(f64::from(i % 50) * 2.9, f64::from(i / 50) * 3.7);
            let all = (0..400).all(|t| plot.place(t).position_m.distance(p) >= 0.3 + 1.0);
            assert_eq!(plot.is_clear(p, 1.0), all, "{p}");
        }
    }
}
