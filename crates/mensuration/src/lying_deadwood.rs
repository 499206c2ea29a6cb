//! Dead wood that lies on the ground, per hectare.

use nemoral_scene::{DeadwoodRecord, DecayStage, ObjectKind, ParamError};

use crate::Plot;
use crate::stand::sum_of;

/// Logs of a plot per hectare.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct DeadwoodMeasures {
    /// Logs per hectare.
    pub pieces_per_ha: f64,
    /// Their volume, m³/ha.
    pub volume_m3_ha: f64,
}

/// Dead wood that lies on a plot, by how far it has decayed.
///
/// A log counts whole on the plot that the middle of its axis is in. Root plates do not count.
///
/// ```
/// use nemoral_mensuration::{LyingDeadwood, Plot};
/// # use nemoral_scene::{ChunkCoord, DeadwoodRecord, DecayStage, ObjectId, ObjectKind};
/// # let log = |item: u16, thick_end_m: f64, volume_m3: f64| DeadwoodRecord {
/// #     object: ObjectId::new(ChunkCoord::new(0, 0), item).unwrap(),
/// #     kind: ObjectKind::Log,
/// #     species: "beech".to_owned(),
/// #     position_m: nemoral_scene::glam::DVec3::ZERO,
/// #     azimuth_deg: 0.0,
/// #     length_m: 5.0,
/// #     diameter_m: [thick_end_m, 0.05],
/// #     decay: DecayStage::Bare,
/// #     volume_m3,
/// #     is_thrown: false,
/// # };
/// let logs = [log(1, 0.09, 0.02), log(2, 0.2, 0.1), log(3, 0.4, 0.3)];
/// let plot = Plot {
///     area_m2: 1_000.0,
///     min_dbh_m: 0.07,
///     min_deadwood_diameter_m: 0.1,
/// };
/// let lying = LyingDeadwood::of(&logs, &plot)?;
/// assert!((lying.all().volume_m3_ha - 4.0).abs() < 1e-9);
/// assert_eq!(lying.of_stage(DecayStage::Bare), lying.all());
/// # Ok::<(), nemoral_scene::ParamError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LyingDeadwood {
    /// By [`DecayStage::index`].
    stages: [DeadwoodMeasures; DecayStage::ALL.len()],
}

impl LyingDeadwood {
    /// That of all pieces on a plot.
    ///
    /// # Errors
    /// As [`Plot::check`].
    pub fn of<'a>(
        pieces: impl IntoIterator<Item = &'a DeadwoodRecord>,
        plot: &Plot,
    ) -> Result<Self, ParamError> {
        plot.check()?;
        let mut volumes_m3: [Vec<f64>; DecayStage::ALL.len()] = Default::default();
        let counted = |piece: &&DeadwoodRecord| {
            let [thick_end_m, _] = piece.diameter_m;
            piece.kind == ObjectKind::Log && thick_end_m >= plot.min_deadwood_diameter_m
        };
        for piece in pieces.into_iter().filter(counted) {
            volumes_m3[piece.decay.index()].push(piece.volume_m3);
        }
        let per_ha = 1.0 / plot.hectares();
        let stages = volumes_m3.map(|mut of_stage| {
            // The sum must not depend on the order in which pieces are given.
            of_stage.sort_by(f64::total_cmp);
            DeadwoodMeasures {
                pieces_per_ha: of_stage.len() as f64 * per_ha,
                volume_m3_ha: sum_of(of_stage) * per_ha,
            }
        });
        Ok(Self { stages })
    }

    /// That of one stage of decay.
    #[must_use]
    pub fn of_stage(&self, stage: DecayStage) -> DeadwoodMeasures {
        self.stages[stage.index()]
    }

    /// That of all stages together.
    #[must_use]
    pub fn all(&self) -> DeadwoodMeasures {
        let nothing = DeadwoodMeasures::default();
        (self.stages.iter()).fold(nothing, |sum, stage| DeadwoodMeasures {
            pieces_per_ha: sum.pieces_per_ha + stage.pieces_per_ha,
            volume_m3_ha: sum.volume_m3_ha + stage.volume_m3_ha,
        })
    }
}
