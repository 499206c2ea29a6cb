//! ROS 2's messages: their definitions, and how they are laid out in bytes.
//!
//! Source: the `.msg` files of common_interfaces, geometry2 and vision_msgs (comments left out);
//! the layout is OMG's plain CDR, little-endian: each number at a multiple of its size, counted
//! from after the four bytes that name the encoding.

use nemoral_scene::RigidTransform;

/// The schemas, by where they stand in [`schemas`].
pub(super) const POINT_CLOUD: usize = 0;
pub(super) const IMAGE: usize = 1;
pub(super) const CAMERA_INFO: usize = 2;
pub(super) const TF: usize = 3;
pub(super) const ODOMETRY: usize = 4;
pub(super) const IMU: usize = 5;
pub(super) const LABEL_INFO: usize = 6;

const TIME: (&str, &str) = ("builtin_interfaces/Time", "int32 sec\nuint32 nanosec\n");
const HEADER: (&str, &str) = (
    "std_msgs/Header",
    "builtin_interfaces/Time stamp\nstring frame_id\n",
);
const VECTOR: (&str, &str) = ("geometry_msgs/Vector3", "float64 x\nfloat64 y\nfloat64 z\n");
const POINT: (&str, &str) = ("geometry_msgs/Point", "float64 x\nfloat64 y\nfloat64 z\n");
const QUATERNION: (&str, &str) = (
    "geometry_msgs/Quaternion",
    "float64 x\nfloat64 y\nfloat64 z\nfloat64 w\n",
);

/// A message's own definition, and those of what it is made of, which are marked by a line of `=`.
fn definition(own: &str, parts: &[(&str, &str)]) -> String {
    let mut text = own.to_owned();
    for (name, part) in parts {
        text += &format!("{}\nMSG: {name}\n{part}", "=".repeat(80));
    }
    text
}

/// The names and definitions of all schemas.
pub(super) fn schemas() -> Vec<(&'static str, String)> {
    let field = (
        "sensor_msgs/PointField",
        "uint8 INT8=1\nuint8 UINT8=2\nuint8 INT16=3\nuint8 UINT16=4\nuint8 INT32=5\n\
         uint8 UINT32=6\nuint8 FLOAT32=7\nuint8 FLOAT64=8\n\
         string name\nuint32 offset\nuint8 datatype\nuint32 count\n",
    );
    let region = (
        "sensor_msgs/RegionOfInterest",
        "uint32 x_offset\nuint32 y_offset\nuint32 height\nuint32 width\nbool do_rectify\n",
    );
    let transform = (
        "geometry_msgs/Transform",
        "geometry_msgs/Vector3 translation\ngeometry_msgs/Quaternion rotation\n",
    );
    let stamped = (
        "geometry_msgs/TransformStamped",
        "std_msgs/Header header\nstring child_frame_id\ngeometry_msgs/Transform transform\n",
    );
    let pose = (
        "geometry_msgs/Pose",
        "geometry_msgs/Point position\ngeometry_msgs/Quaternion orientation\n",
    );
    let pose_covariance = (
        "geometry_msgs/PoseWithCovariance",
        "geometry_msgs/Pose pose\nfloat64[36] covariance\n",
    );
    let twist = (
        "geometry_msgs/Twist",
        "geometry_msgs/Vector3 linear\ngeometry_msgs/Vector3 angular\n",
    );
    let class = (
        "vision_msgs/VisionClass",
        "uint16 class_id\nstring class_name\n",
    );
    let twist_covariance = (
        "geometry_msgs/TwistWithCovariance",
        "geometry_msgs/Twist twist\nfloat64[36] covariance\n",
    );
    vec![
        (
            "sensor_msgs/msg/PointCloud2",
            definition(
                "std_msgs/Header header\nuint32 height\nuint32 width\n\
                 sensor_msgs/PointField[] fields\nbool is_bigendian\nuint32 point_step\n\
                 uint32 row_step\nuint8[] data\nbool is_dense\n",
                &[HEADER, TIME, field],
            ),
        ),
        (
            "sensor_msgs/msg/Image",
            definition(
                "std_msgs/Header header\nuint32 height\nuint32 width\nstring encoding\n\
                 uint8 is_bigendian\nuint32 step\nuint8[] data\n",
                &[HEADER, TIME],
            ),
        ),
        (
            "sensor_msgs/msg/CameraInfo",
            definition(
                "std_msgs/Header header\nuint32 height\nuint32 width\nstring distortion_model\n\
                 float64[] d\nfloat64[9] k\nfloat64[9] r\nfloat64[12] p\nuint32 binning_x\n\
                 uint32 binning_y\nsensor_msgs/RegionOfInterest roi\n",
                &[HEADER, TIME, region],
            ),
        ),
        (
            "tf2_msgs/msg/TFMessage",
            definition(
                "geometry_msgs/TransformStamped[] transforms\n",
                &[stamped, HEADER, TIME, transform, VECTOR, QUATERNION],
            ),
        ),
        (
            "nav_msgs/msg/Odometry",
            definition(
                "std_msgs/Header header\nstring child_frame_id\n\
                 geometry_msgs/PoseWithCovariance pose\ngeometry_msgs/TwistWithCovariance twist\n",
                &[
                    HEADER,
                    TIME,
                    pose_covariance,
                    pose,
                    POINT,
                    QUATERNION,
                    twist_covariance,
                    twist,
                    VECTOR,
                ],
            ),
        ),
        (
            "sensor_msgs/msg/Imu",
            definition(
                "std_msgs/Header header\ngeometry_msgs/Quaternion orientation\n\
                 float64[9] orientation_covariance\ngeometry_msgs/Vector3 angular_velocity\n\
                 float64[9] angular_velocity_covariance\n\
                 geometry_msgs/Vector3 linear_acceleration\n\
                 float64[9] linear_acceleration_covariance\n",
                &[HEADER, TIME, QUATERNION, VECTOR],
            ),
        ),
        (
            "vision_msgs/msg/LabelInfo",
            definition(
                "std_msgs/Header header\nvision_msgs/VisionClass[] class_map\nfloat32 threshold\n",
                &[HEADER, TIME, class],
            ),
        ),
    ]
}

