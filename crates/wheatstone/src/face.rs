//! The stable names, by what they are for. Each names the example that shows it.

/// Example: `examples/fit_table.rs`.
#[doc(inline)]
pub use wheatstone_core::{
    Calibration, Error, Result,
    dataset::{Correspondence, Dataset},
    geometry::{Pixel, Point3},
    method::{AnyMethod, Located, Method, Reconstructor},
};

/// Example: `examples/locate_batch.rs`.
#[doc(inline)]
pub use wheatstone_core::{
    dataset::volume::{Trust, Volume},
    geometry::PixelColumns,
    method::{
        CalibratedMap, CovarianceScale, LocatedBatch, Locator, PointNoise, SettledLocator,
        locate_all,
    },
};

/// Example: `examples/locate_batch.rs`.
#[doc(inline)]
pub use wheatstone_numeric::progress::{FnProgress, Progress, Silent};

/// Example: `examples/custom_method.rs`.
#[doc(inline)]
pub use wheatstone_core::method::{Choice, Fit};

/// Example: `examples/convert_to_opencv.rs`. A camera model of one's own:
/// `tests/open_traits.rs`.
#[doc(inline)]
pub use wheatstone_core::{
    camera::{
        AnyCamera, CameraModel, PosedCamera, brown_conrady::BrownConrady, flat_port::FlatPort,
        kannala_brandt::KannalaBrandt, pinhole::Pinhole,
    },
    geometry::Pose,
};

/// Example: `examples/calibrate_handheld_stereo.rs`.
#[doc(inline)]
pub use wheatstone_core::{
    fit::stage::StagePrior,
    geometry::StageCovariance,
    preparation::{Preparation, Prepared},
};

/// Example: `examples/judge_calibration.rs`.
#[doc(inline)]
pub use wheatstone_core::{
    evaluate::{
        CameraChange, CameraMotion, Comparison, CrossValidation, Evaluation, MethodScore, compare,
        cross_validate, evaluate,
    },
    preparation::checks::{Examination, Finding, Severity, examine},
};

/// Example: the verb `rectify` of the program, `crates/wheatstone-cli/src/commands/rectify.rs`.
#[doc(inline)]
pub use wheatstone_core::rectification::{Rectification, VirtualPair};

/// Example: `examples/detect_chart.rs`. A chart of one's own: `tests/open_traits.rs`.
#[cfg(feature = "charts")]
#[doc(inline)]
pub use wheatstone_charts::{
    chart::{
        AnyChart, Chart, ChartSearch, Detection, april_grid::AprilGrid, charuco::Charuco,
        chessboard::Chessboard, dot_grid::DotGrid, line_grid::LineGrid,
    },
    imaging::{GrayImage, Limits, read_image},
};

/// Example: the verb `detect` of the program, `crates/wheatstone-cli/src/commands/detect.rs`.
#[cfg(feature = "charts")]
#[doc(inline)]
pub use wheatstone_charts::{
    capture::Capture,
    detection::{DetectionSettings, Found, detect},
};

/// Example: `examples/convert_to_opencv.rs`. A format of one's own: `tests/open_traits.rs`.
#[cfg(feature = "io")]
#[doc(inline)]
pub use wheatstone_io::formats::{FORMATS, Format, Given, InputFile, OutputFile};

/// Example: the verb `reconstruct` of the program, `crates/wheatstone-cli/src/commands/reconstruct.rs`.
#[cfg(feature = "reconstruction")]
#[doc(inline)]
pub use wheatstone_reconstruction::{
    Cloud, Reconstruction, ReconstructionSettings, SceneReconstructor,
};

/// Example: `examples/write_report.rs`.
#[cfg(feature = "report")]
#[doc(inline)]
pub use wheatstone_report::{Material, Report, Wording};
