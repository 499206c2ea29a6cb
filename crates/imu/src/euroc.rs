//! The layout of the EuRoC MAV data set (Burri et al., "The EuRoC micro aerial vehicle datasets",
//! International Journal of Robotics Research 35(10), 2016): `imu0/data.csv`, `imu0/sensor.yaml`
//! and `state_groundtruth_estimate0/data.csv`. Times are nanoseconds.

use std::fmt::Write;

use nemoral_scene::RigidTransform;
use nemoral_scene::glam::DVec3;

use crate::{ImuMotion, ImuParams, ImuSample};

/// The file of samples in a data set's folder.
pub const SAMPLES: &str = "imu0/data.csv";
/// The file that describes the unit.
pub const SENSOR: &str = "imu0/sensor.yaml";
/// The file of the true states.
pub const STATES: &str = "state_groundtruth_estimate0/data.csv";

/// The first line of [`SAMPLES`].
pub const SAMPLES_HEADER: &str = "#timestamp [ns],w_RS_S_x [rad s^-1],w_RS_S_y [rad s^-1],\
w_RS_S_z [rad s^-1],a_RS_S_x [m s^-2],a_RS_S_y [m s^-2],a_RS_S_z [m s^-2]\n";

/// The first line of [`STATES`]: position, orientation and velocity of the unit in the world, and
/// the biases of gyroscope and accelerometer.
pub const STATES_HEADER: &str = "#timestamp,p_RS_R_x [m],p_RS_R_y [m],p_RS_R_z [m],q_RS_w [],\
q_RS_x [],q_RS_y [],q_RS_z [],v_RS_R_x [m s^-1],v_RS_R_y [m s^-1],v_RS_R_z [m s^-1],\
b_w_RS_S_x [rad s^-1],b_w_RS_S_y [rad s^-1],b_w_RS_S_z [rad s^-1],b_a_RS_S_x [m s^-2],\
b_a_RS_S_y [m s^-2],b_a_RS_S_z [m s^-2]\n";

/// Adds the line of a sample.
pub fn push_sample(text: &mut String, sample: &ImuSample) {
    let _ = write!(text, "{}", nanoseconds(sample.time_s));
    push(text, sample.angular_rate_rad_s);
    push(text, sample.specific_force_m_s2);
    text.push('\n');
}

/// Adds the line of a state.
pub fn push_state(text: &mut String, motion: &ImuMotion, sample: &ImuSample) {
    let _ = write!(text, "{}", nanoseconds(motion.time_s));
    push(text, motion.world_from_imu.translation_m);
    let q = motion.world_from_imu.rotation;
    let _ = write!(text, ",{:.12},{:.12},{:.12},{:.12}", q.w, q.x, q.y, q.z);
    push(text, motion.velocity_m_s);
    push(text, sample.gyroscope_bias_rad_s);
    push(text, sample.accelerometer_bias_m_s2);
    text.push('\n');
}

/// The text of [`SENSOR`]: the mount on the body, the rate, and the densities of the errors.
#[must_use]
pub fn sensor_yaml(params: &ImuParams, body_from_imu: &RigidTransform) -> String {
    let [x, y, z] = body_from_imu
        .to_rows()
        .map(|row| row.map(decimal).join(", "));
    let (g, a) = (params.errors.gyroscope, params.errors.accelerometer);
    format!(
        "sensor_type: imu\n\
         comment: simulated by nemoral\n\
         # The unit's frame on the body: x forward, y to the left, z up.\n\
         T_BS:\n  cols: 4\n  rows: 4\n  data: [{x},\n         {y},\n         {z},\n         \
         0.0, 0.0, 0.0, 1.0]\n\
         rate_hz: {}\n\
         gyroscope_noise_density: {} # rad / s / sqrt(Hz)\n\
         gyroscope_random_walk: {} # rad / s^2 / sqrt(Hz)\n\
         accelerometer_noise_density: {} # m / s^2 / sqrt(Hz)\n\
         accelerometer_random_walk: {} # m / s^3 / sqrt(Hz)\n",
        decimal(params.rate_hz),
        decimal(g.noise_density),
        decimal(g.random_walk),
        decimal(a.noise_density),
        decimal(a.random_walk)
    )
}

/// A number without an exponent, which not every reader of YAML takes for a number.
fn decimal(v: f64) -> String {
    let text = format!("{v:.12}");
    let short = text.trim_end_matches('0');
    if short.ends_with('.') {
        format!("{short}0")
    } else {
        short.to_owned()
    }
}

fn nanoseconds(time_s: f64) -> i64 {
    (time_s * 1e9).round() as i64
}

fn push(text: &mut String, v: DVec3) {
    let _ = write!(text, ",{:.9},{:.9},{:.9}", v.x, v.y, v.z);
}

#[cfg(test)]
mod tests {
    use std::f64::consts::FRAC_PI_2;

    use super::*;
    use crate::ImuErrors;

    #[test]
    fn lines_have_the_columns_of_their_headers() {
        let motion = ImuMotion {
            time_s: 0.005,
            world_from_imu: RigidTransform::from_xyz_rpy(DVec3::ONE, 0.1, 0.2, 0.3),
            velocity_m_s: DVec3::X,
            angular_rate_rad_s: DVec3::Y,
            specific_force_m_s2: DVec3::Z,
        };
        let sample = ImuSample {
            time_s: 0.005,
            angular_rate_rad_s: DVec3::new(0.25, -1.0, 0.0),
            specific_force_m_s2: DVec3::Z * 9.5,
            gyroscope_bias_rad_s: DVec3::ZERO,
            accelerometer_bias_m_s2: DVec3::X,
        };
        let (mut samples, mut states) = (String::new(), String::new());
        push_sample(&mut samples, &sample);
        push_state(&mut states, &motion, &sample);
        let columns = |line: &str| line.split(',').count();
        assert_eq!(columns(&samples), columns(SAMPLES_HEADER));
        assert_eq!(columns(&states), columns(STATES_HEADER));
        assert_eq!(
            samples,
            "5000000,0.250000000,-1.000000000,0.000000000,0.000000000,0.000000000,9.500000000\n"
        );
        assert!(states.starts_with("5000000,1.000000000,1.000000000,1.000000000,0.98334"));
    }

    #[test]
    fn the_unit_is_described() {
        let params = ImuParams {
            rate_hz: 200.0,
            errors: ImuErrors::ADIS16448,
        };
        let yaml = sensor_yaml(&params, &RigidTransform::IDENTITY);
        assert!(yaml.contains("rate_hz: 200.0\n"));
        assert!(yaml.contains("gyroscope_noise_density: 0.00016968 #"));
        assert!(yaml.contains("accelerometer_random_walk: 0.003 #"));
        // Turned to the left, its sines and cosines are not quite 0.
        let turned = RigidTransform::from_xyz_rpy(DVec3::Z * 0.5, 0.0, 0.0, FRAC_PI_2);
        let yaml = sensor_yaml(&params, &turned);
        assert!(yaml.contains("data: [0.0, -1.0, 0.0, 0.0,\n"), "{yaml}");
        assert!(yaml.contains(" 0.0, 0.0, 1.0, 0.5,\n"), "{yaml}");
        let numbers = [1e-5, 1.9393e-5, 200.0, -0.5, 0.0, 1e-16].map(decimal);
        assert_eq!(
            numbers,
            ["0.00001", "0.000019393", "200.0", "-0.5", "0.0", "0.0"]
        );
    }
}
