//! The objects of a chunk that have an id: sites are numbered, put on the ground, and varied.

use std::f64::consts::{PI, TAU};

use nemoral_scene::glam::{DVec2, DVec3, Mat3, Vec2};
use nemoral_scene::{ChunkCoord, Instance, InstancePlace, ObjectId, ObjectKind, Surface};
use nemoral_seed::{Domain, Draw, Key};

use crate::{Error, InstanceVariation, LyingPose, Variation, grown_scale, sapling_scale};

/// The domain of the draws by which objects of the same asset differ.
pub const OBJECT_VARIATION: Domain = Domain::new("pipeline.look");

/// How far a plant that faces the light may be turned from it, radians.
const FACING_RAD: f64 = 0.5;

/// One rock, tree, stump, shrub, stone, log or root plate.
#[derive(Clone, Debug)]
pub struct SceneObject {
    /// Its true id.
    pub object: ObjectId,
    /// What it is.
    pub kind: ObjectKind,
    /// World position of its foot.
    pub position_m: DVec3,
    /// The radius that it occupies at the ground, metres; of a log, half its length.
    pub radius_m: f64,
    /// Half of its greatest width across its axis, if it lies, else its radius, metres.
    pub half_width_m: f64,
    /// Index into the library's assets of its kind.
    pub asset: usize,
    /// Size relative to the asset; of what is longer or shorter in proportion, its size across.
    pub scale: f64,
    /// The size of a tree that was measured in the field; `None` for everything else.
    pub measured: Option<MeasuredSize>,
    /// Chunk axes from the asset's axes.
    pub linear: Mat3,
    /// A number in 0..1 that varies its colour.
    pub variation: f32,
    /// Whether it lies on a trail, as stones do.
    pub on_trail: bool,
}

impl SceneObject {
    /// Where its shape is placed in the object's chunk.
    #[must_use]
    pub fn place(&self, chunk: ChunkCoord, chunk_size_m: f64) -> InstancePlace {
        let local = self.position_m - chunk.origin_m(chunk_size_m).extend(0.0);
        InstancePlace {
            position_m: local.as_vec3(),
            linear: self.linear,
            object: self.object,
            variation: self.variation,
        }
    }
}

/// The objects of a chunk, in order of their ids.
#[derive(Clone, Debug, Default)]
pub struct SceneObjects(pub Vec<SceneObject>);

impl SceneObjects {
    /// Numbers the sites of a chunk in their order and puts them on its ground.
    ///
    /// # Errors
    /// If there are more than 65,535 sites, or the chunk is beyond ±2,097,151.
    pub fn place_on_ground(
        chunk: ChunkCoord,
        sites: &[ObjectSite],
        ground: &(impl Surface + ?Sized),
        variation: &InstanceVariation,
    ) -> Result<Self, Error> {
        let objects = sites.iter().enumerate().map(|(i, site)| {
            let object = u16::try_from(i + 1)
                .ok()
                .and_then(|item| ObjectId::new(chunk, item))
                .ok_or(Error::NoObjectId {
                    objects: sites.len(),
                    chunk,
                })?;
            Ok(site.place_on_ground(object, ground, variation))
        });
        objects.collect::<Result<_, _>>().map(Self)
    }
}

/// An object on the map, before it is put on the ground.
#[derive(Clone, Debug, PartialEq)]
pub struct ObjectSite {
    /// What it is.
    pub kind: ObjectKind,
    /// World position, metres.
    pub position_m: DVec2,
    /// The radius that it occupies at the ground, metres: of what is [grown](ObjectSize::Grown) and
    /// of [saplings](ObjectSize::Sapling) that of the asset, between two scales that of the largest
    /// copy, else its own.
    pub radius_m: f64,
    /// Index into the library's assets of its kind.
    pub asset: usize,
    /// What decides its size.
    pub size: ObjectSize,
    /// Its own key.
    pub key: Key,
    /// Whether it lies on a trail.
    pub on_trail: bool,
    /// The direction on the map that its asset's x-axis points to, radians from the world's, give
    /// or take half a radian; `None` for any. Only what stands has one.
    pub facing_rad: Option<f64>,
    /// Its pose, if it lies as a stem does; nothing else has one.
    pub lying: Option<LyingPlacement>,
}

/// The pose of what lies.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LyingPlacement {
    /// Where and how it lies.
    pub pose: LyingPose,
    /// Its size along its axis, and across, relative to its asset.
    pub scale: [f64; 2],
    /// Half of its greatest width across its axis, metres.
    pub half_width_m: f64,
}

/// What decides an object's size relative to its asset.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ObjectSize {
    /// The scale is known.
    Given(f64),
    /// It varies a little, by [`grown_scale`].
    Grown,
    /// It varies much, by [`sapling_scale`].
    Sapling,
    /// It varies evenly between two scales.
    Between([f64; 2]),
    /// It was measured.
    Measured(MeasuredSize),
}

