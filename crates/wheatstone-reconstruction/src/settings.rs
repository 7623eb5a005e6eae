//! What is wanted of a reconstruction.

use std::{collections::BTreeSet, ops::Range};
use wheatstone_charts::imaging::ColourImage;
use wheatstone_core::{Error, Result};

/// What is wanted of a reconstruction.
#[derive(Clone, Debug, PartialEq)]
pub struct ReconstructionSettings {
    /// Two or more cameras of the model, counted from 0, in the order of the pictures. The first two make the pair whose
    /// left picture is reconstructed; that picture is matched with those of the others, too.
    pub cameras: Vec<usize>,
    /// Width and height of their pictures in pixels.
    pub sizes: Vec<[u32; 2]>,
    /// The nearest and the farthest depth to search, along the virtual cameras' axis, in the model's unit. Default: the
    /// depths that the model was fitted to, with a margin.
    pub depths: Option<[f64; 2]>,
    /// Points whose probability of a disparity error below a pixel is less are left out. Default: [`Self::LEAST_CONFIDENCE`].
    pub least_confidence: f32,
    /// Points with a larger standard deviation along any axis are left out, in the model's unit.
    pub most_sigma: Option<f64>,
    /// The part of the first camera's picture that is wanted: left, top, width and height in pixels.
    pub region: Option<[u32; 4]>,
    /// Whether only corners and edges are matched, instead of every pixel: where texture is thin, or time short.
    pub sparse: bool,
}

impl ReconstructionSettings {
    /// What [`Self::least_confidence`] is where nothing else is asked for.
    pub const LEAST_CONFIDENCE: f32 = 0.95;

    /// The first cameras of a model, with pictures of these sizes.
    #[must_use]
    pub fn new(sizes: impl Into<Vec<[u32; 2]>>) -> Self {
        let sizes = sizes.into();
        Self {
            cameras: (0..sizes.len()).collect(),
            sizes,
            depths: None,
            least_confidence: Self::LEAST_CONFIDENCE,
            most_sigma: None,
            region: None,
            sparse: false,
        }
    }

    /// Whether a pixel of the reference camera is one of those that are wanted.
    pub(crate) fn holds(&self, [x, y]: [f64; 2]) -> bool {
        let inside = |at: f64, from: u32, length: u32| {
            at >= f64::from(from) - 0.5 && at < f64::from(from) + f64::from(length) - 0.5
        };
        self.region.is_none_or(|[left, top, width, height]| {
            inside(x, left, width) && inside(y, top, height)
        })
    }

    /// Whether pictures are those that the settings tell.
    pub(crate) fn check_pictures(&self, pictures: &[&ColourImage]) -> Result<()> {
        if pictures.len() != self.cameras.len() {
            let [model, data] = [self.cameras.len(), pictures.len()];
            let what = "number of pictures";
            return Err(Error::Mismatch { what, model: model.to_string(), data: data.to_string() });
        }
        for (picture, size) in pictures.iter().zip(&self.sizes) {
            let found = [picture.gray.width() as u32, picture.gray.height() as u32];
            if found != *size {
                return Err(other_size(PICTURES, *size, found));
            }
        }
        Ok(())
    }

    /// Whether the region has something of the reference camera's picture.
    pub(crate) fn check_region(&self, reference: usize) -> Result<()> {
        let mut sizes = self.cameras.iter().zip(&self.sizes);
        let size = sizes.find(|(camera, _)| **camera == reference).map(|(_, size)| *size);
        let Some(([left, top, width, height], [across, down])) = self.region.zip(size) else {
            return Ok(());
        };
        if left < across && top < down {
            return Ok(());
        }
        Err(Error::Setting {
            setting: "region".into(),
            value: format!(
                "{left},{top},{width},{height}: it lies wholly outside of the picture of {across} x {down} pixels"
            ),
            need: "left, top, width and height of a part of the left camera's picture".into(),
        })
    }

    /// What can be said before any work.
    pub(crate) fn check(&self) -> Result<()> {
        let refuse = |setting: &str, value: String, need: &str| {
            Err(Error::Setting { setting: setting.into(), value, need: need.into() })
        };
        let different: BTreeSet<&usize> = self.cameras.iter().collect();
        if self.cameras.len() < 2 || different.len() < self.cameras.len() {
            let named: Vec<String> = self.cameras.iter().map(|own| (own + 1).to_string()).collect();
            return refuse("cameras", named.join(","), "two or more different cameras");
        }
        if self.sizes.len() != self.cameras.len() {
            return refuse("sizes of pictures", self.sizes.len().to_string(), "one a camera");
        }
        if let Some([near, far]) = self.depths
            && !(near > 0.0 && near < far && far.is_finite())
        {
            let need = "two depths above 0, the nearer one first, as in 300:1500";
            return refuse("range of depths", format!("{near}:{far}"), need);
        }
        if !(0.0..1.0).contains(&self.least_confidence) {
            let value = self.least_confidence.to_string();
            return refuse("confidence", value, "a probability from 0 to below 1");
        }
        if let Some(sigma) = self.most_sigma.filter(|sigma| sigma.is_nan() || *sigma <= 0.0) {
            return refuse("largest standard deviation", sigma.to_string(), "a length above 0");
        }
        Ok(())
    }
}

/// Disparities that a search can go over at all.
const MOST: f64 = wheatstone_stereo::MOST_DISPARITIES as f64;

/// Whole disparities from the least to before the most, both in pixels.
pub(crate) fn whole([least, most]: [f64; 2]) -> Result<Range<i32>> {
    let (first, end) = (least.floor(), most.ceil() + 1.0);
    if end - first > MOST {
        return Err(Error::Setting {
            setting: "range of depths".into(),
            value: format!("{:.0} disparities", end - first),
            need: format!(
                "at most {MOST}: name a larger nearest depth, or scale the pictures down and calibrate at that size"
            ),
        });
    }
    Ok(first as i32..end as i32)
}

pub(crate) const PICTURES: &str = "size of the pictures";

pub(crate) fn other_size(what: &'static str, known: [u32; 2], found: [u32; 2]) -> Error {
    let text = |[width, height]: [u32; 2]| format!("{width} x {height}");
    Error::Mismatch { what, model: text(known), data: text(found) }
}
