//! Circles through the points of stems in a slice of a scan.

use nemoral_scene::glam::DVec2;

/// A circle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Circle {
    /// Centre of the circle.
    pub centre: DVec2,
    /// Radius of the circle.
    pub radius: f64,
    /// Root mean square distance of the points from the circle.
    pub residual: f64,
}

/// The least-squares circle by the points' distances from it: Gauss-Newton iterations from Kåsa's
/// algebraic fit (1976). `None` without three points off a line.
#[must_use]
pub fn circle(points: &[DVec2]) -> Option<Circle> {
    let n = points.len() as f64;
    if points.len() < 3 {
        return None;
    }
    let mean = points.iter().sum::<DVec2>() / n;
    let (mut xx, mut yy, mut xy, mut xz, mut yz) = (0.0, 0.0, 0.0, 0.0, 0.0);
    for p in points {
        let d = *p - mean;
        let z = d.length_squared();
        xx += d.x * d.x;
        yy += d.y * d.y;
        xy += d.x * d.y;
        xz += d.x * z;
        yz += d.y * z;
    }
    let determinant = xx * yy - xy * xy;
    if determinant <= 1e-9 * (xx + yy).powi(2) {
        return None;
    }
    let offset = DVec2::new(xz * yy - yz * xy, yz * xx - xz * xy) / (2.0 * determinant);
    let mut centre = mean + offset;
    let mut radius = (offset.length_squared() + (xx + yy) / n).sqrt();
    for _ in 0..20 {
        // These are the normal equations of the distances' derivatives by centre and radius.
        let (mut a, mut b) = ([[0.0; 3]; 3], [0.0; 3]);
        for p in points {
            let d = *p - centre;
            let distance = d.length().max(1e-12);
            let row = [-d.x / distance, -d.y / distance, -1.0];
            for i in 0..3 {
                for j in 0..3 {
                    a[i][j] += row[i] * row[j];
                }
                b[i] -= row[i] * (distance - radius);
            }
        }
        let step = solve(a, b)?;
        centre += DVec2::new(step[0], step[1]);
        radius += step[2];
    }
    let square = points.iter().map(|p| (p.distance(centre) - radius).powi(2));
    let residual = (square.sum::<f64>() / n).sqrt();
    let sound = centre.is_finite() && radius.is_finite() && radius > 0.0;
    sound.then_some(Circle {
        centre,
        radius,
        residual,
    })
}

/// Cramer's rule.
fn solve(a: [[f64; 3]; 3], b: [f64; 3]) -> Option<[f64; 3]> {
    let det = |m: [[f64; 3]; 3]| {
        m[0][0] * (m[1][1] * m[2][2] - m[1][2] * m[2][1])
            - m[0][1] * (m[1][0] * m[2][2] - m[1][2] * m[2][0])
            + m[0][2] * (m[1][0] * m[2][1] - m[1][1] * m[2][0])
    };
    let all = det(a);
    if all.abs() < 1e-12 {
        return None;
    }
    let with = |column: usize| {
        let mut m = a;
        for (row, value) in m.iter_mut().zip(b) {
            row[column] = value;
        }
        det(m) / all
    };
    Some([with(0), with(1), with(2)])
}

#[cfg(test)]
mod tests {
    use super::*;

    fn arc(radius: f64, from_deg: i32, to_deg: i32) -> Vec<DVec2> {
        let at = |deg: i32| DVec2::from_angle(f64::from(deg).to_radians()) * radius;
        (from_deg..=to_deg)
            .map(|d| at(d) + DVec2::new(3.0, -7.0))
            .collect()
    }

    #[test]
    fn an_arc_gives_its_circle() {
        for (from, to) in [(0, 359), (10, 150), (200, 260)] {
            let found = circle(&arc(0.13, from, to)).expect("it bends");
            assert!((found.radius - 0.13).abs() < 1e-6, "{found:?}");
            assert!(found.centre.distance(DVec2::new(3.0, -7.0)) < 1e-6);
            assert!(found.residual < 1e-6);
        }
    }

    #[test]
    fn a_line_is_none() {
        let line: Vec<DVec2> = (0..9).map(|i| DVec2::new(f64::from(i), 0.0)).collect();
        assert_eq!(circle(&line), None);
        assert_eq!(circle(&line[..2]), None);
    }
}
