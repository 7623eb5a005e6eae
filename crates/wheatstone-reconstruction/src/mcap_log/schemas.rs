//! What the messages are made of, as readers of the log need it: protobuf's descriptions of them.

use prost::Message;
use prost_types::{
    DescriptorProto, EnumDescriptorProto, EnumValueDescriptorProto, FieldDescriptorProto,
    FileDescriptorProto, FileDescriptorSet,
    field_descriptor_proto::{Label, Type},
};

/// A field: its name, number and type, the name of the type where it has one, and whether it is repeated.
type Field = (&'static str, i32, Type, &'static str, bool);

const TIMESTAMP: Field = ("timestamp", 1, Type::Message, ".google.protobuf.Timestamp", false);

const fn one(name: &'static str, number: i32, kind: Type) -> Field {
    (name, number, kind, "", false)
}

const fn of(name: &'static str, number: i32, message: &'static str) -> Field {
    (name, number, Type::Message, message, false)
}

const fn doubles(name: &'static str, number: i32) -> Field {
    (name, number, Type::Double, "", true)
}

/// Foxglove's messages.
const MESSAGES: [(&str, &[Field]); 9] = [
    ("Vector3", &[one("x", 1, Type::Double), one("y", 2, Type::Double), one("z", 3, Type::Double)]),
    (
        "Quaternion",
        &[
            one("x", 1, Type::Double),
            one("y", 2, Type::Double),
            one("z", 3, Type::Double),
            one("w", 4, Type::Double),
        ],
    ),
    (
        "Pose",
        &[of("position", 1, ".foxglove.Vector3"), of("orientation", 2, ".foxglove.Quaternion")],
    ),
    (
        "PackedElementField",
        &[
            one("name", 1, Type::String),
            one("offset", 2, Type::Fixed32),
            ("type", 3, Type::Enum, ".foxglove.PackedElementField.NumericType", false),
        ],
    ),
    (
        "PointCloud",
        &[
            TIMESTAMP,
            one("frame_id", 2, Type::String),
            of("pose", 3, ".foxglove.Pose"),
            one("point_stride", 4, Type::Fixed32),
            ("fields", 5, Type::Message, ".foxglove.PackedElementField", true),
            one("data", 6, Type::Bytes),
        ],
    ),
    (
        "CompressedImage",
        &[
            TIMESTAMP,
            one("data", 2, Type::Bytes),
            one("format", 3, Type::String),
            one("frame_id", 4, Type::String),
        ],
    ),
    (
        "CameraCalibration",
        &[
            TIMESTAMP,
            one("width", 2, Type::Fixed32),
            one("height", 3, Type::Fixed32),
            one("distortion_model", 4, Type::String),
            doubles("D", 5),
            doubles("K", 6),
            doubles("R", 7),
            doubles("P", 8),
            one("frame_id", 9, Type::String),
        ],
    ),
    (
        "FrameTransform",
        &[
            TIMESTAMP,
            one("parent_frame_id", 2, Type::String),
            one("child_frame_id", 3, Type::String),
            of("translation", 4, ".foxglove.Vector3"),
            of("rotation", 5, ".foxglove.Quaternion"),
        ],
    ),
    (
        "RawImage",
        &[
            TIMESTAMP,
            one("width", 2, Type::Fixed32),
            one("height", 3, Type::Fixed32),
            one("encoding", 4, Type::String),
            one("step", 5, Type::Fixed32),
            one("data", 6, Type::Bytes),
            one("frame_id", 7, Type::String),
        ],
    ),
];

/// The kinds of numbers that a packed cloud may hold, from 0.
const NUMERIC_TYPES: [&str; 9] =
    ["UNKNOWN", "UINT8", "INT8", "UINT16", "INT16", "UINT32", "INT32", "FLOAT32", "FLOAT64"];

/// Of [`NUMERIC_TYPES`].
pub(super) const UINT8: i32 = 1;
pub(super) const FLOAT32: i32 = 7;

/// The schema of all messages.
pub(super) fn descriptors() -> Vec<u8> {
    let timestamp =
        DescriptorProto { name: Some("Timestamp".into()), ..DescriptorProto::default() };
    let parts = [one("seconds", 1, Type::Int64), one("nanos", 2, Type::Int32)];
    let timestamp = DescriptorProto { field: parts.iter().map(field).collect(), ..timestamp };
    let time = file("google/protobuf/timestamp.proto", "google.protobuf", vec![timestamp]);
    let foxglove = file("foxglove.proto", "foxglove", MESSAGES.iter().map(message).collect());
    let foxglove =
        FileDescriptorProto { dependency: time.name.clone().into_iter().collect(), ..foxglove };
    FileDescriptorSet { file: vec![time, foxglove] }.encode_to_vec()
}

fn file(name: &str, package: &str, messages: Vec<DescriptorProto>) -> FileDescriptorProto {
    FileDescriptorProto {
        name: Some(name.into()),
        package: Some(package.into()),
        message_type: messages,
        syntax: Some("proto3".into()),
        ..FileDescriptorProto::default()
    }
}

fn message((name, fields): &(&str, &[Field])) -> DescriptorProto {
    let value = |(number, name): (usize, &&str)| EnumValueDescriptorProto {
        name: Some((*name).into()),
        number: Some(number as i32),
        options: None,
    };
    let kinds = || EnumDescriptorProto {
        name: Some("NumericType".into()),
        value: NUMERIC_TYPES.iter().enumerate().map(value).collect(),
        ..EnumDescriptorProto::default()
    };
    let has_kinds = fields.iter().any(|field| field.2 == Type::Enum);
    DescriptorProto {
        name: Some((*name).into()),
        field: fields.iter().map(field).collect(),
        enum_type: has_kinds.then(kinds).into_iter().collect(),
        ..DescriptorProto::default()
    }
}

fn field((name, number, kind, type_name, is_repeated): &Field) -> FieldDescriptorProto {
    let label = if *is_repeated { Label::Repeated } else { Label::Optional };
    FieldDescriptorProto {
        name: Some((*name).into()),
        number: Some(*number),
        label: Some(label.into()),
        r#type: Some((*kind).into()),
        type_name: (!type_name.is_empty()).then(|| (*type_name).into()),
        ..FieldDescriptorProto::default()
    }
}
