//! A glade of exact shapes under many skies, as a contact sheet:
//! `cargo run --release -p nemoral-render --example sphere_and_leaves -- FOLDER`

#[path = "../tests/render/analytic.rs"]
mod analytic;

use std::path::PathBuf;
use std::sync::Arc;

use analytic::{Item, Shape, World, camera, object};
use glam::{DVec3, Vec2, Vec3};
use nemoral_render::{
    CameraRenderer, Lighting, RayCastCamera, RayCastParams, SceneView, SkyParams, Sun,
};
use nemoral_scene::{AlphaMask, Card, Material, MaterialId, Semantic, Texture};
use nemoral_seed::{Domain, Draw, Key};

const GROW: Domain = Domain::new("example.grow");

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let folder = PathBuf::from(std::env::args().nth(1).unwrap_or_else(|| ".".into()));
    let forest = forest()?;
    let sky_view_factor = |p: Vec3| (0.12 + 0.88 * smooth((p.z - 3.0) / 8.0)).min(1.0);
    let closed = SceneView {
        sky_visibility: &sky_view_factor,
        ..forest.view()
    };
    let glade = glade()?;

    let skies: Vec<(&str, f64, f64, SkyParams)> = vec![
        ("noon", 200.0, 65.0, SkyParams::default()),
        ("afternoon", 250.0, 35.0, SkyParams::default()),
        ("evening", 285.0, 8.0, SkyParams::default()),
        ("sunset", 290.0, 1.0, SkyParams::default()),
        ("dusk", 290.0, -2.0, SkyParams::default()),
        (
            "hazy",
            250.0,
            35.0,
            SkyParams {
                turbidity: 7.0,
                ..SkyParams::default()
            },
        ),
        (
            "overcast",
            250.0,
            35.0,
            SkyParams {
                overcast: 1.0,
                ..SkyParams::default()
            },
        ),
        (
            "mist",
            110.0,
            20.0,
            SkyParams {
                visibility_m: 90.0,
                overcast: 0.4,
                ..SkyParams::default()
            },
        ),
    ];
    let eye = DVec3::new(0.0, 0.0, 1.2);
    let shots = [
        (
            "glade",
            glade.view(),
            camera(
                480,
                270,
                75.0,
                DVec3::new(0.0, -7.0, 1.6),
                DVec3::new(0.0, 0.0, 1.5),
            ),
        ),
        (
            "under",
            closed,
            camera(480, 270, 80.0, eye, eye + DVec3::new(1.0, 0.35, 0.03)),
        ),
        (
            "backlit",
            closed,
            camera(480, 270, 80.0, eye, eye + DVec3::new(-1.0, -0.3, 0.25)),
        ),
    ];
    for (name, scene, view) in &shots {
        let mut sheet = image::RgbImage::new(480 * 2, 270 * 4);
        for (i, (_, azimuth, elevation, sky)) in skies.iter().enumerate() {
            let lighting = Lighting::new(&Sun::from_angles(*azimuth, *elevation)?, sky)?;
            let camera = RayCastCamera::new(
                RayCastParams {
                    keep_linear: true,
                    ..RayCastParams::default()
                },
                lighting,
            )?;
            let images = camera.render(scene, view, Key::world(7))?;
            let (x, y) = (i as u32 % 2 * 480, i as u32 / 2 * 270);
            for (k, p) in images.rgb.pixels().iter().enumerate() {
                sheet.put_pixel(x + k as u32 % 480, y + k as u32 / 480, image::Rgb(*p));
            }
        }
        sheet.save(folder.join(format!("{name}.png")))?;
    }
    sky_domes(&folder)?;
    Ok(())
}

/// Fish-eye pictures of the sky alone.
fn sky_domes(folder: &std::path::Path) -> Result<(), Box<dyn std::error::Error>> {
    let mut sheet = image::RgbImage::new(240 * 5, 240 * 2);
    for (i, elevation) in [60.0, 20.0, 5.0, 0.0, -3.0].into_iter().enumerate() {
        for (j, turbidity) in [2.0, 6.0].into_iter().enumerate() {
            let sun = Sun::from_angles(180.0, elevation)?;
            let light = Lighting::new(
                &sun,
                &SkyParams {
                    turbidity,
                    ..SkyParams::default()
                },
            )?;
            let bright = light
                .sky_irradiance(Vec3::Z)
                .dot(Vec3::new(0.2126, 0.7152, 0.0722))
                / std::f32::consts::PI;
            for (px, py) in (0..240).flat_map(|x| (0..240).map(move |y| (x, y))) {
                let p = Vec2::new(px as f32 - 119.5, py as f32 - 119.5) / 118.0;
                let z = (p.length() * std::f32::consts::FRAC_PI_2).cos();
                let flat = p.normalize_or(Vec2::X) * (1.0 - z * z).max(0.0).sqrt();
                if p.length() < 1.0 {
                    let c = light.sky_radiance(Vec3::new(flat.x, -flat.y, z)) / bright * 0.35;
                    let code = c.map(|x| 255.0 * x.clamp(0.0, 1.0).powf(1.0 / 2.2));
                    sheet.put_pixel(
                        i as u32 * 240 + px,
                        j as u32 * 240 + py,
                        image::Rgb(code.to_array().map(|x| x as u8)),
                    );
                }
            }
        }
    }
    sheet.save(folder.join("domes.png"))?;
    Ok(())
}