/// The size of a tree that was measured in the field, and its asset's that is nearest.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MeasuredSize {
    /// Its number in the stem map, from 0.
    pub number: u32,
    /// Diameter at breast height, metres.
    pub dbh_m: f64,
    /// Height, metres.
    pub height_m: f64,
    /// Size across relative to the asset.
    pub across: f64,
    /// Height relative to the asset.
    pub along: f64,
}

impl ObjectSize {
    /// The scale by its place among all sizes, 0..1.
    fn scale(self, place: f64) -> f64 {
        match self {
            Self::Given(scale) => scale,
            Self::Grown => grown_scale(place),
            Self::Sapling => sapling_scale(place),
            Self::Between([low, high]) => low + (high - low) * place,
            Self::Measured(size) => size.across,
        }
    }

    /// A copy's radius relative to that of its site, by the copy's scale.
    fn share_of_radius(self, scale: f64) -> f64 {
        match self {
            Self::Given(_) | Self::Measured(_) => 1.0,
            Self::Grown | Self::Sapling => scale,
            // The site has room for the largest copy.
            Self::Between([_, largest]) => scale / largest,
        }
    }
}

impl ObjectSite {
    fn place_on_ground(
        &self,
        object: ObjectId,
        ground: &(impl Surface + ?Sized),
        variations: &InstanceVariation,
    ) -> SceneObject {
        if let Some(lying) = &self.lying {
            return self.lay(object, lying);
        }
        let mut rng = self.key.domain(OBJECT_VARIATION).rng();
        let look = match self.kind {
            ObjectKind::Tree => {
                let pattern = match self.size {
                    ObjectSize::Sapling => &variations.saplings,
                    _ => &variations.trees,
                };
                pattern.at(self.position_m, &mut rng)
            }
            _ => Variation {
                yaw_rad: rng.range_f64(0.0, TAU),
                size: rng.unit_f64(),
            },
        };
        // The pattern's turn decides how it deviates, so that copies near each other still differ.
        let yaw_rad = self.facing_rad.map_or(look.yaw_rad, |facing_rad| {
            facing_rad + FACING_RAD * (look.yaw_rad / PI - 1.0)
        });
        let variation = rng.unit_f32();
        let scale = self.size.scale(look.size);
        let sample = ground.sample(self.position_m);
        // Trees stand upright on a slope, as their root flare reaches into the ground; everything
        // else follows the slope.
        let gradient = match self.kind {
            ObjectKind::Tree | ObjectKind::Stump => Vec2::ZERO,
            _ => sample.gradient.as_vec2(),
        };
        let mut linear = Instance::upright(yaw_rad as f32, scale as f32, gradient);
        let measured = match self.size {
            ObjectSize::Measured(size) => Some(size),
            _ => None,
        };
        if let Some(size) = measured {
            linear.z_axis *= (size.along / size.across) as f32;
        }
        let radius_m = self.radius_m * self.size.share_of_radius(scale);
        SceneObject {
            object,
            kind: self.kind,
            position_m: self.position_m.extend(sample.height_m),
            radius_m,
            half_width_m: radius_m,
            asset: self.asset,
            scale,
            measured,
            linear,
            variation,
            on_trail: self.on_trail,
        }
    }

