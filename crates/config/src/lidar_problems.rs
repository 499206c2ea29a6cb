//! Combinations of a LiDAR's keys that are impossible, though each value alone is allowed.

use nemoral_lidar::{Device, ScanMirror};

use super::validate::Problems;
use super::{Lidar, LidarMirror, LidarPattern, MirrorKind, ReturnMode};

/// What is impossible in a LiDAR's table, which is at `path`.
pub(super) fn lidar_problems(path: &str, lidar: &Lidar, out: &mut Problems) {
    let key = |name: &str| format!("{path}.{name}");
    match &lidar.pattern {
        LidarPattern::Lines(l) => out.ordered(
            (&key("lines.low_deg"), l.low_deg),
            (&key("lines.high_deg"), l.high_deg),
        ),
        LidarPattern::Panorama(p) => out.ordered(
            (&key("panorama.low_deg"), p.low_deg),
            (&key("panorama.high_deg"), p.high_deg),
        ),
        LidarPattern::Mirror(m) => mirror_problems(&key("mirror"), m, out),
        LidarPattern::Table(table) if table.path.is_empty() => {
            out.refuse(&key("table.path"), "\"\"", "name a CSV file of pulses");
        }
        LidarPattern::Table(_)
        | LidarPattern::Mid40(_)
        | LidarPattern::Horizon(_)
        | LidarPattern::Mid70(_)
        | LidarPattern::Avia(_)
        | LidarPattern::Spinning(_) => {}
    }
    if !matches!(lidar.wavelength_nm, 905 | 1550) {
        out.refuse(&key("wavelength_nm"), lidar.wavelength_nm, "be 905 or 1550");
    }
    if lidar.min_range_m >= lidar.max_range_m {
        let must = format!("be below {path}.max_range_m = {}", lidar.max_range_m);
        out.refuse(&key("min_range_m"), lidar.min_range_m, &must);
    }
    return_problems(path, lidar, out);
    carrier_problems(path, lidar, out);
}

/// More returns than the device has.
fn return_problems(path: &str, lidar: &Lidar, out: &mut Problems) {
    let Some(device) = Device::from_name(&lidar.device) else {
        return;
    };
    let most = device.sheet().max_returns;
    let of_device = format!("with {path}.device = \"{}\"", device.name());
    match lidar.returns {
        ReturnMode::Dual | ReturnMode::All if most < 2 => {
            let word = format!("\"{}\"", lidar.returns.word());
            let must = format!(
                "be \"strongest\", \"first\" or \"last\" {of_device}, which has one return"
            );
            out.refuse(&format!("{path}.returns"), word, &must);
        }
        ReturnMode::All if lidar.max_returns > u32::from(most) => {
            let must = format!("be at most {most} {of_device}");
            out.refuse(&format!("{path}.max_returns"), lidar.max_returns, &must);
        }
        _ => {}
    }
}

/// A LiDAR inside of what carries it.
fn carrier_problems(path: &str, lidar: &Lidar, out: &mut Problems) {
    let &[x0, y0, z0, x1, y1, z1] = lidar.carrier.as_slice() else {
        return;
    };
    let mount_m = [lidar.mount_x_m, lidar.mount_y_m, lidar.mount_z_m];
    let sides = [(x0, x1), (y0, y1), (z0, z1)];
    let mut axes = mount_m.iter().zip(sides);
    if axes.all(|(at, (low, high))| (low..=high).contains(at)) {
        let must = format!(
            "leave out the LiDAR, which is at {mount_m:?} by {path}.mount_x_m, mount_y_m and \
             mount_z_m"
        );
        let carrier = format!("{:?}", lidar.carrier);
        out.refuse(&format!("{path}.carrier"), carrier, &must);
    }
}

fn mirror_problems(path: &str, mirror: &LidarMirror, out: &mut Problems) {
    let key = |name: &str| format!("{path}.{name}");
    if mirror.kind != MirrorKind::Rotating && mirror.half_angle_deg > 90.0 {
        let must = format!("be at most 90 with {path}.kind = {:?}", mirror.kind.word());
        out.refuse(&key("half_angle_deg"), mirror.half_angle_deg, &must);
    } else if ScanMirror::new(mirror.params()).is_err_and(|e| e.field == "lines_hz") {
        let must = format!(
            "be so few that each has a pulse of {path}.rate_hz = {}",
            mirror.rate_hz
        );
        out.refuse(&key("lines_hz"), mirror.lines_hz, &must);
    }
}
