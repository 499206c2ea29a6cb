//! Mips: what is far off has the colour that it has near by.

use super::*;

/// Mips of what is cut out are of its opaque texels: neither what is drawn under a mask nor a
/// twig's colour that was filled on under it comes in. What is left is filtering across the mask's
/// border; most of it from the one picture that is thick below and thin above, of grass in flower.
#[test]
fn colour_does_not_depend_on_distance() {
    let (mut leaves, mut solids) = (0, 0);
    for m in LIBRARY.materials.materials() {
        // Of a large texture some 50,000 places tell as much as all.
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

/// How much light goes through a leaf's vein or twig goes by how dark it is beside the texture's
/// mean: that of what can be hit.
#[test]
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
