//! What makes a folder with an MCAP file a bag of rosbag2: `metadata.yaml`, and what the publisher
//! of each topic offers.
//!
//! Source: rosbag2's `yaml.hpp` and `qos.cpp`. Version 5 of the metadata is that of ROS 2 Humble,
//! which later distributions read, too. Policies are numbers in it, not names.

use std::fmt::Write;

use super::cdr;
use super::container::Channel;

/// Whether a topic's last messages are kept for those who join later.
#[derive(Clone, Copy, Debug)]
pub(super) enum Durability {
    /// They are.
    TransientLocal = 1,
    /// They are not.
    Volatile = 2,
}

/// What a publisher offers, as YAML: the last ten messages, reliably, and without any deadline.
pub(super) fn offered_qos(durability: Durability) -> String {
    // rosbag2 writes an unlimited duration as the greatest number of nanoseconds of 63 bits.
    const UNLIMITED: &str = "    sec: 9223372036\n    nsec: 854775807\n";
    // History 1 keeps the last messages, reliability 1 is reliable, liveliness 1 is automatic.
    format!(
        "- history: 1\n  depth: 10\n  reliability: 1\n  durability: {}\n  deadline:\n{UNLIMITED}  \
         lifespan:\n{UNLIMITED}  liveliness: 1\n  liveliness_lease_duration:\n{UNLIMITED}  \
         avoid_ros_namespace_conventions: false\n",
        durability as u8
    )
}

/// `metadata.yaml` of a bag of one file: its name, its topics with their numbers of messages, and
/// the times of the first and the last message, nanoseconds, if there are messages.
pub(super) fn metadata(
    file: &str,
    topics: &[(Channel, usize)],
    span_ns: Option<(u64, u64)>,
) -> String {
    let (start_ns, end_ns) = span_ns.unwrap_or((0, 0));
    let duration_ns = end_ns - start_ns;
    let total: usize = topics.iter().map(|(_, count)| count).sum();
    let schemas = cdr::schemas();
    let mut listed = String::new();
    for (channel, count) in topics {
        // Sensors have names that are plain in YAML, and so have topics and files.
        let (topic, message_type) = (&channel.topic, schemas[channel.schema].0);
        let qos = channel.qos.replace('\n', "\\n");
        write!(
            listed,
            "    - topic_metadata:\n        name: {topic}\n        type: {message_type}\n        \
             serialization_format: cdr\n        offered_qos_profiles: \"{qos}\"\n      \
             message_count: {count}\n"
        )
        .expect("a string takes any text");
    }
    let when = |indent: &str| {
        format!(
            "{indent}starting_time:\n{indent}  nanoseconds_since_epoch: {start_ns}\n\
             {indent}duration:\n{indent}  nanoseconds: {duration_ns}\n\
             {indent}message_count: {total}\n"
        )
    };
    format!(
        "rosbag2_bagfile_information:\n  version: 5\n  storage_identifier: mcap\n{}  \
         topics_with_message_count:\n{listed}  compression_format: \"\"\n  \
         compression_mode: \"\"\n  relative_file_paths:\n    - {file}\n  files:\n    \
         - path: {file}\n{}",
        when("  "),
        when("      ")
    )
}
