//! Places rocks, then the woody layers in their order.

use std::sync::Arc;

use glam::DVec2;
use nemoral_scene::ChunkCoord;
use nemoral_seed::{Domain, Draw, Key};

use super::calibrate::calibrate;
use super::calibrated_layer::{CalibratedLayer, LayerPatches};
use super::gap_part::GapPart;
use super::open_land::OpenLand;
use super::params::PlacementParams;
use super::patches::Clusters;
use super::site::{Site, SiteFilter};
use crate::error::PlacementError;
use crate::sampler::quadtree::{QuadTree, is_free};
use crate::sampler::square::snap;

const ROCKS: Domain = Domain::new("placement.rocks");
const LAYERS: Domain = Domain::new("placement.layers");
const GAPS: Domain = Domain::new("placement.gaps");
const IN_GAPS: Domain = Domain::new("placement.in_gaps");

/// How many places are tried for a rock before the chunk gets one less.
const ROCK_TRIES: u64 = 500;

/// Places rocks and woody plants on an endless plane of square chunks.
///
/// A value is a pure function of its parameters and key: ask it for any chunk, in any order, from
/// any thread.
#[derive(Clone, Debug)]
pub struct Placement {
    params: PlacementParams,
    key: Key,
    /// The parts of the layers, in the order in which they are placed.
    parts: Vec<CalibratedLayer>,
    open_land: Option<Arc<dyn OpenLand>>,
    /// The greatest distance, in chunk edges, at which a site of one layer excludes one of another
    /// layer.
    reach: f64,
}

impl Placement {
    /// Checks the parameters and finds the share of each layer's sample to keep for its target.
    ///
    /// # Errors
    /// A [`PlacementError`] for a value out of range, or for a target for which the radii leave no
    /// room.
    pub fn new(params: PlacementParams, key: Key) -> Result<Self, PlacementError> {
        params.check()?;
        let parts = calibrate(&params)?;
        let largest = parts.iter().map(|p| p.max_radius).fold(0.0, f64::max);
        Ok(Self {
            reach: 2.0 * params.factor() * largest,
            params,
            key,
            parts,
            open_land: None,
        })
    }

    /// The same placement where woods end at open land, by each layer's
    /// [profile](crate::LayerParams::at_edges).
    #[must_use]
    pub fn with_open_land(self, open_land: Arc<dyn OpenLand>) -> Self {
        Self {
            open_land: Some(open_land),
            ..self
        }
    }

    /// The parameters that it was made from.
    #[must_use]
    pub fn params(&self) -> &PlacementParams {
        &self.params
    }

    /// The phase group of a chunk: rocks of a chunk see those of neighbours in lower phases.
    #[must_use]
    pub fn phase(coord: ChunkCoord) -> u8 {
        (coord.x & 1) as u8 + 2 * (coord.y & 1) as u8
    }

    /// Those of the 8 neighbours whose rocks [`rocks`](Self::rocks) must see; none for phase 0.
    #[must_use]
    pub fn lower_phase_neighbours(coord: ChunkCoord) -> Vec<ChunkCoord> {
        let offsets = (-1..=1).flat_map(|dy| (-1..=1).map(move |dx| (dx, dy)));
        offsets
            .map(|(dx, dy)| coord.offset(dx, dy))
            .filter(|c| Self::phase(*c) < Self::phase(coord))
            .collect()
    }

    /// The rocks of a chunk: a uniform number of them, anywhere (paper, section IV-D), but none
    /// in another.
    ///
    /// `neighbours` are the rocks of the [`lower_phase_neighbours`](Self::lower_phase_neighbours),
    /// in any order. There are fewer than asked for only if 500 tries found no place for one.
    #[must_use]
    pub fn rocks(
        &self,
        coord: ChunkCoord,
        allowed: &dyn SiteFilter,
        neighbours: &[&[Site]],
    ) -> Vec<Site> {
        let rocks = &self.params.rocks;
        if rocks.max_per_chunk == 0 {
            return Vec::new();
        }
        let factor = self.params.rock_factor();
        let mut index = QuadTree::new(DVec2::splat(-1.0), 3.0);
        for site in neighbours.iter().copied().flatten() {
            index.insert(
                self.local(coord, site),
                self.in_chunks(factor * site.radius_m),
            );
        }
        let weights: Vec<f64> = rocks.varieties.iter().map(|v| v.weight).collect();
        let chunk = self.key.domain(ROCKS).chunk(coord);
        let number = chunk
            .rng()
            .between(rocks.min_per_chunk, rocks.max_per_chunk);
        let mut sites = Vec::new();
        for i in 0..u64::from(number) {
            let key = chunk.item(i);
            let mut rng = key.rng();
            let variety = rng.weighted(&weights).unwrap_or(0);
            let (low, high) = rocks.varieties[variety].radius_m;
            let radius_m = rng.range_f64(low, high);
            let radius = self.in_chunks(factor * radius_m);
            for _ in 0..ROCK_TRIES {
                let p = snap(DVec2::new(rng.unit_f64(), rng.unit_f64()));
                let position_m = self.world_m(coord, p);
                if p.max_element() < 1.0
                    && is_free(&index, p, radius)
                    && allowed.allows(position_m, radius_m)
                {
                    index.insert(p, radius);
                    sites.push(Site {
                        position_m,
                        radius_m,
                        layer: 0,
                        variety: variety as u16,
                        key,
                    });
                    break;
                }
            }
        }
        sites
    }

