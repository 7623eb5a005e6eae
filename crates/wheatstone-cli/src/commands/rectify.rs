//! `wheatstone rectify`.

use super::{locate::needs_two_cameras, print_json};
use crate::{
    conversion::{PictureSizes, shown, size, write_pair},
    failure::{Failure, Outcome},
    output::Earlier,
    picture_sets::{frames, refuse_another_cameras},
    progress::Bar,
    table::figure,
    verbosity::say,
};
use clap::Args;
use serde_json::{Value, json};
use std::{
    collections::BTreeSet,
    path::{Path, PathBuf},
};
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
        let earlier = self.earlier();
        let mut written = BTreeSet::new();
        let exchanged = made.pair.cameras != cameras;
        let rectified = if pictures.is_empty() {
            None
        } else {
            Some(self.rectify((&made, exchanged), &pictures, &mut written)?)
        };
        // After the pictures, which nobody takes for whole without it.
        let mut told = write_pair(&made, Format::named("remap")?, &self.output)?;
        if let Some(path) = &self.points {
            told["points"] = judge(&made, &model, path)?;
        }
        if let Some(rectified) = rectified {
            told["pictures"] = rectified;
        }
        earlier.tell(&written);
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

    /// The rectified pictures of an earlier run.
    fn earlier(&self) -> Earlier {
        let of_side = |side: &str| {
            let files = self.output.join(side).read_dir().into_iter().flatten().flatten();
            let names = files.map(|file| file.file_name().to_string_lossy().into_owned());
            let pictures = names.filter(|name| name.ends_with(".png"));
            pictures.map(|name| format!("{side}/{name}")).collect::<Vec<_>>()
        };
        let names = SIDES.iter().flat_map(|side| of_side(side)).chain([LINES.into()]).collect();
        let mut earlier = Earlier::default();
        earlier.look(&self.output, LINES, &names);
        earlier
    }

    fn rectify(
        &self,
        (made, exchanged): (&Rectification, bool),
        pictures: &[Vec<PathBuf>],
        written: &mut BTreeSet<PathBuf>,
    ) -> Outcome<Value> {
        let tables = [made.table(0), made.table(1)];
        let names = write_folder(&self.output, |folder| {
            write_pictures(&tables, pictures, exchanged, folder)
        })?;
        let files: Vec<PathBuf> = names.iter().map(|name| self.output.join(name)).collect();
        written.extend(files.iter().cloned());
        let shares = tables.each_ref().map(|table: &Table| table.filled);
        say!(
            "Rectified {} pairs of pictures into {}; {:.0} % and {:.0} % of their pixels are covered",
            pictures.len(),
            self.output.display(),
            100.0 * shares[0],
            100.0 * shares[1]
        );
        Ok(json!({ "files": shown(&files), "filled": shares }))
    }
}

/// The folders of the rectified pictures, and the first pair side by side.
const SIDES: [&str; 2] = ["left", "right"];
const LINES: &str = "lines.png";

/// Rectified pictures in `left` and `right`, and the first pair side by side; gives their names in the folder.
fn write_pictures(
    tables: &[Table; 2],
    pictures: &[Vec<PathBuf>],
    exchanged: bool,
    folder: &Path,
) -> Outcome<Vec<PathBuf>> {
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
            let lines = PathBuf::from(LINES);
            side_by_side(&rectified[0], &rectified[1]).write_png(&folder.join(&lines))?;
            written.push(lines);
        }
        wheatstone::progress::Progress::check(&bar).map_err(Error::from)?;
    }
    Ok(written)
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
