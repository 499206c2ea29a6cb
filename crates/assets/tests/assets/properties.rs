//! What must hold for every library, tested through its public interface.

use std::sync::LazyLock;

use nemoral_assets::{
    AssetParams, Library, PlantAsset, PlantKind, Species, StandParams, StandSpecies,
};
use nemoral_scene::glam::Vec3;
use nemoral_scene::{Material, Prototype, Semantic};
use nemoral_seed::Key;
use proptest::prelude::*;

const KEY: Key = Key::world(7);

fn params() -> AssetParams {
    AssetParams {
        individuals_per_species: 1,
        ..AssetParams::default()
    }
}

/// One library for all tests: it takes seconds to grow.
static LIBRARY: LazyLock<Library> = LazyLock::new(|| Library::grow(&params(), KEY).expect("valid"));

fn luminance(c: Vec3) -> f32 {
    c.dot(Vec3::new(0.2126, 0.7152, 0.0722))
}

/// Linear colours of a material's texture, row by row.
fn texels(m: &Material) -> Vec<Vec3> {
    let (w, h) = (m.albedo.width(), m.albedo.height());
    (0..w * h)
        .map(|i| {
            let uv = Vec3::new(
                ((i % w) as f32 + 0.5) / w as f32,
                ((i / w) as f32 + 0.5) / h as f32,
                0.0,
            );
            m.albedo.sample(uv.truncate(), 0.0)
        })
        .collect()
}

fn materials() -> &'static [Material] {
    LIBRARY.materials.materials()
}

fn named(name: &str) -> &'static Material {
    let found = materials().iter().find(|m| m.name == name);
    found.unwrap_or_else(|| panic!("no material {name}"))
}

/// Renderers refuse others.
#[test]
fn materials_have_numbers_in_their_ranges() {
    for m in materials() {
        let mut shares = m.transmittance.to_array().to_vec();
        shares.push(m.roughness);
        let sound = shares.iter().all(|share| (0.0..=1.0).contains(share));
        assert!(sound && m.tile_m > 0.0 && m.tile_m.is_finite(), "{m:?}");
    }
}

fn semantics(p: &Prototype) -> Vec<Semantic> {
    let triangles = p.mesh().triangles.iter().map(|t| t.material);
    let mut all: Vec<_> = triangles
        .chain(p.cards().iter().map(|c| c.material))
        .map(|m| LIBRARY.materials.get(m).semantic)
        .collect();
    all.sort();
    all.dedup();
    all
}

fn all_plants() -> impl Iterator<Item = &'static PlantAsset> {
    LIBRARY.plants.iter().flatten()
}

/// A seam is where neighbours across the border differ more than neighbours inside.
#[test]
fn textures_tile_without_a_seam() {
    let tiles = materials()
        .iter()
        .filter(|m| m.mask.is_none() && !m.name.contains("stump_face"));
    for m in tiles {
        let (w, h) = (m.albedo.width(), m.albedo.height());
        let bytes = m.albedo.srgb();
        let difference = |a: usize, b: usize| {
            (0..3)
                .map(|k| f64::from(bytes[a][k].abs_diff(bytes[b][k])))
                .sum::<f64>()
        };
        let columns: Vec<f64> = (0..w)
            .map(|x| {
                (0..h)
                    .map(|y| difference(y * w + x, y * w + (x + 1) % w))
                    .sum::<f64>()
                    / h as f64
            })
            .collect();
        let rows: Vec<f64> = (0..h)
            .map(|y| {
                (0..w)
                    .map(|x| difference(y * w + x, (y + 1) % h * w + x))
                    .sum::<f64>()
                    / w as f64
            })
            .collect();
        // The transition between two barks does not repeat upwards: it begins as one bark and ends
        // as the other.
        let changes = m.name.ends_with(".change");
        for lines in [columns, rows].into_iter().take(2 - usize::from(changes)) {
            let (border, inside) = lines.split_last().expect("not empty");
            let mean = inside.iter().sum::<f64>() / inside.len() as f64;
            let spread = (inside.iter().map(|d| (d - mean).powi(2)).sum::<f64>()
                / inside.len() as f64)
                .sqrt();
            // A step in the middle of a line with the same statistics is within a few standard
            // deviations.
            assert!(
                *border < mean + 5.0 * spread + 0.5 && *border > 0.1 * mean,
                "{}: {border:.2} at the border, {mean:.2} +- {spread:.2} inside",
                m.name
            );
        }
    }
}