    fn lay(&self, object: ObjectId, lying: &LyingPlacement) -> SceneObject {
        let mut rng = self.key.domain(OBJECT_VARIATION).rng();
        // One of two mirror images, so that fewer look alike.
        let mirror = if rng.chance(0.5) { 1.0 } else { -1.0 };
        let [along, across] = lying.scale;
        let scale = DVec3::new(along, across * mirror, across).as_vec3();
        SceneObject {
            object,
            kind: self.kind,
            position_m: lying.pose.position_m,
            radius_m: self.radius_m,
            half_width_m: lying.half_width_m,
            asset: self.asset,
            scale: across,
            measured: None,
            linear: lying.pose.rotation * Mat3::from_diagonal(scale),
            variation: rng.unit_f32(),
            on_trail: self.on_trail,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nemoral_scene::FlatSurface;

    fn site(kind: ObjectKind, item: u64) -> ObjectSite {
        ObjectSite {
            kind,
            position_m: DVec2::new(3.0 * item as f64, 7.0),
            radius_m: 0.2,
            asset: 0,
            size: ObjectSize::Grown,
            key: Key::world(7).item(item),
            on_trail: false,
            facing_rad: None,
            lying: None,
        }
    }

    #[test]
    fn objects_are_numbered_and_stand_on_the_ground() {
        let slope = FlatSurface {
            height_m: 5.0,
            gradient: DVec2::new(0.2, 0.0),
        };
        let chunk = ChunkCoord::new(0, 0);
        let kinds = [ObjectKind::Tree, ObjectKind::Shrub];
        let sites: Vec<ObjectSite> = kinds
            .into_iter()
            .zip(1..)
            .map(|(k, i)| site(k, i))
            .collect();
        let variation = InstanceVariation::new(Key::world(7));
        let objects = SceneObjects::place_on_ground(chunk, &sites, &slope, &variation)
            .expect("ids")
            .0;
        assert_eq!(
            objects[1].object,
            ObjectId::new(chunk, 2).expect("in range")
        );
        assert!((objects[1].position_m.z - (5.0 + 0.2 * 6.0)).abs() < 1e-12);
        // A tree stands upright; a shrub is sheared along the slope.
        assert_eq!(objects[0].linear.x_axis.z, 0.0);
        assert!(objects[1].linear.x_axis.z != 0.0 && objects[1].linear.z_axis.x == 0.0);
    }

    #[test]
    fn a_measured_tree_is_as_wide_and_as_high_as_it_was_measured() {
        let size = MeasuredSize {
            number: 0,
            dbh_m: 0.3,
            height_m: 21.0,
            across: 1.2,
            along: 0.9,
        };
        let tree = ObjectSite {
            size: ObjectSize::Measured(size),
            ..site(ObjectKind::Tree, 1)
        };
        let variation = InstanceVariation::new(Key::world(7));
        let chunk = ChunkCoord::new(0, 0);
        let objects =
            SceneObjects::place_on_ground(chunk, &[tree], &FlatSurface::default(), &variation);
        let tree = &objects.expect("ids").0[0];
        assert_eq!((tree.measured, tree.scale), (Some(size), 1.2));
        let [x, y, z] = [tree.linear.x_axis, tree.linear.y_axis, tree.linear.z_axis];
        assert!((x.length() - 1.2).abs() < 1e-6 && (y.length() - 1.2).abs() < 1e-6);
        assert!((z - nemoral_scene::glam::Vec3::Z * 0.9).length() < 1e-6);
    }

    #[test]
    fn sizes_between_two_are_all_there() {
        let variation = InstanceVariation::new(Key::world(7));
        let site = |i| ObjectSite {
            size: ObjectSize::Between([0.5, 3.0]),
            ..site(ObjectKind::Rock, i)
        };
        let sites: Vec<_> = (0..400).map(site).collect();
        let chunk = ChunkCoord::new(0, 0);
        let objects =
            SceneObjects::place_on_ground(chunk, &sites, &FlatSurface::default(), &variation);
        let scales: Vec<f64> = objects.expect("ids").0.iter().map(|o| o.scale).collect();
        assert!(scales.iter().all(|s| (0.5..=3.0).contains(s)));
        assert!(scales.iter().any(|s| *s < 0.6) && scales.iter().any(|s| *s > 2.9));
    }

    /// All sites have a radius of 0.2 m.
    #[test]
    fn a_copy_is_as_wide_as_its_scale_makes_it() {
        let variation = InstanceVariation::new(Key::world(7));
        let measured = MeasuredSize {
            number: 0,
            dbh_m: 0.3,
            height_m: 21.0,
            across: 1.2,
            along: 0.9,
        };
        for (size, radius_of_scale_1_m) in [
            (ObjectSize::Grown, Some(0.2)),
            (ObjectSize::Sapling, Some(0.2)),
            (ObjectSize::Between([0.5, 2.0]), Some(0.1)),
            (ObjectSize::Given(0.4), None),
            (ObjectSize::Measured(measured), None),
        ] {
            let site = |i| ObjectSite {
                size,
                ..site(ObjectKind::Tree, i)
            };
            let sites: Vec<_> = (0..50).map(site).collect();
            let chunk = ChunkCoord::new(0, 0);
            let objects =
                SceneObjects::place_on_ground(chunk, &sites, &FlatSurface::default(), &variation);
            for object in objects.expect("ids").0 {
                let radius_m = radius_of_scale_1_m.map_or(0.2, |radius_m| radius_m * object.scale);
                assert!((object.radius_m - radius_m).abs() < 1e-12, "{object:?}");
            }
        }
    }

    #[test]
    fn there_are_ids_for_65_535_objects() {
        let variation = InstanceVariation::new(Key::world(7));
        let stand = |n: usize| {
            let sites = vec![site(ObjectKind::Rock, 1); n];
            let chunk = ChunkCoord::new(0, 0);
            SceneObjects::place_on_ground(chunk, &sites, &FlatSurface::default(), &variation)
        };
        assert_eq!(stand(65_535).expect("ids").0.len(), 65_535);
        let error = stand(65_536).expect_err("too many").to_string();
        assert!(error.starts_with("65536 objects"), "{error}");
    }
}
