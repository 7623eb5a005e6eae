//! `wheatstone fit`.

use crate::verbosity::{remark, say};
use crate::{
    conversion::{Cameras, PictureSizes, read_cameras, source},
    failure::{Failure, Outcome},
    frame::{name_of, world_frame},
    input::{Reading, load},
    output::refuse_inputs,
    prepare::{Preparing, suspected_stage, warn_of_stage},
    progress::Bar,
    table::figure,
};
use clap::{Args, builder::PossibleValuesParser};
use std::path::{Path, PathBuf};
use wheatstone::{
    Calibration,
    calibration::{KnownLenses, Source},
    formats::Optics,
    method::{AnyMethod, KnownLens},
    preparation::Prepared,
    storage::Output,
};

/// The preset of the network that repeats the 2001 paper.
const PAPER: &str = "paper";

/// Calibrate: fit a method to a capture or a points file, and save the model
///
/// Estimates intrinsics (focal length, principal point, distortion) and extrinsics of every camera, or
/// a mapping without a camera model, by the least error. Without given chart poses these are estimated
/// too, by bundle adjustment. The error that is reported is held out: leave-one-view-out
/// cross-validation.
#[derive(Args)]
#[command(after_help = "Examples:\n  wheatstone fit capture/ -o model.json\n  \
    wheatstone fit points.csv --method network --preset paper --seed 3 -o model.json\n  \
    wheatstone fit waved/ --expect-baseline 200:1% -o model.json   (a hand-held board)\n  \
    wheatstone fit waved/ --gauge first-camera -o model.json       (in the frame of camera 1)\n  \
    wheatstone fit myptv/ -o model.json       (tables of MyPTV, proPTV, OpenPTV or NumPy)\n  \
    wheatstone fit moved/ --intrinsics model.json -o moved.json    (lenses kept, poses found)\n\n\
    A view need not have a picture of every camera. The world frame is named at the end, and by\n\
    `wheatstone info model.json`, which shows intrinsics, poses and what was fitted.")]
pub(crate) struct Fit {
    /// A capture (its folder or capture.toml), or a points file with columns x1,y1,x2,y2,…,X,Y,Z
    input: PathBuf,
    /// The method; `wheatstone list methods` describes them
    #[arg(long, default_value = "auto", value_parser = PossibleValuesParser::new(AnyMethod::NAMES))]
    method: String,
    /// Ready-made settings of the method, such as `paper` for the network
    #[arg(long)]
    preset: Option<String>,
    /// Keep the lenses of an earlier calibration and find only where the cameras stand, from one view or
    /// more: a model file, or cameras of another program (`wheatstone list formats`); once for all cameras,
    /// or repeated for each
    #[arg(long, value_name = "FILE", conflicts_with_all = ["method", "preset", "epochs"])]
    intrinsics: Vec<PathBuf>,
    /// Epochs of training, for methods that train by epochs
    #[arg(long)]
    epochs: Option<u64>,
    /// Seed of every random choice
    #[arg(long, default_value_t = 0)]
    seed: u64,
    /// Skip leave-one-view-out cross-validation, which takes one more fit per view
    #[arg(long)]
    no_validation: bool,
    /// The model file to write
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
    #[command(flatten)]
    told: PictureSizes,
    #[command(flatten)]
    reading: Reading,
    #[command(flatten)]
    preparing: Preparing,
}

impl Fit {
    pub(crate) fn run(self) -> Outcome {
        // A place that cannot be written to is better known before the work than after it.
        let inputs = std::iter::once(&self.input).chain(&self.intrinsics);
        refuse_inputs(&self.output, inputs.map(PathBuf::as_path))?;
        Output::check(&self.output)?;
        let bar = Bar::new();
        let mut method = if self.intrinsics.is_empty() {
            AnyMethod::named(&self.method)?
        } else {
            with_known_lenses(&self.intrinsics)?
        };
        if let Some(preset) = &self.preset {
            method = method.preset(preset)?;
        }
        if let Some(epochs) = self.epochs {
            method = with_epochs(&method, epochs)?;
        }
        let loaded = load(&self.input, &self.reading, &bar)?;
        method.takes(loaded.data.cameras)?;
        let sizes = self.told.of_pixels(loaded.sizes(), &loaded.data)?;
        let prepared = self.preparing.run(&loaded, Some(&method), self.seed, &bar)?;
        let mut model = Calibration::fit(&method, &prepared, self.seed, !self.no_validation, &bar)?;
        model.sizes = sizes;
        model.source = Some(Source {
            name: name_of(&self.input),
            frame: world_frame(&self.input, &loaded, &prepared),
        });
        // Who names a method knows the data; who leaves the choice to us is told what `compare` tells.
        let stage = model.choice.as_ref().and_then(|_| suspected_stage(&prepared, &bar));
        drop(bar);
        self.refuse_broken(&model)?;
        model.save(&self.output)?;
        self.tell(&model, &prepared);
        let before = prepared.findings();
        for finding in model.findings.iter().filter(|finding| !before.contains(finding)) {
            let word = if finding.severity == "warning" { "warning" } else { "note" };
            remark!(word, "{} ({})", finding.explanation, finding.code);
        }
        warn_of_stage(stage, &model.unit);
        Ok(())
    }

