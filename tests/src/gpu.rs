//! The GPU that tests draw on, if there is one, and the comparison of two renderers' truths.

use std::fmt;
use std::io::Write;
use std::sync::OnceLock;

use nemoral_render::{AcceptedGpus, Gpu};
use nemoral_scene::{Ontology, TruthImages};

/// A GPU, or a software renderer in its place. Without any, `None`: the test skips itself, and a
/// message is written past the harness's capture. With `NEMORAL_REQUIRE_GPU` in the environment the
/// test fails instead.
///
/// # Panics
/// If there is none and one is required.
pub fn gpu(test: &str) -> Option<&'static Gpu> {
    static GPU: OnceLock<Result<Gpu, String>> = OnceLock::new();
    match GPU.get_or_init(|| Gpu::open(AcceptedGpus::Any).map_err(|e| e.to_string())) {
        Ok(gpu) => Some(gpu),
        Err(reason) => {
            let message = format!("SKIPPED: {test}: {reason}\n");
            assert!(
                std::env::var_os("NEMORAL_REQUIRE_GPU").is_none(),
                "{message}"
            );
            // The harness captures the output of macros in tests that pass, but not this.
            let _ = std::io::stderr().write_all(message.as_bytes());
            None
        }
    }
}

/// The agreement of two renderers about a picture.
#[derive(Clone, Debug)]
pub struct Agreement {
    /// Share of pixels with equal class.
    pub class: f64,
    /// Share of pixels with equal instance.
    pub instance: f64,
    /// Name, pixels and share of pixels with equal class, for each class of the first picture but
    /// Background.
    pub classes: Vec<(String, usize, f64)>,
    /// The 99th percentile of the relative difference of depth, of pixels with equal class and
    /// instance.
    pub depth_p99: f64,
    /// The 99th percentile of the angle between the normals of such pixels, radians.
    pub normal_p99_rad: f64,
}

impl Agreement {
    /// Compares two truths of the same size.
    ///
    /// # Panics
    /// If the sizes differ.
    #[must_use]
    pub fn of(a: &TruthImages, b: &TruthImages) -> Self {
        let ontology = Ontology::paper();
        let n = a.semantic.pixels().len();
        assert_eq!(n, b.semantic.pixels().len());
        let class = |t: &TruthImages, i: usize| ontology.class(t.semantic.pixels()[i]).id;
        let mut counts = [(0_usize, 0_usize); 256];
        let (mut classes, mut instances) = (0, 0);
        let (mut depths, mut angles) = (Vec::new(), Vec::new());
        for i in 0..n {
            let of_a = class(a, i);
            let same_class = of_a == class(b, i);
            let same_instance = a.object.pixels()[i] == b.object.pixels()[i];
            let (all, equal) = &mut counts[usize::from(of_a)];
            *all += 1;
            *equal += usize::from(same_class);
            classes += usize::from(same_class);
            instances += usize::from(same_instance);
            let [da, db] = [a, b].map(|t| f64::from(t.depth_m.pixels()[i]));
            if same_class && same_instance && da > 0.0 && db > 0.0 {
                depths.push((da - db).abs() / da);
                let [na, nb] = [a, b].map(|t| t.normal.pixels()[i]);
                angles.push(f64::from(na.distance(nb)));
            }
        }
        let share = |k: usize| k as f64 / n as f64;
        let of_class = |(id, &(all, equal)): (usize, &(usize, usize))| {
            let class = ontology
                .classes()
                .iter()
                .find(|c| usize::from(c.id) == id)?;
            (id != 0 && all > 0).then(|| (class.name.to_owned(), all, equal as f64 / all as f64))
        };
        Self {
            class: share(classes),
            instance: share(instances),
            classes: counts.iter().enumerate().filter_map(of_class).collect(),
            depth_p99: p99(depths),
            normal_p99_rad: p99(angles),
        }
    }

    /// Whether two correct renderers of one scene would agree so. Only classes with at least
    /// `least` pixels count.
    #[must_use]
    pub fn is_right(&self, least: usize) -> bool {
        self.class >= 0.999
            && self.instance >= 0.999
            && self.depth_p99 < 1e-5
            && self.normal_p99_rad < 1e-3
            && self
                .classes
                .iter()
                .all(|&(_, pixels, share)| pixels < least || share >= 0.995)
    }
}

impl fmt::Display for Agreement {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "class {:.3} %, instance {:.3} %, depth p99 {:.1e}, normal p99 {:.1e} rad;",
            100.0 * self.class,
            100.0 * self.instance,
            self.depth_p99,
            self.normal_p99_rad
        )?;
        for (name, pixels, share) in &self.classes {
            write!(f, " {name} {:.2} % of {pixels}", 100.0 * share)?;
        }
        Ok(())
    }
}

fn p99(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    let last = values.len().saturating_sub(1);
    values.get(last * 99 / 100).copied().unwrap_or(0.0)
}