/// The mean of a mixture lies between its parts.
#[test]
#[ignore = "half a minute: .ci/full runs it"]
fn albedos_are_those_of_the_literature() {
    let ranges: [(&str, [f32; 3], [f32; 3]); 21] = [
        ("maritime_pine.stem", [0.08, 0.06, 0.04], [0.16, 0.11, 0.08]),
        (
            "eucalyptus.stem.upper",
            [0.25, 0.20, 0.13],
            [0.45, 0.40, 0.32],
        ),
        ("english_oak.stem", [0.09, 0.075, 0.055], [0.18, 0.15, 0.12]),
        (
            "ground.leaf_litter",
            [0.10, 0.065, 0.04],
            [0.17, 0.11, 0.075],
        ),
        (
            "ground.needle_litter",
            [0.12, 0.07, 0.04],
            [0.20, 0.12, 0.075],
        ),
        ("ground.moss", [0.04, 0.05, 0.02], [0.10, 0.10, 0.05]),
        ("ground.cut_slope", [0.10, 0.075, 0.05], [0.25, 0.19, 0.14]),
        (
            "trail.gravel.surface",
            [0.16, 0.15, 0.12],
            [0.30, 0.28, 0.26],
        ),
        (
            "trail.dry_earth.surface",
            [0.18, 0.13, 0.09],
            [0.30, 0.23, 0.17],
        ),
        (
            "trail.mud.surface",
            [0.05, 0.04, 0.03],
            [0.08, 0.065, 0.055],
        ),
        (
            "trail.grassy.surface",
            [0.05, 0.085, 0.025],
            [0.11, 0.15, 0.055],
        ),
        (
            "trail.leaf_litter.surface",
            [0.09, 0.06, 0.035],
            [0.17, 0.11, 0.075],
        ),
        (
            "trail.needles.surface",
            [0.11, 0.07, 0.04],
            [0.20, 0.12, 0.075],
        ),
        ("trail.sand.surface", [0.25, 0.20, 0.13], [0.42, 0.36, 0.28]),
        ("trail.rock.surface", [0.18, 0.17, 0.14], [0.35, 0.35, 0.35]),
        ("rock", [0.16, 0.16, 0.12], [0.35, 0.35, 0.35]),
        // These are shoots, which reflect six tenths of what their needles do.
        (
            "maritime_pine.foliage.0",
            [0.04, 0.074, 0.011],
            [0.08, 0.12, 0.033],
        ),
        (
            "eucalyptus.foliage.0",
            [0.045, 0.08, 0.025],
            [0.10, 0.14, 0.08],
        ),
        (
            "english_oak.foliage.0",
            [0.045, 0.08, 0.02],
            [0.09, 0.13, 0.05],
        ),
        ("bracken.pinna.0", [0.06, 0.10, 0.02], [0.11, 0.16, 0.05]),
        // Grass under trees: from the value of a beech's shade leaves to that of a herb.
        ("grass.blades.0", [0.05, 0.09, 0.02], [0.14, 0.17, 0.06]),
    ];
    for (name, low, high) in ranges {
        let m = named(name);
        let colours = texels(m);
        let keep = |i: usize| {
            m.mask
                .as_ref()
                .is_none_or(|k| k.texel(i % k.width(), i / k.width()))
        };
        let opaque: Vec<Vec3> = (0..colours.len())
            .filter(|&i| keep(i))
            .map(|i| colours[i])
            .collect();
        let mean = opaque.iter().sum::<Vec3>() / opaque.len() as f32;
        let inside = mean.cmpge(Vec3::from(low)).all() && mean.cmple(Vec3::from(high)).all();
        assert!(inside, "{name}: {mean:.3}, expected {low:?}..{high:?}");
    }
}