    /// A model that is worthless is not saved, unless that is insisted on. Who asks for the recipe of 2001
    /// by name gets it: beyond the views that it learned it errs like this on its own kind of data.
    fn refuse_broken(&self, model: &Calibration) -> Outcome {
        let asked_for = self.preparing.force || self.preset.as_deref() == Some(PAPER);
        match model.broken() {
            Some(why) if asked_for => remark!("warning", "the model is unusable: {why}"),
            Some(why) => {
                return Err(wheatstone::Error::Faulty {
                    code: "broken-model".into(),
                    problem: format!("the model was not saved, because it is unusable: {why}"),
                    hint: "`wheatstone check` looks for faults in the data; `--force` saves the model anyway".into(),
                }
                .into());
            }
            None => {}
        }
        Ok(())
    }

    fn tell(&self, model: &Calibration, prepared: &Prepared) {
        let training = &model.training;
        let unit = &training.unit;
        say!(
            "Fitted {} to {} points of {}; error on these points {} {unit} rms",
            model.method.name(),
            training.located,
            match prepared.data.cameras {
                1 => "one camera".into(),
                cameras => format!("{cameras} cameras"),
            },
            figure(training.rms)
        );
        if let Some(choice) = &model.choice {
            say!("Chose {}: {}", choice.chosen, choice.reason);
        }
        match &model.validation {
            Some(validation) if prepared.data.cameras == 1 => say!(
                "Held-out error ({}): {} {unit} rms, {} {unit} median; half of a view's points determine its chart pose, the other half is evaluated",
                validation.scheme(),
                figure(validation.all.rms),
                figure(validation.all.median)
            ),
            Some(validation) => say!(
                "Held-out error ({}): {} {unit} rms, {} {unit} median, {} % of the distance on average",
                validation.scheme(),
                figure(validation.all.rms),
                figure(validation.all.median),
                figure(validation.all.mean_percent)
            ),
            None => {
                say!("Not cross-validated: the error above says little about new points")
            }
        }
        if let Some(source) = &model.source {
            say!("World frame: {}", source.frame);
        }
        say!("Wrote {}", self.output.display());
    }
}

/// The method that keeps the lenses of these files.
fn with_known_lenses(paths: &[PathBuf]) -> Outcome<AnyMethod> {
    let mut lenses = KnownLenses::default();
    for path in paths {
        let path = std::slice::from_ref(path);
        let unknown = PictureSizes::default().given(None, None);
        match read_cameras(source(None, path)?, path, &unknown)?.0 {
            Cameras::Model(model) => {
                let name = model.method.name();
                let refused = |_| no_lens(&path[0], &format!("a `{name}` model"));
                lenses.add(&model).map_err(refused)?;
            }
            Cameras::Rig(rig) => {
                for camera in rig.cameras {
                    match camera.optics {
                        Optics::Brown(own) => {
                            lenses.brown.lenses.push(KnownLens::exact(own.model));
                        }
                        Optics::KannalaBrandt(own) => {
                            lenses.fisheye.lenses.push(KnownLens::exact(own.model));
                        }
                        _ => return Err(no_lens(&path[0], "a projection matrix")),
                    }
                }
            }
        }
    }
    lenses.method().map_err(|_| {
        Failure::usage(
            "`--intrinsics` needs lenses of one kind for all cameras",
            "give lenses of Brown's model (OpenCV's), or fisheyes of Kannala's and Brandt's",
        )
    })
}

/// Cameras whose lens cannot be told from where they stand.
fn no_lens(path: &Path, what: &str) -> Failure {
    Failure::usage(
        format!("{}: {what} has no lens apart from the cameras' poses", path.display()),
        "fit with `--method brown` or `kannala-brandt`, or `wheatstone export --format opencv` and give that file",
    )
}

/// Changes how long a method learns.
pub(crate) fn with_epochs(method: &AnyMethod, epochs: u64) -> Outcome<AnyMethod> {
    method.with_epochs(epochs).map_err(|_| {
        Failure::usage(
            format!("`--epochs` does not apply to `{}`", method.name()),
            "leave out `--epochs`, or choose `--method network --preset paper`",
        )
    })
}
