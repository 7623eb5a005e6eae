//! Logs can be read, by their own schemas.

use crate::optics::{SIZES, fitted, pictures};
use foxglove::{
    Decode,
    messages::{FrameTransform, PointCloud},
};
use std::collections::BTreeMap;
use wheatstone_numeric::progress::Silent;
use wheatstone_reconstruction::{
    EncodedPicture, McapLog, Reconstruction, ReconstructionSettings, SceneReconstructor,
};
use wheatstone_synthetic::{Rig, Scene};

#[test]
fn a_log_has_its_schemas_and_every_frame() {
    let rig = Rig::named("pinhole", 2).unwrap();
    let scene = Scene::before(&rig, 1);
    let model = fitted(&rig, "brown");
    let settings = ReconstructionSettings { sparse: true, ..ReconstructionSettings::new(SIZES) };
    let made = SceneReconstructor::new(&model, settings, &Silent).unwrap();
    let pictures = pictures(&rig, &scene);
    let found = made.reconstruct(&[&pictures[0], &pictures[1]], &Silent).unwrap();
    let mut log = McapLog::new(&made, "cm", Vec::new()).unwrap();
    let picture = EncodedPicture { format: "png", bytes: b"a picture" };
    for second in 0..3 {
        log.frame(f64::from(second), &[Some(picture), None], &found).unwrap();
    }
    let bytes = log.finish().unwrap();
    far_points_are_counted_from_their_middle(&made, &found);

    let mut counts: BTreeMap<String, usize> = BTreeMap::new();
    let mut centres: BTreeMap<String, f64> = BTreeMap::new();
    for message in mcap::MessageStream::new(&bytes).unwrap() {
        let message = message.unwrap();
        let topic = message.channel.topic.clone();
        let schema = message.channel.schema.as_ref().unwrap();
        assert_eq!(schema.encoding, "protobuf");
        assert!(schema.name.starts_with("foxglove.") && !schema.data.is_empty());
        assert!(message.log_time.is_multiple_of(1_000_000_000));
        if topic == "/cloud" {
            let cloud = PointCloud::decode(&message.data[..]).unwrap();
            assert_eq!(cloud.frame_id, "world");
            assert_eq!(cloud.data.len(), cloud.point_stride as usize * found.cloud.len());
            let z = f32::from_le_bytes(cloud.data[8..12].try_into().unwrap());
            assert!((f64::from(z) - 0.01 * found.cloud.points[0][2]).abs() < 1e-6, "{z}");
        }
        if topic == "/tf" {
            let motion = FrameTransform::decode(&message.data[..]).unwrap();
            centres.insert(motion.child_frame_id, motion.translation.unwrap().x);
        }
        *counts.entry(topic).or_default() += 1;
    }
    let expected = [
        ("/camera1/image", 3),
        ("/cloud", 3),
        ("/rectified/calibration", 3),
        ("/rectified/depth", 3),
        ("/tf", 9),
    ];
    assert_eq!(counts, expected.map(|(topic, count)| (topic.to_owned(), count)).into());
    // Seven centimetres apart, in metres.
    assert!((centres["camera2"] - centres["camera1"] - 0.07).abs() < 0.002, "{centres:?}");
}

/// Single precision would round them as coarsely as they are uncertain.
fn far_points_are_counted_from_their_middle(made: &SceneReconstructor, found: &Reconstruction) {
    let mut far = found.clone();
    far.cloud.points.iter_mut().for_each(|point| point[0] += 3e6);
    let mut log = McapLog::new(made, "m", Vec::new()).unwrap();
    log.frame(0.0, &[None, None], &far).unwrap();
    let bytes = log.finish().unwrap();
    let messages = mcap::MessageStream::new(&bytes).unwrap().map(Result::unwrap);
    let message = messages.into_iter().find(|message| message.channel.topic == "/cloud").unwrap();
    let cloud = PointCloud::decode(&message.data[..]).unwrap();
    let from = cloud.pose.unwrap().position.unwrap().x;
    let x = f32::from_le_bytes(cloud.data[..4].try_into().unwrap());
    assert!((from + f64::from(x) - far.cloud.points[0][0]).abs() < 1e-4, "{from} {x}");
}