#[test]
fn no_surface_sends_on_more_light_than_it_gets() {
    for m in materials() {
        let brightest = texels(m).into_iter().fold(Vec3::ZERO, Vec3::max);
        assert!(
            (brightest + m.transmittance).max_element() <= 1.0,
            "{}: {brightest}",
            m.name
        );
        for band in [m.optics.nm905, m.optics.nm1550] {
            assert!(
                band.reflectance > 0.05 && band.transmittance >= 0.0,
                "{}",
                m.name
            );
            assert!(band.reflectance + band.transmittance <= 1.0, "{}", m.name);
        }
    }
    // On this difference the separation of wood and leaves is based.
    let (bark, leaf) = (
        named("english_oak.stem").optics,
        named("english_oak.foliage.0").optics,
    );
    assert!(leaf.nm905.reflectance >= bark.nm905.reflectance);
    assert!(bark.nm1550.reflectance > leaf.nm1550.reflectance);
}

#[test]
fn masks_are_small_attached_and_half_open() {
    let mut cards = 0;
    for m in materials() {
        let Some(mask) = &m.mask else { continue };
        cards += 1;
        assert!(mask.width() <= 256 && mask.height() <= 256, "{}", m.name);
        let texture = (m.albedo.width(), m.albedo.height());
        assert_eq!(
            (mask.width(), mask.height()),
            texture,
            "{}: one texel, one bit",
            m.name
        );
        assert!(mask.is_opaque(0.5, 0.0), "{} hangs in the air", m.name);
        // A single leaf fills its card; a twig does not.
        let high = if m.name.starts_with("fallen") {
            0.80
        } else {
            0.58
        };
        let share = mask.opaque_fraction();
        // The last slice of a frond is its tip, on a card as wide as the frond.
        let low = if m.name.contains("frond") { 0.10 } else { 0.15 };
        assert!(
            (low..high).contains(&share),
            "{}: {share:.2} opaque",
            m.name
        );
        // The image is cropped, so that paint reaches the top.
        let top = mask.height() - 4;
        let painted = (0..mask.width())
            .flat_map(|c| (top..mask.height()).map(move |r| (c, r)))
            .any(|(c, r)| mask.texel(c, r));
        assert!(painted, "{}: empty top", m.name);
    }
    assert!(cards >= 40, "{cards}");
}

/// An oracle for halos: the colours that filtering mixes in from beyond the edge are as bright as
/// the edge itself.
#[test]
#[ignore = "half a minute: .ci/full runs it"]
fn colours_go_on_under_the_mask() {
    for m in materials() {
        let Some(mask) = &m.mask else { continue };
        let colours = texels(m);
        let (w, h) = (mask.width(), mask.height());
        let (mut edge, mut beyond) = (0.0, 0.0);
        for y in 0..h {
            for x in 1..w {
                let (a, b) = (y * w + x - 1, y * w + x);
                if mask.texel(x - 1, y) != mask.texel(x, y) {
                    let (inner, outer) = if mask.texel(x, y) { (b, a) } else { (a, b) };
                    edge += luminance(colours[inner]);
                    beyond += luminance(colours[outer]);
                }
            }
        }
        let ratio = beyond / edge;
        assert!((0.85..1.18).contains(&ratio), "{}: {ratio:.2}", m.name);
        let darkest = colours
            .iter()
            .map(|c| luminance(*c))
            .fold(f32::MAX, f32::min);
        assert!(darkest > 0.004, "{}: {darkest}", m.name);
    }
}

