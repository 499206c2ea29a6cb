//! Use of `nemoral-import` alone: a plot's basal area, and the height of its ground.

use nemoral_import::{ImportError, read_stem_map, read_trail_lines};

#[test]
fn a_plot_is_measured() -> Result<(), ImportError> {
    let stems = read_stem_map(b"x_m,y_m,dbh_cm\n1,1,20\n4,3,40\n")?;
    let area_m2: f64 = stems
        .iter()
        .filter_map(|s| s.dbh_m)
        .map(|d| 0.25 * std::f64::consts::PI * d * d)
        .sum();
    assert!((area_m2 - 0.157).abs() < 1e-3);
    let trails = read_trail_lines(b"x_m,y_m\n0,0\n30,40\n")?;
    let [[x0, y0], [x1, y1]] = trails.lines[0].vertices_m[..] else {
        panic!("two vertices");
    };
    assert_eq!((x1 - x0).hypot(y1 - y0), 50.0);
    Ok(())
}
