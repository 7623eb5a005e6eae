//! Brown's cameras, fitted by bundle adjustment to known points; then triangulation.
//!
//! Sources: D. C. Brown 1971, "Close-range camera calibration", Photogrammetric Engineering 37(8);
//! Weng, Cohen & Herniou 1992 (doi:10.1109/34.159901) for the thin prism; adjustment and choice of
//! terms as in the module on fitting cameras.

use super::{
    AnyMethod, Fit, FittedCameras, KnownLens, Method, known_lens_fit, resection::NestedModels,
    resection_start::Lens, unknown,
};
use crate::{
    Error, Result,
    camera::{
        brown_conrady::BrownConrady,
        picture_domain::{Area, undistorts},
        pinhole::Pinhole,
    },
    dataset::Dataset,
};
use serde::{Deserialize, Serialize};
use wheatstone_numeric::progress::Progress;

/// Which terms of distortion a camera may have, beside focal lengths and principal point.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Brown {
    /// How many of k1, k2, k3: 0 to 3.
    pub radial: usize,
    /// p1 and p2.
    pub tangential: bool,
    /// The denominator k4, k5, k6.
    pub rational: bool,
    /// The thin prism s1 to s4.
    pub prism: bool,
    /// The tilt of the sensor, tauX and tauY.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub tilt: bool,
    /// Whether each camera may do with fewer of these terms, where more would not predict better;
    /// otherwise all are fitted.
    pub choose: bool,
    /// Lenses that are known, one a camera: they are kept, and only poses are adjusted. None where they are to be found.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub lenses: Vec<KnownLens<BrownConrady>>,
}

impl Default for Brown {
    fn default() -> Self {
        Self {
            radial: 3,
            tangential: true,
            rational: false,
            prism: false,
            tilt: false,
            choose: true,
            lenses: Vec::new(),
        }
    }
}

/// Brown's cameras and their noise.
pub type BrownReconstructor = FittedCameras<BrownConrady>;

impl Brown {
    const PRESETS: &'static [&'static str] =
        &["default", "pinhole", "radial", "fixed", "rational", "prism", "full", "tilt"];

    /// The numbers that a camera may have, those that it may do without included.
    pub(super) fn numbers(&self) -> Vec<usize> {
        self.ladder().rungs.pop().unwrap_or_default()
    }

    /// The terms one by one, in the order in which a camera takes them on: those that real lenses have most
    /// of come first. p1 and p2 are one lens element off the axis, s1 to s4 one prism, both angles one sensor.
    fn ladder(&self) -> NestedModels {
        let [k1, k2, k3, p1, p2] = [4, 5, 6, 7, 8];
        let terms: [(bool, &[usize]); 9] = [
            (self.radial >= 1, &[k1]),
            (self.radial >= 2, &[k2]),
            (self.tangential, &[p1, p2]),
            (self.radial >= 3, &[k3]),
            (self.rational, &[9]),
            (self.rational, &[10]),
            (self.rational, &[11]),
            (self.prism, &[12, 13, 14, 15]),
            (self.tilt, &[16, 17]),
        ];
        let mut rungs = vec![vec![0, 1, 2, 3]];
        for (_, terms) in terms.into_iter().filter(|(wanted, _)| *wanted) {
            rungs.extend(rungs.last().map(|last| last.iter().chain(terms).copied().collect()));
        }
        if !self.choose {
            rungs.drain(..rungs.len() - 1);
        }
        NestedModels { method: "brown", rungs }
    }
}

impl Lens for BrownConrady {
    fn start(pinhole: Pinhole, first: f64) -> Self {
        Self { radial: [first, 0.0, 0.0], ..Self::ideal(pinhole) }
    }

    fn holds_over(&self, area: Area) -> bool {
        undistorts(self, area)
    }
}

impl Method for Brown {
    fn fit(&self, train: &Dataset, _seed: u64, progress: &dyn Progress) -> Result<Fit> {
        if self.radial > 3 {
            return Err(Error::Setting {
                setting: "radial".into(),
                value: self.radial.to_string(),
                need: "0 to 3 terms".into(),
            });
        }
        if !self.lenses.is_empty() {
            return known_lens_fit::fit(&self.lenses, train, progress);
        }
        self.ladder().fit::<BrownConrady>(train, progress)
    }

    fn includes_pose_uncertainty(&self) -> bool {
        true
    }

    fn summary(&self) -> &'static str {
        "cameras with radial and tangential distortion, least reprojection error, then triangulation (1971)"
    }

    fn presets(&self) -> &'static [&'static str] {
        Self::PRESETS
    }

    fn preset(&self, name: &str) -> Result<AnyMethod> {
        let standard = Self::default();
        let settings = match name {
            "default" => standard,
            "pinhole" => Self { radial: 0, tangential: false, ..standard },
            "radial" => Self { tangential: false, ..standard },
            "fixed" => Self { choose: false, ..standard },
            "rational" => Self { rational: true, ..standard },
            "prism" => Self { prism: true, ..standard },
            "tilt" => Self { tilt: true, ..standard },
            "full" => Self { rational: true, prism: true, ..standard },
            _ => return Err(unknown("preset", name, Self::PRESETS)),
        };
        Ok(settings.into())
    }
}
