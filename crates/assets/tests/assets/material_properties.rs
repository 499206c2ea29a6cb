//! What must hold for every material of a library.

use crate::default_library::{KEY, LIBRARY, luminance, materials, named, params, texels};
use nemoral_assets::{AssetParams, Library, Species, StandSpecies};
use nemoral_scene::Semantic;
use nemoral_scene::glam::Vec3;

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
