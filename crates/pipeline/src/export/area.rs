//! A rectangle of the world.

use std::sync::Arc;

use nemoral_export::{ExportScene, clipped, is_ground};
use nemoral_scene::glam::{DVec2, Vec3};
use nemoral_scene::{ChunkCoord, Instance, MaterialLibrary, Prototype};
use nemoral_water::SURFACE_REACH_M;

use crate::chunks::chunks_of;
use crate::config::Site;
use crate::plan::Runner;
use crate::world::water::{is_water, water_instance};
use crate::{Error, InputFiles, Recorder};

/// How far from the world's origin a region may be, metres.
const FARTHEST_M: f64 = 1e7;

/// A rectangle with area.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Rectangle {
    pub(crate) low_m: DVec2,
    pub(crate) high_m: DVec2,
}

impl Rectangle {
    pub(crate) fn new(low_m: DVec2, high_m: DVec2) -> Result<Self, Error> {
        let numbers = [low_m.x, low_m.y, high_m.x, high_m.y];
        let is_near = numbers.iter().all(|n| n.abs() <= FARTHEST_M);
        if !is_near || low_m.cmpge(high_m).any() {
            let [w, s, e, n] = numbers;
            return Err(Error::request(format!(
                "region = {w},{s},{e},{n}: must be X0,Y0,X1,Y1 in metres with X0 < X1 and Y0 < Y1, \
                 within 1e7 m of the world's origin"
            )));
        }
        Ok(Self { low_m, high_m })
    }

    /// The rectangle that reaches so much farther at all sides.
    pub(crate) fn grown(&self, by_m: f64) -> Result<Self, Error> {
        Self::new(self.low_m - by_m, self.high_m + by_m)
    }

    /// The chunks that it touches, in order, if an export may have so many.
    pub(crate) fn chunks(&self, size_m: f64) -> Result<Vec<ChunkCoord>, Error> {
        let Self { low_m, high_m } = *self;
        chunks_of((low_m, high_m), size_m, ("region", Recorder::EXPORT_CHUNKS))
    }

    pub(crate) fn middle_m(&self) -> DVec2 {
        (self.low_m + self.high_m) / 2.0
    }
}

/// Nearer than this a site's origin tells no coordinates apart, metres.
const LEAST_ORIGIN_M: f64 = 1000.0;

impl Recorder {
    /// A rectangle of the world, with area. One that is meant in the coordinates of a site's files
    /// is refused: it does not touch the site, and without the site's origin it does.
    pub(crate) fn rectangle(&self, low_m: DVec2, high_m: DVec2) -> Result<Rectangle, Error> {
        let rectangle = Rectangle::new(low_m, high_m)?;
        let sequence = self.sequence();
        let site = &sequence.config.site;
        let origin_m = DVec2::new(site.origin_x_m, site.origin_y_m);
        if origin_m.length() < LEAST_ORIGIN_M {
            return Ok(rectangle);
        }
        let Some([south_west_m, north_east_m]) = extent_m(site, &sequence.inputs)? else {
            return Ok(rectangle);
        };
        let touches = |low_m: DVec2, high_m: DVec2| {
            low_m.cmple(north_east_m).all() && high_m.cmpge(south_west_m).all()
        };
        if touches(low_m, high_m) || !touches(low_m - origin_m, high_m - origin_m) {
            return Ok(rectangle);
        }
        let text = |corners: [DVec2; 2]| {
            let numbers = corners.iter().flat_map(|corner| corner.to_array());
            numbers.map(|m| m.to_string()).collect::<Vec<_>>().join(",")
        };
        Err(Error::request(format!(
            "region = {}: must be in world coordinates, which are the site's without its origin, \
             {origin_m} m: that would be {}",
            text([low_m, high_m]),
            text([low_m - origin_m, high_m - origin_m])
        )))
    }