#[test]
fn every_kind_has_its_semantics_and_its_variants() {
    let l = &*LIBRARY;
    let only = |kind: PlantKind, wanted: &[Semantic]| {
        for p in &l.plants[kind] {
            for s in semantics(&p.prototype) {
                assert!(wanted.contains(&s), "{}: {s:?}", p.prototype.name());
            }
        }
    };
    only(PlantKind::Grass, &[Semantic::Grass]);
    only(PlantKind::Herbs, &[Semantic::Herb]);
    only(PlantKind::Ferns, &[Semantic::Fern]);
    only(PlantKind::Litter, &[Semantic::FallenTwig]);
    only(PlantKind::TrailTuft, &[Semantic::Grass, Semantic::Herb]);
    only(PlantKind::StripMat, &[Semantic::Grass, Semantic::Herb]);
    only(PlantKind::TrailStone, &[Semantic::Stone]);
    only(PlantKind::Rock, &[Semantic::Rock]);
    only(PlantKind::Stump, &[Semantic::Stump]);
    only(PlantKind::Shrub, &[Semantic::Shrub, Semantic::Bramble]);
    for p in &l.plants[PlantKind::Shrub] {
        let want = if p.name == "bramble" {
            Semantic::Bramble
        } else {
            Semantic::Shrub
        };
        assert_eq!(semantics(&p.prototype), [want], "{}", p.name);
    }
    for kind in [
        PlantKind::Grass,
        PlantKind::Herbs,
        PlantKind::Litter,
        PlantKind::TrailTuft,
        PlantKind::StripMat,
        PlantKind::TrailStone,
    ] {
        assert!(l.plants[kind].len() >= 16, "{kind:?}");
    }
    for kind in ["bracken", "male_fern"] {
        let ferns = l.plants[PlantKind::Ferns].iter();
        assert!(ferns.filter(|p| p.name == kind).count() >= 16);
    }
    let count = |kind: PlantKind| l.plants[kind].len();
    assert!(count(PlantKind::Shrub) >= 6);
    assert!(count(PlantKind::Rock) >= 8 && count(PlantKind::Stump) >= 6);
    let mut names: Vec<_> = all_plants()
        .map(|p| p.prototype.name().to_owned())
        .collect();
    names.sort();
    let count = names.len();
    names.dedup();
    assert_eq!(names.len(), count, "two prototypes share a name");
}

#[test]
fn things_stand_in_the_ground_and_keep_their_radius() {
    let l = &*LIBRARY;
    for p in all_plants() {
        let b = p.prototype.bounds();
        assert!((f64::from(b.max.z) - p.height_m).abs() < 1e-6);
        assert!(p.radius_m > 0.02, "{}", p.name);
        let lies = p.name == "litter";
        assert!(
            lies || b.min.z < -0.009,
            "{} floats: {}",
            p.prototype.name(),
            b.min.z
        );
    }
    let patches = [
        PlantKind::Grass,
        PlantKind::Herbs,
        PlantKind::Ferns,
        PlantKind::Litter,
    ];
    for p in patches.into_iter().flat_map(|kind| &l.plants[kind]) {
        assert!(
            (0.2..1.8).contains(&p.radius_m),
            "{}: {}",
            p.prototype.name(),
            p.radius_m
        );
        assert!(p.height_m < 1.8, "{}: {}", p.name, p.height_m);
        let cards = p.prototype.cards().len();
        assert!(
            (30..=400).contains(&cards),
            "{}: {cards} cards",
            p.prototype.name()
        );
        let triangles = p.prototype.mesh().triangles.len();
        assert!(
            triangles <= 3000,
            "{}: {triangles} triangles",
            p.prototype.name()
        );
    }
    let stones = [PlantKind::Rock, PlantKind::TrailStone].into_iter();
    for p in stones.flat_map(|kind| &l.plants[kind]) {
        let b = p.prototype.bounds();
        let sunk = -b.min.z / (b.max.z - b.min.z);
        assert!(
            (0.24..0.62).contains(&sunk),
            "{}: {sunk}",
            p.prototype.name()
        );
    }
    for p in &l.plants[PlantKind::Stump] {
        // Under the ground all around, also on a slope of 45 degrees.
        let b = p.prototype.bounds();
        let wide = b.max.truncate().max(-b.min.truncate()).max_element();
        assert!(b.min.z < -wide, "{} of {wide}", b.min.z);
        assert!((0.06..0.75).contains(&p.radius_m), "{}", p.radius_m);
    }
    for p in &l.plants[PlantKind::Shrub] {
        assert!(
            (0.35..2.4).contains(&p.height_m),
            "{}: {}",
            p.prototype.name(),
            p.height_m
        );
    }
    for p in &l.plants[PlantKind::TrailStone] {
        assert!((0.03..0.14).contains(&p.radius_m), "{}", p.radius_m);
    }
    for t in &l.trees {
        assert!(
            t.size.dbh_m >= 0.07 && t.radius_m >= 0.4 * t.size.dbh_m,
            "{}",
            t.species
        );
    }
}

