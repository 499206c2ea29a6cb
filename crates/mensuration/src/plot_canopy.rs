//! The canopy of plots, for area-based methods.

use nemoral_scene::glam::DVec2;

use crate::canopy_maps::CANOPY_FROM_M;
use crate::{CanopyMaps, MapGrid};

/// Measures of the cells of a plot.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlotCanopy {
    /// The share of rays that met something 2 m above the ground or higher.
    pub cover: f64,
    /// The share of cells whose height is 2 m or more.
    pub cells: f64,
    /// Mean of the cells' heights, metres.
    pub mean_m: f64,
    /// Their median and their 95th percentile, by the nearest rank, metres.
    pub percentiles_m: [f64; 2],
    /// The greatest of them, metres.
    pub highest_m: f64,
}

impl PlotCanopy {
    /// Those of all plots of a grid: of the cells whose middles are in them; `None` for a plot
    /// without any.
    #[must_use]
    pub fn of_plots(maps: &CanopyMaps, plots: &MapGrid) -> Vec<Option<Self>> {
        let mut of_plots: Vec<(f64, Vec<f64>)> = vec![(0.0, Vec::new()); plots.cells()];
        for (number, cell) in maps.cells.iter().enumerate() {
            if let Some(plot) = plots.cell_at(maps.grid.middle_m(number)) {
                of_plots[plot].0 += cell.cover;
                of_plots[plot].1.push(cell.height_m);
            }
        }
        let measured = of_plots.into_iter();
        measured
            .map(|(cover, heights)| Self::of(cover, heights))
            .collect()
    }

    /// That of a part of the map: of the cells whose middles are in it; `None` if none are. Nothing
    /// of the part is outside of its `bounds_m`, the lowest and the highest corner, metres.
    #[must_use]
    pub fn of_part(
        maps: &CanopyMaps,
        bounds_m: [DVec2; 2],
        contains: impl Fn(DVec2) -> bool,
    ) -> Option<Self> {
        let [low_m, high_m] = bounds_m;
        let (mut cover, mut heights_m) = (0.0, Vec::new());
        for number in maps.grid.touched(low_m, high_m) {
            if contains(maps.grid.middle_m(number)) {
                cover += maps.cells[number].cover;
                heights_m.push(maps.cells[number].height_m);
            }
        }
        Self::of(cover, heights_m)
    }

    /// From the sum of covers and all heights.
    fn of(cover: f64, mut heights_m: Vec<f64>) -> Option<Self> {
        heights_m.sort_by(f64::total_cmp);
        let highest_m = *heights_m.last()?;
        let count = heights_m.len() as f64;
        let percentile = |share: f64| heights_m[((share * count).ceil().max(1.0) as usize) - 1];
        let high = heights_m.iter().filter(|m| **m >= CANOPY_FROM_M).count();
        Some(Self {
            cover: cover / count,
            cells: high as f64 / count,
            mean_m: heights_m.iter().sum::<f64>() / count,
            percentiles_m: [0.5, 0.95].map(percentile),
            highest_m,
        })
    }
}
