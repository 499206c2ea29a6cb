//! The repetition of its picture cannot be seen on bark.

use super::*;
use crate::common;
use nemoral_assets::{GrowthParams, grow};
use nemoral_seed::Domain;

/// Brightness less its mean over a surrounding square of 2 `half` texels, row by row, so that
/// larger patches are left out.
fn detail(m: &Material, half: usize) -> Vec<f32> {
    let (w, h) = (m.albedo.width(), m.albedo.height());
    let light: Vec<f32> = opaque(m)
        .iter()
        .map(|&uv| luminance(m.albedo.sample(uv, 0.0)))
        .collect();
    // Means along rows, then along columns; the picture repeats.
    let mean = |values: &[f32], line: usize, n: usize, at: &dyn Fn(usize, usize) -> usize| {
        let mut sum: f64 = (0..2 * half)
            .map(|i| f64::from(values[at(line, (n - half + i) % n)]))
            .sum();
        let mut out = Vec::with_capacity(n);
        for i in 0..n {
            out.push((sum / (2 * half) as f64) as f32);
            sum += f64::from(values[at(line, (i + half) % n)]);
            sum -= f64::from(values[at(line, (i + n - half) % n)]);
        }
        out
    };
    let rows: Vec<f32> = (0..h)
        .flat_map(|y| mean(&light, y, w, &|y, x| y * w + x))
        .collect();
    let mut out = light;
    for x in 0..w {
        for (y, m) in mean(&rows, x, h, &|x, y| y * w + x).into_iter().enumerate() {
            out[y * w + x] -= m;
        }
    }
    out
}

/// The correlation of a picture's detail with itself, shifted to the right and up.
fn alike(detail: &[f32], width: usize, [right, up]: [usize; 2]) -> f64 {
    let height = detail.len() / width;
    let (mut product, mut square) = (0.0, 0.0);
    for y in 0..height {
        let line = &detail[y * width..][..width];
        let other = &detail[(y + up) % height * width..][..width];
        for (x, a) in line.iter().enumerate() {
            let b = other[(x + right) % width];
            product += f64::from(a * b);
            square += f64::from(a * a);
        }
    }
    product / square
}

/// No recipe repeats within its own picture, for example by the lattice of its noise: shifted
/// sideways or upwards by an eighth to a half of the picture, its detail does not correlate with
/// itself.
#[test]
#[ignore = "half a minute: .ci/full runs it"]
fn recipes_have_no_period_of_their_own() {
    let mut count = 0;
    for species in Species::all() {
        let parts = ["stem", "stem.upper"];
        // A species with one bark has it twice.
        for part in parts
            .iter()
            .take(1 + usize::from(species.bark.upper.is_some()))
        {
            let m = named(&format!("{}.{part}", species.name));
            let (w, h) = (m.albedo.width(), m.albedo.height());
            let detail = detail(m, w / 8);
            let beside = (w / 8..=w / 2).step_by(6).map(|x| [x, 0]);
            let above = (h / 8..=h / 2).step_by(12).map(|y| [0, y]);
            let most = beside
                .chain(above)
                .map(|lag| (alike(&detail, w, lag), lag))
                .fold((-1.0, [0; 2]), |a, b| if b.0 > a.0 { b } else { a });
            // The patches of these barks are longer than an eighth of the picture.
            let limit = match m.name.as_str() {
                "eucalyptus.stem.upper" | "silver_birch.stem" => 0.25,
                _ => 0.15,
            };
            assert!(most.0 < limit, "{}: {most:.3?} texels away", m.name);
            count += 1;
        }
    }
    assert_eq!(count, 13);
}

/// A picture goes around a stem once or twice. If twice, the second copy is on the far side of the
/// stem, so that both are never seen at once.
#[test]
fn a_picture_is_not_seen_twice_beside_itself() {
    let params = GrowthParams {
        wood_triangles_max: 3_000,
        cards_max: 50,
        ..GrowthParams::default()
    };
    for species in Species::all() {
        for (dbh_m, most) in [(0.1, 1), (0.3, 1), (0.5, 2), (0.55, 2), (0.9, 2)] {
            let key = Key::world(3).domain(Domain::new("bark"));
            let size = species.draw_size(dbh_m, key);
            let tree = grow(&species, &size, &common::materials(), &params, key).expect("grows");
            // The stem's lowest ring, which contains the seam twice.
            let uvs = &tree.mesh.uvs;
            let ring: Vec<f32> = (uvs.iter().take_while(|uv| uv.y == uvs[0].y))
                .map(|uv| uv.x)
                .collect();
            assert!(ring.len() > 8, "{}", species.name);
            let times = (ring[ring.len() - 1] - ring[0]).abs();
            let whole = times.round();
            assert!(
                (times - whole).abs() < 1e-4 && (1..=most).contains(&(whole as i32)),
                "{} of {dbh_m} m: {times} times round",
                species.name
            );
        }
    }
}
