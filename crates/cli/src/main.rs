//! The nemoral command line.
fn main() {}
