//! Mips: a surface has the same mean colour from afar as from nearby.

use super::*;

/// Mips of a masked texture are made of its opaque texels alone, so the colours that were filled in
/// under the mask do not show. The remaining difference comes from filtering across the mask's
/// border, mostly in the picture of flowering grass, which is dense below and sparse above.
#[test]
fn colour_does_not_depend_on_distance() {
    let (mut leaves, mut solids) = (0, 0);
    for m in LIBRARY.materials.materials() {
        // For a large texture, some 50,000 places are enough.
        let at = opaque(m);
        let at: Vec<Vec2> = at.iter().copied().step_by(1 + at.len() / 50_000).collect();
        let near = mean_colour(m, &at, 0.0);
        let (luminance_off, channel_off) = if m.mask.is_none() {
            solids += 1;
            (0.015, 0.025)
        } else if m.name.contains(".foliage.") {
            leaves += 1;
            (0.03, 0.06)
        } else {
            (0.09, 0.18)
        };
        for level in 1..m.albedo.levels() {
            let far = mean_colour(m, &at, (1_u32 << level) as f32);
            let off = (far / near - Vec3::ONE).abs().max_element();
            let brighter = (luminance(far) / luminance(near) - 1.0).abs();
            assert!(
                brighter < luminance_off && off < channel_off,
                "{} at level {level}: {far:.4} for {near:.4}",
                m.name
            );
        }
    }
    // Five pictures of each species' twigs; barks, wood, ground.
    assert!(leaves >= 9 * 5 && solids > 9 * 6 + 28, "{leaves} {solids}");
}

/// The light that passes a leaf's vein or twig depends on how dark it is relative to the texture's
/// mean, which is that of the opaque texels.
#[test]
#[ignore = "half a minute: .ci/full runs it"]
fn the_mean_is_of_what_is_opaque() {
    for m in LIBRARY.materials.materials() {
        let seen = mean_colour(m, &opaque(m), 0.0);
        let mean = m.albedo.mean();
        assert!(
            (luminance(mean) / luminance(seen) - 1.0).abs() < 0.02,
            "{}: {mean:.4} for {seen:.4}",
            m.name
        );
    }
}
