//! Numbers in the manual agree with the crates.

use nemoral_lidar::{Device, Wavelength};

/// The row of a device in `docs/explanation/lidar.md`.
fn row(device: Device) -> String {
    let (sheet, params, rate_hz) = (device.sheet(), device.params(), device.pattern().rate_hz());
    let [wide, tall] = sheet.field_of_view_deg;
    let beam_deg = [
        params.beam.horizontal_fwhm_rad,
        params.beam.vertical_fwhm_rad,
    ]
    .map(f64::to_degrees);
    let wavelength = match params.wavelength {
        Wavelength::Nm905 => 905,
        Wavelength::Nm1550 => 1550,
    };
    format!(
        "| `{}` | {} | {wide}° × {tall}° | {rate_hz:.0} | {:.2}° × {:.2}°, {:.1} mm | \
         {wavelength} nm | {}–{} m | {} m at {:.0} % | {:.1} cm, {:.0} cm | {:.2}° | {:.0} mm | {} \
         | {} |",
        device.name(),
        sheet.title,
        beam_deg[0],
        beam_deg[1],
        1000.0 * params.beam.exit_m,
        params.min_range_m,
        params.max_range_m,
        sheet.reference_range_m,
        100.0 * sheet.reference_reflectance,
        100.0 * sheet.sigma_floor_m,
        100.0 * sheet.sigma_at_threshold_m,
        params.errors.angular_sigma_rad.to_degrees(),
        1000.0 * params.errors.range_step_m,
        sheet.max_returns,
        sheet.source,
    )
}

#[test]
fn the_table_of_devices_is_the_crates() {
    let manual = include_str!("../../../docs/explanation/lidar.md");
    let table = manual.lines().skip_while(|l| !l.starts_with("| name"));
    let written: Vec<&str> = table.skip(2).take_while(|l| !l.is_empty()).collect();
    let rows: Vec<String> = Device::ALL.iter().copied().map(row).collect();
    assert!(written == rows, "it should be\n{}", rows.join("\n"));
}

#[test]
fn the_example_is_as_short_as_the_manual_says() {
    let example = include_str!("../../../crates/pipeline/examples/scan_obj.rs");
    let manual = include_str!("../../../docs/explanation/lidar.md");
    let lines = example.lines().count();
    assert!(lines < 42, "{lines} lines");
    assert!(manual.contains(&format!("in {lines} lines")));
}
