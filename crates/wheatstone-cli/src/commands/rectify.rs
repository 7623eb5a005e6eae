//! `wheatstone rectify`.

use super::{locate::needs_two_cameras, print_json};
use crate::{
    conversion::{PictureSizes, shown, size, write_pair},
    failure::{Failure, Outcome},
    picture_sets::frames,
    progress::Bar,
    table::figure,
    verbosity::say,
};
use clap::Args;
use serde_json::{Value, json};
use std::path::{Path, PathBuf};
use wheatstone::{
    Calibration, Error,
    formats::Format,
    imaging::{GrayImage, Limits, read_image, read_size},
    rectification::{PairSettings, Rectification, Table},
    rectified_pictures::{remapped, side_by_side},
    storage::{create_folder, write_folder},
    tables::{self, Duplicates},
};

/// Rectify any two cameras along epipolar lines: maps for cv2.remap, P1 P2 Q, pictures
#[derive(Args)]
#[command(after_help = "Examples:\n  wheatstone rectify model.json -o pair/\n  \
    wheatstone rectify model.json --images left.png right.png -o pair/\n  \
    wheatstone rectify model.json --cameras 1,3 --images left/ right/ --points exam.csv -o pair/\n\n\
    The folder gets left_map_x.npy, left_map_y.npy, right_map_x.npy, right_map_y.npy (float32, what\n\
    cv2.remap takes; -1 outside the picture), pair.yml (OpenCV's K D R T, P1 P2 Q; the left virtual\n\
    camera's frame, in the model's unit), left/ and right/ with the rectified pictures, and lines.png\n\
    to look at. The vertical error that is left is reported in pixels: over the calibrated volume,\n\
         and of measured points. docs/rectification.md has the rest.")]
pub(crate) struct Rectify {
    /// The model file, of any method
    model: PathBuf,
    /// Two of its cameras, counted from 1; the one to the left becomes the left one
    #[arg(long, value_name = "A,B", default_value = "1,2", value_parser = two)]
    cameras: [usize; 2],
    /// Pictures to rectify, of the first and the second of the cameras: two files, or two folders with
    /// as many files each; may be given again
    #[arg(long, num_args = 2, value_names = ["FIRST", "SECOND"], action = clap::ArgAction::Append)]
    images: Vec<PathBuf>,
    /// Matched pixels to evaluate the pair on: a points file with the pixels of all cameras of the
    /// model
    #[arg(long, value_name = "FILE")]
    points: Option<PathBuf>,
    /// Width and height of the rectified pictures [default: those of the model's pictures, or
    /// larger where the common volume needs it]
    #[arg(long, value_name = "WxH", value_parser = size)]
    rectified_size: Option<[u32; 2]>,
    /// Focal length of the rectified pictures in pixels [default: the scale of the model's pictures]
    #[arg(long, value_name = "PIXELS")]
    focal: Option<f64>,
    /// The folder for the pair
    #[arg(short, long, value_name = "DIR")]
    output: PathBuf,
    #[command(flatten)]
    told: PictureSizes,
    /// Print the pair and the vertical error that is left as JSON
    #[arg(long)]
    json: bool,
}

/// `1,2`.
pub(super) fn two(text: &str) -> Result<[usize; 2], String> {
    let parts = text.split_once(',').map(|(a, b)| (a.trim().parse(), b.trim().parse()));
    match parts {
        Some((Ok(a), Ok(b))) if a > 0 && b > 0 && a != b => Ok([a, b]),
        _ => Err("write two cameras as 1,2".into()),
    }
}

impl Rectify {
    pub(crate) fn run(self) -> Outcome {
        let bar = Bar::new();
        let model = Calibration::load(&self.model)?;
        needs_two_cameras(&model, "rectify")?;
        let pictures = self.pictures()?;
        let cameras = self.cameras.map(|camera| camera - 1);
        let mut sizes = self.told.sizes(model.sizes.clone(), model.volume.cameras())?;
        sizes.resize(model.volume.cameras().max(sizes.len()), None);
        if let Some(first) = pictures.first() {
            for (path, camera) in first.iter().zip(cameras) {
                let found = read_size(path)?;
                refuse_another_cameras(path, found, model.picture_size(camera))?;
                if let Some(known) = sizes.get_mut(camera) {
                    *known = Some(found);
                }
            }
        }
        let wanted = PairSettings { cameras, sizes, size: self.rectified_size, focal: self.focal };
        let made = Rectification::of(&model, &wanted, &bar)?;
        drop(bar);
        let exchanged = made.pair.cameras != cameras;
        let rectified = (!pictures.is_empty()).then(|| self.rectify(&made, &pictures, exchanged));
        let rectified = rectified.transpose()?;
        // After the pictures, which nobody takes for whole without it.
        let mut told = write_pair(&made, Format::named("remap")?, &self.output)?;
        if let Some(path) = &self.points {
            told["points"] = judge(&made, &model, path)?;
        }
        if let Some(rectified) = rectified {
            told["pictures"] = rectified;
        }
        if self.json { print_json(&told) } else { Ok(()) }
    }

    /// Pairs of files, in the order of the cameras that were named.
    fn pictures(&self) -> Outcome<Vec<Vec<PathBuf>>> {
        let mut pairs = Vec::new();
        for both in self.images.chunks_exact(2) {
            pairs.extend(frames(both, 2)?);
        }
        Ok(pairs)
    }

    fn rectify(
        &self,
        made: &Rectification,
        pictures: &[Vec<PathBuf>],
        exchanged: bool,
    ) -> Outcome<Value> {
        let tables = [made.table(0), made.table(1)];
        let written = write_folder(&self.output, |folder| {
            write_pictures(&tables, pictures, exchanged, folder)
        })?;
        let written: Vec<PathBuf> = written.iter().map(|name| self.output.join(name)).collect();
        let shares = tables.each_ref().map(|table: &Table| table.filled);
        say!(
            "Rectified {} pairs of pictures into {}; {:.0} % and {:.0} % of their pixels are covered",
            pictures.len(),
            self.output.display(),
            100.0 * shares[0],
            100.0 * shares[1]
        );
        Ok(json!({ "files": shown(&written), "filled": shares }))
    }
}

/// Rectified pictures in `left` and `right`, and the first pair side by side; gives their names in the folder.
fn write_pictures(
    tables: &[Table; 2],
    pictures: &[Vec<PathBuf>],
    exchanged: bool,
    folder: &Path,
) -> Outcome<Vec<PathBuf>> {
    const SIDES: [&str; 2] = ["left", "right"];
    for side in SIDES {
        create_folder(&folder.join(side))?;
    }
    let bar = Bar::new();
    let mut written = Vec::new();
    let mut size: [Option<(usize, usize)>; 2] = [None; 2];
    for (index, pair) in pictures.iter().enumerate() {
        let mut rectified = Vec::with_capacity(2);
        for side in 0..2 {
            let path = &pair[if exchanged { 1 - side } else { side }];
            let picture = read_image(path, Limits::default())?;
            refuse_other_size(path, &picture, &mut size[side])?;
            rectified.push(remapped(&tables[side], &picture));
            let name = path.file_stem().unwrap_or_default().to_string_lossy();
            let place = Path::new(SIDES[side]).join(format!("{name}.png"));
            rectified[side].write_png(&folder.join(&place))?;
            written.push(place);
        }
        if index == 0 {
            let lines = PathBuf::from("lines.png");
            side_by_side(&rectified[0], &rectified[1]).write_png(&folder.join(&lines))?;
            written.push(lines);
        }
        wheatstone::progress::Progress::check(&bar).map_err(Error::from)?;
    }
    Ok(written)
}

/// Pictures that were scaled or cropped after the model was fitted have other pixels than it knows.
fn refuse_another_cameras(path: &Path, found: [u32; 2], known: Option<[u32; 2]>) -> Outcome {
    match known {
        Some(known) if known != found => Err(Error::Image {
            path: path.into(),
            problem: format!(
                "{} x {} pixels, but the model was fitted to pictures of {} x {}",
                found[0], found[1], known[0], known[1]
            ),
            hint: "give unscaled pictures, of the cameras in the order of `--cameras`".into(),
        }
        .into()),
        _ => Ok(()),
    }
}

/// A table is of pictures of one size.
fn refuse_other_size(
    path: &Path,
    picture: &GrayImage,
    known: &mut Option<(usize, usize)>,
) -> Outcome {
    let size = (picture.width(), picture.height());
    let (width, height) = *known.get_or_insert(size);
    if (width, height) == size {
        return Ok(());
    }
    Err(Error::Image {
        path: path.into(),
        problem: format!(
            "{} x {} pixels, but the first picture has {width} x {height}",
            size.0, size.1
        ),
        hint: "one map serves pictures of one size; rectify the others separately".into(),
    }
    .into())
}

/// Vertical differences of matched pixels.
fn judge(made: &Rectification, model: &Calibration, path: &Path) -> Outcome<Value> {
    let data = tables::read(path, &model.unit, Duplicates::Keep)?;
    if data.cameras != model.volume.cameras() {
        return Err(Error::Mismatch {
            what: "number of cameras",
            model: model.volume.cameras().to_string(),
            data: data.cameras.to_string(),
        }
        .into());
    }
    let Some(judged) = made.judge(&data) else {
        return Err(Failure::usage(
            format!("in `{}` no point is seen by both cameras", path.display()),
            "give matched pixels of both cameras",
        ));
    };
    let vertical = judged.vertical;
    say!(
        "Of the {} points of {}: {} px median, {} rms, 95 % below {}, {} at most",
        vertical.n,
        path.display(),
        figure(vertical.median),
        figure(vertical.rms),
        figure(vertical.p95),
        figure(vertical.max)
    );
    if let Some(place) = judged.place {
        say!(
            "Points triangulated from the rectified pair are off by {} {} rms",
            figure(place.rms),
            model.unit
        );
    }
    Ok(json!(judged))
}
