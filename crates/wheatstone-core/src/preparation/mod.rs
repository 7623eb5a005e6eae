//! From what the user recorded to what a method is fitted to: faults are named, or put right where
//! that is asked for and certain; charts of unknown place are placed; gross outliers are set aside; charts are moved to where they stood.

mod after_placing;
mod chart_poses;
mod chart_shape;
pub mod checks;
mod examine;
pub mod outliers;
mod uncertain_places;
mod worst_apart;

pub use chart_poses::EstimatedPoses;
pub use examine::{examine, examine_every_view, repair};

use crate::{
    Error, Result,
    camera::AnyCamera,
    dataset::Dataset,
    error::{Hint, Remedy},
    fit::{
        bundle::{self, BundleSettings, Lenses},
        stage::{self, StagePrior, ViewOffset},
    },
    geometry::StageCovariance,
    method::AnyMethod,
};
use after_placing::{
    Placed, Repair, add_findings, add_remaining, cannot_be_fixed, put_right, rows_placed,
};
use checks::{Examination, Finding, Severity};
use outliers::Outlier;
use serde::{Deserialize, Serialize};
use wheatstone_numeric::progress::Progress;

/// A point that was set aside as a gross outlier.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
#[non_exhaustive]
pub struct SetAside {
    /// Its view's name; empty where there is none.
    pub view: String,
    /// Its name within the view; its row, counted from 1, where it has none.
    pub id: String,
    /// The cameras whose pixel is wrong, counted from 1.
    pub cameras: Vec<usize>,
    /// How far the worst of these pixels is off.
    pub residual: f64,
}

/// A fault of the data that was found before the fit.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
#[non_exhaustive]
pub struct SavedFinding {
    /// Its name, in kebab case.
    pub code: String,
    /// `information`, `warning` or `fatal`.
    pub severity: String,
    /// The views that have it; none for all of them.
    pub views: Vec<String>,
    /// The cameras that have it, counted from 1; none for all of them.
    pub cameras: Vec<usize>,
    /// What is wrong and where.
    pub explanation: String,
    /// What to do about it.
    pub hint: String,
    /// Whether it was put right before the fit.
    pub repaired: bool,
    /// Whether it is in the model, whose errors or error bars it makes larger than they are told.
    #[serde(default)]
    pub stays_in_fit: bool,
}

impl SavedFinding {
    pub(crate) fn new(finding: &Finding, repaired: bool) -> Self {
        Self {
            code: finding.code.into(),
            severity: finding.severity.name().into(),
            views: finding.views.clone(),
            cameras: finding.cameras.iter().map(|camera| camera + 1).collect(),
            explanation: finding.explanation.clone(),
            hint: finding.hint.clone(),
            repaired,
            stays_in_fit: finding.stays_in_fit && !repaired,
        }
    }
}

/// What is done to data before a fit.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Preparation {
    /// Put faults right where that is safe: not by an estimate from the pixels, unless insisted on.
    pub repair: bool,
    /// Go on in spite of faults that make a fit worthless.
    pub insist: bool,
    /// The distance of the first two cameras as measured on the rig, in the data's unit, and by what
    /// share of it the data may differ.
    pub baseline: Option<(f64, f64)>,
    /// Keep gross outliers.
    pub keep_outliers: bool,
    /// How well the charts' places are known; without it they are taken as they are given.
    pub stage: Option<StagePrior>,
    /// How charts held by hand are placed.
    pub bundle_settings: BundleSettings,
    /// The lenses that are known, one a camera; none where they are to be found.
    pub lenses: Vec<AnyCamera>,
    /// Whether the error bars of the method to be fitted leave out the uncertainty of estimated chart poses.
    pub omits_pose_uncertainty: bool,
}

/// Data ready for a fit, and what was done to them.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Prepared {
    /// What a method is fitted to.
    pub data: Dataset,
    /// The faults that were found, in the data as they came.
    pub examination: Examination,
    /// Whether the faults that can be put right were.
    pub repaired: bool,
    /// Pictures that only could be left out for that: the view's name and the camera, counted from 0.
    pub left_out: Vec<(String, usize)>,
    /// The points set aside, by the rows of the data that were screened.
    pub outliers: Vec<Outlier>,
    /// Where the charts are believed to have stood; none where that was not asked for.
    pub stage: Vec<ViewOffset>,
    /// What points are uncertain by that.
    pub stage_covariance: Option<StageCovariance>,
    /// Where charts of unknown place were found to have stood; none where all places were known.
    pub placed: Option<EstimatedPoses>,
}