/// Stumps are left by trees such as stand.
#[test]
fn stumps_are_of_the_stands_species_and_sizes() {
    let species = params().species;
    let stumps = &LIBRARY.plants[PlantKind::Stump];
    let each = stumps.len() / species.len();
    assert!(each >= 3 && stumps.len() == each * species.len());
    for (of, stumps) in species.iter().zip(stumps.chunks(each)) {
        for stump in stumps {
            let mesh = stump.prototype.mesh();
            let own = format!("{}.stump_", of.species.name);
            for t in &mesh.triangles {
                let name = &LIBRARY.materials.get(t.material).name;
                assert!(name.starts_with(&own), "{name} in a stump of {own}");
            }
        }
        assert!(stumps[0].radius_m < stumps[each - 1].radius_m);
    }
    // A plantation of thin trees has no thick stumps.
    let thin = AssetParams {
        species: vec![StandSpecies {
            species: Species::eucalyptus(),
            dbh_mean_m: 0.16,
            trees_per_ha: 900.0,
        }],
        stand: StandParams {
            shape: 4.0,
            dbh_min_m: 0.08,
            dbh_max_m: 0.30,
        },
        textures: false,
        ..params()
    };
    let thin = Library::grow(&thin, KEY).expect("valid");
    // Roots make the foot up to twice as wide as the cut, which is up to 1.3 times as wide as the
    // tree.
    let stumps = thin.plants[PlantKind::Stump].iter();
    let radii_m: Vec<f64> = stumps.map(|s| s.radius_m).collect();
    assert!(
        radii_m.iter().all(|r| *r < 0.65 * 0.30 * 2.0),
        "{radii_m:?}"
    );
    let mean_m = radii_m.iter().sum::<f64>() / radii_m.len() as f64;
    assert!((0.09..0.19).contains(&mean_m), "{mean_m}");
}

#[test]
fn meshes_face_the_way_their_normals_do() {
    for p in all_plants() {
        let m = p.prototype.mesh();
        let turned = m
            .triangles
            .iter()
            .filter(|t| {
                let [a, b, c] = t.corners.map(|i| m.positions[i as usize]);
                let n: Vec3 = t.corners.iter().map(|&i| m.normals[i as usize]).sum();
                (b - a).cross(c - a).dot(n) < 0.0
            })
            .count();
        assert!(
            turned * 200 <= m.triangles.len(),
            "{}: {turned} of {}",
            p.prototype.name(),
            m.triangles.len()
        );
    }
}

#[test]
fn the_ground_is_ground() {
    let g = &LIBRARY.ground;
    let get = |id| LIBRARY.materials.get(id);
    let floor: Vec<_> = g.floor.iter().map(|&id| get(id).semantic).collect();
    assert_eq!(
        floor,
        [Semantic::Litter, Semantic::Litter, Semantic::GroundMoss]
    );
    assert_eq!(get(g.cut_slope).semantic, Semantic::CutSlope);
    let order = [
        "gravel",
        "dry_earth",
        "mud",
        "grassy",
        "leaf_litter",
        "needles",
        "sand",
        "rock",
    ];
    for (t, name) in g.trails.iter().zip(order) {
        let bands = [
            (t.surface, Semantic::TrailSurface, "surface"),
            (t.rut, Semantic::TrailRut, "rut"),
            (t.strip, Semantic::TrailStrip, "strip"),
        ];
        for (id, semantic, band) in bands {
            assert_eq!(get(id).semantic, semantic);
            assert_eq!(get(id).name, format!("trail.{name}.{band}"));
        }
        assert!(luminance(get(t.rut).albedo.mean()) < luminance(get(t.surface).albedo.mean()));
    }
    for m in materials() {
        assert_eq!(
            m.ground,
            m.name.starts_with("ground.")
                || m.name.starts_with("trail.") && m.semantic != Semantic::Stone
        );
        assert!(m.tile_m > 0.0 && (0.0..=1.0).contains(&m.roughness));
    }
}

