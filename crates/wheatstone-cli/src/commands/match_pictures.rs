//! `wheatstone match`.

use super::print_json;
use crate::{
    exposure::badly_exposed,
    failure::{Failure, Outcome},
    verbosity::{remark, say},
};
use clap::Args;
use serde_json::{Value, json};
use std::{
    ops::Range,
    path::{Path, PathBuf},
};
use wheatstone::{
    Error,
    formats::npy_float32,
    imaging::{GrayImage, Limits, read_image},
    stereo::{
        CONFIDENT, DisparityMap, MatchError, Matcher, PairFault, Picture, VerticalOffset,
        judge_pair,
    },
    storage::{Output, write_folder},
};

/// Match a rectified pair: disparity, confidence and standard deviation of every pixel
#[derive(Args)]
#[command(
    name = "match",
    after_help = "Examples:\n  wheatstone match left.png right.png --range 0:64 -o matched/\n  \
    wheatstone rectify model.json --images left.png right.png -o pair/\n  \
    wheatstone match pair/left/left.png pair/right/right.png --range=-20:80 -o matched/ --fill\n\n\
    A disparity is x on the left less x on the right, in pixels. The folder gets disparity.npy (NaN\n\
    where there is none), confidence.npy (the probability that a disparity is less than a pixel off)\n\
    and sigma.npy (its standard deviation in pixels), float32 of the left picture's size, and\n\
    disparity.png to look at: the nearer, the brighter; black where there is none.\n\
         docs/matching.md has the rest."
)]
pub(crate) struct Match {
    /// The left picture of a rectified pair
    left: PathBuf,
    /// The right one, of the same size
    right: PathBuf,
    /// Disparities to search, from the first to before the last
    #[arg(long, value_name = "A:B", value_parser = range, allow_hyphen_values = true)]
    range: Range<i32>,
    /// The folder for the results
    #[arg(short, long, value_name = "DIR")]
    output: PathBuf,
    /// Fill gaps with the disparities of what is behind; their confidence is 0
    #[arg(long)]
    fill: bool,
    /// Leave disparities as the search found them: faster, and less exact
    #[arg(long)]
    no_refinement: bool,
    /// Print what was found as JSON
    #[arg(long)]
    json: bool,
}

/// `0:64`.
fn range(text: &str) -> Result<Range<i32>, String> {
    let parts = text.split_once(':').map(|(a, b)| (a.trim().parse(), b.trim().parse()));
    match parts {
        Some((Ok(first), Ok(end))) if first < end => Ok(first..end),
        _ => Err("write disparities as 0:64, or --range=-16:48".into()),
    }
}

/// What the matcher cannot do, and the way out.
fn refused(error: MatchError) -> Failure {
    let hint = match error {
        MatchError::Sizes { .. } => {
            "give a rectified pair: `wheatstone rectify model.json --images LEFT RIGHT -o pair/`"
        }
        MatchError::Range { .. } | MatchError::OutsidePicture { .. } => {
            "give the disparities of the nearest and the farthest things, as in `--range 0:64`"
        }
        _ => "are these the pictures that you meant?",
    };
    Failure::usage(error.to_string(), hint)
}

impl Match {
    pub(crate) fn run(self) -> Outcome {
        let read = |path: &Path| read_image(path, Limits::default()).map_err(Failure::from);
        let images = [read(&self.left)?, read(&self.right)?];
        let bytes = images.each_ref().map(|image| image.to_8_bit().into_raw());
        let picture = |side: usize| {
            Picture::new(images[side].width(), images[side].height(), &bytes[side]).map_err(refused)
        };
        let (left, right) = (picture(0)?, picture(1)?);
        let matcher =
            Matcher::new(self.range.clone()).refining(!self.no_refinement).filling(self.fill);
        let map = matcher.compute(&left, &right).map_err(refused)?;
        let confident = map.density(CONFIDENT);
        let exchanged =
            || Ok(matcher.clone().refining(false).compute(&right, &left)?.density(CONFIDENT));
        let judged = judge_pair([&left, &right], self.range.clone(), (confident, 0.0), exchanged);
        let judged = judged.map_err(refused)?;
        let fault = judged.fault.map(|fault| {
            let mut told = fault.to_string();
            if let PairFault::NothingInCommon { .. } = fault {
                let both = [&self.left, &self.right].into_iter().zip(&images);
                told.extend(both.filter_map(|(path, image)| badly_exposed(path, image)));
            }
            told
        });
        if let Some(fault) = &fault {
            remark!("warning", "{fault}");
        } else if let Some(offset) = judged.vertical.filter(|offset| offset.is_doubtful(0.0)) {
            remark!(
                "warning",
                "{offset}: disparities of such a pair are off where edges slant; was it rectified by a calibration of \
                 cameras that have not moved since?"
            );
        }
        write_folder(&self.output, |folder| write(&map, &self.range, folder))?;
        let matched = map.disparity.iter().filter(|value| !value.is_nan()).count();
        let matched = matched as f64 / map.disparity.len() as f64;
        say!(
            "Wrote {}: {:.1} % of the pixels have a disparity, {:.1} % one that is less than a pixel off with a \
             probability above {CONFIDENT}",
            self.output.display(),
            100.0 * matched,
            100.0 * confident
        );
        if self.json {
            print_json(&json!({
                "size": [map.width, map.height],
                "matched": matched,
                "confident": confident,
                "vertical_offset": judged.vertical.map(vertical),
                "fault": fault,
            }))?;
        }
        Ok(())
    }
}

/// What is told of a vertical offset.
pub(super) fn vertical(found: VerticalOffset) -> Value {
    json!({
        "median_px": found.median,
        "median_size_px": found.median_size,
        "p95_px": found.largest,
        "sigma_px": found.sigma,
        "corners": found.corners,
    })
}

/// The three arrays, and the picture to look at.
fn write(map: &DisparityMap, range: &Range<i32>, folder: &Path) -> Result<(), Error> {
    for (name, values) in
        [("disparity", &map.disparity), ("confidence", &map.confidence), ("sigma", &map.sigma)]
    {
        let path = folder.join(format!("{name}.npy"));
        let mut output = Output::create(&path)?;
        let bytes = npy_float32((map.height, map.width), values);
        std::io::Write::write_all(&mut output, &bytes).map_err(|source| Error::Io {
            action: "write",
            path,
            source,
        })?;
        output.commit()?;
    }
    let span = (range.end - range.start) as f32;
    let brightness = |x: usize, y: usize| {
        let disparity = map.disparity[y * map.width + x];
        let share = (disparity - range.start as f32) / span;
        if disparity.is_nan() { 0.0 } else { 40.0 + 215.0 * share.clamp(0.0, 1.0) }
    };
    GrayImage::from_fn(map.width, map.height, brightness).write_png(&folder.join("disparity.png"))
}