impl Prepared {
    /// Data taken as they are.
    #[must_use]
    pub fn as_given(data: Dataset) -> Self {
        let examination = Examination::default();
        Self {
            data,
            examination,
            repaired: false,
            left_out: Vec::new(),
            outliers: Vec::new(),
            stage: Vec::new(),
            stage_covariance: None,
            placed: None,
        }
    }

    /// The outliers as a model file keeps them.
    #[must_use]
    pub fn set_aside(&self) -> Vec<SetAside> {
        let keep = |outlier: &Outlier| SetAside {
            view: outlier.view.clone(),
            id: outlier.id.clone().unwrap_or_else(|| (outlier.row + 1).to_string()),
            cameras: outlier.cameras.iter().map(|camera| camera + 1).collect(),
            residual: outlier.residual,
        };
        self.outliers.iter().map(keep).collect()
    }

    /// The findings as a model file keeps them.
    #[must_use]
    pub fn findings(&self) -> Vec<SavedFinding> {
        let keep =
            |finding: &Finding| SavedFinding::new(finding, self.repaired && finding.is_fixable());
        self.examination.findings.iter().map(keep).collect()
    }
}

impl Preparation {
    /// For a fit of this method: charts held by hand are placed with its lens, where it has one, and lenses that
    /// it knows are kept. Without a method they are placed with whichever lens predicts best.
    #[must_use]
    pub fn for_method(mut self, method: Option<&AnyMethod>) -> Self {
        (self.bundle_settings.lenses, self.bundle_settings.all_terms) = match method {
            Some(AnyMethod::Brown(brown)) => (Lenses::Brown, !brown.choose),
            Some(AnyMethod::KannalaBrandt(_)) => (Lenses::KannalaBrandt, false),
            _ => (Lenses::Either, false),
        };
        // Only where the method is to be chosen may a lens be good enough.
        self.bundle_settings.always_model_free = !matches!(method, None | Some(AnyMethod::Auto(_)));
        self.lenses = method.map_or_else(Vec::new, AnyMethod::known_lenses);
        self.omits_pose_uncertainty = method.is_some_and(|it| !it.includes_pose_uncertainty());
        self
    }

    /// Prepares `data`; the same `seed` gives the same bits.
    ///
    /// # Errors
    ///
    /// [`Error::Faulty`] where a fit would be wrong, unless repaired or insisted on; those of
    /// [`stage::solve`]; [`Error::Cancelled`].
    pub fn run(&self, data: Dataset, seed: u64, progress: &dyn Progress) -> Result<Prepared> {
        let (mut data, mut faults) = self.put_right(data);
        if let Some(prior) = &self.stage {
            let examine = |data: &Dataset| self.examine(data);
            let found = faults.examination;
            faults.examination =
                uncertain_places::examine(&data, prior, found, &examine, progress)?;
        }
        self.refuse_faults(&faults)?;
        progress.check()?;
        let mut placed = None;
        if bundle::needed(&data) {
            let (solved, estimated) = self.place(&data, &mut faults, progress)?;
            let omits = self.omits_pose_uncertainty;
            faults.examination.findings.extend(omits.then(checks::omitted_pose_uncertainty));
            (data, placed) = (solved, Some(estimated));
        }
        if let Some((length, tolerance)) = self.baseline {
            let differs = checks::compare_baseline(&faults.examination, length, tolerance);
            faults.examination.findings.splice(0..0, differs);
        }
        self.refuse_faults(&faults)?;
        let mut outliers = Vec::new();
        if !self.keep_outliers {
            let screening = match &self.stage {
                Some(prior) => uncertain_places::screen(&data, prior, seed, progress)?,
                None => outliers::screen(&data, seed, progress)?,
            };
            if !screening.outliers.is_empty() {
                data = screening.clean(&data);
            }
            outliers = screening.outliers;
        }
        let (mut stage, mut stage_covariance) = (Vec::new(), None);
        if let Some(prior) = &self.stage {
            let solved = stage::solve(&data, prior, progress)?;
            (data, stage, stage_covariance) =
                (solved.data, solved.offsets, Some(solved.uncertainty));
        }
        let Faults { examination, left_out, .. } = faults;
        Ok(Prepared {
            data,
            examination,
            repaired: self.repair,
            left_out,
            outliers,
            stage,
            stage_covariance,
            placed,
        })
    }
}