/// 64-bit FNV-1a.
struct Hash(u64);

impl Hash {
    fn add(&mut self, bytes: &[u8]) {
        for b in bytes {
            self.0 = (self.0 ^ u64::from(*b)).wrapping_mul(0x0000_0100_0000_01B3);
        }
    }

    fn vector(&mut self, v: Vec3) {
        for x in v.to_array() {
            self.add(&x.to_le_bytes());
        }
    }

    fn shape(&mut self, p: &Prototype) {
        p.mesh().positions.iter().for_each(|v| self.vector(*v));
        p.mesh().normals.iter().for_each(|v| self.vector(*v));
        for t in &p.mesh().triangles {
            t.corners.iter().for_each(|c| self.add(&c.to_le_bytes()));
            self.add(&t.material.0.to_le_bytes());
        }
        for c in p.cards() {
            [c.corner, c.edge_u, c.edge_v]
                .iter()
                .for_each(|v| self.vector(*v));
            self.add(&c.material.0.to_le_bytes());
        }
    }
}

fn fingerprint(l: &Library) -> (u64, u64, u64) {
    let new = || Hash(0xCBF2_9CE4_8422_2325);
    let (mut shapes, mut masks, mut colours) = (new(), new(), new());
    for t in &l.trees {
        shapes.shape(&t.prototype);
    }
    for p in l.plants.iter().flatten() {
        shapes.shape(&p.prototype);
    }
    for m in l.materials.materials() {
        colours.add(m.name.as_bytes());
        m.albedo.srgb().iter().for_each(|t| colours.add(t));
        if let Some(mask) = &m.mask {
            // Row by row, however the mask stores them.
            for row in 0..mask.height() {
                for first in (0..mask.width()).step_by(32) {
                    let texels = (first..mask.width()).take(32).enumerate();
                    let word = texels.fold(0_u32, |word, (bit, column)| {
                        word | u32::from(mask.texel(column, row)) << bit
                    });
                    masks.add(&word.to_le_bytes());
                }
            }
        }
    }
    (shapes.0, masks.0, colours.0)
}

#[test]
fn threads_do_not_matter() {
    let one = rayon::ThreadPoolBuilder::new()
        .num_threads(1)
        .build()
        .expect("a pool");
    let serial = one
        .install(|| Library::grow(&params(), KEY))
        .expect("valid");
    assert_eq!(fingerprint(&serial), fingerprint(&LIBRARY));
}

/// Bark spirals up a stem, so that one repetition of the picture straight above a place, another
/// part of the picture is seen.
#[test]
fn bark_does_not_repeat_up_a_stem() {
    let library = Library::grow(
        &AssetParams {
            species: Species::all()
                .into_iter()
                .map(|species| StandSpecies {
                    species,
                    dbh_mean_m: 0.25,
                    trees_per_ha: 300.0,
                })
                .collect(),
            ..params()
        },
        KEY,
    )
    .expect("valid");
    let barks = library.materials.materials().iter().filter(|m| {
        [".stem", ".stem.upper"]
            .iter()
            .any(|end| m.name.ends_with(end))
    });
    let mut count = 0;
    for bark in barks {
        let (w, h) = (bark.albedo.width(), bark.albedo.height());
        let light: Vec<f32> = texels(bark).into_iter().map(luminance).collect();
        let mean = light.iter().sum::<f32>() / light.len() as f32;
        let with_lag = |lag: usize| -> f32 {
            (0..w * h)
                .map(|i| (light[i] - mean) * (light[i / w * w + (i % w + lag) % w] - mean))
                .sum()
        };
        // The picture is compared with itself at all horizontal offsets that the spiral makes, from
        // the least to the greatest.
        let itself = with_lag(0);
        let [least, most] = [0.17, 0.24].map(|share| (share * w as f32).round() as usize);
        for lag in least..=most {
            let correlation = with_lag(lag) / itself;
            assert!(
                correlation < 0.15,
                "{} at {lag} texels: {correlation}",
                bark.name
            );
        }
        assert!(itself / (w * h) as f32 > 1e-6, "{} is flat", bark.name);
        count += 1;
    }
    assert_eq!(count, 18);
    // The mesh of stems, limbs and twigs spirals too: along one of its sides u changes as promised.
    for tree in &library.trees {
        let mesh = tree.prototype.mesh();
        let mut sides = 0;
        for triangle in &mesh.triangles {
            let [a, b, d] = triangle.corners.map(|c| mesh.uvs[c as usize]);
            // Corners: (ring i, side j), (ring i, side j + 1), (ring i + 1, side j + 1).
            if a.y != b.y || d.y - b.y < 0.01 {
                continue;
            }
            let spiral = ((d.x - b.x) / (d.y - b.y)).abs();
            assert!(
                (0.168..0.242).contains(&spiral),
                "{}: {spiral}",
                tree.species
            );
            sides += 1;
        }
        assert!(3 * sides > mesh.triangles.len(), "{}", tree.species);
    }
    // Each species' wood and stumps are its own, and the nine libraries share nothing by chance.
    let names: std::collections::BTreeSet<_> = library
        .materials
        .materials()
        .iter()
        .map(|m| &m.name)
        .collect();
    assert_eq!(names.len(), library.materials.materials().len());
}

