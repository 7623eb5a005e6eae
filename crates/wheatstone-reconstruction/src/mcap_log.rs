//! Logs of reconstructions as MCAP files, in Foxglove's schemas: what Foxglove and Rerun show.
//!
//! Lengths are metres there. Frames are `world`, `rectified` (the left virtual camera) and `camera1`, `camera2`, … Source
//! of the messages: Foxglove's schemas, <https://docs.foxglove.dev/docs/sdk/schemas>, by its crate; its own writer of files is
//! not used, as that wants to seek.

use crate::{cloud::Cloud, reconstruction::Reconstruction, scene::SceneReconstructor};
use foxglove::{
    Encode,
    messages::{
        CameraCalibration, CompressedImage, FrameTransform, PackedElementField, PointCloud, Pose,
        Quaternion, RawImage, Timestamp, Vector3, packed_element_field::NumericType,
    },
};
use mcap::{McapError, WriteOptions, Writer, records::MessageHeader, write::NoSeek};
use nalgebra::{Rotation3, UnitQuaternion};
use std::{
    collections::BTreeMap,
    io::{self, Write},
};
use wheatstone_core::{geometry::Pose as Motion, unit::factor};

/// Frames of one reconstructor, one after the other.
pub struct McapLog<'s, 'm, W: Write> {
    made: &'s SceneReconstructor<'m>,
    writer: Writer<NoSeek<W>>,
    /// Metres in the model's unit.
    metres: f64,
    sequence: u32,
}

/// A picture as its file has it.
#[derive(Clone, Copy, Debug)]
pub struct EncodedPicture<'p> {
    /// `png`, `jpeg` or `webp`.
    pub format: &'p str,
    /// The file's content.
    pub bytes: &'p [u8],
}

const WORLD: &str = "world";
const RECTIFIED: &str = "rectified";

impl<'s, 'm, W: Write> McapLog<'s, 'm, W> {
    /// Begins a log; `unit` is that of the model. Lengths of an unknown unit are taken for metres.
    ///
    /// # Errors
    ///
    /// Those of the writer.
    pub fn new(made: &'s SceneReconstructor<'m>, unit: &str, out: W) -> io::Result<Self> {
        let options = WriteOptions::new()
            .compression(None)
            .library(concat!("wheatstone ", env!("CARGO_PKG_VERSION")))
            .disable_seeking(true);
        let writer = options.create(NoSeek::new(out)).map_err(failed)?;
        let metres = factor(unit, "m").unwrap_or(1.0);
        Ok(Self { made, writer, metres, sequence: 0 })
    }

