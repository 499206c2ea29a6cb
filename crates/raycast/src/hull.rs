//! The convex hull of the opaque texels of a mask.

use glam::DVec2;
use nemoral_scene::AlphaMask;

/// The corners, in uv, of the convex hull of the opaque texels, counter-clockwise; none if nothing
/// is opaque. (Andrew's monotone chain.)
pub(crate) fn opaque_hull(mask: &AlphaMask) -> Vec<DVec2> {
    // The outermost texels of each column are enough; columns ascend, as the chain needs them.
    let (width, height) = (mask.width(), mask.height());
    let mut points = Vec::new();
    for line in 0..=width {
        let columns = [line.checked_sub(1), (line < width).then_some(line)];
        let rows = columns.into_iter().flatten().flat_map(|column| {
            let opaque = move |row: &usize| mask.texel(column, *row);
            let first = (0..height).find(opaque);
            let last = (0..height).rev().find(opaque).map(|row| row + 1);
            [first, last].into_iter().flatten()
        });
        let rows: Vec<usize> = rows.collect();
        let ends = [rows.iter().min(), rows.iter().max()];
        points.extend(
            ends.into_iter()
                .flatten()
                .map(|&row| DVec2::new(line as f64 / width as f64, row as f64 / height as f64)),
        );
    }
    let mut hull = chain(points.iter().copied());
    hull.extend(chain(points.iter().rev().copied()));
    hull
}

/// One side of the hull, without its last point.
fn chain(points: impl Iterator<Item = DVec2>) -> Vec<DVec2> {
    let mut side: Vec<DVec2> = Vec::new();
    for p in points {
        while let [.., a, b] = side[..] {
            if (b - a).perp_dot(p - a) > 0.0 {
                break;
            }
            side.pop();
        }
        side.push(p);
    }
    side.pop();
    side
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn a_full_mask_has_its_four_corners() {
        let mask = AlphaMask::from_fn(7, 3, |_, _| true).expect("size");
        let hull = opaque_hull(&mask);
        assert_eq!(hull, [DVec2::ZERO, DVec2::X, DVec2::ONE, DVec2::Y]);
        let none = AlphaMask::from_fn(7, 3, |_, _| false).expect("size");
        assert!(opaque_hull(&none).is_empty());
    }

    proptest! {
        #[test]
        fn the_hull_is_convex_tight_and_holds_every_opaque_texel(
            w in 1_usize..20,
            h in 1_usize..20,
            texels in proptest::collection::vec((0_usize..20, 0_usize..20), 1..9),
        ) {
            let mask = AlphaMask::from_fn(w, h, |c, r| {
                texels.iter().any(|&(x, y)| (x % w, y % h) == (c, r))
            })
            .expect("size");
            let hull = opaque_hull(&mask);
            let corners: Vec<DVec2> = texels
                .iter()
                .flat_map(|&(x, y)| {
                    [(0, 0), (1, 0), (0, 1), (1, 1)].map(|(dx, dy)| (x % w + dx, y % h + dy))
                })
                .map(|(x, y)| DVec2::new(x as f64 / w as f64, y as f64 / h as f64))
                .collect();
            for (i, &a) in hull.iter().enumerate() {
                let b = hull[(i + 1) % hull.len()];
                prop_assert!(corners.contains(&a));
                prop_assert!(corners.iter().all(|&p| (b - a).perp_dot(p - a) > -1e-12));
            }
        }
    }
}