    /// Everything in a rectangle, which touches these chunks. What stands or lies is in it where
    /// its foot is; ground and water are cut at its borders.
    pub(super) fn region(
        &self,
        runner: &Runner<'_>,
        rectangle: Rectangle,
        chunks: &[ChunkCoord],
    ) -> Result<ExportScene, Error> {
        let size_m = self.sequence().config.chunks.size_m;
        let Rectangle { low_m, high_m } = rectangle;
        let middle_m = rectangle.middle_m();
        let assets = runner.get(self.forest().assets, ())?;
        let materials = &assets.library.materials;
        let offset_m = |origin_m: DVec2| (origin_m - middle_m).as_vec2().extend(0.0);
        let cut = |surface: &Instance, origin_m: DVec2| {
            let part = Rectangle {
                low_m: low_m - origin_m,
                high_m: high_m - origin_m,
            };
            cut_surface(surface, part, offset_m(origin_m), materials)
        };
        let mut instances = Vec::new();
        for &chunk in chunks {
            let origin_m = chunk.origin_m(size_m);
            let objects = runner.get(self.forest().object_geometry, chunk)?;
            let low_plants = runner.get(self.forest().undergrowth_geometry, chunk)?;
            let litter = runner.get(self.forest().litter_geometry, chunk)?;
            let groups = std::iter::once(&objects.group)
                .chain(&low_plants.0)
                .chain(&litter.0);
            for (instance, _) in groups.flat_map(|group| group.instances()) {
                let shape = &instance.prototype;
                let foot_m = origin_m + instance.position_m.truncate().as_dvec2();
                if is_ground(shape, materials) || is_water(shape, materials) {
                    instances.extend(cut(instance, origin_m)?);
                } else if foot_m.cmpge(low_m).all() && foot_m.cmple(high_m).all() {
                    instances.push(Instance {
                        position_m: instance.position_m + offset_m(origin_m),
                        ..instance.clone()
                    });
                }
            }
        }
        for (origin_m, waters) in self.waters_of_neighbours(runner, rectangle, chunks)? {
            instances.extend(cut(&waters, origin_m)?);
        }
        let name = format!("region {},{},{},{}", low_m.x, low_m.y, high_m.x, high_m.y);
        self.scene_of(runner, chunks, (name, middle_m.extend(0.0), instances))
    }

    /// The waters that may reach into a rectangle from chunks that it does not touch, as a pond's
    /// surface is all of the chunk of its middle, and a stream's of the one where it begins; each
    /// with the corner of its chunk.
    fn waters_of_neighbours(
        &self,
        runner: &Runner<'_>,
        Rectangle { low_m, high_m }: Rectangle,
        touched: &[ChunkCoord],
    ) -> Result<Vec<(DVec2, Instance)>, Error> {
        let assets = runner.get(self.forest().assets, ())?;
        let Some(materials) = &assets.water else {
            return Ok(Vec::new());
        };
        let ground_model = runner.get(self.forest().ground_model, ())?;
        let size_m = self.sequence().config.chunks.size_m;
        let first = ChunkCoord::containing(low_m - SURFACE_REACH_M, size_m);
        let last = ChunkCoord::containing(high_m + SURFACE_REACH_M, size_m);
        let mut waters = Vec::new();
        for x in first.x..=last.x {
            for y in first.y..=last.y {
                let chunk = ChunkCoord::new(x, y);
                let is_neighbour = !touched.contains(&chunk);
                if is_neighbour && ground_model.waters_reach(chunk, (low_m, high_m)) {
                    let ground = runner.get(self.forest().ground, chunk)?;
                    let water = water_instance(&ground, materials, &assets.library)?;
                    waters.extend(water.map(|water| (chunk.origin_m(size_m), water)));
                }
            }
        }
        Ok(waters)
    }
}

/// The south-west and the north-east corner of all that a site's files have, in the world, metres;
/// `None` without files.
fn extent_m(site: &Site, inputs: &InputFiles) -> Result<Option<[DVec2; 2]>, Error> {
    let mut places_m: Vec<DVec2> = (site.trail_lines_m(inputs)?.into_iter().flatten()).collect();
    let stems = site.stem_map(inputs)?.into_iter().flatten();
    places_m.extend(stems.map(|stem| site.position_m(&stem)));
    if let Some(map) = site.height_map(inputs)? {
        let origin_m = DVec2::new(site.origin_x_m, site.origin_y_m);
        let corners = [(0, map.rows - 1), (map.columns - 1, 0)];
        let place = |(column, row)| DVec2::from(map.post_m(column, row)) - origin_m;
        places_m.extend(corners.map(place));
    }
    let corners = |[low, high]: [DVec2; 2], place: &DVec2| [low.min(*place), high.max(*place)];
    let first = places_m.first().copied();
    Ok(first.map(|first| places_m.iter().fold([first; 2], corners)))
}

/// The part of a chunk's ground or water in a rectangle, which is relative to the chunk's corner;
/// nothing if they only touch.
fn cut_surface(
    surface: &Instance,
    Rectangle { low_m, high_m }: Rectangle,
    offset_m: Vec3,
    materials: &MaterialLibrary,
) -> Result<Option<Instance>, Error> {
    let mesh = clipped(surface.prototype.mesh(), low_m.as_vec2(), high_m.as_vec2());
    if mesh.triangles.is_empty() {
        return Ok(None);
    }
    let shape = Prototype::new(surface.prototype.name(), mesh, Vec::new(), materials)
        .map_err(Error::of_stage)?;
    Ok(Some(Instance {
        prototype: Arc::new(shape),
        position_m: surface.position_m + offset_m,
        ..surface.clone()
    }))
}
