//! Keeps a tree within its budget of triangles: chooses which wood is drawn, and how finely.

use super::foliage::Leaf;
use super::skeleton::Axis;
use super::sweep::{DrawnWood, Tessellation, cost};

/// Tolerances grow to at most this before any wood is left out.
const COARSEST: f64 = 2.0;

/// Draws all wood if that fits into the budget. If not, tolerances grow; then axes are left out,
/// the smallest first: those without leaves before the others, and a parent only after all that it
/// bears. The stem and the axes that lead to the top are always drawn, as they need far less than
/// the least budget.
pub(super) fn within_budget(
    most: usize,
    axes: &[Axis],
    radii: &[Vec<f64>],
    leaves: &[Leaf],
    mut tessellation: Tessellation,
) -> DrawnWood {
    let mut cost = triangles(axes, radii, tessellation);
    while cost.iter().sum::<usize>() > most && tessellation.tolerance < COARSEST {
        tessellation.tolerance = (1.2 * tessellation.tolerance).min(COARSEST);
        cost = triangles(axes, radii, tessellation);
    }
    let mut total: usize = cost.iter().sum();
    let mut drawn = vec![true; axes.len()];
    if total > most {
        let mut leafy = vec![false; axes.len()];
        for leaf in leaves {
            leafy[leaf.axis] = true;
        }
        // What a parent bears counts towards its size, so that it is left out last.
        let mut bulk: Vec<f64> = axes
            .iter()
            .zip(radii)
            .map(|(a, r)| r[0] * a.arcs()[a.points.len() - 1])
            .collect();
        // The highest twig is the tree's height.
        let top = |i: &usize| axes[*i].points[axes[*i].points.len() - 1].z;
        if let Some(highest) = (0..axes.len()).max_by(|a, b| top(a).total_cmp(&top(b))) {
            bulk[highest] = f64::INFINITY;
            leafy[highest] = true;
        }
        for i in (1..axes.len()).rev() {
            if let Some((parent, _)) = axes[i].parent {
                leafy[parent] |= leafy[i];
                bulk[parent] = bulk[parent].max(bulk[i]);
            }
        }
        let mut order: Vec<usize> = (1..axes.len()).collect();
        order.sort_by(|&a, &b| {
            let of = |i: usize| (leafy[i], bulk[i]);
            let ((la, ba), (lb, bb)) = (of(a), of(b));
            la.cmp(&lb).then(ba.total_cmp(&bb)).then(b.cmp(&a))
        });
        for i in order {
            if total <= most || bulk[i].is_infinite() {
                break;
            }
            drawn[i] = false;
            total -= cost[i];
        }
    }
    DrawnWood {
        tessellation,
        drawn,
        pointed: pointed(axes),
    }
}

/// Living twigs that bear no other end in a point.
fn pointed(axes: &[Axis]) -> Vec<bool> {
    let mut pointed: Vec<bool> = axes.iter().map(|a| a.order > 0 && !a.dead).collect();
    for (parent, _) in axes.iter().filter_map(|a| a.parent) {
        pointed[parent] = false;
    }
    pointed
}

/// An upper bound of the triangles of the wood, for every axis.
pub(super) fn triangles(
    axes: &[Axis],
    radii: &[Vec<f64>],
    tessellation: Tessellation,
) -> Vec<usize> {
    let pointed = pointed(axes);
    let of = |i: usize| cost(axes, radii, i, pointed[i], tessellation);
    (0..axes.len()).map(of).collect()
}
