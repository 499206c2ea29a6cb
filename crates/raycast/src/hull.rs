//! The convex hull of the opaque texels of a mask.

use glam::{DMat2, DVec2};
use nemoral_scene::{AlphaMask, TextureWindow};

/// A whole card.
pub(crate) const SQUARE: [DVec2; 4] = [DVec2::ZERO, DVec2::X, DVec2::ONE, DVec2::Y];

/// The corners, in places on the card, of a hull of what is opaque in a window of a mask; none if
/// nothing is.
pub(crate) fn window_hull(mask: &AlphaMask, window: &TextureWindow) -> Vec<DVec2> {
    let [origin, u, v] = [window.origin, window.along_u, window.along_v].map(|p| p.as_dvec2());
    let corners = SQUARE.map(|p| origin + u * p.x + v * p.y);
    let min = corners.into_iter().fold(DVec2::INFINITY, DVec2::min);
    let max = corners.into_iter().fold(DVec2::NEG_INFINITY, DVec2::max);
    let to_card = DMat2::from_cols(u, v).inverse();
    // Outside of the texture the border's texels go on for ever.
    let is_inside = min.min_element() >= 0.0 && max.max_element() <= 1.0;
    if !is_inside || !to_card.is_finite() {
        return SQUARE.to_vec();
    }
    // Wider than what rounding a texture coordinate to f32 may bring to the next texel.
    const MARGIN: f64 = 1e-6;
    let size = DVec2::new(mask.width() as f64, mask.height() as f64);
    let texel = |p: DVec2| {
        let last = [mask.width() - 1, mask.height() - 1];
        // `as` saturates.
        [
            ((p.x * size.x) as usize).min(last[0]),
            ((p.y * size.y) as usize).min(last[1]),
        ]
    };
    let ([left, bottom], [right, top]) = (texel(min - MARGIN), texel(max + MARGIN));
    let mut points = Vec::new();
    for row in bottom..=top {
        if let Some((first, last)) = mask.opaque_span(row, left..=right) {
            let low = DVec2::new(first as f64, row as f64) / size - MARGIN;
            let high = DVec2::new(last as f64 + 1.0, row as f64 + 1.0) / size + MARGIN;
            points.extend([
                low,
                high,
                DVec2::new(low.x, high.y),
                DVec2::new(high.x, low.y),
            ]);
        }
    }
    points.sort_by(|a, b| a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y)));
    let mut hull = chain(points.iter().copied());
    hull.extend(chain(points.iter().rev().copied()));
    let mut hull: Vec<DVec2> = hull.iter().map(|&p| to_card * (p - origin)).collect();
    // What is on the card: cut at each of its four borders (Sutherland and Hodgman 1974).
    let inside: [fn(DVec2) -> f64; 4] = [|p| p.x, |p| 1.0 - p.x, |p| p.y, |p| 1.0 - p.y];
    for depth in inside {
        let mut kept = Vec::with_capacity(hull.len() + 1);
        for (i, &a) in hull.iter().enumerate() {
            let b = hull[(i + 1) % hull.len()];
            let (at_a, at_b) = (depth(a), depth(b));
            if at_a >= 0.0 {
                kept.push(a);
            }
            if (at_a >= 0.0) != (at_b >= 0.0) {
                kept.push(a + (b - a) * (at_a / (at_a - at_b)));
            }
        }
        hull = kept;
    }
    hull
}

/// The corners, in uv, of the convex hull of the opaque texels, counter-clockwise; none if nothing
/// is opaque. (Andrew's monotone chain.)
pub(crate) fn opaque_hull(mask: &AlphaMask) -> Vec<DVec2> {
    // The outermost texels of each row are enough; rows ascend, as the chain needs them.
    let (width, height) = (mask.width(), mask.height());
    let span = |row| mask.opaque_span(row, 0..=width - 1);
    let mut points = Vec::new();
    for line in 0..=height {
        let rows = [line.checked_sub(1), (line < height).then_some(line)];
        let spans = rows.into_iter().flatten().filter_map(span);
        let span = spans.reduce(|a, b| (a.0.min(b.0), a.1.max(b.1)));
        let ends = span.map(|(first, last)| [first, last + 1]);
        points.extend(
            (ends.into_iter().flatten()).map(|column| {
                DVec2::new(column as f64 / width as f64, line as f64 / height as f64)
            }),
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
        fn a_windows_hull_holds_what_is_opaque_on_the_card(
            (w, h) in (1_usize..60, 1_usize..60),
            texels in proptest::collection::vec((0_usize..60, 0_usize..60), 1..5),
            origin in (0.0_f32..1.0, 0.0_f32..1.0),
            size in (0.01_f32..0.7, 0.01_f32..0.7),
            turn in -3.2_f32..3.2,
            place in (0.0_f64..1.0, 0.0_f64..1.0),
        ) {
            use glam::Vec2;
            let opaque = |c, r| texels.iter().any(|&(x, y)| (x % w, y % h) == (c, r));
            let mask = AlphaMask::from_fn(w, h, opaque).expect("size");
            // Turns beyond a bound stand for upright windows.
            let axis = if turn.abs() > 1.6 { Vec2::X } else { Vec2::from_angle(turn) };
            let window = TextureWindow {
                origin: Vec2::new(origin.0, origin.1),
                along_u: axis * size.0,
                along_v: axis.perp() * size.1,
            };
            let hull = window_hull(&mask, &window);
            let place = DVec2::new(place.0, place.1);
            let uv = window.uv(place.x, place.y);
            if mask.is_opaque(uv.x, uv.y) {
                let low = hull.iter().copied().fold(DVec2::INFINITY, DVec2::min);
                let high = hull.iter().copied().fold(DVec2::NEG_INFINITY, DVec2::max);
                prop_assert!((place - low).min_element() >= 0.0);
                prop_assert!((high - place).min_element() >= 0.0);
            }
            prop_assert!(hull.iter().all(|p| p.min_element() > -1e-9));
            prop_assert!(hull.iter().all(|p| p.max_element() < 1.0 + 1e-9));
        }

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
