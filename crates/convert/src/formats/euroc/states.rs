//! What the inertial unit measured, and the true states.

use std::fmt::Write;
use std::path::PathBuf;

use nemoral_dataset::{Error as DatasetError, TrackRecord};

use super::{calibration, stamp, stamp_of};
use crate::formats::mcap::START_NS;
use crate::formats::mcap::odometry::Motion;
use crate::{Error, FrameRef, Sequence, Source, StepFiles};

const SAMPLES_HEADER: &str = "#timestamp [ns],w_RS_S_x [rad s^-1],w_RS_S_y [rad s^-1],\
w_RS_S_z [rad s^-1],a_RS_S_x [m s^-2],a_RS_S_y [m s^-2],a_RS_S_z [m s^-2]\n";

/// Position, orientation and velocity of B in the world, and the biases of gyroscope and
/// accelerometer.
const STATES_HEADER: &str = "#timestamp,p_RS_R_x [m],p_RS_R_y [m],p_RS_R_z [m],q_RS_w [],\
q_RS_x [],q_RS_y [],q_RS_z [],v_RS_R_x [m s^-1],v_RS_R_y [m s^-1],v_RS_R_z [m s^-1],\
b_w_RS_S_x [rad s^-1],b_w_RS_S_y [rad s^-1],b_w_RS_S_z [rad s^-1],b_a_RS_S_x [m s^-2],\
b_a_RS_S_y [m s^-2],b_a_RS_S_z [m s^-2]\n";

/// Puts `imu0` and `imu.yaml`, if the sequence has a unit, and the true states.
pub(super) fn put(
    source: &Source,
    sequence: &Sequence<'_>,
    frames: &[FrameRef<'_>],
    files: &mut StepFiles,
) -> Result<(), Error> {
    let number = sequence.number;
    // Tables that are not those of a unit are refused.
    source.imu(number)?;
    let unit = sequence.imu.zip(source.imu_files(number)?);
    let states = if let Some((unit, recorded)) = unit {
        let place = |name: &str| source.root().join(format!("sequences/{number:02}/{name}"));
        let densities = densities(place("imu0/sensor.yaml"), &recorded.sensor)?;
        let sensor = calibration::unit_yaml(unit, &densities);
        files.put(format!("{number:02}/mav0/imu0/sensor.yaml"), sensor);
        let samples = later(place("imu0/data.csv"), &recorded.samples, SAMPLES_HEADER)?;
        files.put(format!("{number:02}/mav0/imu0/data.csv"), samples);
        let kalibr = calibration::kalibr_unit_yaml(unit, &densities);
        files.put(format!("{number:02}/imu.yaml"), kalibr);
        let states = place("state_groundtruth_estimate0/data.csv");
        later(states, &recorded.states, STATES_HEADER)?
    } else {
        states_of(frames, source.track(number))
    };
    let folder = format!("{number:02}/mav0/state_groundtruth_estimate0");
    files.put(format!("{folder}/data.csv"), states);
    let sensor = calibration::states_yaml();
    files.put(format!("{folder}/sensor.yaml"), sensor);
    Ok(())
}

/// A table with the times of the format; all else stays as it is.
fn later(path: PathBuf, table: &str, header: &str) -> Result<String, Error> {
    let mut text = String::with_capacity(table.len() + table.len() / 4);
    text += header;
    for line in table.lines().filter(|line| !line.starts_with('#')) {
        let moved = line.split_once(',').and_then(|(time_ns, rest)| {
            let time_ns = time_ns.parse::<i64>().ok()?;
            Some((START_NS.checked_add_signed(time_ns)?, rest))
        });
        let Some((time_ns, rest)) = moved else {
            let shown: String = line.chars().take(200).collect();
            let message = format!("'{shown}' does not begin with a time in nanoseconds");
            return Err(DatasetError::Malformed { path, message }.into());
        };
        let _ = writeln!(text, "{},{rest}", stamp_of(time_ns));
    }
    Ok(text)
}

/// The densities of a unit's errors, in the order of [`calibration::DENSITIES`], from the data
/// set's description of it.
fn densities(path: PathBuf, sensor: &str) -> Result<[f64; 4], Error> {
    let mut all = [0.0; 4];
    for (density, name) in all.iter_mut().zip(calibration::DENSITIES) {
        let value = sensor.lines().find_map(|line| {
            let value = line.strip_prefix(name)?.strip_prefix(':')?;
            let value = value.split('#').next()?.trim().parse::<f64>().ok()?;
            (value.is_finite() && value >= 0.0).then_some(value)
        });
        let Some(value) = value else {
            let message = format!("{name}: must be a number of at least 0");
            return Err(DatasetError::Malformed { path, message }.into());
        };
        *density = value;
    }
    Ok(all)
}

/// The true states by the frames alone: velocities are by differences of places, 0 where a
/// neighbour is missing, and there is nothing that has biases.
fn states_of(frames: &[FrameRef<'_>], track: Option<&TrackRecord>) -> String {
    let mut text = STATES_HEADER.to_owned();
    let motion = Motion {
        frames,
        track,
        unit: None,
    };
    for (i, frame) in frames.iter().enumerate() {
        let pose = frame.world_from_body();
        let twist = motion.at(i).unwrap_or_default();
        let velocity = pose.rotation * twist.linear_m_s;
        let [x, y, z, w] = pose.rotation.to_array();
        let turn = [w, x, y, z];
        let place = pose.translation_m.to_array();
        text += &stamp(frame);
        for number in place.into_iter().chain(turn).chain(velocity.to_array()) {
            // Adding zero turns -0 into 0.
            let _ = write!(text, ",{}", number + 0.0);
        }
        text += ",0,0,0,0,0,0\n";
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tables_keep_all_but_their_times() {
        let table = "#timestamp,x\n-5,1.50,2\n0,1e-3\n";
        let found = later(PathBuf::new(), table, "#head\n").expect("sound");
        assert_eq!(
            found,
            "#head\n0000000000999999995,1.50,2\n0000000001000000000,1e-3\n"
        );
        for wrong in ["", "1", "x,1", "-1000000001,1", "9223372036854775808,1"] {
            let table = format!("0,1\n{wrong}\n");
            let error = later("data.csv".into(), &table, "").expect_err(wrong);
            let told = error.to_string();
            assert!(
                told.starts_with("data.csv: '") && told.contains("a time"),
                "{told}"
            );
        }
    }

    #[test]
    fn densities_are_in_the_description() {
        let lines = [
            "gyroscope_noise_density: 0.5 # rad",
            "gyroscope_random_walk: 0.25",
            "accelerometer_noise_density: 0",
            "accelerometer_random_walk: 3e-3",
        ];
        let found = densities(PathBuf::new(), &lines.join("\n")).expect("sound");
        assert_eq!(found, [0.5, 0.25, 0.0, 0.003]);
        for wrong in [
            "",
            "accelerometer_random_walk: -1",
            "accelerometer_random_walk: x",
        ] {
            let text = [&lines[..3], &[wrong]].concat().join("\n");
            let error = densities("sensor.yaml".into(), &text).expect_err(wrong);
            assert_eq!(
                error.to_string(),
                "sensor.yaml: accelerometer_random_walk: must be a number of at least 0"
            );
        }
    }
}
