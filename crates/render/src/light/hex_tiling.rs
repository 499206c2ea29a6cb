//! Ground that does not repeat.
//!
//! The texture is laid out anew around each vertex of a triangular lattice, shifted and turned by
//! the vertex's hash, and blended between the three nearest (Mikkelsen 2022, "Practical real-time
//! hex-tiling"), with the variance restored that blending loses (Deliot and Heitz 2019, "Procedural
//! stochastic textures by tiling and blending"). Lattice and tint have a period of 1024 m, like
//! ground coordinates, so they have no seam.
//!
//! The texture is seen from above, which stretches it along the fall of steep slopes; there it is
//! blended into the texture as seen from the sides (Geiss 2007, "Generating complex procedural
//! terrains using the GPU").

use glam::{Vec2, Vec3};
use nemoral_scene::{Hit, MaterialId, MaterialLibrary, Texture};

/// The period of ground coordinates, metres.
const PERIOD_M: f32 = 1024.0;

/// Distance of lattice vertices over the side of the texture's tile: near 1 whole copies are
/// visible, near 0 only their blend.
const SPACING: f32 = 0.6;

/// The vertical component of the normal of slopes from which on the texture is not only seen from
/// above, 37 degrees, and that from which on it is only seen from the sides, 53 degrees. Halfway
/// either view stretches by 1.4.
const STEEP: [f32; 2] = [0.8, 0.6];

/// A place of the ground.
#[derive(Clone, Copy, Debug)]
struct Place {
    /// Ground coordinates and height, metres.
    at_m: Vec3,
    normal: Vec3,
}

impl Place {
    /// Coordinates as seen along x, along y, and from above, each with its share.
    fn views(&self) -> [(Vec2, f32); 3] {
        let Vec3 { x, y, z } = self.at_m;
        let n = self.normal * self.normal;
        let t = ((STEEP[0] - n.z.sqrt()) / (STEEP[0] - STEEP[1])).clamp(0.0, 1.0);
        let steep = t * t * (3.0 - 2.0 * t);
        let (nx, ny) = (n.x * n.x, n.y * n.y);
        let along_x = steep * nx / (nx + ny).max(f32::MIN_POSITIVE);
        let seen = [along_x, steep - along_x, 1.0 - steep];
        [
            (Vec2::new(y, z), seen[0]),
            (Vec2::new(x, z), seen[1]),
            (Vec2::new(x, y), seen[2]),
        ]
    }
}

/// The albedo and the roughness of the ground at a hit at a height, from the materials that meet
/// there.
pub(crate) fn look(
    materials: &MaterialLibrary,
    hit: &Hit,
    height_m: f32,
    footprint_m: f32,
) -> (Vec3, f32) {
    let place = Place {
        at_m: hit.shading.uv.extend(height_m),
        normal: hit.shading.normal,
    };
    let of = |id: MaterialId| {
        let m = materials.get(id);
        let albedo = of_texture(&m.albedo, place, m.tile_m, footprint_m);
        (albedo, m.roughness)
    };
    let Some(mixture) = hit.shading.mixture else {
        return of(hit.surface.material);
    };
    // Higher materials lie on lower ones, whichever triangle of a border is seen.
    let ([low, middle, high], [of_low, of_middle, of_high]) = (mixture.materials, mixture.shares);
    let at_m = hit.shading.uv;
    let below = || {
        let share = if of_middle > 0.0 {
            ragged(of_middle / (of_low + of_middle), at_m)
        } else {
            0.0
        };
        over(|| of(low), || of(middle), share)
    };
    over(below, || of(high), ragged(of_high, at_m))
}

/// A look with a share of another one over it. What is not seen is not looked at.
fn over(
    below: impl FnOnce() -> (Vec3, f32),
    above: impl FnOnce() -> (Vec3, f32),
    share: f32,
) -> (Vec3, f32) {
    if share <= 0.0 {
        below()
    } else if share >= 1.0 {
        above()
    } else {
        let ((low, low_rough), (high, high_rough)) = (below(), above());
        let rough = low_rough + share * (high_rough - low_rough);
        (low.lerp(high, share), rough)
    }
}

