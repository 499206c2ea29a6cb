//! Posts that were not measured: which of them are outside, how far away, and heights for them.

/// Which posts are outside of what was measured: those without a height from which a way along rows
/// and columns leads to the first post over others without one. The first post has none.
pub(super) fn outside(heights_m: &[f32], columns: usize) -> Vec<bool> {
    let count = heights_m.len();
    let mut is_outside = vec![false; count];
    is_outside[0] = true;
    let mut open = vec![0];
    while let Some(post) = open.pop() {
        let column = post % columns;
        for (is_there, beside) in [
            (column > 0, post.wrapping_sub(1)),
            (column + 1 < columns, post + 1),
            (post >= columns, post.wrapping_sub(columns)),
            (post + columns < count, post + columns),
        ] {
            if is_there && heights_m[beside].is_nan() && !is_outside[beside] {
                is_outside[beside] = true;
                open.push(beside);
            }
        }
    }
    is_outside
}

/// The distance from each post to the nearest one that is not outside, in posts, by lower envelopes
/// of parabolas (Felzenszwalb and Huttenlocher 2012, "Distance transforms of sampled functions").
pub(super) fn distances(is_outside: &[bool], columns: usize) -> Vec<f32> {
    let rows = is_outside.len() / columns;
    // Large, but its squares are finite.
    const FAR: f64 = 1e9;
    let square = |outside: &bool| if *outside { FAR * FAR } else { 0.0 };
    let mut squares: Vec<f64> = is_outside.iter().map(square).collect();
    let mut line = Vec::new();
    for row in squares.chunks_exact_mut(columns) {
        line.clear();
        line.extend_from_slice(row);
        envelope(&line, |i, square| row[i] = square);
    }
    for column in 0..columns {
        line.clear();
        line.extend((0..rows).map(|row| squares[row * columns + column]));
        envelope(&line, |row, square| {
            squares[row * columns + column] = square
        });
    }
    squares.into_iter().map(|s| s.sqrt() as f32).collect()
}

/// Of each place of a line, the least sum of a value and the square of the way to it.
fn envelope(values: &[f64], mut put: impl FnMut(usize, f64)) {
    // The parabolas of the envelope, each with the place from which on it is the lowest.
    let mut lowest: Vec<(usize, f64)> = Vec::with_capacity(values.len());
    for (i, &value) in values.iter().enumerate() {
        let from = loop {
            let Some(&(j, start)) = lowest.last() else {
                break f64::NEG_INFINITY;
            };
            let (a, b) = (i as f64, j as f64);
            let meet = ((value + a * a) - (values[j] + b * b)) / (2.0 * (a - b));
            if meet > start {
                break meet;
            }
            lowest.pop();
        };
        lowest.push((i, from));
    }
    let mut k = 0;
    for i in 0..values.len() {
        while lowest.get(k + 1).is_some_and(|&(_, from)| from < i as f64) {
            k += 1;
        }
        let off = i as f64 - lowest[k].0 as f64;
        put(i, values[lowest[k].0] + off * off);
    }
}

/// Gives posts without a height that of the coarsest means around them, from a pyramid of means of
/// 2 × 2 (Gortler et al. 1996, "The lumigraph": push and pull).
pub(super) fn fill(heights_m: &mut [f32], columns: usize) {
    let rows = heights_m.len() / columns;
    if !heights_m.iter().any(|h| h.is_nan()) || heights_m.len() == 1 {
        return;
    }
    let half = [columns.div_ceil(2), rows.div_ceil(2)];
    let mut coarse = vec![f32::NAN; half[0] * half[1]];
    for (i, mean) in coarse.iter_mut().enumerate() {
        let (x, y) = (2 * (i % half[0]), 2 * (i / half[0]));
        let (mut sum, mut count) = (0.0, 0.0);
        for (x, y) in [(x, y), (x + 1, y), (x, y + 1), (x + 1, y + 1)] {
            if x < columns && y < rows && !heights_m[y * columns + x].is_nan() {
                sum += f64::from(heights_m[y * columns + x]);
                count += 1.0;
            }
        }
        if count > 0.0 {
            *mean = (sum / count) as f32;
        }
    }
    fill(&mut coarse, half[0]);
    for (i, height) in heights_m.iter_mut().enumerate().filter(|(_, h)| h.is_nan()) {
        // Linear between the middles of the coarse cells.
        let place = |at: usize, count: usize| {
            let at = (0.5 * at as f64 - 0.25).clamp(0.0, (count - 1) as f64);
            let cell = (at as usize).min(count.saturating_sub(2));
            (cell, (cell + 1).min(count - 1), at - cell as f64)
        };
        let (x0, x1, tx) = place(i % columns, half[0]);
        let (y0, y1, ty) = place(i / columns, half[1]);
        let at = |x: usize, y: usize| f64::from(coarse[y * half[0] + x]);
        let upper = at(x0, y0) * (1.0 - tx) + at(x1, y0) * tx;
        let lower = at(x0, y1) * (1.0 - tx) + at(x1, y1) * tx;
        *height = (upper * (1.0 - ty) + lower * ty) as f32;
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec2;
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn distances_are_those_to_the_nearest(seed in any::<u64>(), columns in 2_usize..9) {
            let mut state = seed | 1;
            let mut measured = || {
                state ^= state << 13;
                state ^= state >> 7;
                state ^= state << 17;
                state % 5 == 0
            };
            let mut grid: Vec<f32> =
                (0..columns * 7).map(|_| if measured() { 1.0 } else { f32::NAN }).collect();
            grid[3] = 1.0;
            let place = |i: usize| DVec2::new((i % columns) as f64, (i / columns) as f64);
            let is_outside: Vec<bool> = grid.iter().map(|h| h.is_nan()).collect();
            for (i, found) in distances(&is_outside, columns).into_iter().enumerate() {
                let to = |j: usize| place(i).distance(place(j));
                let nearest = (0..grid.len()).filter(|&j| !grid[j].is_nan()).map(to);
                let nearest = nearest.fold(f64::INFINITY, f64::min);
                prop_assert!((f64::from(found) - nearest).abs() < 1e-5);
            }
            fill(&mut grid, columns);
            prop_assert!(grid.iter().all(|h| *h == 1.0));
        }
    }
}
