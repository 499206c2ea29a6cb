//! What programs that read nuScenes may take otherwise than they expect.

use std::collections::BTreeSet;

use nemoral_dataset::{DatasetHeader, LidarSpec};

/// All notes.
pub(super) fn of(header: &DatasetHeader) -> Vec<String> {
    let mut notes = Vec::new();
    if let Some(deaf) = header.sequences.iter().find(|s| s.lidars.is_empty()) {
        notes.push(format!(
            "sequence {:02} has no LiDAR, so num_lidar_pts is 0 there, and programs leave out \
             boxes without points; the converters of mmdetection3d and OpenPCDet ask each sample \
             for LIDAR_TOP and stop where there is none (KeyError)",
            deaf.number
        ));
    }
    let lidars = || header.sequences.iter().flat_map(|s| &s.lidars);
    if lidars().next().is_some() {
        notes.push(
            "boxes cover only what cameras with boxes look at, to camera.boxes_range_m, while \
             scans of LIDAR_TOP reach all around: objects elsewhere have points and no box, and \
             detectors would learn them as background; put cameras with boxes all around and \
             raise boxes_range_m, or crop the scans"
                .to_owned(),
        );
    }
    // LiDARs of one name are mostly the same ones in all sequences.
    let named = |is: fn(&LidarSpec) -> bool| -> BTreeSet<&str> {
        lidars().filter(|l| is(l)).map(|l| &*l.name).collect()
    };
    for name in named(|l| !l.deskewed) {
        notes.push(format!(
            "scans of LiDAR '{name}' are raw (lidar.deskew = false): each point is in the frame of \
             its own time, so points of a moving robot lie beside the boxes of their objects"
        ));
    }
    for name in named(|l| l.pointing_errors) {
        notes.push(format!(
            "points of LiDAR '{name}' have errors of pointing (lidar.errors), so they lie beside \
             the boxes of their objects as far as these go"
        ));
    }
    if let Some(plain) = lidars().find(|l| !l.ply) {
        notes.push(format!(
            "scans of LiDAR '{}' have no PLY file, which alone has rings: they are 0 here",
            plain.name
        ));
    }
    notes
}