/// What is wrong with data, and what became of it.
struct Faults {
    examination: Examination,
    /// Pictures of which nothing is left.
    left_out: Vec<(String, usize)>,
    /// Why what was found was not put right.
    doubt: Option<String>,
}

impl Preparation {
    /// The data as they were recorded, with the faults put right that show without placing charts, where that is asked
    /// for and can be believed.
    fn put_right(&self, data: Dataset) -> (Dataset, Faults) {
        let mut examination = self.examine(&data);
        if !self.repair {
            return (data, Faults { examination, left_out: Vec::new(), doubt: None });
        }
        let findings = &mut examination.findings;
        let doubt = checks::doubt(&data, findings);
        if doubt.is_some() {
            cannot_be_fixed(findings);
        }
        let left_out = checks::left_out(&data, findings);
        let data = checks::repair_all(&data, findings);
        (data, Faults { examination, left_out, doubt })
    }

    /// Places charts, and puts right, likewise, what shows only then.
    fn place(
        &self,
        recorded: &Dataset,
        faults: &mut Faults,
        progress: &dyn Progress,
    ) -> Result<Placed> {
        let place =
            |data: &Dataset| chart_poses::place(data, &self.lenses, self.bundle_settings, progress);
        let placed = place(recorded)?;
        let rows = rows_placed(recorded, &placed.1);
        let after = worst_apart::examine_placed(
            (recorded, &rows),
            &placed,
            &|data| self.examine(data),
            &place,
        )?;
        if self.lenses.is_empty() && after.worst() < Some(Severity::Fatal) {
            let shape = chart_shape::examine(recorded, &placed, self.bundle_settings, progress)?;
            faults.examination.findings.extend(shape);
        }
        let found = add_findings(&mut faults.examination, after, &placed, (recorded, &rows));
        let asked: &[Finding] = if self.repair { found } else { &[] };
        match put_right(recorded, asked, &place)? {
            Repair::Nothing => Ok(placed),
            Repair::Doubted(why) => {
                cannot_be_fixed(found);
                faults.doubt.get_or_insert(why);
                Ok(placed)
            }
            Repair::Done(repaired) => {
                add_remaining(&mut faults.examination, self.examine(&repaired.placed.0));
                faults.left_out.extend(repaired.left_out);
                Ok(repaired.placed)
            }
        }
    }

    /// Looks for faults. One plane tells where cameras stand whose lenses are known.
    fn examine(&self, data: &Dataset) -> Examination {
        let mut examination = checks::examine(data);
        examination.findings.retain(|f| self.lenses.is_empty() || f.code != "single-plane");
        // How many points it needs, a method says itself.
        examination.findings.retain(|f| f.code != "too-few-points");
        examination
    }

    /// Refuses data whose faults make a fit worthless, unless they were put right, and by more than an estimate, or that
    /// is insisted on.
    fn refuse_faults(&self, faults: &Faults) -> Result<()> {
        let Faults { examination, doubt, .. } = faults;
        let is_left = |finding: &&Finding| match self.repair && finding.is_fixable() {
            true => finding.is_estimate,
            false => finding.severity == Severity::Fatal,
        };
        let mut left = examination.findings.iter().filter(is_left);
        let Some(first) = left.next().filter(|_| !self.insist) else { return Ok(()) };
        let others = left.count();
        let more = if others > 0 { format!(" (and {others} more faults)") } else { String::new() };
        let kept = match doubt {
            Some(why) => format!("; not corrected: {why}"),
            None if self.repair && first.is_fixable() => {
                "; what it would be corrected by is an estimate from the pixels, and the calibration would take on its error".into()
            }
            None => String::new(),
        };
        let fixable = first.is_fixable() && !self.repair;
        let way_out = if fixable { Remedy::RepairOrInsist } else { Remedy::Insist };
        Err(Error::Faulty {
            code: first.code.into(),
            problem: format!("{}{more}{kept}", first.explanation),
            hint: Hint::new(first.hint.clone(), way_out),
        })
    }
}
