//! All tests are in one binary, because linking takes most of the time. `common` has the world and
//! its sensors, `round_trip` the formats, `sensors` mounts and lenses, `further_truth` what cameras
//! write on request, `refusals` what cannot be written, `resume` folders and modes, `atomic`
//! failing disks, `check` sabotage, `cloud` registered clouds, `cloud_tables` the tables beside
//! these, `site` where worlds lie, and `properties` what holds for any input.

#![allow(
    clippy::disallowed_methods,
    reason = "tests, examples and benchmarks use files directly"
)]

mod atomic;
mod balance;
mod check;
mod cloud;
mod cloud_tables;
mod common;
mod faults;
mod further_truth;
mod hostile;
mod imu;
mod navigation;
mod progress;
mod properties;
mod refusals;
mod resume;
mod round_trip;
mod sensors;
mod sequences;
mod site;