    /// Adds what was reconstructed at a time, in seconds: poses of the cameras, the left rectified camera with its depths,
    /// the cloud, and those pictures that are given, in the order of the settings' cameras.
    ///
    /// # Errors
    ///
    /// Those of the writer.
    pub fn frame(
        &mut self,
        seconds: f64,
        pictures: &[Option<EncodedPicture<'_>>],
        found: &Reconstruction,
    ) -> io::Result<()> {
        let nanos = (seconds.max(0.0) * 1e9) as u64;
        let time =
            Timestamp::new_checked((nanos / 1_000_000_000) as u32, (nanos % 1_000_000_000) as u32);
        let rectified = self.made.pair().rectified_from_world.inverse();
        self.pose(nanos, time, (RECTIFIED, &rectified))?;
        let cameras = self.made.settings().cameras.clone();
        for (camera, picture) in cameras.iter().zip(pictures) {
            let name = format!("camera{}", camera + 1);
            if let Some(pose) = self.made.view(*camera) {
                self.pose(nanos, time, (&name, &pose))?;
            }
            if let Some(picture) = picture {
                let image = CompressedImage {
                    timestamp: time,
                    data: picture.bytes.to_vec().into(),
                    format: picture.format.into(),
                    frame_id: name.clone(),
                };
                self.put(&format!("/{name}/image"), nanos, &image)?;
            }
        }
        self.put("/rectified/calibration", nanos, &self.calibration(time))?;
        let depth = self.depth(time, &found.depth);
        self.put("/rectified/depth", nanos, &depth)?;
        self.put("/cloud", nanos, &cloud(time, &found.cloud, self.metres))
    }

    /// Ends the log.
    ///
    /// # Errors
    ///
    /// Those of the writer.
    pub fn finish(mut self) -> io::Result<W> {
        self.writer.finish().map_err(failed)?;
        Ok(self.writer.into_inner().into_inner())
    }

    /// Writes a message; its schema and its channel are written before the first of them.
    fn put<M: Encode>(&mut self, topic: &str, log_time: u64, message: &M) -> io::Result<()> {
        let mut data = Vec::new();
        message.encode(&mut data).map_err(|error| io::Error::other(error.to_string()))?;
        let writer = &mut self.writer;
        let schema = match M::get_schema() {
            Some(own) => writer.add_schema(&own.name, &own.encoding, &own.data).map_err(failed)?,
            None => 0,
        };
        let encoding = M::get_message_encoding();
        let channel_id =
            writer.add_channel(schema, topic, &encoding, &BTreeMap::new()).map_err(failed)?;
        let header =
            MessageHeader { channel_id, sequence: self.sequence, log_time, publish_time: log_time };
        self.sequence = self.sequence.wrapping_add(1);
        self.writer.write_to_known_channel(&header, &data).map_err(failed)
    }

    fn pose(
        &mut self,
        nanos: u64,
        timestamp: Option<Timestamp>,
        (frame, world_from_frame): (&str, &Motion),
    ) -> io::Result<()> {
        let translation = world_from_frame.translation * self.metres;
        let rotation = Rotation3::from_matrix_unchecked(world_from_frame.rotation);
        let rotation = UnitQuaternion::from_rotation_matrix(&rotation);
        let transform = FrameTransform {
            timestamp,
            parent_frame_id: WORLD.into(),
            child_frame_id: frame.into(),
            translation: Some(Vector3 { x: translation.x, y: translation.y, z: translation.z }),
            rotation: Some(Quaternion {
                x: rotation.i,
                y: rotation.j,
                z: rotation.k,
                w: rotation.w,
            }),
        };
        self.put("/tf", nanos, &transform)
    }

    /// The left rectified camera, a pinhole without distortion.
    fn calibration(&self, timestamp: Option<Timestamp>) -> CameraCalibration {
        let pair = self.made.pair();
        let (f, [x, y]) = (pair.focal, pair.principal[0]);
        CameraCalibration {
            timestamp,
            width: pair.size[0],
            height: pair.size[1],
            distortion_model: String::new(),
            d: Vec::new(),
            k: vec![f, 0.0, x, 0.0, f, y, 0.0, 0.0, 1.0],
            r: vec![1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0],
            p: vec![f, 0.0, x, 0.0, 0.0, f, y, 0.0, 0.0, 0.0, 1.0, 0.0],
            frame_id: RECTIFIED.into(),
        }
    }

    fn depth(&self, timestamp: Option<Timestamp>, depth: &[f32]) -> RawImage {
        let [width, height] = self.made.pair().size;
        let metres = depth.iter().map(|depth| (f64::from(*depth) * self.metres) as f32);
        RawImage {
            timestamp,
            width,
            height,
            encoding: "32FC1".into(),
            step: 4 * width,
            data: metres.flat_map(f32::to_le_bytes).collect::<Vec<u8>>().into(),
            frame_id: RECTIFIED.into(),
        }
    }
}

/// Points with their colours; standard deviations and confidence are fields of each.
fn cloud(timestamp: Option<Timestamp>, cloud: &Cloud, metres: f64) -> PointCloud {
    const NUMBERS: [&str; 7] = ["x", "y", "z", "sigma_x", "sigma_y", "sigma_z", "confidence"];
    const COLOURS: [&str; 4] = ["red", "green", "blue", "alpha"];
    let field = |name: &str, offset: usize, kind: NumericType| PackedElementField {
        name: name.into(),
        offset: offset as u32,
        r#type: kind.into(),
    };
    let numbers =
        NUMBERS.iter().enumerate().map(|(at, name)| field(name, 4 * at, NumericType::Float32));
    let colours = COLOURS
        .iter()
        .enumerate()
        .map(|(at, name)| field(name, 4 * NUMBERS.len() + at, NumericType::Uint8));
    let stride = 4 * NUMBERS.len() + COLOURS.len();
    let middle = middle(cloud);
    let mut data = Vec::with_capacity(stride * cloud.len());
    for index in 0..cloud.len() {
        let point = [0, 1, 2].map(|axis| cloud.points[index][axis] - middle[axis]);
        let lengths = point.into_iter().chain(cloud.sigmas[index].map(f64::from));
        let lengths = lengths.map(|length| (length * metres) as f32);
        let numbers = lengths.chain([cloud.confidence[index]]);
        data.extend(numbers.flat_map(f32::to_le_bytes));
        data.extend(cloud.colours[index]);
        data.push(u8::MAX);
    }
    let [x, y, z] = middle.map(|length| length * metres);
    let pose = Pose {
        position: Some(Vector3 { x, y, z }),
        orientation: Some(Quaternion { x: 0.0, y: 0.0, z: 0.0, w: 1.0 }),
    };
    PointCloud {
        timestamp,
        frame_id: WORLD.into(),
        pose: Some(pose),
        point_stride: stride as u32,
        fields: numbers.chain(colours).collect(),
        data: data.into(),
    }
}

/// What points are counted from: the middle of them where floats would be coarse in the world, else its origin.
fn middle(cloud: &Cloud) -> [f64; 3] {
    match cloud.bounds().filter(|_| cloud.float_rounding().is_some()) {
        Some([low, high]) => [0, 1, 2].map(|axis| 0.5 * (low[axis] + high[axis])),
        None => [0.0; 3],
    }
}

fn failed(error: McapError) -> io::Error {
    match error {
        McapError::Io(error) => error,
        other => io::Error::other(other.to_string()),
    }
}
