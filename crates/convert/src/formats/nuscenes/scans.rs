//! Scans as nuScenes has them, and whether the files of one belong together.

use nemoral_dataset::{Error as DatasetError, LidarFrame};
use nemoral_scene::Ontology;

use crate::{Error, FrameRef, Sequence, Source};

/// A scan whose files have as many points as one another, and classes that there are.
pub(super) fn read(
    source: &Source,
    sequence: Sequence<'_>,
    frame: &FrameRef<'_>,
    lidar: usize,
) -> Result<LidarFrame, Error> {
    let scan = source.scan(frame, lidar)?;
    let wrong = |folder: &str, message: String| {
        let name = &sequence.lidars[lidar].name;
        let below = if lidar == 0 { "" } else { &format!("{name}/") };
        let (number, index) = (sequence.number, frame.index);
        let extension = if folder == "points" { "ply" } else { "label" };
        let path = format!("sequences/{number:02}/{below}{folder}/{index:06}.{extension}");
        Error::Dataset(DatasetError::Malformed {
            path: source.root().join(path),
            message,
        })
    };
    let (points, labels) = (scan.points.len(), scan.labels.len());
    if labels != points {
        let message = format!("{labels} labels for {points} points of .bin");
        return Err(wrong("labels", message));
    }
    if sequence.lidars[lidar].ply && scan.ply.len() != points {
        let message = format!("{} points for {points} of .bin", scan.ply.len());
        return Err(wrong("points", message));
    }
    if let Some(class) = unknown(&scan, source.ontology()) {
        let message = format!("class {class} is none of the data set's");
        return Err(wrong("labels", message));
    }
    Ok(scan)
}

/// A class of points that the ontology does not have.
fn unknown(scan: &LidarFrame, ontology: &Ontology) -> Option<u16> {
    let mut known = [false; 256];
    for class in ontology.classes() {
        known[usize::from(class.id)] = true;
    }
    let mut classes = scan.labels.iter().map(|&(class, _)| class);
    classes.find(|&class| !known.get(usize::from(class)).is_some_and(|known| *known))
}

/// x y z intensity ring of each point, float32.
pub(super) fn encode(scan: &LidarFrame) -> Vec<u8> {
    let mut bytes = Vec::with_capacity(20 * scan.points.len());
    for (i, &[x, y, z, intensity]) in scan.points.iter().enumerate() {
        // As Velodyne's scale of diffuse targets, which nuScenes' LiDAR has: per cent, and more
        // than 100 for mirrors alone.
        let percent = (100.0 * intensity).clamp(0.0, 255.0);
        let ring = scan.ply.get(i).map_or(0.0, |p| f32::from(p.point.ring));
        for value in [x, y, z, percent, ring] {
            bytes.extend(value.to_le_bytes());
        }
    }
    bytes
}