/// The values of undergrowth and masks; trees have a test of their own.
#[test]
fn value_stability() {
    let mut shapes = Hash(0xCBF2_9CE4_8422_2325);
    for p in all_plants() {
        shapes.shape(&p.prototype);
    }
    let got = (shapes.0, fingerprint(&LIBRARY).1);
    assert_eq!(format!("{got:x?}"), VALUES);
}
const VALUES: &str = "(7decc0d8e1a3da0f, a8cfd2dfea2cd4c9)";

proptest! {
    #[test]
    fn parameters_in_range_are_accepted_and_others_named(
        n in 0_u32..80,
        radius in 0.0_f64..0.3,
        mean in 0.0_f64..1.2,
        per_ha in -1_000.0_f64..25_000.0,
        shape in 0.5_f64..7.0,
        low in 0.0_f64..0.6,
        high in 0.0_f64..2.0,
    ) {
        let p = AssetParams {
            individuals_per_species: n,
            trunk_radius_m: radius,
            stand: StandParams {
                shape,
                dbh_min_m: low,
                dbh_max_m: high,
            },
            species: vec![
                StandSpecies {
                    species: Species::beech(),
                    dbh_mean_m: 0.3,
                    trees_per_ha: 300.0,
                },
                StandSpecies {
                    species: Species::cork_oak(),
                    dbh_mean_m: mean,
                    trees_per_ha: per_ha,
                },
            ],
            ..AssetParams::default()
        };
        let good = [
            ((0.08..=1.0).contains(&mean), "species[1].dbh_mean_m"),
            ((0.0..=20_000.0).contains(&per_ha), "species[1].trees_per_ha"),
            ((1..=64).contains(&n), "individuals_per_species"),
            ((0.01..=0.2).contains(&radius), "trunk_radius_m"),
            ((1.0..=6.0).contains(&shape), "stand.shape"),
            ((0.07..=0.5).contains(&low), "stand.dbh_min_m"),
            ((low..=1.5).contains(&high), "stand.dbh_max_m"),
        ];
        match p.check() {
            Ok(()) => prop_assert!(good.iter().all(|g| g.0)),
            Err(e) => prop_assert_eq!(
                Some(e.field.as_str()),
                good.iter().find(|g| !g.0).map(|g| g.1)
            ),
        }
    }
}

#[test]
fn a_wrong_parameter_is_refused() {
    let mut p = params();
    p.stand.dbh_min_m = f64::NAN;
    let e = Library::grow(&p, KEY).expect_err("NaN");
    assert!(e.to_string().contains("stand.dbh_min_m = NaN"), "{e}");
    let mut p = params();
    p.species.push(p.species[0].clone());
    let e = p.check().expect_err("twice the same");
    assert!(
        e.to_string().contains("species[3].name = maritime_pine"),
        "{e}"
    );
    p.species.clear();
    assert!(p.check().is_err());
}