/// A message that is being laid out.
pub(super) struct Cdr(Vec<u8>);

impl Cdr {
    pub(super) fn new() -> Self {
        // Plain CDR, little-endian, no options.
        Self(vec![0, 1, 0, 0])
    }

    pub(super) fn finish(self) -> Vec<u8> {
        self.0
    }

    fn align(&mut self, size: usize) {
        let filled = 4 + (self.0.len() - 4).next_multiple_of(size);
        self.0.resize(filled, 0);
    }

    pub(super) fn u8(&mut self, value: u8) -> &mut Self {
        self.0.push(value);
        self
    }

    pub(super) fn u16(&mut self, value: u16) -> &mut Self {
        self.align(2);
        self.0.extend_from_slice(&value.to_le_bytes());
        self
    }

    pub(super) fn u32(&mut self, value: u32) -> &mut Self {
        self.align(4);
        self.0.extend_from_slice(&value.to_le_bytes());
        self
    }

    pub(super) fn f64(&mut self, value: f64) -> &mut Self {
        self.align(8);
        self.0.extend_from_slice(&value.to_le_bytes());
        self
    }

    pub(super) fn f64s(&mut self, values: &[f64]) -> &mut Self {
        for &value in values {
            self.f64(value);
        }
        self
    }

    /// A text, with its length and a zero.
    pub(super) fn text(&mut self, text: &str) -> &mut Self {
        self.u32(text.len() as u32 + 1);
        self.0.extend_from_slice(text.as_bytes());
        self.u8(0)
    }

    /// Bytes with their number.
    pub(super) fn bytes(&mut self, bytes: &[u8]) -> &mut Self {
        self.u32(bytes.len() as u32);
        self.0.extend_from_slice(bytes);
        self
    }

    /// `std_msgs/Header`.
    pub(super) fn header(&mut self, time_ns: u64, frame: &str) -> &mut Self {
        let (seconds, rest) = (time_ns / 1_000_000_000, time_ns % 1_000_000_000);
        self.u32(seconds as u32).u32(rest as u32).text(frame)
    }

    /// `geometry_msgs/Transform` and `geometry_msgs/Pose`, which are laid out alike.
    pub(super) fn pose(&mut self, pose: &RigidTransform) -> &mut Self {
        self.f64s(&pose.translation_m.to_array());
        self.f64s(&pose.rotation.to_array())
    }
}
