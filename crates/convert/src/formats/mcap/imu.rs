//! The messages of an inertial measurement unit.

use nemoral_dataset::{ImuReading, ImuSpec};

use super::START_NS;
use super::cdr::Cdr;
use super::container::Message;

/// The topic, and the frame of the unit.
pub(in crate::formats) const TOPIC: &str = "/imu";
pub(super) const FRAME: &str = "imu";

/// How long before the first frame, and after the last, readings are written, nanoseconds: scans
/// begin before their frame's time and end after it.
const AROUND_NS: u64 = 1_000_000_000;

/// Of a drive's readings those around these frames, whose times are in nanoseconds, in parts: up to
/// each frame, and for the last frame all that follow.
pub(super) fn parts<'a>(
    readings: &'a [ImuReading],
    frames_ns: &[u64],
) -> impl Iterator<Item = &'a [ImuReading]> {
    let until = |at_ns: u64| readings.partition_point(|reading| time_ns(reading) <= at_ns);
    let before = |first: &u64| match first.checked_sub(AROUND_NS) {
        Some(at_ns) => until(at_ns),
        None => 0,
    };
    let first = frames_ns.first().map_or(0, before);
    let ends = frames_ns.iter().enumerate().map(|(i, time_ns)| {
        let is_last = i + 1 == frames_ns.len();
        until(time_ns.saturating_add(if is_last { AROUND_NS } else { 0 }))
    });
    let ends: Vec<usize> = ends.collect();
    (0..ends.len()).map(move |i| {
        let begin = i.checked_sub(1).map_or(first, |before| ends[before]);
        &readings[begin..ends[i].max(begin)]
    })
}

/// A reading's time, which is not before the sequence's start.
pub(super) fn time_ns(reading: &ImuReading) -> u64 {
    START_NS + u64::try_from(reading.time_ns).unwrap_or(0)
}

/// `Imu`: what the unit measured, with gravity as REP 145 has it, and without an orientation.
pub(super) fn message(channel: usize, reading: &ImuReading, imu: &ImuSpec) -> Message {
    let time_ns = time_ns(reading);
    let variances = |deviation: f64| {
        let v = deviation * deviation;
        [v, 0.0, 0.0, 0.0, v, 0.0, 0.0, 0.0, v]
    };
    let mut out = Cdr::new();
    out.header(time_ns, FRAME).f64s(&[0.0, 0.0, 0.0, 1.0]);
    // As the message's definition says, the first element is -1 where a quantity is not measured.
    let mut none = [0.0; 9];
    none[0] = -1.0;
    out.f64s(&none);
    out.f64s(&reading.angular_rate_rad_s.to_array());
    out.f64s(&variances(imu.angular_rate_noise_rad_s));
    out.f64s(&reading.specific_force_m_s2.to_array());
    out.f64s(&variances(imu.specific_force_noise_m_s2));
    Message {
        channel,
        time_ns,
        data: out.finish(),
    }
}
