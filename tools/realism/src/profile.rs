//! Vertical distribution of plants, from first returns of pulses from above.

/// Plant area density of each metre above ground, m²/m³: -d ln P / dz / K, with the share P of
/// pulses that first return from below z and K = 0.5 (Bouvier et al. 2015). `heights_m` are the
/// heights of all first returns, of which those of the ground are near 0.
#[must_use]
pub fn plant_area_density(heights_m: &[f64], metres: usize) -> Vec<f64> {
    let below = |z: usize| {
        let z = z as f64;
        // Where no pulse came through, half a pulse is assumed.
        heights_m.iter().filter(|h| **h < z).count().max(1) as f64
    };
    (0..metres)
        .map(|z| {
            // Returns of the ground itself do not count as plants.
            let low = if z == 0 {
                heights_m.iter().filter(|h| **h < 0.1).count().max(1) as f64
            } else {
                below(z)
            };
            2.0 * (below(z + 1) / low).ln()
        })
        .collect()
}

/// Layers of a profile.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Layers {
    /// The height of the densest layer over 2 m, over the stand's dominant height.
    pub mode: f64,
    /// The extent of heights over 2 m with more than half of the greatest density, over the
    /// dominant height.
    pub breadth: f64,
    /// The density under 2 m over the mean between 2 m and the dominant height.
    pub understorey: f64,
}

/// The layers of a profile by metres, smoothed over three.
#[must_use]
pub fn layers(profile: &[f64], dominant_m: f64) -> Layers {
    let smooth = |i: usize| {
        let around = &profile[i.saturating_sub(1)..(i + 2).min(profile.len())];
        around.iter().sum::<f64>() / around.len() as f64
    };
    let top = (dominant_m.ceil() as usize).clamp(3, profile.len());
    let crowns: Vec<(usize, f64)> = (2..top).map(|i| (i, smooth(i))).collect();
    let densest = crowns
        .iter()
        .fold((2, 0.0), |a, b| if b.1 > a.1 { *b } else { a });
    let dense = crowns.iter().filter(|c| c.1 > 0.5 * densest.1).count();
    let mean = profile[2..top].iter().sum::<f64>() / (top - 2) as f64;
    Layers {
        mode: (densest.0 as f64 + 0.5) / dominant_m,
        breadth: dense as f64 / dominant_m,
        understorey: 0.5 * (profile[0] + profile[1]) / mean.max(1e-9),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nemoral_seed::{Draw, Key};

    /// The densities of random leaves in two layers are found again.
    #[test]
    fn densities_of_layers_come_back() {
        let mut rng = Key::world(4).rng();
        let density = |z: f64| match z {
            z if (12.0..16.0).contains(&z) => 0.4,
            z if z < 2.0 => 0.3,
            _ => 0.05,
        };
        let heights: Vec<f64> = (0..100_000)
            .map(|_| {
                // A pulse comes down from 20 m and is stopped with probability K u dz.
                let mut z = 20.0;
                while z > 0.0 && !rng.chance(0.5 * density(z) * 0.05) {
                    z -= 0.05;
                }
                f64::max(z, 0.0)
            })
            .collect();
        let profile = plant_area_density(&heights, 20);
        for (z, found) in profile.iter().enumerate().skip(1) {
            let truth = density(z as f64 + 0.5);
            assert!((found - truth).abs() < 0.02, "{z} {found} {truth}");
        }
        let layers = layers(&profile, 18.0);
        assert!((0.65..0.9).contains(&layers.mode), "{layers:?}");
        assert!((0.2..0.35).contains(&layers.breadth), "{layers:?}");
        assert!(layers.understorey > 1.5, "{layers:?}");
        // The densest layer of the reversed profile is low.
        let turned: Vec<f64> = profile.iter().rev().copied().collect();
        assert!(super::layers(&turned, 18.0).mode < 0.5);
    }
}
