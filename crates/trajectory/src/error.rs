//! Errors of files of poses.

/// An error in a file of poses; `origin` is what the caller calls the file.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A line is not a pose.
    #[error("{origin}:{line}: {shown}: must be {expected}")]
    Line {
        /// The file.
        origin: String,
        /// Number of the line, from 1.
        line: usize,
        /// The text of the line, quoted and shortened if it is long, or the number that is wrong.
        shown: String,
        /// What is expected.
        expected: &'static str,
    },
    /// There is no pose.
    #[error("{origin}: holds no pose")]
    Empty {
        /// The file.
        origin: String,
    },
    /// The poses are those of a camera.
    #[error(
        "{origin}: moves along its poses' z axes, as a camera does: poses must be the body's, \
         whose x axis points forward and z axis up"
    )]
    CameraAxes {
        /// The file.
        origin: String,
    },
    /// Times do not increase.
    #[error("{origin}: time {time_s} of pose {pose} is not after {before_s}: times must increase")]
    Times {
        /// The file.
        origin: String,
        /// Number of the pose, from 1.
        pose: usize,
        /// Its time, seconds.
        time_s: f64,
        /// The time of the pose before it, seconds.
        before_s: f64,
    },
}