fn smooth(x: f32) -> f32 {
    let x = x.clamp(0.0, 1.0);
    x * x * (3.0 - 2.0 * x)
}

/// A litter-like ground: dots of many browns.
fn litter() -> Result<Material, Box<dyn std::error::Error>> {
    let mut rng = Key::world(1).domain(GROW).rng();
    let n = 256_usize;
    let mut data = vec![Vec3::new(0.09, 0.06, 0.04); n * n];
    for _ in 0..5000 {
        let (cx, cy) = (rng.below(n as u32) as i32, rng.below(n as u32) as i32);
        let (a, b) = (rng.range_f32(2.0, 5.0), rng.range_f32(1.0, 2.5));
        let (sin, cos) = rng.range_f32(0.0, std::f32::consts::TAU).sin_cos();
        let tone = rng.range_f32(0.35, 1.5) * Vec3::new(0.149, rng.range_f32(0.075, 0.105), 0.055);
        for (dx, dy) in (-5..=5).flat_map(|x| (-5..=5).map(move |y| (x, y))) {
            let (x, y) = (dx as f32, dy as f32);
            if ((x * cos + y * sin) / a).powi(2) + ((y * cos - x * sin) / b).powi(2) < 1.0 {
                let at = |v: i32| v.rem_euclid(n as i32) as usize;
                data[at(cy + dy) * n + at(cx + dx)] = tone;
            }
        }
    }
    Ok(Material {
        albedo: Arc::new(Texture::from_linear(n, n, &data)?),
        ground: true,
        tile_m: 2.0,
        roughness: 0.9,
        ..Material::plain("litter", Semantic::Litter, Vec3::ONE)
    })
}

/// A card of a few beech leaves.
fn leaves() -> Result<Material, Box<dyn std::error::Error>> {
    let inside = |u: f32, v: f32| {
        (0..5).find_map(|k| {
            let (cx, cy) = (
                0.5 + 0.28 * (k as f32 * 1.26).cos(),
                0.5 + 0.28 * (k as f32 * 1.26).sin(),
            );
            let (sin, cos) = (k as f32 * 1.26).sin_cos();
            let (x, y) = (
                (u - cx) * cos + (v - cy) * sin,
                (v - cy) * cos - (u - cx) * sin,
            );
            let d = (x / 0.2).powi(2) + (y / (0.11 - 0.15 * x)).powi(2);
            (d < 1.0).then(|| if y.abs() < 0.008 { 1.3 } else { 1.0 - 0.2 * d })
        })
    };
    let data: Vec<Vec3> = (0..128 * 128)
        .map(|i| {
            let tone = inside((i % 128) as f32 / 128.0, (i / 128) as f32 / 128.0);
            Vec3::new(0.06, 0.11, 0.034) * tone.unwrap_or(1.0)
        })
        .collect();
    let mask = AlphaMask::from_fn(128, 128, |x, y| {
        inside((x as f32 + 0.5) / 128.0, (y as f32 + 0.5) / 128.0).is_some()
    })?;
    Ok(Material {
        albedo: Arc::new(Texture::from_linear(128, 128, &data)?),
        transmittance: Vec3::new(0.066, 0.13, 0.002),
        roughness: 0.45,
        mask: Some(Arc::new(mask)),
        ..Material::plain("leaves", Semantic::Leaf, Vec3::ONE)
    })
}

fn crown(
    rng: &mut impl Draw,
    centre: DVec3,
    radius: f64,
    cards: u32,
    size: f32,
    material: MaterialId,
    item: u16,
) -> Item {
    let unit = |rng: &mut dyn FnMut() -> f64| {
        let z = 2.0 * rng() - 1.0;
        let a = std::f64::consts::TAU * rng();
        let r = (1.0 - z * z).sqrt();
        DVec3::new(r * a.cos(), r * a.sin(), z)
    };
    let variation = rng.unit_f32();
    let mut draw = || rng.unit_f64();
    let items = (0..cards)
        .map(|_| {
            let at = centre + unit(&mut draw) * (radius * 0.85 * draw().powf(0.4));
            let n = (unit(&mut draw) + DVec3::Z * 0.8)
                .as_vec3()
                .normalize_or(Vec3::Z);
            let (u, v) = n.any_orthonormal_pair();
            let corner = at.as_vec3() - (u + v) * (size * 0.5);
            Item {
                shape: Shape::Card(Card {
                    corner,
                    edge_u: u * size,
                    edge_v: v * size,
                    material,
                }),
                material,
                object: object(item),
                variation,
            }
        })
        .collect();
    Item {
        shape: Shape::Group {
            centre,
            radius,
            items,
        },
        material,
        object: object(item),
        variation,
    }
}