/// The visible share of a blend. Needles and crumbs of one ground lie on the other, in patches as
/// wide as a hand and as a finger. On average 0, 1/2 and 1 do not change, and 0 and 1 change
/// nowhere.
fn ragged(share: f32, at_m: Vec2) -> f32 {
    let noise = 0.6 * value_noise(at_m, 8192, 4) + 0.4 * value_noise(at_m, 32768, 5);
    let lifted = share + 2.0 * share * (1.0 - share) * noise;
    let t = (2.5 * (lifted - 0.5) + 0.5).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

/// The albedo of a ground texture whose tile is `tile_m` wide at a place, for a sample that covers
/// `footprint_m`.
fn of_texture(texture: &Texture, place: Place, tile_m: f32, footprint_m: f32) -> Vec3 {
    let base = if footprint_m > tile_m {
        texture.mean()
    } else {
        from_all_sides(texture, place, tile_m, footprint_m)
    };
    base * macro_tint(place.at_m.truncate())
}

fn from_all_sides(texture: &Texture, place: Place, tile_m: f32, footprint_m: f32) -> Vec3 {
    let views = place.views();
    let [.., (from_above, share)] = views;
    if share >= 1.0 {
        return laid_anew(texture, from_above, tile_m, footprint_m);
    }
    let mean = texture.mean();
    let (mut sum, mut squares) = (Vec3::ZERO, 0.0);
    for (at_m, share) in views.into_iter().filter(|v| v.1 > 0.0) {
        sum += (laid_anew(texture, at_m, tile_m, footprint_m) - mean) * share;
        squares += share * share;
    }
    (mean + sum / squares.sqrt()).clamp(Vec3::ZERO, Vec3::ONE)
}

fn laid_anew(texture: &Texture, at_m: Vec2, tile_m: f32, footprint_m: f32) -> Vec3 {
    // The number of vertices is whole in each direction, so triangles are equilateral up to
    // rounding.
    let columns = (PERIOD_M / (SPACING * tile_m)).round().max(2.0);
    let half_rows = (PERIOD_M / (SPACING * tile_m * 1.732)).round().max(1.0);
    let step = Vec2::new(PERIOD_M / columns, PERIOD_M / (2.0 * half_rows));
    let y = at_m.y / step.y;
    let x = at_m.x / step.x - 0.5 * y;
    let (ix, iy) = (x.floor(), y.floor());
    let (fx, fy) = (x - ix, y - iy);
    let upper = fx + fy >= 1.0;
    let corner = if upper {
        (1.0, 1.0, fx + fy - 1.0)
    } else {
        (0.0, 0.0, 1.0 - fx - fy)
    };
    let (right, top) = if upper {
        (1.0 - fy, 1.0 - fx)
    } else {
        (fx, fy)
    };
    let vertices = [corner, (1.0, 0.0, right), (0.0, 1.0, top)];

    // Sharpened weights leave two thirds of the ground to a single copy.
    let sharp = vertices.map(|(_, _, w): (f32, f32, f32)| (w * w) * (w * w));
    let total: f32 = sharp.iter().sum();
    let mean = texture.mean();
    let (mut sum, mut squares, mut kept) = (Vec3::ZERO, 0.0, 0.0);
    for ((dx, dy, _), w) in vertices.into_iter().zip(sharp) {
        let w = w / total;
        if w < 0.02 {
            continue;
        }
        let (vx, vy) = (ix + dx, iy + dy);
        let hash = hash(
            (2.0 * vx + vy).rem_euclid(2.0 * columns) as u32,
            vy.rem_euclid(2.0 * half_rows) as u32,
        );
        let from_vertex = at_m - Vec2::new((vx + 0.5 * vy) * step.x, vy * step.y);
        let uv = turn(hash).rotate(from_vertex / tile_m)
            + Vec2::new((hash & 0xFFF) as f32, (hash >> 12 & 0xFFF) as f32) / 4096.0;
        sum += (texture.sample(uv, footprint_m / tile_m) - mean) * w;
        squares += w * w;
        kept += w;
    }
    // The few percent that are dropped go to the others.
    let deviation = sum / kept;
    (mean + deviation * (kept / squares.sqrt())).clamp(Vec3::ZERO, Vec3::ONE)
}

/// A unit vector (cosine, sine) from a hash's upper bits.
fn turn(hash: u32) -> Vec2 {
    // The rational circle: no trigonometry.
    let t = (hash >> 24 & 0x7F) as f32 / 64.0 - 1.0;
    let c = Vec2::new(1.0 - t * t, 2.0 * t) / (1.0 + t * t);
    if hash >> 31 == 1 { -c } else { c }
}

/// Slow changes of brightness (±15 %) and warmth (±5 %) over 4..16 m, for dry and damp, worn and
/// fresh ground.
fn macro_tint(at_m: Vec2) -> Vec3 {
    let slow = value_noise(at_m, 64, 1);
    let middle = value_noise(at_m, 128, 2);
    let fast = value_noise(at_m, 256, 3);
    let light = 1.0 + 0.15 * (0.5 * slow + 0.3 * middle + 0.2 * fast);
    let warm = 0.05 * middle;
    Vec3::new(1.0 + warm, 1.0, 1.0 - warm) * light
}

/// Periodic value noise in −1..1 with `cells` cells in a period.
fn value_noise(at_m: Vec2, cells: u32, salt: u32) -> f32 {
    let p = at_m * (cells as f32 / PERIOD_M);
    let (ix, iy) = (floor(p.x), floor(p.y));
    let f = p - Vec2::new(ix as f32, iy as f32);
    let f = f * f * (Vec2::splat(3.0) - 2.0 * f);
    let at = |dx: i32, dy: i32| {
        let (x, y) = (
            (ix + dx) as u32 & (cells - 1),
            (iy + dy) as u32 & (cells - 1),
        );
        (hash(x | salt << 16, y) >> 8) as f32 * (2.0 / (1_u32 << 24) as f32) - 1.0
    };
    let low = at(0, 0) + (at(1, 0) - at(0, 0)) * f.x;
    let high = at(0, 1) + (at(1, 1) - at(0, 1)) * f.x;
    low + (high - low) * f.y
}

/// `f32::floor` is a function call on processors without SSE 4.1.
fn floor(x: f32) -> i32 {
    let i = x as i32;
    i - i32::from(x < i as f32)
}

/// A pair of integers, mixed (the finaliser of MurmurHash3).
fn hash(x: u32, y: u32) -> u32 {
    let mut h = x.wrapping_mul(0x9E37_79B1) ^ y.wrapping_mul(0x85EB_CA77).rotate_left(15);
    h = (h ^ h >> 16).wrapping_mul(0x85EB_CA6B);
    h = (h ^ h >> 13).wrapping_mul(0xC2B2_AE35);
    h ^ h >> 16
}

#[cfg(test)]
mod tests {
    use super::*;
    use nemoral_scene::{GroundMixture, Material, Semantic, Shading};
    use proptest::prelude::*;

    /// A place of level ground.
    fn level(at_m: Vec2) -> Place {
        Place {
            at_m: at_m.extend(3.0),
            normal: Vec3::Z,
        }
    }

    /// One bright spot in a dark tile.
    fn spot() -> Texture {
        let data: Vec<Vec3> = (0..64 * 64)
            .map(|i| {
                let (x, y) = (i % 64, i / 64);
                Vec3::splat(if (x - 20_i32).pow(2) + (y - 33_i32).pow(2) < 150 {
                    0.6
                } else {
                    0.1
                })
            })
            .collect();
        Texture::from_linear(64, 64, &data).expect("size")
    }

    proptest! {
        #[test]
        fn there_is_no_seam_at_1024_m(
            x in 0.0_f32..1024.0,
            y in 0.0_f32..1024.0,
            tile in 0.5_f32..8.0,
        ) {
            let t = spot();
            // A multiple of 1/64 m survives the shift exactly.
            let p = (Vec2::new(x, y) * 64.0).round() / 64.0;
            let here = of_texture(&t, level(p), tile, 0.0);
            for shift in [Vec2::X, Vec2::Y, Vec2::ONE] {
                let there = of_texture(&t, level(p + 1024.0 * shift), tile, 0.0);
                prop_assert!((here - there).length() < 0.02, "{here} {there}");
            }
        }

        #[test]
        fn it_is_continuous(x in 1.0_f32..1000.0, y in 1.0_f32..1000.0) {
            // A smooth texture, so that only lattice edges could jump.
            let data: Vec<Vec3> = (0..64)
                .map(|i| Vec3::splat(0.3 + 0.2 * (i as f32 * std::f32::consts::TAU / 64.0).sin()))
                .collect();
            let t = Texture::from_linear(64, 1, &data).expect("size");
            let (a, b) = (
                of_texture(&t, level(Vec2::new(x, y)), 4.0, 0.0),
                of_texture(&t, level(Vec2::new(x + 0.002, y)), 4.0, 0.0),
            );
            prop_assert!((a - b).length() < 0.03, "{a} {b}");
        }
    }

    proptest! {
        #[test]
        fn a_border_is_ragged_and_no_line(
            x in 0.0_f32..1024.0,
            y in 0.0_f32..1024.0,
            share in 0.0_f32..1.0,
        ) {
            let at = Vec2::new(x, y);
            prop_assert_eq!([ragged(0.0, at), ragged(1.0, at)], [0.0, 1.0]);
            let more = ragged((share + 0.05).min(1.0), at);
            prop_assert!(
                (0.0..=1.0).contains(&more) && more >= ragged(share, at),
                "more is not less"
            );

            // Two grounds seen from both of their sides.
            let mut materials = MaterialLibrary::new();
            let mut add = |value: f32| {
                let plain =
                    Material::plain(&format!("{value}"), Semantic::Soil, Vec3::splat(value));
                materials.add(Material {
                    ground: true,
                    tile_m: 1.0,
                    roughness: value,
                    ..plain
                })
            };
            let (dark, light) = (add(0.1), add(0.5));
            let third = add(0.9);
            let colour = |material, shares: Option<[f32; 3]>| {
                let mut hit = Hit::new(1.0, Vec3::Z, material);
                hit.shading = Shading {
                    mixture: shares.map(|shares| GroundMixture {
                        materials: [dark, light, third],
                        shares,
                    }),
                    uv: at,
                    ..hit.shading
                };
                let (albedo, roughness) = look(&materials, &hit, 0.0, 0.0);
                albedo.extend(roughness)
            };
            // Whichever ground a triangle is of.
            let two = Some([1.0 - share, share, 0.0]);
            prop_assert_eq!(colour(dark, two), colour(light, two));
            for (alone, material) in [dark, light, third].into_iter().enumerate() {
                let mut shares = [0.0; 3];
                shares[alone] = 1.0;
                prop_assert_eq!(colour(dark, Some(shares)), colour(material, None));
            }
            // A third one begins from nothing.
            let three = |little: f32| {
                let rest = 1.0 - little;
                colour(dark, Some([rest * (1.0 - share), rest * share, little]))
            };
            prop_assert!(three(1e-4).distance(colour(dark, two)) < 1e-2);
        }
    }

    #[test]
    fn half_and_half_on_the_line() {
        let n = 200_i32;
        let at = |i: i32| Vec2::new((i % n) as f32, (i / n) as f32) * 0.037;
        let seen: Vec<f32> = (0..n * n).map(|i| ragged(0.5, at(i))).collect();
        let mean = seen.iter().sum::<f32>() / seen.len() as f32;
        assert!((mean - 0.5).abs() < 0.02, "{mean}");
        // It forms patches, so in a half of the area it is almost unblended.
        let clear = seen.iter().filter(|&&s| !(0.2..=0.8).contains(&s)).count();
        assert!(clear > seen.len() / 3, "{clear} of {}", seen.len());
    }

    #[test]
    fn steep_slopes_are_not_stretched() {
        let t = spot();
        // The mean change of colour over 5 cm along the fall of a slope.
        let change = |slope_deg: f32, azimuth_deg: f32| {
            let (sin, cos) = slope_deg.to_radians().sin_cos();
            let level = Vec2::from_angle(azimuth_deg.to_radians());
            let down = (level * cos).extend(-sin);
            let normal = (level * sin).extend(cos);
            let across = Vec2::new(-level.y, level.x).extend(0.0);
            let colour = |i: i32, step: f32| {
                let start = across * (i % 40) as f32 * 0.31 + down * (i / 40) as f32 * 0.37;
                let at_m = Vec3::splat(50.0) + start + down * step;
                from_all_sides(&t, Place { at_m, normal }, 2.0, 0.0).x
            };
            let n = 1600;
            (0..n)
                .map(|i| (colour(i, 0.05) - colour(i, 0.0)).abs())
                .sum::<f32>()
                / n as f32
        };
        let level = change(0.0, 0.0);
        for azimuth in [0.0, 20.0, 45.0, 90.0, 200.0] {
            for slope in [30.0, 45.0, 55.0, 65.0, 80.0, 90.0] {
                let ratio = change(slope, azimuth) / level;
                assert!(
                    (0.65..1.35).contains(&ratio),
                    "{ratio} at {slope} and {azimuth}"
                );
            }
        }
        // It is the same as before on all but steep slopes.
        let at_m = Vec3::new(3.0, 7.0, 11.0);
        let place = Place {
            at_m,
            normal: Vec3::new(0.6, 0.0, 0.8),
        };
        let flat = laid_anew(&t, Vec2::new(3.0, 7.0), 2.0, 0.0);
        assert_eq!(from_all_sides(&t, place, 2.0, 0.0), flat);
    }

    #[test]
    fn the_repetition_is_gone_and_the_contrast_is_kept() {
        let t = spot();
        let n = 120_i32;
        let plain = |i: i32, j: i32| t.sample(Vec2::new(i as f32, j as f32) / 16.0, 0.0).x;
        let ours = |i: i32, j: i32| laid_anew(&t, Vec2::new(i as f32, j as f32) / 8.0, 2.0, 0.0).x;
        // Autocorrelation at one tile (16 samples), and the variance.
        let statistics = |f: &dyn Fn(i32, i32) -> f32| {
            let samples: Vec<(f32, f32)> = (0..n * n)
                .map(|k| (f(k % n, k / n), f(k % n + 16, k / n)))
                .collect();
            let mean = samples.iter().map(|s| s.0).sum::<f32>() / samples.len() as f32;
            let variance =
                samples.iter().map(|s| (s.0 - mean).powi(2)).sum::<f32>() / samples.len() as f32;
            let covariance = samples
                .iter()
                .map(|s| (s.0 - mean) * (s.1 - mean))
                .sum::<f32>()
                / samples.len() as f32;
            (covariance / variance, variance)
        };
        let (tiled, variance) = statistics(&plain);
        let (hidden, kept) = statistics(&ours);
        assert!(tiled > 0.99, "{tiled}");
        assert!(hidden.abs() < 0.15, "{hidden}");
        assert!((kept / variance - 1.0).abs() < 0.25, "{kept} of {variance}");
    }

    #[test]
    fn a_plain_texture_keeps_its_colour_on_average() {
        let colour = Vec3::new(0.2, 0.15, 0.1);
        let t = Texture::plain(colour);
        let n = 4096;
        let mean = (0..n)
            .map(|i| {
                of_texture(
                    &t,
                    level(Vec2::new((i % 64) as f32, (i / 64) as f32) * 16.0),
                    4.0,
                    0.0,
                )
            })
            .sum::<Vec3>()
            / n as f32;
        assert!((mean / t.mean() - Vec3::ONE).length() < 0.03, "{mean}");
    }

    #[test]
    fn value_stability() {
        let a = of_texture(&spot(), level(Vec2::new(123.25, 456.5)), 2.0, 0.001);
        assert_eq!(format!("{a:.6}"), VALUE);
    }
    const VALUE: &str = "[0.072263, 0.073857, 0.075450]";
}
