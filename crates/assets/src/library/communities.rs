//! Grows tiles of vegetation that closes over the ground.

use nemoral_scene::PlantCommunity;
use nemoral_seed::Domain;

use super::PlantAsset;
use super::plants::PlantGrower;
use crate::ambient_occlusion::OcclusionParams;
use crate::plant::{sward, thicket};

/// Variants of a tile.
const VARIANTS: u32 = 8;
/// Radii of tiles of grass, metres: in the open, and along borders.
const SWARD_M: [f32; 2] = [1.0, 0.42];

/// Tiles of a community, whose variants follow each other: of grass from yellow-green to
/// blue-grey, of thickets from low to high.
#[derive(Clone, Debug, Default)]
pub struct CommunityTiles {
    /// Tiles that leave no gaps if they are some 1.25 m apart.
    pub wide: Vec<PlantAsset>,
    /// Tiles that leave no gaps if they are 0.55 m apart, for borders; of grass alone.
    pub narrow: Vec<PlantAsset>,
}

impl PlantGrower<'_> {
    /// The tiles of each community, if they were asked for.
    pub(super) fn communities(&self) -> [CommunityTiles; PlantCommunity::ALL.len()] {
        PlantCommunity::ALL.map(|community| {
            if self.params.communities.contains(&community) {
                self.tiles(community)
            } else {
                CommunityTiles::default()
            }
        })
    }

    fn tiles(&self, of: PlantCommunity) -> CommunityTiles {
        let domain = Domain::new(&format!("assets.{}", of.name()));
        if of.is_grass() {
            let [wide, narrow] = [0, 1].map(|size| {
                self.collect(domain, VARIANTS, &|i, key| {
                    let variant = i as f32 / (VARIANTS - 1) as f32;
                    let mut rng = key.item(size as u64).rng();
                    let of_grass = &self.materials.communities;
                    let tile = sward::tile(of, SWARD_M[size], variant, of_grass, &mut rng);
                    self.patch(of.name(), i, tile)
                })
            });
            return CommunityTiles { wide, narrow };
        }
        let wide = self.collect(domain, VARIANTS, &|i, key| {
            let rank = i as f32 / (VARIANTS - 1) as f32;
            let mut rng = key.rng();
            let rng = &mut rng;
            let (all, own) = (self.materials, &self.materials.communities);
            let height = |low: f32, high: f32| low + (high - low) * rank;
            let (shape, occlusion) = match of {
                PlantCommunity::Bramble => {
                    let shape = thicket::bramble(height(0.6, 1.5), all, rng);
                    (shape, OcclusionParams::SHRUB)
                }
                PlantCommunity::Bracken => {
                    let mut shape = thicket::bracken(height(0.7, 1.4), all, rng);
                    shape.flatten(all.frond_height);
                    (shape, OcclusionParams::LOW)
                }
                PlantCommunity::Heath => {
                    let shape = thicket::heath(height(0.28, 0.65), all, rng);
                    (shape, OcclusionParams::SHRUB)
                }
                PlantCommunity::Bilberry => {
                    let shape = thicket::bilberry(height(0.16, 0.34), own, rng);
                    (shape, OcclusionParams::LOW)
                }
                PlantCommunity::Nettles => {
                    let shape = thicket::nettles(height(0.6, 1.25), own, rng);
                    (shape, OcclusionParams::LOW)
                }
                PlantCommunity::Reeds => {
                    let shape = thicket::reeds(height(1.2, 2.3), own, rng);
                    (shape, OcclusionParams::LOW)
                }
                _ => unreachable!("grass grows above"),
            };
            let radius_m = shape.reach_m();
            self.leafy(of.name(), i, shape, radius_m, &occlusion)
        });
        CommunityTiles {
            wide,
            narrow: Vec::new(),
        }
    }
}