fn add_trees(
    world: &mut World,
    places: &[(f64, f64)],
    leaves: MaterialId,
    bark: MaterialId,
    high: bool,
) {
    for (k, &(x, y)) in places.iter().enumerate() {
        let mut rng = Key::world(3).domain(GROW).item(k as u64).rng();
        let item = k as u16 + 10;
        let height = if high {
            rng.range_f64(13.0, 17.0)
        } else {
            rng.range_f64(2.5, 4.0)
        };
        let radius = if high {
            rng.range_f64(0.13, 0.28)
        } else {
            0.06
        };
        world.items.push(Item {
            shape: Shape::Cylinder {
                foot: DVec3::new(x, y, -0.2),
                radius,
                height,
            },
            material: bark,
            object: object(item),
            variation: rng.unit_f32(),
        });
        let clumps = if high { 7 } else { 3 };
        for _ in 0..clumps {
            let spread = if high { 2.6 } else { 0.7 };
            let centre = DVec3::new(
                x + rng.range_f64(-spread, spread),
                y + rng.range_f64(-spread, spread),
                height * rng.range_f64(0.55, 1.02),
            );
            let (r, n) = if high { (2.0, 130) } else { (0.8, 120) };
            let group = crown(
                &mut rng,
                centre,
                r,
                n,
                if high { 0.45 } else { 0.2 },
                leaves,
                item,
            );
            world.items.push(group);
        }
    }
}

fn materials(world: &mut World) -> Result<(MaterialId, MaterialId), Box<dyn std::error::Error>> {
    let leaves = world.materials.add(leaves()?);
    let mut rng = Key::world(2).domain(GROW).rng();
    let bark: Vec<Vec3> = (0..64 * 64)
        .map(|i| {
            let stripe = ((i % 64) as f32 * 0.8 + (i / 64) as f32 * 0.05).sin() * 0.5 + 0.5;
            Vec3::new(0.15, 0.12, 0.095) * (0.4 + 0.7 * stripe * rng.range_f32(0.7, 1.0))
        })
        .collect();
    let bark = world.materials.add(Material {
        albedo: Arc::new(Texture::from_linear(64, 64, &bark)?),
        roughness: 0.9,
        ..Material::plain("bark", Semantic::Stem, Vec3::ONE)
    });
    world.add(
        Shape::Plane {
            normal: DVec3::Z,
            offset: 0.0,
        },
        litter()?,
        0,
    );
    Ok((leaves, bark))
}

/// Grey and glossy balls and a few small trees in the open.
fn glade() -> Result<World, Box<dyn std::error::Error>> {
    let mut world = World::default();
    let (leaves, bark) = materials(&mut world)?;
    for (i, (albedo, roughness)) in [(0.18, 1.0), (0.5, 1.0), (0.05, 0.3), (0.18, 0.6)]
        .into_iter()
        .enumerate()
    {
        let ball = Material {
            roughness,
            ..analytic::grey(albedo)
        };
        world.add(
            Shape::Sphere {
                centre: DVec3::new(i as f64 * 1.3 - 2.0, -2.0, 0.5),
                radius: 0.5,
            },
            ball,
            i as u16 + 1,
        );
    }
    let places = [
        (-5.0, 3.0),
        (-2.5, 5.0),
        (1.5, 4.0),
        (4.5, 2.0),
        (7.0, 6.0),
        (-9.0, 8.0),
    ];
    add_trees(&mut world, &places, leaves, bark, false);
    Ok(world)
}

/// High trees all around.
fn forest() -> Result<World, Box<dyn std::error::Error>> {
    let mut world = World::default();
    let (leaves, bark) = materials(&mut world)?;
    let mut rng = Key::world(5).domain(GROW).rng();
    let mut places: Vec<(f64, f64)> = Vec::new();
    while places.len() < 90 {
        let p = (rng.range_f64(-30.0, 30.0), rng.range_f64(-30.0, 30.0));
        let apart = |q: &(f64, f64)| (p.0 - q.0).hypot(p.1 - q.1);
        if places.iter().all(|q| apart(q) > 3.5) && apart(&(0.0, 0.0)) > 2.5 {
            places.push(p);
        }
    }
    add_trees(&mut world, &places, leaves, bark, true);
    let shrubs: Vec<(f64, f64)> = (0..8)
        .map(|_| (rng.range_f64(-14.0, 14.0), rng.range_f64(-14.0, 14.0)))
        .filter(|p| p.0.hypot(p.1) > 3.0)
        .collect();
    add_trees(&mut world, &shrubs, leaves, bark, false);
    Ok(world)
}