    /// The woody sites of a chunk, by layer, then by key.
    ///
    /// `rocks` are those of this chunk and of its 8 neighbours, in any order. Woody sites of other
    /// chunks are not needed, as those near the border are computed here exactly.
    #[must_use]
    pub fn woody(&self, coord: ChunkCoord, allowed: &dyn SiteFilter, rocks: &[Site]) -> Vec<Site> {
        let rock_factor = self.params.rock_factor();
        let mut rock_index = QuadTree::new(DVec2::splat(-1.0), 3.0);
        for rock in rocks {
            let radius = self.in_chunks(rock_factor * rock.radius_m);
            rock_index.insert(self.local(coord, rock), radius);
        }
        let factor = self.params.factor();
        let mut standing = QuadTree::new(DVec2::splat(-self.reach), 1.0 + 2.0 * self.reach);
        let minds = self.parts.iter().any(CalibratedLayer::minds_gaps);
        let gaps = self.params.gaps.filter(|_| minds).map(|gaps| {
            let window = 0.5 + self.reach * self.parts.len() as f64;
            gaps.around(
                self.key.domain(GAPS),
                coord,
                self.params.chunk_size_m,
                window,
            )
        });
        let mut sites = Vec::new();
        for (place, part) in self.parts.iter().enumerate() {
            // Later parts give way to this one and to each other, so each of them adds one reach.
            let need = 0.5 + self.reach * (self.parts.len() - 1 - place) as f64;
            let layer_key = self.layer_key(part.number);
            let clusters = part.clusters(layer_key, coord, need);
            let patches = LayerPatches {
                gaps: gaps.as_ref(),
                clusters: clusters.as_ref(),
            };
            let key = match part.part {
                GapPart::Inside => layer_key.domain(IN_GAPS),
                GapPart::Both | GapPart::Outside => layer_key,
            };
            let mut points = part.points_around(key, coord, need, &patches);
            let at_edge = |p: DVec2| match &self.open_land {
                Some(land) => part.at_edge(|| land.depth_m(self.world_m(coord, p))),
                None => 1.0,
            };
            points.retain(|p| {
                part.keeps(p, &patches, at_edge(p.p)) && is_free(&standing, p.p, factor * p.radius)
            });
            for p in &points {
                standing.insert(p.p, factor * p.radius);
            }
            // Chunks are half-open, so that a point on a shared border belongs to one chunk.
            points.retain(|p| p.p.min_element() >= 0.0 && p.p.max_element() < 1.0);
            for point in points {
                let site = Site {
                    position_m: self.world_m(coord, point.p),
                    radius_m: point.radius * self.params.chunk_size_m,
                    layer: part.number as u8,
                    variety: point.variety,
                    key: point.key,
                };
                // Points that a rock or the exclusion forbids are left out, and no others take
                // their places, so that the pattern beside a trail is the same as everywhere.
                if is_free(&rock_index, point.p, rock_factor * point.radius)
                    && allowed.allows(site.position_m, site.radius_m)
                {
                    sites.push(site);
                }
            }
        }
        sites.sort_unstable_by_key(|site| (site.layer, site.key));
        sites
    }

    /// The clusters of a layer in a chunk, if it has any. They also place plants that are too small
    /// to be sites of the layer, and exist for empty layers, too.
    #[must_use]
    pub fn clusters(&self, coord: ChunkCoord, layer: usize) -> Option<Clusters> {
        let patches = self.params.layers.get(layer)?.clusters?;
        let (size_m, key) = (self.params.chunk_size_m, self.layer_key(layer));
        Some(Clusters {
            map: patches.around(key, coord, size_m, 0.5),
            origin_m: coord.origin_m(size_m),
            chunk_size_m: size_m,
        })
    }

    fn layer_key(&self, layer: usize) -> Key {
        self.key.domain(LAYERS).item(layer as u64)
    }

    fn in_chunks(&self, metres: f64) -> f64 {
        metres / self.params.chunk_size_m
    }

    fn world_m(&self, coord: ChunkCoord, p: DVec2) -> DVec2 {
        // Chunk coordinates of 32 bits and 30 binary places would need 62 bits. Far from the origin
        // the last places of a position are rounded off, here and nowhere else.
        (DVec2::new(f64::from(coord.x), f64::from(coord.y)) + p) * self.params.chunk_size_m
    }

    fn local(&self, coord: ChunkCoord, site: &Site) -> DVec2 {
        (site.position_m - coord.origin_m(self.params.chunk_size_m)) / self.params.chunk_size_m
    }
}
