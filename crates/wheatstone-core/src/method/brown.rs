//! Brown's cameras, fitted by bundle adjustment to known points; then triangulation.
//!
//! Sources: D. C. Brown 1971, "Close-range camera calibration", Photogrammetric Engineering 37(8);
//! Weng, Cohen & Herniou 1992 (doi:10.1109/34.159901) for the thin prism; adjustment and choice of
//! terms as in the module on fitting cameras.

use super::{
    AnyMethod, Fit, FittedCameras, Method, resection::NestedModels, resection_start::Lens, unknown,
};
use crate::{
    Error, Result,
    camera::{brown_conrady::BrownConrady, pinhole::Pinhole},
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
        }
    }
}

/// Brown's cameras and their noise.
pub type BrownReconstructor = FittedCameras<BrownConrady>;

impl Brown {
    const PRESETS: &'static [&'static str] =
        &["default", "pinhole", "radial", "fixed", "rational", "prism", "full", "tilt"];

    /// The terms, in the order in which a camera takes them on: those that real lenses have most of
    /// come first.
    fn ladder(&self) -> NestedModels {
        let (k1, k2, k3) = (4, 5, 6);
        let mut rungs = vec![vec![0, 1, 2, 3]];
        let mut take = |wanted: bool, terms: &[usize]| {
            if let (true, Some(last)) = (wanted, rungs.last()) {
                rungs.push(last.iter().chain(terms).copied().collect());
            }
        };
        take(self.radial >= 1, &[k1]);
        let second: &[usize] = match (self.radial >= 2, self.tangential) {
            (true, true) => &[k2, 7, 8],
            (true, false) => &[k2],
            (false, _) => &[7, 8],
        };
        take(self.radial >= 2 || self.tangential, second);
        take(self.radial >= 3, &[k3]);
        take(self.rational, &[9, 10, 11]);
        take(self.prism, &[12, 13, 14, 15]);
        take(self.tilt, &[16, 17]);
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
        self.ladder().fit::<BrownConrady>(train, progress)
    }

    fn summary(&self) -> &'static str {
        "cameras with radial and tangential distortion, bundle adjusted, then triangulation (1971)"
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

#[cfg(test)]
mod tests {
    use super::{
        super::{
            AnyReconstructor,
            fitted_cameras::tests::{fit, rig, staged},
        },
        *,
    };
    use wheatstone_numeric::progress::Silent;

    #[test]
    fn a_camera_takes_no_more_terms_than_it_needs() {
        let terms = |radial: [f64; 3], tangential| {
            let lens = BrownConrady { radial, tangential, ..BrownConrady::default() };
            let data = staged(&rig(vec![lens; 2]), 0.4, (0.1, 1), |p| p);
            let AnyReconstructor::Brown(fitted) = fit("brown", &data) else { unreachable!() };
            assert!((fitted.pixel_sigma - 0.1).abs() < 0.01, "{}", fitted.pixel_sigma);
            fitted.cameras[0].model
        };
        let plain = terms([0.0; 3], [0.0; 2]);
        assert_eq!((plain.radial, plain.tangential), ([0.0; 3], [0.0; 2]));
        let barrel = terms([-0.2, 0.0, 0.0], [0.0; 2]);
        assert_eq!((barrel.radial[1], barrel.tangential), (0.0, [0.0; 2]));
        assert!((barrel.radial[0] + 0.2).abs() < 0.005);
        let full = terms([-0.23, 0.12, -0.02], [1e-3, -5e-4]);
        assert!(full.radial[1] != 0.0 && (full.tangential[0] - 1e-3).abs() < 3e-4, "{full:?}");
    }

    #[test]
    fn every_preset_fits_its_own_terms() {
        let lens = BrownConrady {
            rational: [0.05, 0.02, 0.0],
            prism: [2e-3, 0.0, -1e-3, 0.0],
            ..BrownConrady::default()
        };
        let data = staged(&rig(vec![lens; 2]), 0.4, (0.02, 2), |p| p);
        let sigma = |preset: &str| {
            let method = Brown::default().preset(preset).unwrap();
            match method.fit_checked(&data, 0, &Silent).unwrap().reconstructor {
                AnyReconstructor::Brown(fitted) => {
                    let model = fitted.cameras[0].model;
                    if preset == "pinhole" {
                        assert_eq!(model, BrownConrady::ideal(model.pinhole));
                    }
                    fitted.pixel_sigma
                }
                other => panic!("{other:?}"),
            }
        };
        assert!(sigma("full") < 0.022 && sigma("full") < sigma("default"));
        assert!(sigma("default") < sigma("radial") && sigma("radial") < sigma("pinhole"));
        assert!(sigma("fixed") < 2.0 * sigma("default") && sigma("rational") < sigma("radial"));
        let odd = Brown { radial: 4, ..Brown::default() };
        assert!(matches!(odd.fit(&data, 0, &Silent), Err(Error::Setting { .. })));
        assert!(matches!(odd.preset("wide"), Err(Error::UnknownName { .. })));
    }
}
